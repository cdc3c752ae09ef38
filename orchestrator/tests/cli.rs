//! The program as its users see it: exit codes, messages, files. Runs a unit in C that `cc` compiles here.

mod bench;

use bench::{Bench, LOOP};
use std::fs;
use std::io::Write;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};
use zip::write::SimpleFileOptions;

/// Whether a line of the list shows this file with this title, among those of the project if the program was built there.
fn lists(text: &str, file: &str, title: &str) -> bool {
    text.lines().any(|line| line.contains(file) && line.ends_with(title))
}

fn refusal_of(from: &str, to: &str) -> String {
    let changed = LOOP.replace(from, to);
    assert_ne!(changed, LOOP, "{from}");
    Bench::with(&changed).refusal(&[])
}

#[test]
fn oracle_a_run_writes_its_results() {
    let bench = Bench::new();
    let (code, summary, errors) = bench.run(&["--set", "gain.gain=500 mm", "--set", "gain.kind=rough"]);
    assert_eq!(code, 0, "{errors}");
    assert!(summary.contains("loop delay        none (gain -> plant -> gain)"), "{summary}");
    // x⁺ = x + x/2.
    let rows = fs::read_to_string(bench.path("out/loop/results.csv")).unwrap();
    let expected = "time,gain.output.direct,plant.output.integral,plant.steps\n\
                    0.0,0.5,1.0,0\n1.0,0.75,1.5,1\n2.0,1.125,2.25,2\n3.0,1.6875,3.375,3\n";
    assert_eq!(rows, expected);

    let sidecar = bench.json("out/loop/results.json");
    assert_eq!(sidecar["status"], "completed");
    assert_eq!(sidecar["experiment"]["text"], LOOP);
    assert_eq!(sidecar["components"]["gain"]["guid"], "{u-1}");
    assert_eq!(sidecar["components"]["gain"]["set"]["gain"], 0.5);
    assert_eq!(sidecar["components"]["gain"]["parameters"]["kind"], "rough");
    assert_eq!(sidecar["components"]["plant"]["parameters"]["kind"], "calm");
    assert_eq!(sidecar["seeds"]["plant.noise.seed"], 0);
    let metrics = bench.json("out/loop/metrics.json");
    for key in [
        "ems_deg",
        "cms",
        "max_rate_deg_s",
        "max_moment_ratio",
        "solver_ms_mean",
        "solver_ms_p99",
        "solver_ms_max",
        "fallbacks",
        "real_time_factor",
    ] {
        assert!(metrics.as_object().unwrap().contains_key(key), "{key}");
    }
}

#[test]
fn the_same_run_gives_the_same_bytes() {
    let bench = Bench::new();
    for out in ["a", "b"] {
        assert_eq!(bench.run(&["--out", out, "--quiet"]), (0, String::new(), String::new()));
    }
    for file in ["results.csv", "results.json"] {
        assert_eq!(
            fs::read(bench.path("a").join(file)).unwrap(),
            fs::read(bench.path("b").join(file)).unwrap()
        );
    }
}

#[test]
fn couplings_and_orders_that_delay_the_loop_say_so() {
    let bench = Bench::new();
    let (_, summary, _) = bench.run(&["--coupling", "jacobi"]);
    assert!(summary.contains("1 s, 1 step (gain -> plant -> gain), from the Jacobi coupling"), "{summary}");
    let bench = Bench::with(&LOOP.replace("[\"gain\", \"plant\"]", "[\"plant\", \"gain\"]"));
    let (_, summary, _) = bench.run(&[]);
    assert!(summary.contains("1 s, 1 step (plant -> gain -> plant), from the order"), "{summary}");
    assert_eq!(bench.json("out/loop/metrics.json")["loop_delay_s"], 1.0);
}

#[test]
fn a_law_that_counts_on_another_delay_is_warned_of_in_one_line() {
    let bench = Bench::new();
    let warnings = |arguments: &[&str]| {
        let (code, _, errors) = bench.run(&[&["--quiet"], arguments].concat());
        assert_eq!(code, 0, "{errors}");
        errors
    };
    let jacobi = ["--coupling", "jacobi", "--set", "gain.delay=1.25", "--set", "plant.actuation.delay=0.25"];
    let errors = warnings(&jacobi);
    // The plant has a parameter of this name, too, and counts on nothing.
    assert_eq!(errors.lines().count(), 1, "{errors}");
    let told =
        "plant.delay = 0 s, but the loop gain -> plant -> gain has a delay of 1 s: set plant.delay = 1";
    assert!(errors.contains(told), "{errors}");
    assert_eq!(warnings(&[&jacobi[..], &["--set", "plant.delay=1"]].concat()), "");
    assert_eq!(warnings(&[]), "");
    let errors = warnings(&["--set", "gain.delay=0.5"]);
    assert!(
        errors.contains("gain.delay = 0.5 s, but the loop gain -> plant -> gain has a delay of 0 s"),
        "{errors}"
    );
}

