//! Third-party FMUs, imitated by an FMU in C. Their deviations must run, and their faults must be
//! reported.

use crate::prelude::*;

/// Checks that standard error holds one line, which names the archive and not the temporary folder.
fn told(errors: &str) -> &str {
    assert_eq!(errors.lines().count(), 1, "{errors}");
    assert!(
        errors.starts_with("error: Model.fmu: ") || errors.contains("/Model.fmu: "),
        "{errors}"
    );
    assert!(!errors.contains("/fmu-"), "{errors}");
    errors.trim_end()
}

fn changed<'a>(from: &'a str, to: &'a str) -> impl Fn(String) -> String + 'a {
    move |text| {
        assert!(text.contains(from), "{from}");
        text.replacen(from, to, 1)
    }
}

#[test]
fn unusual_fmus_run() {
    // Memory functions are passed all the same.
    let memory =
        changed("modelIdentifier", "canNotUseMemoryManagementFunctions=\"true\" modelIdentifier");
    let hyphen = changed("modelIdentifier=\"model\"", "modelIdentifier=\"model-7\"");
    let revision = changed("fmiVersion=\"2.0\"", "fmiVersion=\"2.0.1\"");
    for recipe in [
        Recipe { description: &hyphen, name: "model-7.so", ..Recipe::default() },
        Recipe { description: &revision, ..Recipe::default() },
        Recipe { description: &memory, ..Recipe::default() },
        Recipe { prefix: "./", ..Recipe::default() },
    ] {
        Bench::made(LOOP, &recipe).silent(&["--quiet"]);
    }
    for name in ["../model", "a/b", "c:d", ""] {
        let text = format!("modelIdentifier=\"{name}\"");
        let description = changed("modelIdentifier=\"model\"", &text);
        let bench = Bench::made(LOOP, &Recipe { description: &description, ..Recipe::default() });
        let (code, _, errors) = bench.run(&["--quiet"]);
        assert_eq!(code, 2);
        assert!(told(&errors).contains("must be the name of a file"), "{errors}");
    }
}

#[test]
fn an_instance_may_end_the_simulation() {
    let bench = Bench::made(LOOP, &Recipe { flags: &["-DENDS=1"], ..Recipe::default() });
    let fails = ["--set", "plant.fail.time=2", "--set", "plant.fail.status=2"];
    let (code, summary, _) = bench.run(&fails);
    assert_eq!(code, 0);
    assert!(summary.contains("ended early       plant ended the simulation at t = 2 s: out of propellant at 2; it got as far as t = 3 s"), "{summary}");
    assert_eq!(bench.results().lines().count(), 4);
    assert_eq!(bench.json("out/loop/metrics.json")["completed"], false);
    bench.ends(0, &[&fails[..], &["--quiet"]].concat(), "plant ended the simulation at t = 2 s");

    // The experiment may expect it: the run is then complete, up to the moment of the end.
    let text = LOOP.replace("[simulation]", "[simulation]\nends_with = \"plant\"");
    let bench = Bench::made(&text, &Recipe { flags: &["-DENDS=1"], ..Recipe::default() });
    for isolation in [&[][..], &["--isolate"]] {
        let summary = bench.flown(&[&fails[..], isolation].concat());
        assert_has(&summary, "ended             by plant: out of propellant at 2");
        assert_eq!(bench.json("out/loop/metrics.json")["completed"], true);
        let rows = bench.results();
        assert_eq!(rows.lines().count(), 5);
        assert!(rows.lines().last().unwrap().starts_with("3.0,"), "{rows}");
    }
    let other = LOOP.replace("[simulation]", "[simulation]\nends_with = \"plan\"");
    let (code, _, errors) = Bench::made(&other, &Recipe::default()).run(&[]);
    assert_eq!(code, 2);
    assert!(errors.contains("ends_with: there is no component \"plan\""), "{errors}");

    // Without fmi2Terminated the discarded step is a failure, whose message says how far the
    // instance got.
    let (code, _, errors) = Bench::new().run(&fails);
    assert_eq!(code, 1);
    let last = "error: plant failed at t = 2 s in doStep: out of propellant at 2; it got as far as t = 3 s (fmi2Discard)";
    assert_eq!(errors.lines().last(), Some(last));
}

