//! Instances that try to reach what is not their own: tests/model/hostile.h.

use crate::bench::{Bench, LOOP, Recipe};
use std::fs;
use std::os::unix::fs::MetadataExt;
use std::path::Path;

/// A bench with a model that makes attempts on a folder outside.
struct Hostile {
    bench: Bench,
    outside: tempfile::TempDir,
}

/// Content of the file that the model may neither read nor change.
const SECRET: &str = "nobody's business";

impl Hostile {
    fn new() -> Self {
        // Not below the temporary folder of the runs.
        let outside = tempfile::tempdir_in(env!("CARGO_TARGET_TMPDIR")).unwrap();
        fs::write(outside.path().join("secret"), SECRET).unwrap();
        let flags = format!("-DOUTSIDE=\"{}\"", outside.path().display());
        let bench = Bench::made(LOOP, &Recipe { flags: &[&flags], ..Recipe::default() });
        fs::create_dir(bench.path("temporary")).unwrap();
        Self { bench, outside }
    }

    /// Runs the experiment with one attempt. Returns the exit code and standard error.
    fn attempt(&self, number: u32, arguments: &[&str]) -> (Option<i32>, String) {
        let seed = format!("gain.noise.seed={number}");
        let mut command = self.bench.command(&["run", "loop.toml", "--force", "--quiet"]);
        command.args(["--set", &seed, "--unit-memory=64", "--call-timeout=5"]).args(arguments);
        command.env("TMPDIR", self.bench.path("temporary")).env("HOSTILE", self.mark());
        let output = command.output().unwrap();
        (output.status.code(), String::from_utf8(output.stderr).unwrap())
    }

    /// A text in the environment of all processes of a run.
    fn mark(&self) -> String {
        self.outside.path().display().to_string()
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
        assert_eq!(self.processes(), 0, "{what}");
    }

    /// Number of processes that are left of all runs.
    fn processes(&self) -> usize {
        let mark = self.mark();
        let entries = fs::read_dir("/proc").into_iter().flatten().flatten();
        let is_left = |folder: &Path| {
            let environment = fs::read(folder.join("environ")).unwrap_or_default();
            environment.windows(mark.len()).any(|text| text == mark.as_bytes())
        };
        entries.filter(|entry| is_left(&entry.path())).count()
    }
}

#[test]
fn a_sandboxed_instance_reaches_nothing_but_its_own_folder() {
    let hostile = Hostile::new();
    let mut count = 0;
    for number in 1.. {
        let (code, errors) = hostile.attempt(number, &["--sandbox"]);
        if errors.contains("has no sandbox: this system cannot close") {
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
fn the_attempts_get_through_without_a_sandbox() {
    let hostile = Hostile::new();
    let harmless = [
        "write_file",
        "append_file",
        "read_file",
        "parent_environment",
        "signal_parent",
        "signal_by_pipe",
        "limit_parent",
        "local_socket",
        "memory_file",
        "shared_memory",
        "new_process",
        "change_mode",
    ];
    let mut through = Vec::new();
    for number in 1.. {
        let name = |errors: &str| {
            let text = errors.split("[attempt] ").nth(1)?;
            text.split(' ').next().map(str::to_string)
        };
        // What an attempt is called is asked in the sandbox.
        let (_, errors) = hostile.attempt(number, &["--sandbox"]);
        if errors.contains("there are ") || errors.contains("has no sandbox") {
            break;
        }
        let Some(name) = name(&errors).filter(|name| harmless.contains(&name.as_str())) else {
            continue;
        };
        let (_, errors) = hostile.attempt(number, &["--isolate"]);
        assert!(errors.contains(&format!("{name} got through")), "{errors}");
        through.push(name);
    }
    assert!(through.is_empty() || through.len() == harmless.len(), "{through:?}");
    assert_eq!(hostile.processes(), 0);
}

#[test]
fn a_sandbox_needs_no_other_option_and_no_trust() {
    let hostile = Hostile::new();
    let experiment = LOOP.replace("[components.gain]", "[components.gain]\nisolate = false");
    fs::write(hostile.bench.path("loop.toml"), experiment).unwrap();
    // The first attempt writes a file.
    for arguments in [&["--sandbox"][..], &["--sandbox", "--isolate=false"]] {
        let (code, errors) = hostile.attempt(1, arguments);
        let is_refused = code == Some(0) && errors.contains("write_file was refused");
        assert!(is_refused || errors.contains("has no sandbox"), "{errors}");
        hostile.assert_untouched(&errors);
    }
    let made_by_us = |text: String| text.replace("generationTool=\"", "generationTool=\"fmu-pack ");
    let flags = format!("-DOUTSIDE=\"{}\"", hostile.outside.path().display());
    let recipe = Recipe { flags: &[&flags], description: &made_by_us, ..Recipe::default() };
    let foreign = Bench::made(LOOP, &recipe);
    fs::create_dir(foreign.path("temporary")).unwrap();
    let foreign = Hostile { bench: foreign, ..hostile };
    let (_, errors) = foreign.attempt(1, &["--sandbox"]);
    assert!(errors.contains("write_file was refused") || errors.contains("no sandbox"), "{errors}");
    foreign.assert_untouched(&errors);
}