#[test]
fn oracle_a_guarantee_is_summed_up_and_told() {
    let bench = Bench::with(&format!("{LOOP}[metrics]\nguarantee = \"gain.guarantee\"\n"));
    let guarantee = |largest: &str| {
        let (code, summary, errors) =
            bench.run(&["--set", "gain.gain=0.5", "--set", &format!("gain.largest={largest}")]);
        assert_eq!(code, 0, "{errors}");
        let line = summary.lines().find(|line| line.starts_with("  guarantee ")).unwrap().to_string();
        (line, bench.json("out/loop/metrics.json"))
    };
    // Its input is 1, 1.5, 2.25, 3.375; margins of 1 - input/largest, and half of that.
    let (line, metrics) = guarantee("2");
    assert_eq!(line, "  guarantee         in force at 50.0 % of the ticks, lost at t = 2 s (exceeded)");
    assert_eq!((&metrics["guarantee_share"], &metrics["guarantee_lost_at"]), (&0.5.into(), &2.0.into()));
    assert_eq!(metrics["guarantee_rate_margin_min"], 0.25);
    assert_eq!(metrics["guarantee_moment_margin_min"], 0.125);
    // No limits are known.
    assert!(metrics["guarantee_broken"].is_null());
    let (line, metrics) = guarantee("3.75");
    assert_eq!(line, "  guarantee         in force throughout, margins 10.0 % (rate), 5.0 % (moment)");
    assert!(metrics["guarantee_lost_at"].is_null());
    assert_eq!(guarantee("0.5").0, "  guarantee         never in force (exceeded)");
    let (_, summary, _) = Bench::new().run(&[]);
    assert!(!summary.contains("guarantee"), "{summary}");
    let message = Bench::with(&format!("{LOOP}[metrics]\nguarantee = \"gain.fail\"\n")).refusal(&[]);
    assert!(message.contains("[metrics] guarantee: there is no variable \"gain.fail.inForce\""), "{message}");
}

#[test]
fn a_failing_unit_ends_the_run_with_its_own_words_and_keeps_the_results() {
    let bench = Bench::new();
    // fmi2Discard, fmi2Error, and fmi2Fatal, after which not even fmi2FreeInstance may be called.
    for (status, name) in [("2", "fmi2Discard"), ("3", "fmi2Error"), ("4", "fmi2Fatal")] {
        let status = format!("plant.fail.status={status}");
        let (code, _, errors) = bench.run(&["--set", "plant.fail.time=2", "--set", &status]);
        assert_eq!(code, 1, "{errors}");
        let last = errors.lines().last().unwrap();
        assert!(
            last.starts_with("error: plant failed at t = 2 s in doStep: out of propellant at 2"),
            "{last}"
        );
        assert!(last.contains(name), "{last}");
        assert_eq!(fs::read_to_string(bench.path("out/loop/results.csv")).unwrap().lines().count(), 4);
        assert_eq!(bench.json("out/loop/metrics.json")["completed"], false);
        let status = bench.json("out/loop/results.json")["status"].as_str().unwrap().to_string();
        assert!(status.contains("out of propellant"), "{status}");
    }
    let (code, _, errors) = bench.run(&["--set", "gain.gain=500"]);
    assert_eq!(code, 1);
    assert!(
        errors.contains("gain failed at t = 0 s in enterInitializationMode: gain too large: 500"),
        "{errors}"
    );
}

#[test]
fn a_run_in_real_time_takes_its_time() {
    let bench = Bench::new();
    let begin = Instant::now();
    let (code, summary, errors) = bench.run(&["--stop", "1", "--real-time"]);
    assert_eq!(code, 0, "{errors}");
    assert!(begin.elapsed() >= Duration::from_secs(1));
    assert!(summary.contains("real time         factor 1: 0 of 4 deadlines missed"), "{summary}");
    assert!(summary.contains("realtime.svg"), "{summary}");
    let real_time = &bench.json("out/loop/metrics.json")["real_time"];
    assert!(real_time["elapsed_s"].as_f64().unwrap() >= 1.0);
    assert_eq!(real_time["components"]["plant"]["step_ms"]["count"], 2);
    // The first communication point is not waited for.
    assert_eq!(real_time["components"]["plant"]["wake_up_ms"]["count"], 1);
    assert_eq!(bench.json("out/loop/results.json")["real_time"]["on_miss"], "catch-up");
    assert!(fs::read_to_string(bench.path("out/loop/realtime.svg")).unwrap().contains("wake-up jitter, ms"));
}

/// No machine steps units in a nanosecond.
const IMPOSSIBLE: &str = "1e9";

