//! Instances that harm the process they are in.

use crate::bench::{Bench, LOOP, PATIENCE, Recipe, await_until, await_while_it_runs};
use crate::campaign::CAMPAIGN;
use std::fs;
use std::path::Path;
use std::process::Stdio;
use std::time::Instant;

/// Kinds of harm, with the messages about them.
const HARM: [(&str, &str); 8] = [
    ("EXIT", "it ended its process with exit code 0"),
    ("QUICK_EXIT", "it ended its process with exit code 0"),
    ("ABORT", "killed by signal 6 (SIGABRT, an abort); its last output: a bolt is loose"),
    ("SEGFAULT", "killed by signal 11 (SIGSEGV"),
    ("DIVISION", "killed by signal 8 (SIGFPE"),
    ("ENDLESS", "no answer within 3 s (call_timeout)"),
    ("OVERWRITE", "killed by signal 11 (SIGSEGV"),
    ("MEMORY", "killed by signal 6 (SIGABRT, an abort); its last output: no memory is left"),
];

/// Limits with which an instance that never answers, or takes all memory, does so soon.
const LIMITS: [&str; 2] = ["--call-timeout=3", "--unit-memory=64"];

fn harmful(place: &str, how: &str) -> Bench {
    let (place, how) = (format!("-DPLACE={place}"), format!("-DHOW={how}"));
    // The compiled form of a write past an array is part of the harm.
    let flags = [place.as_str(), how.as_str(), "-Wno-error", "-w"];
    Bench::made(LOOP, &Recipe { flags: &flags, ..Recipe::default() })
}

/// Runs the experiment with these limits and a temporary folder of its own, which must be empty
/// afterwards.
fn run(bench: &Bench, arguments: &[&str]) -> (i32, String) {
    run_within(bench, &LIMITS, arguments)
}

fn run_within(bench: &Bench, limits: &[&str], arguments: &[&str]) -> (i32, String) {
    let folder = bench.path("temporary");
    fs::create_dir_all(&folder).unwrap();
    let mut command = bench.command(&["run", "loop.toml", "--force", "--quiet"]);
    let begin = Instant::now();
    command.args(limits).args(arguments).env("TMPDIR", &folder);
    let child = command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
    let prefix = format!("fmu-{}-", child.id());
    let output = child.wait_with_output().unwrap();
    assert!(begin.elapsed() < PATIENCE, "{:?}", begin.elapsed());
    assert_eq!(fs::read_dir(&folder).unwrap().count(), 0);
    let memory = fs::read_dir("/dev/shm").into_iter().flatten().flatten();
    let left = memory.filter(|file| file.file_name().to_string_lossy().starts_with(&prefix));
    assert_eq!(left.count(), 0);
    (output.status.code().expect("no signal"), String::from_utf8(output.stderr).unwrap())
}

fn rows(bench: &Bench) -> usize {
    let path = bench.path("out/loop/results.csv");
    fs::read_to_string(path).map_or(0, |text| text.lines().count().saturating_sub(1))
}

/// Returns the only line of an error. One before it may say where the results are.
fn told(errors: &str) -> &str {
    let is_remark = |line: &&str| line.contains("the results up to this failure are in");
    let lines: Vec<&str> = errors.lines().filter(|line| !is_remark(line)).collect();
    assert_eq!(lines.len(), 1, "{errors}");
    lines[0]
}

#[test]
fn harm_in_a_step_or_a_get_call_ends_the_run_with_all_rows() {
    // Values are read with the step that goes before.
    for (place, time, kept) in [("STEP", 2, 3), ("GET", 1, 2)] {
        for (how, says) in HARM {
            let bench = harmful(place, how);
            let (code, errors) = run(&bench, &[]);
            assert_eq!(code, 1, "{place} {how}: {errors}");
            let begin = format!("error: gain failed at t = {time} s in doStep: ");
            assert!(told(&errors).starts_with(&begin), "{errors}");
            assert!(errors.contains(says), "{place} {how}: {errors}");
            assert_eq!(rows(&bench), kept, "{place} {how}");
        }
    }
}

