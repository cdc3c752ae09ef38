//! A folder to run the program in, with an FMU in C that `cc` compiles there.

use crate::prelude::*;
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::record::{Field, Row};
use std::path::PathBuf;
use std::process::{Child, Output};
use std::sync::LazyLock;
use tempfile::TempDir;

/// Experiment in which two instances of the FMU form a loop.
pub(crate) const LOOP: &str = r#"
title = "gain and integrator"
[simulation]
stop = 3.0
step = 1.0
order = ["gain", "plant"]
[components.gain]
fmu = "Model.fmu"
[components.plant]
fmu = "Model.fmu"
[[connections]]
from = "plant.output.integral"
to = "gain.input"
[[connections]]
from = "gain.output.direct"
to = "plant.input"
[record]
variables = ["gain.output.direct", "plant.output.integral", "plant.steps"]
"#;

/// Files of the FMU in C of FMI 2.0, and the folder of its library.
const FMI2: [&str; 3] = ["model.c", "modelDescription.xml", "linux64"];
/// Files of the FMU in C of FMI 3.0, and the folder of its library.
pub(crate) const FMI3: [&str; 3] = ["fmi3.c", "fmi3.xml", "x86_64-linux"];

/// Time after which something that is awaited counts as missing. It is far beyond what a busy
/// machine needs, so that it never decides where nothing is wrong.
pub(crate) const PATIENCE: Duration = Duration::from_secs(120);

/// Waits until the condition holds.
pub(crate) fn await_until(what: &str, mut holds: impl FnMut() -> bool) {
    let begin = Instant::now();
    while !holds() {
        assert!(begin.elapsed() < PATIENCE, "in vain: {what}");
        std::thread::sleep(Duration::from_millis(10));
    }
}

/// Waits until the condition holds for a process that is still at work.
pub(crate) fn await_while_it_runs(child: &mut Child, what: &str, mut holds: impl FnMut() -> bool) {
    await_until(what, || holds() || child.try_wait().unwrap().is_some());
    assert!(child.try_wait().unwrap().is_none(), "ended too early: {what}");
}

/// Whether there is a program that starts another one with all signals as they usually are.
static RESETS_SIGNALS: LazyLock<bool> = LazyLock::new(|| {
    let tried = Command::new("env").args(["--default-signal", "true"]).output();
    tried.is_ok_and(|output| output.status.success())
});

/// Returns a command that no signal is ignored by, although this process may ignore some: `nohup`
/// ignores SIGHUP, and a shell that starts it in the background SIGINT.
pub(crate) fn with_usual_signals(program: &str) -> Command {
    if !*RESETS_SIGNALS {
        return Command::new(program);
    }
    let mut command = Command::new("env");
    command.args(["--default-signal", program]);
    command
}

/// Instructions to make the FMU in C.
pub(crate) struct Recipe<'a> {
    /// [`FMI3`], or that of FMI 2.0.
    pub(crate) files: [&'a str; 3],
    /// Further arguments of the compiler, for instance `-DENDS`.
    pub(crate) flags: &'a [&'a str],
    /// Change to the text of the model description.
    pub(crate) description: &'a dyn Fn(String) -> String,
    /// Prefix of the names of the archive's entries.
    pub(crate) prefix: &'a str,
    /// Name of the library in the archive.
    pub(crate) name: &'a str,
}

impl Default for Recipe<'_> {
    fn default() -> Self {
        Self { files: FMI2, flags: &[], description: &|text| text, prefix: "", name: "model.so" }
    }
}

/// A folder that holds `Model.fmu` and `loop.toml`.
pub(crate) struct Bench {
    /// Temporary folder, which is removed when the bench is dropped.
    pub(crate) folder: TempDir,
    /// Folder that the program's environment variable names.
    pub(crate) installed: Option<PathBuf>,
}

impl Bench {
    pub(crate) fn new() -> Self {
        Self::with(LOOP)
    }

    pub(crate) fn with(experiment: &str) -> Self {
        Self::made(experiment, &Recipe::default())
    }

    pub(crate) fn made(experiment: &str, recipe: &Recipe) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/model");
        let library = folder.path().join("model.so");
        let compiler = std::env::var("CC").unwrap_or_else(|_| "cc".into());
        let status = Command::new(compiler)
            .args(["-shared", "-fPIC", "-O1", "-Wall", "-Werror", "-o"])
            .arg(&library)
            .arg(source.join(recipe.files[0]))
            .args(recipe.flags)
            .status()
            .expect("a C compiler");
        assert!(status.success());
        let mut zip =
            zip::ZipWriter::new(fs::File::create(folder.path().join("Model.fmu")).unwrap());
        let mut add = |name: &str, content: &[u8]| {
            zip.start_file(format!("{}{name}", recipe.prefix), SimpleFileOptions::default())
                .unwrap();
            zip.write_all(content).unwrap();
        };
        let description = fs::read_to_string(source.join(recipe.files[1])).unwrap();
        add("modelDescription.xml", (recipe.description)(description).as_bytes());
        let library = fs::read(&library).unwrap();
        add(&format!("binaries/{}/{}", recipe.files[2], recipe.name), &library);
        zip.finish().unwrap();
        fs::write(folder.path().join("loop.toml"), experiment).unwrap();
        Self { folder, installed: None }
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    pub(crate) fn command(&self, arguments: &[&str]) -> Command {
        let mut command = with_usual_signals(env!("CARGO_BIN_EXE_orchestrator"));
        command.args(arguments).current_dir(self.folder.path()).env_remove("RUST_LOG");
        command.envs(self.installed.iter().map(|folder| ("ORCHESTRATOR_PATH", folder)));
        command
    }