#[test]
fn every_missed_deadline_is_counted_and_what_was_done_is_said() {
    let bench = Bench::new();
    let (_, _, _) = bench.run(&["--out", "usual"]);
    for (policy, said) in
        [("catch-up", "went on at once, 3 times"), ("slip", "shifted the time base 3 times, by ")]
    {
        let (code, summary, errors) = bench.run(&["--real-time", IMPOSSIBLE, "--on-miss", policy]);
        assert_eq!(code, 0, "{errors}");
        assert!(summary.contains(": 8 of 8 deadlines missed") && summary.contains(said), "{summary}");
        assert!(
            summary.contains("first miss        gain at t = 0 s, ") && summary.contains("worst miss"),
            "{summary}"
        );
        // The results are those of a run without pacing.
        let rows = |out: &str| fs::read(bench.path(out).join("results.csv")).unwrap();
        assert_eq!(rows("out/loop"), rows("usual"));
        let (_, _, errors) = bench.run(&["--real-time", IMPOSSIBLE, "--on-miss", policy, "--quiet"]);
        assert!(errors.contains("8 of 8 deadlines missed") && errors.contains(said), "{errors}");
    }
    let (code, summary, errors) = bench.run(&["--real-time", IMPOSSIBLE, "--on-miss", "stop"]);
    assert_eq!(code, 1);
    assert!(errors.contains("error: gain missed its deadline at t = 0 s by "), "{errors}");
    assert!(summary.contains("2 of 2 deadlines missed"), "{summary}");
    assert_eq!(fs::read_to_string(bench.path("out/loop/results.csv")).unwrap().lines().count(), 2);
    assert_eq!(bench.json("out/loop/metrics.json")["completed"], false);
    let status = bench.json("out/loop/results.json")["status"].as_str().unwrap().to_string();
    assert!(status.starts_with("failed: gain missed its deadline"), "{status}");
}

#[test]
fn a_slow_unit_is_named() {
    let bench = Bench::new();
    // 20 ms from tick to tick, and a step of the plant takes 50 ms.
    let (code, summary, errors) = bench.run(&["--real-time", "50", "--set", "plant.pause=0.05"]);
    assert_eq!(code, 0, "{errors}");
    let worst = summary.lines().find(|line| line.contains("worst miss")).unwrap();
    assert!(worst.contains("longest step since the last wait: plant, "), "{worst}");
    let real_time = &bench.json("out/loop/metrics.json")["real_time"];
    let plant = &real_time["components"]["plant"];
    // The histogram has three digits.
    assert!(plant["step_ms"]["max"].as_f64().unwrap() >= 49.9, "{plant}");
    // The tick at the start needs no step.
    assert!(plant["misses"].as_u64().unwrap() >= 3, "{plant}");
    assert!(real_time["worst_miss"]["late_ms"].as_f64().unwrap() >= 29.9, "{real_time}");
}

#[test]
fn factors_and_priorities_that_make_no_sense_are_refused() {
    let bench = Bench::new();
    for factor in ["0", "-1", "nan", "inf"] {
        let (code, _, errors) = bench.run(&["--real-time", factor]);
        assert_eq!(code, 2);
        assert!(errors.contains("must be finite and above 0"), "{factor}: {errors}");
    }
    let (code, _, errors) = bench.call(&["run", "--real-time", "loop.toml"]);
    assert_eq!(code, 2);
    assert!(errors.contains("write the experiment before --real-time"), "{errors}");
    for arguments in [&["--on-miss", "stop"][..], &["--priority"], &["--real-time", "--priority", "100"]] {
        assert_eq!(bench.run(arguments).0, 2, "{arguments:?}");
    }
}

#[test]
fn a_priority_is_had_or_refused_in_words() {
    let bench = Bench::new();
    let (code, summary, errors) = bench.run(&["--real-time", "1000", "--priority", "1"]);
    assert_eq!(code, 0, "{errors}");
    let line = summary.lines().find(|line| line.starts_with("  priority ")).unwrap();
    assert!(line.contains("SCHED_FIFO 1") || line.contains("REFUSED, ran with usual scheduling: "), "{line}");
}

#[test]
fn the_live_view_wants_a_terminal() {
    let bench = Bench::new();
    let message = bench.refusal(&["--live"]);
    assert!(message.contains("--live draws on a terminal, and standard output is none"), "{message}");
    assert!(!bench.path("out").exists());
}

/// Starts the program, sends it a signal once `awaited` is there, and gives back its exit code.
#[cfg(unix)]
fn signalled(bench: &Bench, arguments: &[&str], signal: &str, awaited: &str) -> Option<i32> {
    let mut child = bench
        .command(arguments)
        .env("TMPDIR", bench.path("tmp"))
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    while !bench.path(awaited).exists() {
        std::thread::sleep(Duration::from_millis(10));
    }
    let status = Command::new("kill").args([signal, &child.id().to_string()]).status().unwrap();
    assert!(status.success());
    child.wait().unwrap().code()
}