#[test]
fn harm_before_a_run_is_told_with_the_component_and_the_call() {
    for (how, says) in HARM {
        for place in ["LOAD", "INSTANTIATE"] {
            let (code, errors) = run(&harmful(place, how), &[]);
            assert_eq!(code, 2, "{place} {how}: {errors}");
            let begin = "error: ./Model.fmu: the component \"gain\" failed in instantiate: ";
            assert!(told(&errors).starts_with(begin), "{errors}");
            assert!(errors.contains(says), "{place} {how}: {errors}");
        }
        let (code, errors) = run(&harmful("INITIALIZE", how), &[]);
        assert_eq!(code, 1, "{how}: {errors}");
        let begin = "error: gain failed at t = 0 s in exitInitializationMode: ";
        assert!(told(&errors).starts_with(begin), "{errors}");
        assert!(errors.contains(says), "{how}: {errors}");
    }
}

#[test]
fn harm_after_a_run_keeps_the_results_but_is_no_success() {
    for (how, says) in HARM {
        for place in ["FREE", "UNLOAD"] {
            let bench = harmful(place, how);
            let (code, errors) = run(&bench, &[]);
            assert_eq!(code, 1, "{place} {how}: {errors}");
            // Both components are of this FMU.
            assert_eq!(errors.lines().count(), 2, "{errors}");
            for (line, name) in errors.lines().zip(["gain", "plant"]) {
                let begin = format!("error: {name} failed in freeInstance: ");
                assert!(line.starts_with(&begin) && line.contains(says), "{place} {how}: {line}");
            }
            assert_eq!(rows(&bench), 4);
            assert_eq!(bench.json("out/loop/metrics.json")["completed"], true);
        }
    }
}

#[test]
fn harm_in_the_same_process_names_the_component_and_the_call() {
    for (how, what) in [
        ("EXIT", "exit"),
        ("QUICK_EXIT", "_exit"),
        ("ABORT", "SIGABRT"),
        ("SEGFAULT", "SIGSEGV"),
        ("DIVISION", "SIGFPE"),
        ("OVERWRITE", "SIGSEGV"),
    ] {
        for (place, call) in
            [("INSTANTIATE", "instantiate"), ("STEP", "doStep"), ("GET", "getReal")]
        {
            let bench = harmful(place, how);
            let mut command = bench.command(&["run", "loop.toml", "--quiet", "--isolate=false"]);
            let output = command.output().unwrap();
            let errors = String::from_utf8(output.stderr).unwrap();
            // The name itself may have been overwritten.
            let component = if how == "OVERWRITE" { "" } else { "gain" };
            let says = format!("{component} ended this process in {call} ({what})");
            assert!(errors.contains(&says), "{place} {how}: {errors}");
            // A process that a signal has killed has no exit code.
            assert_eq!(output.status.code(), how.ends_with("EXIT").then_some(1), "{place} {how}");
        }
    }
}

#[test]
fn harm_by_a_thread_of_an_fmu_names_the_fmus_that_were_loaded() {
    for (how, what, code) in
        [("THREAD_EXIT", "exit", Some(1)), ("THREAD_SEGFAULT", "SIGSEGV", None)]
    {
        let bench = harmful("STEP", how);
        let mut command = bench.command(&["run", "loop.toml", "--quiet", "--isolate=false"]);
        let output = command.output().unwrap();
        let errors = String::from_utf8(output.stderr).unwrap();
        let says = format!("({what}), perhaps by a thread of an FMU that was loaded: ");
        assert!(errors.contains(&says) && errors.contains("Model.fmu"), "{how}: {errors}");
        assert_eq!(output.status.code(), code, "{how}: {errors}");
    }
}

#[test]
fn messages_with_any_pointer_reach_the_component_that_is_called() {
    let bench = harmful("STEP", "LOGS");
    for isolate in ["--isolate", "--isolate=false"] {
        let (code, errors) = run(&bench, &[isolate]);
        assert_eq!(code, 0, "{isolate}: {errors}");
        for text in ["two", "nothing", "its own"] {
            assert!(errors.contains(&format!("gain: [odd] {text}")), "{isolate}: {errors}");
        }
        // In a process of its own there is one instance; here there are two.
        let name = if isolate == "--isolate" { "gain" } else { "an FMU" };
        assert!(errors.contains(&format!("{name}: [odd] from a thread")), "{isolate}: {errors}");
    }
}

