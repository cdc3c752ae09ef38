//! Tests of runs with the wall clock, of runs that are ended early, and of the files that they
//! leave.

use crate::prelude::*;

#[test]
fn a_run_in_real_time_takes_its_time() {
    let bench = Bench::new();
    let begin = Instant::now();
    let summary = bench.flown(&["--stop", "2", "--real-time", "2"]);
    assert!(begin.elapsed() >= Duration::from_secs(1));
    assert!(summary.contains("real time         factor 2: 0 of 4 deadlines missed\n"), "{summary}");
    let metrics = bench.json("out/loop/metrics.json");
    assert!(metrics["wall_s"].as_f64().unwrap() >= 1.0);
    assert_eq!(metrics["real_time"]["misses"]["plant"], 0);
    assert_eq!(bench.json("out/loop/results.json")["real_time"]["factor"], 2.0);
}

/// A real-time factor that leaves a nanosecond for each step, which no machine can keep.
const IMPOSSIBLE: &str = "1e9";

#[test]
fn every_missed_deadline_is_counted() {
    let bench = Bench::new();
    let (_, _, _) = bench.run(&["--out", "usual"]);
    let (code, summary, errors) = bench.run(&["--real-time", IMPOSSIBLE]);
    assert_eq!(code, 0, "{errors}");
    assert!(summary.contains(": 6 of 6 deadlines missed; at worst "), "{summary}");
    // The results are those of a run without pacing.
    let rows = |out: &str| fs::read(bench.path(out).join("results.csv")).unwrap();
    assert_eq!(rows("out/loop"), rows("usual"));
    let (_, _, errors) = bench.run(&["--real-time", IMPOSSIBLE, "--quiet"]);
    assert!(errors.contains("6 of 6 deadlines missed"), "{errors}");
}

/// Starts the program, sends it a signal once the file `awaited` exists, and returns its exit code.
#[cfg(unix)]
pub(crate) fn signalled(
    bench: &Bench,
    arguments: &[&str],
    signal: &str,
    awaited: &str,
) -> Option<i32> {
    fs::create_dir_all(bench.path("tmp")).unwrap();
    let mut child = bench
        .command(arguments)
        .env("TMPDIR", bench.path("tmp"))
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    await_while_it_runs(&mut child, awaited, || bench.path(awaited).exists());
    let status = Command::new("kill").args([signal, &child.id().to_string()]).status().unwrap();
    assert!(status.success());
    child.wait().unwrap().code()
}

#[cfg(unix)]
#[test]
fn a_signal_ends_any_run_and_keeps_its_results() {
    let bench = Bench::new();
    // A step takes ten hours in the paced run, and as long as the instance takes in the usual one.
    let paced = ["run", "loop.toml", "--force", "--real-time", "2.7e-5"];
    let usual = ["run", "loop.toml", "--force", "--stop", "1000", "--set", "plant.pause=0.02"];
    for (arguments, signal, code) in [
        (&paced[..], "-INT", 130),
        (&paced, "-TERM", 143),
        (&usual, "-INT", 130),
        (&usual, "-TERM", 143),
    ] {
        fs::create_dir_all(bench.path("out/loop")).unwrap();
        for old in ["metrics.json", "plot.svg"] {
            fs::write(bench.path("out/loop").join(old), "of an earlier run").unwrap();
        }
        assert_eq!(signalled(&bench, arguments, signal, "out/loop/results.csv"), Some(code));
        let status = bench.json("out/loop/results.json")["status"].as_str().unwrap().to_string();
        assert!(status.starts_with("ended by a signal (SIG"), "{status}");
        assert!(status.contains(") at t = "), "{status}");
        assert_eq!(bench.json("out/loop/metrics.json")["completed"], false);
        let rows = bench.results();
        assert!(rows.starts_with("time,gain.output.direct") && rows.ends_with('\n'), "{rows}");
        assert!(rows.lines().all(|row| row.split(',').count() == 4), "{rows}");
        assert!(!bench.path("out/loop/plot.svg").exists());
        assert_eq!(fs::read_dir(bench.path("tmp")).unwrap().count(), 0);
        fs::remove_file(bench.path("out/loop/results.csv")).unwrap();
    }
}

#[test]
fn results_of_an_earlier_run_are_replaced_only_if_that_is_asked_for() {
    let bench = Bench::new();
    let run =
        |arguments: &[&str]| bench.call(&[&["run", "loop.toml", "--quiet"], arguments].concat());
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

    let pack = |arguments: &[&str]| bench.call(&[&["pack", "loop.toml"], arguments].concat());
    assert_eq!(pack(&[]).0, 0);
    let (code, _, errors) = pack(&[]);
    assert!(
        code == 2 && errors.contains("loop.ssp already exists: --force replaces it"),
        "{errors}"
    );
    assert_eq!(pack(&["--force"]).0, 0);
}

#[cfg(unix)]
#[test]
fn an_archive_that_cannot_be_written_leaves_nothing_behind() {
    let bench = Bench::new();
    // Noise makes the archive larger than any file in it.
    let archive = fs::File::options().read(true).write(true).open(bench.path("Model.fmu")).unwrap();
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
    let script = "trap '' XFSZ; ulimit -f 100; exec \"$0\" pack loop.toml";
    let output = with_usual_signals("sh")
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
    // This run prints a warning.
    assert_eq!(run(&["--set", "gain.delay=0.5"]), Some(0));
    assert_eq!(run(&["--set", "gain.gian=0.5"]), Some(2));
    assert_eq!(bench.results().lines().count(), 5);
}

#[test]
fn a_reader_that_goes_away_is_no_failure() {
    let bench = Bench::new();
    let mut child = bench
        .command(&["inspect", "Model.fmu"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    drop(child.stdout.take());
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(0));
    assert!(output.stderr.is_empty());
}