#[cfg(unix)]
#[test]
fn a_signal_ends_any_run_and_keeps_its_results() {
    let bench = Bench::new();
    fs::create_dir(bench.path("tmp")).unwrap();
    // A step takes ten hours, or as long as the unit does.
    let paced = ["run", "loop.toml", "--force", "--real-time", "2.7e-5"];
    let usual = ["run", "loop.toml", "--force", "--stop", "1000", "--set", "plant.pause=0.02"];
    for (arguments, signal, code) in
        [(&paced[..], "-INT", 130), (&paced, "-TERM", 143), (&usual, "-INT", 130), (&usual, "-TERM", 143)]
    {
        fs::create_dir_all(bench.path("out/loop")).unwrap();
        for old in ["metrics.json", "plot.svg", "realtime.svg"] {
            fs::write(bench.path("out/loop").join(old), "of an earlier run").unwrap();
        }
        assert_eq!(signalled(&bench, arguments, signal, "out/loop/results.csv"), Some(code));
        let status = bench.json("out/loop/results.json")["status"].as_str().unwrap().to_string();
        assert!(status.starts_with("ended by a signal (SIG"), "{status}");
        assert!(status.contains(") before t = "), "{status}");
        assert_eq!(bench.json("out/loop/metrics.json")["completed"], false);
        let rows = fs::read_to_string(bench.path("out/loop/results.csv")).unwrap();
        assert!(rows.starts_with("time,gain.output.direct") && rows.ends_with('\n'), "{rows}");
        assert!(rows.lines().all(|row| row.split(',').count() == 4), "{rows}");
        assert_eq!(bench.path("out/loop/realtime.svg").exists(), arguments == paced);
        assert!(!bench.path("out/loop/plot.svg").exists());
        assert_eq!(fs::read_dir(bench.path("tmp")).unwrap().count(), 0);
        fs::remove_file(bench.path("out/loop/results.csv")).unwrap();
    }
}

#[test]
fn results_of_an_earlier_run_are_replaced_only_if_that_is_asked_for() {
    let bench = Bench::new();
    let run = |arguments: &[&str]| bench.call(&[&["run", "loop.toml", "--quiet"], arguments].concat());
    assert_eq!(run(&[]), (0, String::new(), String::new()));
    let before = fs::read(bench.path("out/loop/results.csv")).unwrap();
    let (code, _, errors) = run(&["--stop", "1"]);
    assert_eq!(code, 2);
    assert_eq!(errors.lines().count(), 1, "{errors}");
    assert!(errors.contains("out/loop holds results of an earlier run"), "{errors}");
    assert_eq!(fs::read(bench.path("out/loop/results.csv")).unwrap(), before);
    assert_eq!(run(&["--stop", "1", "--force"]).0, 0);
    assert_ne!(fs::read(bench.path("out/loop/results.csv")).unwrap(), before);
    let (code, _, errors) = run(&["--out", "loop.toml"]);
    assert!(code == 2 && errors.contains("--out loop.toml is a file"), "{errors}");

    let pack = |arguments: &[&str]| bench.call(&[&["pack", "loop.toml", "--ssp"], arguments].concat());
    assert_eq!(pack(&[]).0, 0);
    let (code, _, errors) = pack(&[]);
    assert!(code == 2 && errors.contains("loop.ssp is there already: --force replaces it"), "{errors}");
    assert_eq!(pack(&["--force"]).0, 0);
}

#[cfg(unix)]
#[test]
fn an_archive_that_cannot_be_written_leaves_nothing_behind() {
    let bench = Bench::new();
    // Noise makes the archive larger than any file in it.
    let archive = fs::File::options().read(true).write(true).open(bench.path("Unit.fmu")).unwrap();
    let mut zip = zip::ZipWriter::new_append(archive).unwrap();
    let mut noise = 1_u32;
    for name in 0..10 {
        zip.start_file(format!("resources/{name}"), SimpleFileOptions::default()).unwrap();
        let bytes = (0..20_000).map(|_| {
            noise = noise.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (noise >> 24) as u8
        });
        zip.write_all(&bytes.collect::<Vec<_>>()).unwrap();
    }
    zip.finish().unwrap();
    // Files may not grow beyond 100 blocks, of 512 or 1024 bytes, as if the disk were full.
    let script = "trap '' XFSZ; ulimit -f 100; exec \"$0\" pack loop.toml --ssp";
    let output = Command::new("sh")
        .args(["-c", script, env!("CARGO_BIN_EXE_orchestrator")])
        .current_dir(bench.folder.path())
        .output()
        .unwrap();
    let errors = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(1), "{errors}");
    assert_eq!(errors.lines().count(), 1, "{errors}");
    let there = fs::read_dir(bench.folder.path()).unwrap().flatten().map(|entry| entry.file_name());
    assert!(there.into_iter().all(|name| !name.to_string_lossy().contains("ssp")), "{errors}");
}

#[cfg(unix)]
#[test]
fn two_processes_do_not_share_a_folder() {
    let bench = Bench::new();
    let mut child = bench
        .command(&["run", "loop.toml", "--out", "shared", "--real-time", "2.7e-5"])
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    while !bench.path("shared/results.csv").exists() {
        std::thread::sleep(Duration::from_millis(10));
    }
    let message = bench.refusal(&["--out", "shared"]);
    assert!(message.contains("another process is writing its results to shared"), "{message}");
    child.kill().unwrap();
    child.wait().unwrap();
    assert_eq!(bench.run(&["--out", "shared"]).0, 0);
}

#[test]
fn a_warning_is_told_once_with_first_time_and_count() {
    let bench = Bench::new();
    let (code, _, errors) = bench.run(&["--quiet", "--set", "plant.flag=true"]);
    assert_eq!(code, 0);
    assert_eq!(errors.lines().count(), 1, "{errors}");
    assert!(errors.contains("plant: [trouble] runs hot at 7 (first at t = 1 s, 3 times)"), "{errors}");
}