#[test]
fn rows_are_on_disk_within_a_second() {
    let bench = Bench::new();
    // A buffer that is written when it is full would take minutes.
    let slow = ["run", "loop.toml", "--quiet", "--stop=1000", "--set", "gain.pause=0.7"];
    let mut child = bench.command(&slow).spawn().unwrap();
    let mut seen = 0;
    await_while_it_runs(&mut child, "two rows", || {
        seen = rows(&bench);
        seen >= 2
    });
    child.kill().unwrap();
    child.wait().unwrap();
    // A row takes 0.7 s, so each second brings two at most. On a busy machine a look may come late.
    assert!(seen <= 6, "{seen} rows came at once");
}

#[test]
fn an_instance_ends_with_the_process_that_asked_for_it() {
    let bench = harmful("STEP", "ENDLESS");
    // The name of the instance's memory is an argument of its process, which is found by it.
    let children_of = |pid: u32| {
        let entries = fs::read_dir("/proc").into_iter().flatten().flatten();
        let parent = format!("PPid:\t{pid}\n");
        let is_child = |folder: &Path| {
            fs::read_to_string(folder.join("status")).is_ok_and(|status| status.contains(&parent))
        };
        entries.map(|entry| entry.path()).filter(|folder| is_child(folder)).collect::<Vec<_>>()
    };
    let mut child = bench.command(&["run", "loop.toml", "--quiet"]).spawn().unwrap();
    let mut instances = Vec::new();
    if Path::new("/proc/self/status").exists() {
        await_until("two instances", || {
            instances = children_of(child.id());
            instances.len() == 2
        });
    }
    child.kill().unwrap();
    child.wait().unwrap();
    await_until("their end", || !instances.iter().any(|instance| instance.exists()));
}

#[test]
fn a_flood_of_messages_is_held_back() {
    let bench = harmful("STEP", "FLOOD");
    for isolate in ["--isolate", "--isolate=false"] {
        let (code, errors) = run_within(&bench, &["--call-timeout=20"], &[isolate]);
        assert_eq!(code, 0, "{errors}");
        assert!(errors.lines().count() < 500, "{isolate}: {}", errors.lines().count());
        assert!(errors.contains("further messages are left out"), "{isolate}: {errors}");
        assert_eq!(rows(&bench), 4);
    }
}

#[test]
fn results_are_the_same_in_processes_of_their_own() {
    let bench = Bench::new();
    let results = || fs::read(bench.path("out/loop/results.csv")).unwrap();
    assert_eq!(run(&bench, &["--isolate=false"]).0, 0);
    let expected = results();
    assert_eq!(run(&bench, &["--isolate"]).0, 0);
    assert_eq!(results(), expected);
    assert_eq!(run(&bench, &[]).0, 0);
    assert_eq!(results(), expected);
}

#[test]
fn a_component_says_for_itself_whether_it_is_isolated() {
    let bench = harmful("STEP", "SEGFAULT");
    let experiment = LOOP.replace("[components.gain]", "[components.gain]\nisolate = true");
    fs::write(bench.path("loop.toml"), experiment.clone() + "[isolation]\nisolate = false\n")
        .unwrap();
    assert_eq!(run(&bench, &[]).0, 1);
    let wrong = experiment + "[isolation]\ncall_timeout = 0.0\n";
    fs::write(bench.path("loop.toml"), wrong).unwrap();
    let errors = bench.refusal(&["--quiet"]);
    assert!(
        errors.contains("[isolation] call_timeout = 0: it must be from 0.001 to 1e6 s"),
        "{errors}"
    );
}

#[test]
fn what_an_archive_says_of_its_origin_is_not_trusted() {
    let ours = |text: String| text.replace("generationTool=\"", "generationTool=\"fmu-pack ");
    let flags = ["-DPLACE=STEP", "-DHOW=ABORT", "-w"];
    let recipe = Recipe { flags: &flags, description: &ours, ..Recipe::default() };
    let bench = Bench::made(LOOP, &recipe);
    let (code, errors) = run(&bench, &[]);
    assert!(code == 1 && errors.contains("its process was killed by signal 6"), "{errors}");
    // A user who names the folder trusts its content.
    let mut command = bench.command(&["run", "loop.toml", "--force", "--quiet", "--fmu-dir", "."]);
    let output = command.output().unwrap();
    let errors = String::from_utf8(output.stderr).unwrap();
    assert!(errors.contains("gain ended this process in doStep (SIGABRT)"), "{errors}");
}