#[test]
fn a_status_that_does_not_exist_is_a_failure_of_that_call() {
    // The logger receives the same status.
    let description = changed(" min=\"2\" max=\"4\" start=\"3\"", " start=\"3\"");
    let bench = Bench::made(LOOP, &Recipe { description: &description, ..Recipe::default() });
    for status in ["-7", "42", "99"] {
        let value = format!("plant.fail.status={status}");
        let (code, _, errors) =
            bench.run(&["--quiet", "--set", "plant.fail.time=2", "--set", &value]);
        assert_eq!(code, 1, "{errors}");
        let last = format!(
            "error: plant failed at t = 2 s in doStep: out of propellant at 2 (status {status}, which FMI 2.0 does not have)"
        );
        assert_eq!(errors.lines().last(), Some(last.as_str()));
    }
}

#[test]
fn a_misnamed_library_is_told_by_run_and_check() {
    let bench = Bench::made(LOOP, &Recipe { name: "other.so", ..Recipe::default() });
    let (code, _, errors) = bench.run(&["--quiet"]);
    let said = "has no binaries/linux64/model.so, which its model identifier names; the folder holds: other.so";
    assert!(code == 2 && told(&errors).ends_with(said), "{errors}");
    let (checked, text, _) = bench.call(&["inspect", "--check", "Model.fmu"]);
    let text = text.replace("Model.fmu: ", "");
    assert!(checked == 1 && errors.trim_end().ends_with(text.trim_end()), "{errors} {text}");
}

#[test]
fn doubtful_fmus_are_warned_of_and_checked() {
    let description = |text: String| {
        let text = changed(
            "\"flag\" valueReference=\"6\"",
            "\"flag\" valueReference=\"6\" causality=\"paramter\"",
        )(text);
        let text = changed(
            "causality=\"paramter\" causality=\"parameter\"",
            "causality=\"paramter\"",
        )(text);
        changed("<Real unit=\"m/s\"/>", "<Real unit=\"knots\" start=\"fast\"/>")(text)
    };
    let recipe =
        Recipe { description: &description, flags: &["-DVERSION=\"1.0\""], ..Recipe::default() };
    let bench = Bench::made(LOOP, &recipe);
    let (code, text, errors) = bench.call(&["inspect", "--check", "Model.fmu"]);
    let expected = "Model.fmu: the causality \"paramter\" of \"flag\" is not known\n\
                    Model.fmu: the unit \"knots\" of \"speed\" is not defined\n\
                    Model.fmu: the start value \"fast\" of \"speed\" is not a number\n\
                    Model.fmu: its library reports version \"1.0\" of FMI\n";
    assert_eq!((code, text.as_str()), (1, expected));
    assert_eq!(errors, "error: Model.fmu: 4 faults\n");
    let errors = bench.ends(
        0,
        &["--quiet"],
        "\"flag\" is not known (2 more, which orchestrator inspect --check lists)",
    );
    assert_eq!(errors.matches("its library reports version \"1.0\" of FMI").count(), 1, "{errors}");
    let (_, text, _) = bench.call(&["inspect", "Model.fmu"]);
    assert!(text.contains("\nparamter (1)\n"), "{text}");

    let (code, text, errors) = Bench::new().call(&["inspect", "--check", "Model.fmu"]);
    let sound = "Model: sound, 20 variables for linux64\n";
    assert_eq!((code, text.as_str(), errors.as_str()), (0, sound, ""));
}

#[test]
fn names_of_any_length_are_shown() {
    let long = format!("name=\"{}\"", "n".repeat(66_000));
    let description = changed("name=\"speed\"", &long);
    let bench = Bench::made(LOOP, &Recipe { description: &description, ..Recipe::default() });
    let (code, text, errors) = bench.call(&["inspect", "Model.fmu"]);
    assert_eq!((code, errors.as_str()), (0, ""));
    assert!(text.len() < 200_000, "{}", text.len());
}