#[test]
fn experiments_and_units_are_found_from_any_folder() {
    let bench = Bench::new();
    let elsewhere = tempfile::tempdir().unwrap();
    let run = |arguments: &[&str]| {
        let mut command = bench.command(arguments);
        let output = command
            .current_dir(elsewhere.path())
            .env("ORCHESTRATOR_PATH", bench.folder.path())
            .output()
            .unwrap();
        let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
        (output.status.code(), text(output.stdout), text(output.stderr))
    };
    let (code, text, _) = run(&["list"]);
    assert!(code == Some(0) && lists(&text, "loop.toml", "gain and integrator"), "{text}");
    for (name, out) in [("loop", "a"), ("loop.toml", "b")] {
        let (code, _, errors) = run(&["run", name, "--quiet", "--out", out]);
        assert_eq!(code, Some(0), "{errors}");
        assert!(elsewhere.path().join(out).join("results.csv").exists());
    }
    let (code, _, errors) = run(&["run", "lop"]);
    assert!(code == Some(2) && errors.contains("there is no experiment \"lop\""), "{errors}");
    assert!(errors.contains("did you mean \"loop\"?"), "{errors}");
    let (code, _, errors) = run(&["run", "some/Unit.fmu"]);
    assert!(code == Some(2) && errors.contains("is a unit, and units are run by an experiment"), "{errors}");
    fs::create_dir(bench.path("more")).unwrap();
    fs::copy(bench.path("loop.toml"), bench.path("more/loop.toml")).unwrap();
    let (code, _, errors) = run(&["run", "loop"]);
    assert!(code == Some(2) && errors.contains("several experiments are called loop: "), "{errors}");
}

#[test]
fn usage_that_is_nearly_right_is_told_what_it_lacks() {
    let bench = Bench::new();
    assert!(bench.refusal(&["--stop", "-1"]).contains("stop = -1 s must be at least one step of 1 s"));
    let (code, _, errors) = bench.call(&["pack", "loop.toml"]);
    assert!(code == 2 && errors.contains("--ssp"), "{errors}");
    let (code, _, errors) = bench.call(&["reproduce", "loop", "--members", "0"]);
    assert!(code == 2 && errors.contains("--members"), "{errors}");
    // A unit without inputs that are left: all of none stay unconnected.
    let lonely = LOOP.replace(
        "[components.plant]",
        "[components.other]\nfmu = \"Unit.fmu\"\nunconnected = [\"*\"]\n[components.plant]",
    );
    let bench = Bench::with(&lonely);
    let (code, summary, errors) = bench.run(&[]);
    assert_eq!(code, 0, "{errors}");
    // What the order leaves out comes last.
    assert!(summary.contains("gain, plant, other"), "{summary}");
}

#[test]
fn results_can_be_left_out_or_labelled() {
    let bench = Bench::with(&LOOP.replace("\"plant.steps\"", "\"plant.steps\", \"gain.guarantee.status\""));
    let (code, summary, errors) = bench.run(&["--no-csv", "--no-plot", "--out", "few"]);
    assert_eq!(code, 0, "{errors}");
    assert!(summary.contains("few: results.json, metrics.json\n"), "{summary}");
    assert!(!bench.path("few/results.csv").exists() && !bench.path("few/plot.svg").exists());
    let (code, summary, errors) = bench.run(&["--format", "parquet", "--out", "columnar"]);
    assert_eq!(code, 0, "{errors}");
    assert!(summary.contains("columnar: results.parquet, results.json"), "{summary}");
    assert!(bench.path("columnar/results.parquet").exists() && !bench.path("columnar/results.csv").exists());
    let (code, _, errors) = bench.run(&["--format", "parquet", "--labels", "--out", "neither"]);
    assert!(code == 2 && errors.contains("--labels") && !bench.path("neither").exists(), "{code} {errors}");
    let head = |arguments: &[&str]| {
        assert_eq!(bench.run(arguments).0, 0);
        let rows = fs::read_to_string(bench.path("out/loop/results.csv")).unwrap();
        rows.lines().take(2).map(String::from).collect::<Vec<_>>()
    };
    assert_eq!(
        head(&[]),
        [
            "time,gain.output.direct,plant.output.integral,plant.steps,gain.guarantee.status",
            "0.0,2.0,1.0,0,1"
        ]
    );
    let labelled = head(&["--labels"]);
    let names = "time [s],gain.output.direct [m],plant.output.integral [m],plant.steps,gain.guarantee.status";
    assert_eq!(labelled[0], names);
    let item = labelled[1].rsplit(',').next().unwrap();
    // Whichever way, the numbers have their names beside them.
    let columns = &bench.json("out/loop/results.json")["columns"];
    assert_eq!(columns[3]["items"]["1"], item, "{columns}");
    assert!(columns[0]["items"].is_null() && columns[0]["unit"] == "m");
}