    pub(crate) fn call(&self, arguments: &[&str]) -> (i32, String, String) {
        let Output { status, stdout, stderr } = self.command(arguments).output().unwrap();
        let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
        (status.code().expect("no signal"), text(stdout), text(stderr))
    }

    /// Calls the program, which must succeed, and returns what it prints.
    pub(crate) fn says(&self, arguments: &[&str]) -> String {
        let (code, said, errors) = self.call(arguments);
        assert_eq!(code, 0, "{arguments:?}: {errors}");
        said
    }

    /// Calls the program, which must end with this exit code and name this on standard error, whose
    /// text is returned.
    #[track_caller]
    pub(crate) fn fails(&self, exit_code: i32, arguments: &[&str], named: &str) -> String {
        let (code, _, errors) = self.call(arguments);
        assert!(code == exit_code && errors.contains(named), "{arguments:?}: {code} {errors}");
        errors
    }

    /// Runs the experiment, with an exit code and words on standard error as [`Bench::fails`].
    #[track_caller]
    pub(crate) fn ends(&self, exit_code: i32, arguments: &[&str], named: &str) -> String {
        self.fails(exit_code, &[&["run", "loop.toml", "--force"], arguments].concat(), named)
    }

    /// Runs the experiment, which must succeed without a word on standard error.
    #[track_caller]
    pub(crate) fn silent(&self, arguments: &[&str]) {
        let (code, _, errors) = self.run(arguments);
        assert_eq!((code, errors.as_str()), (0, ""), "{arguments:?}");
    }

    /// Runs the experiment, replaces results of an earlier run, and returns the summary.
    pub(crate) fn flown(&self, arguments: &[&str]) -> String {
        self.says(&[&["run", "loop.toml", "--force"], arguments].concat())
    }

    /// Runs the experiment, and replaces results of an earlier run.
    pub(crate) fn run(&self, arguments: &[&str]) -> (i32, String, String) {
        self.call(&[&["run", "loop.toml", "--force"], arguments].concat())
    }

    /// Runs an experiment that must be refused with exit code 2 and one line on standard error.
    pub(crate) fn refusal(&self, arguments: &[&str]) -> String {
        let (code, _, errors) = self.run(arguments);
        assert_eq!(code, 2, "{errors}");
        assert_eq!(errors.lines().count(), 1, "{errors}");
        errors
    }

    pub(crate) fn text(&self, name: &str) -> String {
        fs::read_to_string(self.path(name)).unwrap()
    }

    /// Returns the rows of the experiment's run.
    pub(crate) fn results(&self) -> String {
        self.text("out/loop/results.csv")
    }

    /// Returns the table of cases in a folder of results: a line for its heading and one for each
    /// row, whose cells are separated by commas.
    pub(crate) fn cases(&self, folder: &str) -> Vec<String> {
        let path = self.path(folder).join("cases.parquet");
        let reader = SerializedFileReader::new(fs::File::open(path).unwrap()).unwrap();
        let columns = reader.metadata().file_metadata().schema_descr().columns();
        let heading: Vec<&str> = columns.iter().map(|column| column.name()).collect();
        let cell = |field: &Field| match field {
            Field::Null => String::new(),
            Field::Double(value) => value.to_string(),
            Field::Str(text) => text.clone(),
            other => other.to_string(),
        };
        let row = |row: Row| {
            row.get_column_iter().map(|(_, field)| cell(field)).collect::<Vec<_>>().join(",")
        };
        let rows = reader.get_row_iter(None).unwrap().map(|read| row(read.unwrap()));
        std::iter::once(heading.join(",")).chain(rows).collect()
    }

    pub(crate) fn json(&self, name: &str) -> serde_json::Value {
        serde_json::from_str(&self.text(name)).unwrap()
    }
}

/// Random numbers by SplitMix64: G. L. Steele, D. Lea, C. H. Flood, Fast splittable pseudorandom
/// number generators, OOPSLA (2014).
pub(crate) struct Random(pub(crate) u64);

impl Random {
    /// Returns a number from 0 up to but not including 1.
    pub(crate) fn part(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }

    pub(crate) fn between(&mut self, low: f64, high: f64) -> f64 {
        low + self.part() * (high - low)
    }

    pub(crate) fn below(&mut self, count: usize) -> usize {
        (self.part() * count as f64) as usize
    }

    /// Returns a number of either sign, whose magnitude is a power of ten between these.
    pub(crate) fn power(&mut self, low: f64, high: f64) -> f64 {
        let magnitude = 10.0_f64.powf(self.between(low, high));
        if self.below(2) == 0 { -magnitude } else { magnitude }
    }
}

/// Asserts that a text holds this part.
#[track_caller]
pub(crate) fn assert_has(text: &str, part: &str) {
    assert!(text.contains(part), "no {part:?} in {text}");
}

/// Returns a text without its quotation marks.
pub(crate) fn plain(text: &str) -> String {
    text.replace('"', "")
}
