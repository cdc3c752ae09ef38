//! Ends of runs: instances that enforce the exact stop time, and full disks.

use crate::prelude::*;

/// Records the time that the instances have reached.
fn strict(description: &dyn Fn(String) -> String) -> Bench {
    let recorded = LOOP.replace("\"plant.steps\"", "\"plant.speed\", \"gain.speed\"");
    let flags = ["-DSTRICT"];
    Bench::made(&recorded, &Recipe { flags: &flags, description, ..Recipe::default() })
}

#[test]
fn oracle_instances_end_exactly_at_the_stop_time() {
    let bench = strict(&|text| text);
    let text = bench.text("loop.toml");
    // In floating-point arithmetic each of these last steps passes the stop time.
    for (step, stop, start, every) in [
        ("0.2", "0.6", "0.0", 1),
        ("0.1", "0.3", "0.0", 1),
        ("0.1", "0.8", "0.1", 1),
        ("0.05", "0.9", "0.0", 3),
    ] {
        let text = text.replace("[simulation]", &format!("[simulation]\nstart = {start}"));
        let slow = format!("[components.gain]\nevery = {every}");
        let text = text.replace("[components.gain]", &slow);
        fs::write(bench.path("loop.toml"), text).unwrap();
        for more in [&[][..], &["--isolate=false"], &["--coupling=jacobi"], &["--real-time=100"]] {
            let times = ["--quiet", "--step", step, "--stop", stop];
            bench.flown(&[&times[..], more].concat());
            let results = bench.results();
            let last: Vec<&str> = results.lines().last().unwrap().split(',').collect();
            assert_eq!((last[0], last[3], last[4]), (stop, stop, stop), "{step} {more:?}");
        }
    }
    fs::write(bench.path("loop.toml"), &text).unwrap();
    fs::write(bench.path("c.toml"), CAMPAIGN).unwrap();
    let (code, _, errors) = bench.call(&["campaign", "c.toml", "--step=0.2", "--stop=0.6"]);
    assert_eq!((code, errors.contains("beyond")), (0, false), "{errors}");
    let cases = bench.json("out/c/summary.json");
    assert_eq!(cases["outcomes"]["failed"], serde_json::Value::Null, "{cases}");
}

#[test]
fn an_instance_with_steps_of_one_length_is_told_where_the_last_one_ends() {
    let bench = strict(&|text| text.replace("canHandleVariableCommunicationStepSize=\"true\"", ""));
    bench.silent(&["--quiet", "--step=0.2", "--stop=0.6"]);
    let results = bench.results();
    let last = results.lines().last().unwrap();
    assert!(last.starts_with("0.6,") && last.ends_with(",0.6000000000000001"), "{last}");
}

/// Runs a command in a shell that first does something. Returns exit code and standard error.
fn after(bench: &Bench, first: &str, arguments: &[&str]) -> (i32, String) {
    let mut command = with_usual_signals("sh");
    command.args(["-c", &format!("{first}; exec \"$0\" \"$@\"")]);
    command.arg(env!("CARGO_BIN_EXE_orchestrator")).args(arguments);
    let output = command.current_dir(bench.folder.path()).output().unwrap();
    (output.status.code().expect("no signal"), String::from_utf8(output.stderr).unwrap())
}

#[test]
#[cfg(target_os = "linux")]
fn a_file_that_may_not_grow_is_named_and_no_folder_is_left() {
    let bench = Bench::new();
    let temporary = bench.path("temporary");
    fs::create_dir(&temporary).unwrap();
    let limited = format!("export TMPDIR='{}'; ulimit -f 200", temporary.display());
    let run = ["run", "loop.toml", "--force", "--quiet", "--step=0.0001", "--isolate=false"];
    let (code, errors) = after(&bench, &limited, &run);
    let errors = errors.lines().last().unwrap().to_string();
    assert_eq!(code, 1, "{errors}");
    assert!(errors.starts_with("error: out/loop/results.csv: File too large"), "{errors}");
    assert_eq!(fs::read_dir(&temporary).unwrap().count(), 0);
    // Here it is the archive that has no room.
    let small = format!("export TMPDIR='{}'; ulimit -f 1", temporary.display());
    let (code, errors) = after(&bench, &small, &["run", "loop.toml", "--force"]);
    let place = format!("cannot be unpacked into {}: File too large", temporary.display());
    assert!(code == 2 && errors.contains(&place), "{errors}");
    assert_eq!(fs::read_dir(&temporary).unwrap().count(), 0);
}

/// Runs a command where a folder is a file system of its own. Returns `None` where the system lets
/// nobody make any.
fn on_own_disk(
    bench: &Bench,
    options: &str,
    folder: &str,
    first: &str,
    arguments: &[&str],
) -> Option<(i32, String)> {
    let path = bench.path(folder);
    fs::create_dir_all(&path).unwrap();
    let mount = format!("mount -t tmpfs -o {options} none '{}'", path.display());
    let tried = Command::new("unshare").args(["-rm", "sh", "-c", &mount]).output();
    if !tried.is_ok_and(|tried| tried.status.success()) {
        return None;
    }
    let inner = format!("{mount}; {first}; exec \"$0\" \"$@\"");
    let mut command = with_usual_signals("unshare");
    command.args(["-rm", "sh", "-c", &inner, env!("CARGO_BIN_EXE_orchestrator")]).args(arguments);
    let output = command.current_dir(bench.folder.path()).output().unwrap();
    Some((output.status.code().expect("no signal"), String::from_utf8(output.stderr).unwrap()))
}

#[test]
#[cfg(target_os = "linux")]
fn a_temporary_folder_from_which_nothing_can_be_run_is_named() {
    let bench = Bench::new();
    let folder = bench.path("temporary").display().to_string();
    for more in ["--isolate=false", "--isolate"] {
        let first = format!("export TMPDIR='{folder}'");
        let run = ["run", "loop.toml", "--force", "--quiet", more];
        let outcome = on_own_disk(&bench, "noexec", "temporary", &first, &run);
        let Some((code, errors)) = outcome else { return };
        let said = format!(
            "cannot be loaded from {folder}, whose files may not be run (noexec): set TMPDIR to another folder"
        );
        assert!(code == 2 && errors.contains(&said), "{more}: {errors}");
    }
}