#[test]
fn a_unit_is_exchanged_from_the_command_line() {
    let experiment =
        LOOP.replace("[components.plant]", "[components.gain.parameters]\ngain = 3.0\n[components.plant]");
    let bench = Bench::with(&experiment);
    // Another unit, that lacks what is set of the first.
    let mut old = zip::ZipArchive::new(fs::File::open(bench.path("Unit.fmu")).unwrap()).unwrap();
    fs::create_dir(bench.path("mine")).unwrap();
    let mut zip = zip::ZipWriter::new(fs::File::create(bench.path("mine/My.fmu")).unwrap());
    for index in 0..old.len() {
        let mut entry = old.by_index(index).unwrap();
        let name = entry.name().unwrap().into_owned();
        let mut content = Vec::new();
        std::io::Read::read_to_end(&mut entry, &mut content).unwrap();
        if name == "modelDescription.xml" {
            let text = String::from_utf8(content).unwrap();
            content = text.replace("name=\"gain\"", "name=\"amplification\"").into_bytes();
        }
        zip.start_file(name, SimpleFileOptions::default()).unwrap();
        zip.write_all(&content).unwrap();
    }
    zip.finish().unwrap();
    let (code, _, errors) =
        bench.run(&["--quiet", "--fmu", "gain=mine/My.fmu", "--set", "gain.amplification=0.5"]);
    assert_eq!(code, 0, "{errors}");
    assert!(errors.contains("gain.gain: ") && errors.contains("it is left out"), "{errors}");
    let sidecar = bench.json("out/loop/results.json");
    assert_eq!(sidecar["components"]["gain"]["fmu"], "My.fmu");
    assert_eq!(sidecar["components"]["gain"]["set"]["amplification"], 0.5);
    for (assignment, told) in [
        ("gian=mine/My.fmu", "did you mean \"gain\""),
        ("mine/My.fmu", "wants component=file"),
        ("gain=mine/Me.fmu", "there is no file \"mine/Me.fmu\""),
        ("gain=Unti.fmu", "did you mean \"Unit.fmu\""),
    ] {
        let message = bench.refusal(&["--fmu", assignment]);
        assert!(message.contains(told), "{message}");
    }
}

#[test]
fn inspect_filters_and_speaks_json() {
    let bench = Bench::new();
    let (code, text, _) = bench.call(&["inspect", "Unit.fmu", "guarantee.*", "--json"]);
    assert_eq!(code, 0);
    let all: serde_json::Value = serde_json::from_str(&text).unwrap();
    let names: Vec<&str> =
        all["variables"].as_array().unwrap().iter().map(|v| v["name"].as_str().unwrap()).collect();
    assert_eq!(
        names,
        ["guarantee.inForce", "guarantee.status", "guarantee.rateMargin", "guarantee.momentMargin"]
    );
    assert_eq!(all["guid"], "{u-1}");
    let (_, text, _) = bench.call(&["inspect", "Unit.fmu", "seed"]);
    assert!(text.contains("noise.seed") && !text.contains("output.direct"), "{text}");
    let (_, text, _) = bench.call(&["inspect", "Unit.fmu", "--causality", "input"]);
    assert!(text.contains("input (1)") && !text.contains("parameter ("), "{text}");
    let (code, _, errors) = bench.call(&["inspect", "Unit.fmu", "sed"]);
    assert!(code == 2 && errors.contains("has no variable that fits \"sed\""), "{errors}");
}

#[test]
fn shells_complete_commands() {
    for shell in ["bash", "zsh", "fish"] {
        let (code, text, _) = Bench::new().call(&["completions", shell]);
        assert!(code == 0 && text.contains("reproduce") && text.contains("on-miss"), "{shell}");
    }
}

#[test]
fn steps_without_number_are_refused_with_what_they_would_take() {
    let bench = Bench::new();
    for (arguments, steps) in
        [(["--step", "1e-9"], "3000000000 steps"), (["--stop", "1e12"], "1000000000000 steps")]
    {
        let message = bench.refusal(&arguments);
        assert!(message.contains(steps) && message.contains(" GB and the run "), "{message}");
        assert!(!bench.path("out").exists());
    }
}

#[cfg(target_os = "linux")]
#[test]
fn standard_error_that_cannot_be_written_ends_no_run() {
    let bench = Bench::new();
    let run = |arguments: &[&str]| {
        let full = fs::File::options().write(true).open("/dev/full").unwrap();
        let mut command = bench.command(&[&["run", "loop.toml", "--force"], arguments].concat());
        command.stdout(Stdio::null()).stderr(full).status().unwrap().code()
    };
    assert_eq!(run(&[]), Some(0));
    // With a warning.
    assert_eq!(run(&["--set", "gain.delay=0.5"]), Some(0));
    assert_eq!(run(&["--set", "gain.gian=0.5"]), Some(2));
    assert_eq!(fs::read_to_string(bench.path("out/loop/results.csv")).unwrap().lines().count(), 5);
}

