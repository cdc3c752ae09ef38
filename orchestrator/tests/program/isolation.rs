//! Instances that harm the process they are in, which is closed unless an option opens it.

use crate::prelude::*;

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
const LIMITS: &str = "[isolation]\ncall_timeout = 3.0\nmemory = 64\n";

fn harmful(place: &str, how: &str) -> Bench {
    harmful_within(LIMITS, place, how)
}

fn harmful_within(limits: &str, place: &str, how: &str) -> Bench {
    let (place, how) = (format!("-DPLACE={place}"), format!("-DHOW={how}"));
    // The compiled form of a write past an array is part of the harm.
    let flags = [place.as_str(), how.as_str(), "-Wno-error", "-w"];
    Bench::made(&format!("{LOOP}{limits}"), &Recipe { flags: &flags, ..Recipe::default() })
}

/// Runs the experiment with a temporary folder of its own, which must be empty afterwards.
fn run(bench: &Bench, arguments: &[&str]) -> (i32, String) {
    let folder = bench.path("temporary folder");
    fs::create_dir_all(&folder).unwrap();
    let mut command = bench.command(&["run", "loop.toml", "--force", "--quiet"]);
    let begin = Instant::now();
    command.args(arguments).env("TMPDIR", &folder);
    let output = command.stdout(Stdio::null()).stderr(Stdio::piped()).output().unwrap();
    assert!(begin.elapsed() < PATIENCE, "{:?}", begin.elapsed());
    assert_eq!(fs::read_dir(&folder).unwrap().count(), 0);
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
    // Values are read after the step that goes before.
    for (place, time, call) in [("STEP", 2, "doStep"), ("GET", 1, "getReal")] {
        for (how, says) in HARM {
            let bench = harmful(place, how);
            let (code, errors) = run(&bench, &[]);
            assert_eq!(code, 1, "{place} {how}: {errors}");
            let begin = format!("error: gain failed at t = {time} s in {call}: ");
            assert!(told(&errors).starts_with(&begin), "{errors}");
            assert!(errors.contains(says), "{place} {how}: {errors}");
            // Those of all communication points before.
            assert_eq!(rows(&bench), time, "{place} {how}");
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
        // The library of both is unloaded with the last one.
        for (place, name) in [("FREE", "gain"), ("UNLOAD", "plant")] {
            let bench = harmful(place, how);
            let (code, errors) = run(&bench, &[]);
            assert_eq!(code, 1, "{place} {how}: {errors}");
            let begin = format!("error: {name} failed at t = 3 s in freeInstance: ");
            assert!(told(&errors).starts_with(&begin), "{place}: {errors}");
            assert!(errors.contains(says), "{place} {how}: {errors}");
            assert_eq!(rows(&bench), 4);
            assert_eq!(bench.json("out/loop/metrics.json")["completed"], true);
        }
    }
}

#[test]
fn harm_in_the_same_process_names_the_component_and_the_call() {
    for (how, what) in [
        ("EXIT", "exit"),
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
fn a_problem_is_told_whether_the_call_then_succeeds_or_ends_the_process() {
    let murmurs = |flags: &[&str]| {
        let flags = [&["-DMURMURS", "-w"], flags].concat();
        let bench = Bench::made(LOOP, &Recipe { flags: &flags, ..Recipe::default() });
        let call = ["run", "loop.toml", "--quiet", "--isolate=false"];
        let output = bench.command(&call).output().unwrap();
        (output.status.code(), String::from_utf8(output.stderr).unwrap())
    };
    let (code, errors) = murmurs(&[]);
    let mut told = errors.lines().filter(|line| line.contains("gain: [trouble]"));
    assert_eq!((code, told.next()), (Some(0), Some("ERROR gain: [trouble] murmur 0")));
    assert_eq!(told.next(), Some("ERROR gain: [trouble] murmur 1"));
    let (_, errors) = murmurs(&["-DPLACE=STEP", "-DHOW=ABORT"]);
    assert_eq!(errors.matches("gain: [trouble] murmur 1").count(), 1, "{errors}");
    assert!(errors.contains("in doStep (SIGABRT); it said: murmur 2"), "{errors}");
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
        // There are two instances that it could come from.
        assert!(errors.contains("an FMU: [odd] from a thread"), "{isolate}: {errors}");
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
        await_until("a closed process", || {
            instances = children_of(child.id());
            instances.len() == 1
        });
    }
    child.kill().unwrap();
    child.wait().unwrap();
    await_until("their end", || !instances.iter().any(|instance| instance.exists()));
}

#[test]
fn a_flood_of_messages_is_held_back() {
    let bench = harmful_within("", "STEP", "FLOOD");
    for isolate in ["--isolate", "--isolate=false"] {
        let (code, errors) = run(&bench, &[isolate]);
        assert_eq!(code, 0, "{errors}");
        assert!(errors.lines().count() < 500, "{isolate}: {}", errors.lines().count());
        assert!(errors.contains("further messages are left out"), "{isolate}: {errors}");
        assert_eq!(rows(&bench), 4);
    }
}

#[test]
fn the_command_line_decides_before_the_experiment_whose_limits_are_checked() {
    let bench = harmful_within("[isolation]\nisolate = false\n", "STEP", "SEGFAULT");
    let (code, errors) = run(&bench, &["--isolate"]);
    assert!(code == 1 && errors.contains("its process was killed by signal 11"), "{errors}");
    for (wrong, says) in [
        ("call_timeout = 0.0", "call_timeout = 0: it must be from 0.001 to 1e6 s"),
        ("cpu = 0", "cpu = 0: it must be at least 1 s"),
    ] {
        fs::write(bench.path("loop.toml"), format!("{LOOP}[isolation]\n{wrong}\n")).unwrap();
        let errors = bench.refusal(&["--quiet"]);
        assert!(errors.contains(&format!("[isolation] {says}")), "{errors}");
    }
}

#[test]
fn a_run_that_takes_all_processor_time_ends_by_its_limit() {
    let bench = harmful_within("[isolation]\ncpu = 1\n", "STEP", "ENDLESS");
    let (code, errors) = run(&bench, &[]);
    let says = "gain failed at t = 2 s in doStep: its process was killed by signal 24";
    assert!(code == 1 && errors.contains(says), "{errors}");
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
fn an_fmu_that_may_be_in_a_process_only_once_is_used_once() {
    let only_once = |text: String| {
        text.replace("<CoSimulation", "<CoSimulation canBeInstantiatedOnlyOncePerProcess=\"true\"")
    };
    let bench = Bench::made(LOOP, &Recipe { description: &only_once, ..Recipe::default() });
    for isolate in ["--isolate", "--isolate=false"] {
        let errors = bench.refusal(&["--quiet", isolate]);
        assert!(errors.contains("only once per process"), "{errors}");
    }
    fs::copy(bench.path("Model.fmu"), bench.path("Copy.fmu")).unwrap();
    let experiment = LOOP.replacen("Model.fmu", "Copy.fmu", 1);
    fs::write(bench.path("loop.toml"), experiment).unwrap();
    assert_eq!(run(&bench, &[]).0, 0);
}

#[test]
fn a_campaign_is_the_same_in_closed_processes() {
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
    assert!(code == 0 && out.contains("\"missing\":[[10,15]]"), "{out}");
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
