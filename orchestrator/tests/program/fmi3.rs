//! Units of FMI 3.0: arrays, types, events and clocks, with an FMU in C that refuses calls in a
//! wrong mode.

use crate::prelude::*;

/// Two instances, of which the second gets what the first one gives.
const CHAIN: &str = r#"
title = "chain"
[simulation]
stop = 3.0
step = 1.0
order = ["first", "second"]
[components.first]
fmu = "Model.fmu"
unconnected = ["u*", "single", "byte"]
[components.second]
fmu = "Model.fmu"
unconnected = ["byte"]
[[connections]]
from = "first.y"
to = "second.u"
[[connections]]
from = "first.echo"
to = "second.single"
[record]
variables = ["second.y", "second.same[1]", "second.events", "second.parts", "first.big"]
"#;

fn made(text: &str, flags: &[&str], description: &dyn Fn(String) -> String) -> Bench {
    Bench::made(text, &Recipe { files: FMI3, flags, description, ..Recipe::default() })
}

fn bench(flags: &[&str]) -> Bench {
    made(CHAIN, flags, &|text| text)
}

fn rows(bench: &Bench) -> Vec<String> {
    let text = bench.results();
    text.lines().map(ToString::to_string).collect()
}

/// Removes event mode from a description.
fn without_events(text: &str) -> String {
    let clock = text.lines().find(|line| line.contains("<Clock")).unwrap().to_string();
    let text =
        text.replace(&clock, "").replace("<Output valueReference=\"16\" dependencies=\"\"/>", "");
    text.replace(" hasEventMode=\"true\"", "")
}

#[test]
fn oracle_arrays_are_connected_set_and_recorded_whole_and_by_element() {
    for without in [false, true] {
        let bench = made(CHAIN, &[], &|text| if without { without_events(&text) } else { text });
        for isolation in ["--isolate=false", "--isolate"] {
            let sets =
                ["--quiet", "--set", "first.u[2]=5", "--set", "first.texts[2]=long", isolation];
            bench.silent(&sets);
            let rows = rows(&bench);
            let names =
                "time,second.y[1],second.y[2],second.same[1],second.events,second.parts,first.big";
            assert_eq!(rows[0], names);
            assert_eq!(rows[1], "0.0,4.0,20.0,4.0,0,0,0");
            assert_eq!(rows[4], "3.0,4.0,20.0,4.0,0,3,7");
        }
    }
    let text = CHAIN.replace("to = \"second.u\"", "to = \"second.u[1]\"");
    let refusal = made(&text, &[], &|text| text).refusal(&[]);
    assert_has(&refusal, "\"first.y\" is an array of 2, but \"second.u[1]\" is none");
    let text =
        CHAIN.replace("\"first.y\"", "\"first.y[2]\"").replace("\"second.u\"", "\"second.u[1]\"");
    let text = text.replace("[\"byte\"]", "[\"byte\", \"u[2]\"]");
    let bench = made(&text, &[], &|text| text);
    assert_eq!(bench.run(&["--quiet"]).0, 0);
    // The other element keeps its start value.
    assert_eq!(rows(&bench)[2], "1.0,8.0,4.0,8.0,0,1,7");
}

#[test]
fn an_event_within_a_step_cuts_it_and_one_at_its_end_waits_for_the_inputs() {
    for (early, isolation) in [("0", "--isolate"), ("1", "--isolate=false")] {
        let bench = bench(&[&format!("-DEARLY={early}")]);
        for (period, last) in [("0.25", "11,12"), ("0.75", "3,6"), ("1", "2,3")] {
            let period = format!("second.period={period}");
            bench.silent(&["--quiet", "--set", &period, isolation]);
            assert_eq!(rows(&bench)[4], format!("3.0,4.0,8.0,4.0,{last},7"), "{period} {early}");
        }
        // So it is with inputs that are not connected.
        let text = bench.text("loop.toml");
        fs::write(bench.path("loop.toml"), text.replace("second.events", "first.events")).unwrap();
        assert_eq!(bench.run(&["--quiet", "--set", "first.period=1", isolation]).0, 0);
        assert_eq!(rows(&bench)[4], "3.0,4.0,8.0,4.0,2,3,7");
    }
}

#[test]
fn a_unit_may_end_the_simulation_within_a_step() {
    let text = CHAIN.replace("[simulation]", "[simulation]\nends_with = \"second\"");
    let bench = made(&text, &[], &|text| text);
    for isolation in ["--isolate=false", "--isolate"] {
        let summary = bench.flown(&["--set", "second.end=1.5", isolation]);
        let end = "by second: out of propellant; it got as far as t = 1.5 s (terminateSimulation)";
        assert!(summary.contains(end), "{summary}");
        assert!(rows(&bench).last().unwrap().starts_with("1.5,"), "{summary}");
    }
}