#[test]
fn bad_usage_exits_with_2() {
    let bench = Bench::new();
    for arguments in [&["run"][..], &["jump"], &[], &["run", "loop.toml", "--stop", "soon"]] {
        assert_eq!(bench.call(arguments).0, 2, "{arguments:?}");
    }
    assert_eq!(bench.call(&["--help"]).0, 0);
    assert_eq!(bench.call(&["run", "missing.toml"]).0, 2);
    assert_eq!(bench.call(&["inspect", "missing.fmu"]).0, 2);
    assert_eq!(bench.call(&["inspect", "loop.toml"]).0, 2);
    assert_eq!(bench.call(&["list", "missing"]).0, 2);
}

#[test]
fn wrong_names_are_refused_with_place_and_remedy() {
    let message = refusal_of("plant.output.integral\"\nto", "plant.output.integrall\"\nto");
    assert!(
        message.contains("loop.toml:12: ") && message.contains("did you mean \"output.integral\""),
        "{message}"
    );
    let message = refusal_of("to = \"gain.input\"", "to = \"gian.input\"");
    assert!(message.contains("loop.toml:13: ") && message.contains("did you mean \"gain\""), "{message}");
    let message = refusal_of("\"plant.steps\"", "\"plant.step\"");
    assert!(message.contains("loop.toml:18: ") && message.contains("did you mean \"steps\""), "{message}");
    let message = refusal_of("Unit.fmu\"\n[components.plant]", "Unti.fmu\"\n[components.plant]");
    assert!(message.contains("loop.toml:8: ") && message.contains("did you mean \"Unit.fmu\""), "{message}");
    let message = refusal_of("[\"gain\", \"plant\"]", "[\"gain\", \"palnt\"]");
    assert!(message.contains("did you mean \"plant\""), "{message}");
    let message = refusal_of("[\"gain\", \"plant\"]", "[]");
    assert!(
        message.contains("there is no order") && message.contains("order = [\"gain\", \"plant\"]"),
        "{message}"
    );
    let message = refusal_of("stop = 3.0", "stopp = 3.0");
    assert!(message.contains("loop.toml:4: ") && message.contains("`stop`"), "{message}");
}

#[test]
fn wrong_settings_are_refused() {
    let bench = Bench::new();
    for (setting, remedy) in [
        ("gain.gian=1", "did you mean \"gain.gain\""),
        ("noise.seed=1", "of which component? Write gain.noise.seed or plant.noise.seed"),
        ("palnt.gain=1", "did you mean \"plant.gain\""),
        ("gain.seed=1", "did you mean \"gain.noise.seed\""),
        ("gain.kind=ruogh", "did you mean \"rough\""),
        ("gain.kind=2", "the name of an item (calm, rough)"),
        ("gain.gain=1 m/s", "measure different things"),
        ("gain.gain=1 mmm", "did you mean \"mm\""),
        ("gain.gain=2000", "above its maximum 1000"),
        ("gain.fail.status=7", "not between 2 and 4"),
        ("gain.flag=1", "wants true or false"),
        ("gain.steps=1", "is of causality output"),
        ("gain.input=1", "is an input with a connection"),
    ] {
        let message = bench.refusal(&["--set", setting]);
        assert!(message.contains(remedy), "{setting}: {message}");
        assert!(message.starts_with("error: --set ") && !message.contains("loop.toml"), "{message}");
    }
    assert!(bench.refusal(&["--stop", "2.5"]).contains("2 s or 3 s"));
    let (code, _, errors) = bench.run(&["--set", "gain.text=hello", "--set", "gain.flag=true"]);
    assert_eq!(code, 0, "{errors}");
    assert_eq!(bench.json("out/loop/results.json")["components"]["gain"]["parameters"]["flag"], true);
}

#[test]
fn wrong_wiring_is_refused() {
    let message = refusal_of("plant.output.integral\"\nto", "plant.speed\"\nto");
    assert!(message.contains("units") && message.contains("m/s against m"), "{message}");
    let message = refusal_of("plant.output.integral\"\nto", "plant.steps\"\nto");
    assert!(message.contains("Integer against Real"), "{message}");
    let message = refusal_of("plant.output.integral\"\nto", "plant.gain\"\nto");
    assert!(message.contains("is of causality parameter, not an output"), "{message}");
    let message = refusal_of("to = \"plant.input\"", "to = \"plant.output.direct\"");
    assert!(message.contains("is of causality output, not an input"), "{message}");
    let message = refusal_of("to = \"plant.input\"", "to = \"gain.input\"");
    assert!(message.contains("loop.toml:16: ") && message.contains("connected twice"), "{message}");
    let message = refusal_of("plant.output.integral\"\nto", "plant.output.direct\"\nto");
    assert!(message.contains("algebraic loop") && message.contains("gain.input"), "{message}");
    let message = refusal_of(
        "from = \"gain.output.direct\"\nto = \"plant.input\"",
        "from = \"plant.*\"\nto = \"gain.none.*\"",
    );
    assert!(message.contains("there are: input"), "{message}");
}

