//! Instances that try to reach resources of others: tests/model/hostile.h.

use crate::prelude::*;
use std::os::unix::fs::MetadataExt;

/// A bench with a model that makes attempts on a folder outside.
struct Hostile {
    bench: Bench,
    outside: tempfile::TempDir,
}

/// Content of the file that the model may neither read nor change.
const SECRET: &str = "nobody's business";
/// Limits with which an attempt to take all memory fails soon.
const LIMITS: &str = "[isolation]\ncall_timeout = 600.0\nmemory = 64\n";

impl Hostile {
    fn new() -> Self {
        // Not below the temporary folder of the runs.
        let outside = tempfile::tempdir_in(env!("CARGO_TARGET_TMPDIR")).unwrap();
        fs::write(outside.path().join("secret"), SECRET).unwrap();
        let flags = format!("-DOUTSIDE=\"{}\"", outside.path().display());
        let experiment = format!("{LOOP}{LIMITS}");
        let bench = Bench::made(&experiment, &Recipe { flags: &[&flags], ..Recipe::default() });
        fs::create_dir(bench.path("temporary")).unwrap();
        Self { bench, outside }
    }

    /// Runs the experiment with one attempt. Returns the exit code and standard error.
    fn attempt(&self, number: u32, arguments: &[&str]) -> (Option<i32>, String) {
        let seed = format!("gain.noise.seed={number}");
        let run = ["run", "loop.toml", "--force", "--quiet", "--set", &seed];
        let output = self.command(&run).args(arguments).output().unwrap();
        (output.status.code(), String::from_utf8(output.stderr).unwrap())
    }

    /// Returns a command of the program, which inherits an open file and a key.
    fn command(&self, arguments: &[&str]) -> Command {
        let mut command = with_usual_signals("sh");
        command.args(["-c", r#"exec 9>>"$0"; exec "$@""#]).arg(self.outside.path().join("secret"));
        command.arg(env!("CARGO_BIN_EXE_orchestrator")).args(arguments).env_remove("RUST_LOG");
        command.current_dir(self.bench.folder.path()).env("SECRET_KEY", "nobody's");
        command.env("TMPDIR", self.mark());
        command
    }

    /// A text in the environment of all processes of a run: the folder of their temporary files.
    fn mark(&self) -> String {
        self.bench.path("temporary").display().to_string()
    }

    /// Asserts that nothing outside is changed and nothing is left behind.
    fn assert_untouched(&self, what: &str) {
        let secret = self.outside.path().join("secret");
        assert_eq!(fs::read_to_string(&secret).unwrap(), SECRET, "{what}");
        let metadata = secret.metadata().unwrap();
        assert_eq!((metadata.nlink(), metadata.mode() & 0o111), (1, 0), "{what}");
        assert_eq!(fs::read_dir(self.outside.path()).unwrap().count(), 1, "{what}");
        assert_eq!(fs::read_dir(self.bench.path("temporary")).unwrap().count(), 0, "{what}");
        assert!(!Path::new("/dev/shm/fresh-of-an-instance").exists(), "{what}");
        assert_gone(&self.mark(), what);
    }
}

/// Number of processes with this text in their environment.
fn processes(mark: &str) -> usize {
    let entries = fs::read_dir("/proc").into_iter().flatten().flatten();
    let has_mark = |folder: &Path| {
        let environment = fs::read(folder.join("environ")).unwrap_or_default();
        environment.windows(mark.len()).any(|text| text == mark.as_bytes())
    };
    entries.filter(|entry| has_mark(&entry.path())).count()
}

#[test]
fn a_closed_process_reaches_nothing_but_its_own_folders() {
    let hostile = Hostile::new();
    let mut count = 0;
    for number in 1.. {
        let (code, errors) = hostile.attempt(number, &["--isolate"]);
        if errors.contains("this system cannot close") {
            // An old kernel: nothing was run.
            assert_eq!(code, Some(2), "{errors}");
            return;
        }
        if errors.contains("there are ") {
            break;
        }
        count = number;
        let is_refused = code == Some(0) && errors.contains(" was refused");
        let is_its_failure = code == Some(1) && errors.contains("error: gain failed at t = 0 s");
        assert!(is_refused || is_its_failure, "{number} {code:?}: {errors}");
        assert!(!errors.contains("got through"), "{errors}");
        hostile.assert_untouched(&errors);
    }
    assert!(count >= 90, "{count}");
}

#[test]
fn the_attempts_get_through_in_an_open_process() {
    let hostile = Hostile::new();
    let harmless = "write_file append_file read_file environment own_environment connections mounts \
                    users_folder parent_environment signal_parent signal_by_pipe limit_parent \
                    local_socket memory_file shared_memory new_process change_mode";
    let harmless: Vec<&str> = harmless.split(' ').collect();
    let mut through = Vec::new();
    for number in 1.. {
        let name = |errors: &str| {
            let text = errors.split("[attempt] ").nth(1)?;
            text.split(' ').next().map(str::to_string)
        };
        // The name of an attempt is read in a closed process.
        let (_, errors) = hostile.attempt(number, &["--isolate"]);
        if errors.contains("there are ") || errors.contains("this system cannot close") {
            break;
        }
        let Some(name) = name(&errors).filter(|name| harmless.contains(&name.as_str())) else {
            continue;
        };
        let (_, errors) = hostile.attempt(number, &["--isolate=false"]);
        assert!(errors.contains(&format!("{name} got through")), "{errors}");
        through.push(name);
    }
    assert!(through.is_empty() || through.len() == harmless.len(), "{through:?}");
    assert_gone(&hostile.mark(), "attempts");
}

#[test]
fn whatever_loads_a_library_can_do_so_in_a_closed_process_and_cleans_up_after_it() {
    let hostile = Hostile::new();
    // In all cases it nests its folders; the first one is the number of that attempt.
    let mut number = 1;
    while !hostile.attempt(number, &["--isolate"]).1.contains("deep_folders") {
        number += 1;
        if number > 200 {
            return; // This system cannot close a process.
        }
    }
    let seed = format!("gain.noise.seed={number}");
    fs::write(hostile.bench.path("c.toml"), CAMPAIGN).unwrap();
    for command in [
        &["campaign", "c.toml", "--jobs=2", "--quiet", "--isolate", "--set", &seed][..],
        &["inspect", "Model.fmu", "--check", "--isolate"],
    ] {
        let output = hostile.command(command).output().unwrap();
        let errors = String::from_utf8_lossy(&output.stderr);
        let is_told = errors.contains("cannot be removed");
        assert!(output.status.success() && !is_told, "{command:?}: {errors}");
        hostile.assert_untouched(&errors);
    }
}

/// Asserts that no process of a mark is left, or only for a moment.
pub(crate) fn assert_gone(mark: &str, what: &str) {
    await_until(&format!("no process of {what}"), || processes(mark) == 0);
}

#[test]
fn a_campaign_does_not_run_out_of_descriptors() {
    let bench = Bench::new();
    // Every other case fails, after which there are new instances.
    let gains = "[0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0, 1.1, 1.2, 1.3, 1.4, 1.5]";
    let campaign = CAMPAIGN.replace("[0.5, 1.0, 2.0]", gains);
    fs::write(bench.path("c.toml"), campaign).unwrap();
    let program = env!("CARGO_BIN_EXE_orchestrator");
    let script = format!("ulimit -n 128; exec {program} campaign c.toml --jobs 2 --quiet");
    let mut command = with_usual_signals("sh");
    command.args(["-c", &script]).current_dir(bench.folder.path());
    let output = command.output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}