#[test]
fn values_that_are_none_end_the_run() {
    let recorded = LOOP.replace("\"plant.steps\"]", "\"plant.steps\", \"plant.guarantee.*\"]");
    let direct = "gain failed at t = 1 s in getReal: \"output.direct\"";
    let status = "plant failed at t = 1 s in getInteger: \"guarantee.status\"";
    let in_force = "plant failed at t = 1 s in getBoolean: \"guarantee.inForce\"";
    for (flag, place, value, what) in [
        ("-DDIRECT(value)=0.0/0.0", direct, "NaN", "not finite"),
        ("-DDIRECT(value)=1e308*10", direct, "inf", "not finite"),
        ("-DITEM(value)=7", status, "7", "no item"),
        ("-DTRUTH(value)=3", in_force, "3", "neither true nor false"),
    ] {
        let bench = Bench::made(&recorded, &Recipe { flags: &[flag], ..Recipe::default() });
        let (code, _, errors) = bench.run(&["--quiet"]);
        assert_eq!(code, 1, "{flag}: {errors}");
        assert!(
            errors.contains(&format!("{place} is {value}, which is {what}")),
            "{flag}: {errors}"
        );
        assert_eq!(bench.results().lines().count(), 3);
        let warns = recorded.replace("[simulation]", "[simulation]\non_invalid = \"warn\"");
        fs::write(bench.path("loop.toml"), warns).unwrap();
        let (code, _, errors) = bench.run(&["--quiet"]);
        assert_eq!(code, 0, "{flag}: {errors}");
        let text = format!("{} is {what}", place.split_once(": ").unwrap().1);
        assert_eq!(
            errors.lines().filter(|line| line.contains(&text)).count(),
            1,
            "{flag}: {errors}"
        );
        assert!(errors.contains("first at t = 1 s, "), "{flag}: {errors}");
    }
}

#[test]
fn what_an_fmu_says_moves_no_cursor() {
    let flags = ["-DTROUBLE=\"\\033[2Jout of propellant at\""];
    let escape = |text: String| text.replace("gain and integrator", "gain \u{1b}[2J and \u{9b}1m");
    let bench =
        Bench::made(LOOP, &Recipe { flags: &flags, description: &escape, ..Recipe::default() });
    for isolate in ["--isolate", "--isolate=false"] {
        let (code, out, errors) = bench.run(&["--set", "gain.fail.time=1", isolate]);
        assert_eq!(code, 1, "{errors}");
        assert!(errors.contains("[2Jout of propellant"), "{errors}");
        assert!(!(out + &errors).contains(['\u{1b}', '\u{9b}']), "{errors}");
    }
    for arguments in [&["inspect", "Model.fmu"][..], &["inspect", "--check", "Model.fmu"]] {
        let (_, out, errors) = bench.call(arguments);
        assert!(!(out + &errors).contains(['\u{1b}', '\u{9b}']));
    }
}

#[test]
fn a_check_makes_an_instance() {
    let other = |text: String| text.replace("{u-1}", "{u-2}");
    let bench = Bench::made(LOOP, &Recipe { description: &other, ..Recipe::default() });
    let (code, text, errors) = bench.call(&["inspect", "--check", "Model.fmu"]);
    let says = "its instance could not be instantiated: it has another GUID than {u-2}";
    assert!(code == 1 && text.contains(says), "{text}{errors}");
}

/// Rounding upward, flushing to zero, and traps, left behind by each function that computes
/// nothing.
#[test]
#[cfg(target_arch = "x86_64")]
fn the_floating_point_environment_that_an_fmu_leaves_behind_changes_nothing() {
    let flown = |flags: &[&str]| {
        let bench = Bench::made(LOOP, &Recipe { flags, ..Recipe::default() });
        bench.silent(&["--isolate=false", "--step", "0.1", "--quiet"]);
        fs::read(bench.path("out/loop/results.csv")).unwrap()
    };
    let usual = flown(&[]);
    for place in ["LOAD", "INSTANTIATE", "INITIALIZE", "GET", "FREE"] {
        for mxcsr in ["0x5f80", "0x9fc0", "0x1900"] {
            let (place, mxcsr) = (format!("-DPLACE={place}"), format!("-DMXCSR={mxcsr}"));
            assert!(flown(&[&place, "-DHOW=FLOATS", &mxcsr]) == usual, "{place} {mxcsr}");
        }
    }
}