#[test]
fn inputs_without_connection_must_be_meant() {
    let open = LOOP.replace("[[connections]]\nfrom = \"gain.output.direct\"\nto = \"plant.input\"\n", "");
    let message = Bench::with(&open).refusal(&[]);
    assert!(message.contains("inputs of \"plant\" are not connected: input"), "{message}");
    // The line that the message proposes is the remedy.
    let (_, line) = message.split_once("[components.plant]: ").unwrap();
    let meant = open.replace("[components.plant]\n", &format!("[components.plant]\n{line}"));
    assert_eq!(Bench::with(&meant).run(&[]).0, 0);
    // A value will do as well.
    let bench = Bench::with(&open);
    assert_eq!(bench.run(&["--set", "plant.input=3"]).0, 0);
    assert!(fs::read_to_string(bench.path("out/loop/results.csv")).unwrap().contains("\n3.0,20.0,10.0,3\n"));
    let message =
        Bench::with(&LOOP.replace("[components.plant]\n", "[components.plant]\nunconnected = [\"input\"]\n"))
            .refusal(&[]);
    assert!(message.contains("is said to be unconnected, but is connected"), "{message}");
}

#[test]
fn inspect_and_list_show_what_there_is() {
    let bench = Bench::new();
    let (code, text, _) = bench.call(&["inspect", "Unit.fmu"]);
    assert_eq!(code, 0);
    for part in
        ["{u-1}", "linux64", "canHandleVariableCommunicationStepSize", "output.integral", "{calm, rough}"]
    {
        assert!(text.contains(part), "{part}: {text}");
    }
    let (code, text, _) = bench.call(&["list"]);
    assert_eq!(code, 0);
    assert!(lists(&text, "loop.toml", "gain and integrator") && text.contains("Unit.fmu"), "{text}");
}

#[test]
fn a_reader_that_goes_away_is_no_failure() {
    let bench = Bench::new();
    let mut child = bench
        .command(&["inspect", "Unit.fmu"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    drop(child.stdout.take());
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(0));
    assert!(output.stderr.is_empty());
}

#[test]
fn nothing_is_left_in_the_temporary_folder() {
    let bench = Bench::new();
    let temporary = bench.path("tmp with space");
    fs::create_dir(&temporary).unwrap();
    let status = bench.command(&["run", "loop.toml", "--quiet"]).env("TMPDIR", &temporary).status().unwrap();
    assert!(status.success());
    assert_eq!(fs::read_dir(&temporary).unwrap().count(), 0);
}

#[test]
fn an_experiment_that_extends_another_is_all_of_them() {
    let bench = Bench::new();
    let (code, _, errors) = bench.call(&["run", "loop.toml", "--quiet"]);
    assert_eq!(code, 0, "{errors}");
    let results = |name: &str| fs::read_to_string(bench.path(&format!("out/{name}/results.csv"))).unwrap();
    let own = "extends = \"../loop.toml\"\ntitle = \"longer\"\n[simulation]\nstop = 4.0\n";
    fs::create_dir(bench.path("more")).unwrap();
    fs::write(bench.path("more/longer.toml"), own).unwrap();
    // The unit stands beside the file that is extended.
    let (code, _, errors) = bench.call(&["run", "longer", "--quiet"]);
    assert_eq!(code, 0, "{errors}");
    assert!(results("longer").starts_with(&results("loop")) && results("longer") != results("loop"));
    // What is kept of the run, what is shown and what is packed is the whole.
    let kept = bench.json("out/longer/results.json");
    let (code, shown, _) = bench.call(&["show", "longer"]);
    assert!(code == 0 && kept["experiment"]["text"] == shown && !shown.contains("extends"), "{shown}");
    fs::write(bench.path("whole.toml"), shown).unwrap();
    let (code, _, errors) = bench.call(&["run", "whole.toml", "--quiet"]);
    assert!(code == 0 && results("whole") == results("longer"), "{errors}");
    let (code, _, errors) = bench.call(&["pack", "more/longer.toml", "--ssp", "--out", "longer.ssp"]);
    assert_eq!(code, 0, "{errors}");
    let (code, _, errors) = bench.call(&["run", "longer.ssp", "--quiet", "--out", "out/packed"]);
    assert_eq!(code, 0, "{errors}");
    // A fault is told with the file that has it; without a title a file is no experiment of its own.
    fs::write(bench.path("loop.toml"), LOOP.replace("plant.steps", "plant.stepz")).unwrap();
    let (code, _, errors) = bench.call(&["run", "more/longer.toml", "--force"]);
    assert!(code == 2 && errors.contains("loop.toml:18: ") && errors.contains("\"steps\""), "{errors}");
    fs::write(bench.path("loop.toml"), LOOP.replace("title = \"gain and integrator\"\n", "")).unwrap();
    let (_, text, _) = bench.call(&["list"]);
    assert!(lists(&text, "longer.toml", "longer") && !text.contains("./loop.toml"), "{text}");
}

#[test]
fn all_experiments_of_the_project_can_be_read() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("experiments");
    let (code, text, _) = Bench::new().call(&["list", folder.to_str().unwrap()]);
    assert_eq!(code, 0);
    assert!(text.contains("crmpc-robust.toml") && !text.contains("FAULT"), "{text}");
}