#[test]
fn events_without_end_and_steps_without_progress_are_failures() {
    for (flag, text) in [
        ("-DENDLESS=1", "updateDiscreteStates: the discrete states do not settle at t = 0 s"),
        ("-DSTUCK=1", "doStep: its step makes no progress: it has events without end at t = 0 s"),
    ] {
        bench(&[flag]).ends(1, &["--quiet", "--set", "first.period=5"], text);
    }
}

#[test]
fn values_that_do_not_fit_are_refused_by_name() {
    let bench = bench(&["-DBIG=3000000000"]);
    for isolation in ["--isolate=false", "--isolate"] {
        let (code, _, errors) = bench.run(&["--quiet", isolation]);
        let text = "first failed at t = 0 s in getInt64: \"big\" is 3000000000, and this program reads integers of 32 bits";
        assert!(code == 1 && errors.contains(text), "{errors}");
    }
    let refusal = bench.refusal(&["--set", "first.byte=256"]);
    assert!(refusal.contains("256 is not between 0 and 255"), "{refusal}");
    let (code, _, errors) = bench.run(&["--quiet", "--set", "first.single=1e39"]);
    let text = "setFloat32: \"single\" is of type Float32, which cannot be 1";
    assert!(code == 1 && errors.contains(text), "{errors}");
    let refusal = bench.refusal(&["--set", "first.n=3"]);
    assert_has(&refusal, "is a structural parameter, which keeps its start value");
}

#[test]
fn clocks_and_bytes_are_shown_only() {
    let (code, shown, _) = bench(&[]).call(&["inspect", "Model.fmu"]);
    assert_eq!(code, 0);
    for line in [
        "Model (FMI 3.0)",
        "canHandleVariableCommunicationStepSize, hasEventMode,",
        "u[2]  2 m, continuous",
        "tick  discrete, Clock, triggered",
        "bytes  discrete, Binary",
        "echo  continuous, Float32",
        "big  discrete, Int64",
    ] {
        assert!(shown.contains(line), "{line}: {shown}");
    }
    for (name, what) in [("tick", "Clock"), ("bytes", "Binary")] {
        let text = CHAIN.replace("\"first.big\"", &format!("\"first.{name}\""));
        let refusal = made(&text, &[], &|text| text).refusal(&[]);
        let text = format!("is of type {what}, which cannot be recorded");
        assert!(refusal.contains(&text), "{refusal}");
        let text = CHAIN.replace("\"first.y\"", &format!("\"first.{name}\""));
        let text = text.replace("\"second.u\"", "\"second.u[1]\"");
        let refusal = made(&text, &[], &|text| text).refusal(&[]);
        let text = format!("is of type {what}, which cannot be connected");
        assert!(refusal.contains(&text), "{refusal}");
    }
}

#[test]
fn what_cannot_be_run_is_refused_with_its_reason() {
    let ticked = |text: String| {
        text.replace(
            "causality=\"output\" intervalVariability=\"triggered\"",
            "causality=\"input\" intervalVariability=\"countdown\"",
        )
    };
    let unclocked = |text: String| text.replace(" hasEventMode=\"true\"", "");
    let scheduled = |text: String| text.replace("<CoSimulation", "<ScheduledExecution");
    let exchange = |text: String| text.replace("<CoSimulation", "<ModelExchange");
    let later = |text: String| text.replace("fmiVersion=\"3.0\"", "fmiVersion=\"4.0\"");
    let changes: [(&dyn Fn(String) -> String, &str); 5] = [
        (&ticked, "has the clock \"tick\" (countdown), which the importer has to tick: export the"),
        (&unclocked, "has the clock \"tick\", but no event mode, which FMI 3.0 demands"),
        (
            &scheduled,
            "offers no co-simulation, only scheduled execution: export the model for co-s",
        ),
        (&exchange, "InstantiateModelExchange"),
        (&later, "is an FMU for FMI 4.0, this program runs FMI 2.0 and 3.0: export the model for"),
    ];
    for (change, reason) in changes {
        let tick = if reason.contains("countdown") {
            "unconnected = [\"tick\", "
        } else {
            "unconnected = ["
        };
        let bench = made(&CHAIN.replace("unconnected = [", tick), &[], change);
        for isolation in ["--isolate=false", "--isolate"] {
            assert_has(&bench.refusal(&["--quiet", isolation]), reason);
        }
    }
    let minor = |text: String| text.replace("fmiVersion=\"3.0\"", "fmiVersion=\"3.1\"");
    assert_eq!(made(CHAIN, &[], &minor).run(&["--quiet"]).0, 0);
    let bench = bench(&[]);
    let (code, sound, _) = bench.call(&["inspect", "--check", "Model.fmu"]);
    assert_eq!((code, sound.as_str()), (0, "Model: sound, 22 variables for x86_64-linux\n"));
}