#[test]
fn instances_that_may_be_in_a_process_only_once_have_processes_of_their_own() {
    let only_once = |text: String| {
        text.replace("<CoSimulation", "<CoSimulation canBeInstantiatedOnlyOncePerProcess=\"true\"")
    };
    let bench = Bench::made(LOOP, &Recipe { description: &only_once, ..Recipe::default() });
    assert_eq!(run(&bench, &[]).0, 0);
    let errors = bench.refusal(&["--quiet", "--isolate=false"]);
    assert!(errors.contains("only once per process"), "{errors}");
}

#[test]
fn a_sandbox_keeps_an_instance_from_files_and_network() {
    let outside = Path::new(env!("CARGO_TARGET_TMPDIR")).join("written-by-an-instance");
    let _ = fs::remove_file(&outside);
    let flags = format!("-DREACHES=\"{}\"", outside.display());
    let bench = Bench::made(LOOP, &Recipe { flags: &[&flags], ..Recipe::default() });
    let (code, errors) = run(&bench, &[]);
    assert_eq!(code, 0, "{errors}");
    assert!(outside.is_file());
    fs::remove_file(&outside).unwrap();
    let (code, errors) = run(&bench, &["--sandbox"]);
    // Where the system has no Landlock, a message says so.
    assert!(
        !outside.exists() || errors.contains("cannot limit these for instances: files"),
        "{errors}"
    );
    assert_eq!(code, 0, "{errors}");
    assert!(outside.exists() || errors.contains("no file, no network"), "{errors}");
    let _ = fs::remove_file(&outside);
}

#[test]
fn a_campaign_is_the_same_with_instances_in_processes_of_their_own() {
    let bench = Bench::new();
    // The first component of the order fails while the other one is stepped.
    let campaign = CAMPAIGN.replace("plant.fail.time", "gain.fail.time");
    fs::write(bench.path("c.toml"), campaign).unwrap();
    let table = |isolate| {
        let arguments = ["campaign", "c.toml", "--fresh", isolate];
        bench.says(&arguments);
        bench.cases("out/c").join("\n")
    };
    let isolated = table("--isolate");
    assert_eq!(isolated, table("--isolate=false"));
    assert_eq!(isolated.matches(",failed,").count(), 3, "{isolated}");
    assert_eq!(isolated.matches(",completed,").count(), 3, "{isolated}");
}

#[test]
fn a_campaign_goes_on_after_an_instance_that_does_harm_but_has_no_result() {
    let bench =
        Bench::made(LOOP, &Recipe { flags: &["-DHARM_BY_GAIN", "-w"], ..Recipe::default() });
    let gains: Vec<String> = (1..=60).map(|gain| format!("{gain}.0")).collect();
    let campaign = CAMPAIGN.replace("[0.5, 1.0, 2.0]", &format!("[{}]", gains.join(", ")));
    fs::write(bench.path("c.toml"), campaign.replace("[1e9, 2.0]", "[1e9]")).unwrap();
    let (code, out, errors) = bench.call(&["campaign", "c.toml"]);
    let says =
        "case 12 could not be flown: gain failed at t = 0 s in doStep: its process was killed";
    assert!(code == 1 && errors.contains(says) && out.is_empty(), "{errors}");
    assert!(
        !bench.path("out/c/summary.json").exists() && !bench.path("out/c/cases.parquet").exists()
    );
    // The parts without such a case are kept.
    let (code, out, _) = bench.call(&["campaign", "c.toml", "--work"]);
    assert!(code == 0 && out.contains("\"missing\":[[0,25]]"), "{out}");
}

#[test]
fn an_fmu_is_inspected_without_harm() {
    for (how, says) in HARM.iter().filter(|(how, _)| !["ENDLESS", "MEMORY"].contains(how)) {
        let bench = harmful("LOAD", how);
        let (code, out, errors) = bench.call(&["inspect", "--check", "Model.fmu"]);
        assert_eq!(code, 1, "{out}{errors}");
        assert!((out + &errors).contains(says), "{how}: {errors}");
    }
}
