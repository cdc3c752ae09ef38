//! Units for model exchange, whose states the program integrates. The FMU in C refuses calls that
//! FMI does not allow in its mode.

use crate::prelude::*;
use std::f64::consts::PI;

const ALONE: &str = r#"
title = "exchange"
[simulation]
stop = 2.0
step = 0.1
[components.m]
fmu = "Model.fmu"
unconnected = ["input", "whole"]
[record]
variables = ["m.x", "m.v", "m.mark", "m.events", "m.evaluations", "m.steps"]
"#;

/// Changes of the descriptions of FMI 2.0 and 3.0, as texts that others replace.
type Changes = [[&'static str; 2]; 2];

/// Makes the FMU by FMI 2.0 and by 3.0, where its two states are one array.
fn changed(kind: &str, experiment: &str, changes: Changes) -> [Bench; 2] {
    defined(&[&format!("-DKIND={kind}"), "-lm"], experiment, changes)
}

/// Makes the FMUs as [`changed`] does, with these arguments of the compiler.
fn defined(flags: &[&str], experiment: &str, changes: Changes) -> [Bench; 2] {
    let three = experiment.replace("\"m.x\", \"m.v\"", "\"m.x\"");
    let versions = [
        (experiment, ["exchange.c", "exchange.xml", "linux64"]),
        (&three, ["exchange3.c", "exchange3.xml", "x86_64-linux"]),
    ];
    [0, 1].map(|version| {
        let ((experiment, files), [from, to]) = (versions[version], changes[version]);
        let description = &|text: String| text.replacen(from, to, 1);
        Bench::made(experiment, &Recipe { files, flags, description, ..Recipe::default() })
    })
}

fn made(kind: &str, experiment: &str) -> [Bench; 2] {
    changed(kind, experiment, [["", ""]; 2])
}

/// Runs the experiment in this process, or in one of its own, and returns the rows, which are the
/// same by both versions of FMI.
fn rows(benches: &[Bench; 2], arguments: &[&str]) -> Vec<Vec<f64>> {
    let [two, three] = [0, 1].map(|version| -> Vec<Vec<f64>> {
        let bench = &benches[version];
        bench.silent(&[&["--quiet"], arguments].concat());
        let text = bench.results();
        let numbers = |row: &str| row.split(',').map(|n| n.parse().unwrap()).collect();
        text.lines().skip(1).map(numbers).collect()
    });
    assert_eq!(two, three);
    two
}

/// Returns the errors of runs that must fail.
fn failures(benches: &[Bench; 2], arguments: &[&str]) -> [String; 2] {
    [0, 1].map(|version| {
        let (code, _, errors) = benches[version].run(&[&["--quiet"], arguments].concat());
        assert_eq!(code, 1, "{errors}");
        errors
    })
}

#[test]
fn oracle_a_ball_bounces_at_the_instants_of_the_closed_form() {
    let benches = made("BALL", &ALONE.replace("stop = 2.0", "stop = 1.4"));
    let results = rows(&benches, &[]);
    // Height 1 m, 10 m/s²; each flight lasts half as long as the one before.
    let first = 0.2_f64.sqrt();
    let flight = |n: u8| 2.0 * first * 0.5_f64.powi(n.into());
    let bounces: Vec<f64> = (0..6).map(|n| first + (1..=n).map(flight).sum::<f64>()).collect();
    for row in &results {
        let expected = bounces.iter().rev().find(|bounce| **bounce <= row[0]);
        let [time, height, mark] = [row[0], row[1], row[3]];
        assert!((mark - expected.unwrap_or(&0.0)).abs() < 1e-9, "{row:?}");
        let since = time - expected.unwrap_or(&-first);
        let number = bounces.iter().filter(|bounce| **bounce <= time).count();
        let speed = if number >= 6 { 0.0 } else { 5.0 * flight(number as u8) };
        let closed = if number >= 6 { 0.0 } else { speed * since - 5.0 * since * since };
        assert!((height - closed).abs() < 1e-8, "{row:?} {closed}");
    }
    // A process of its own and another run give the same bits.
    assert_eq!(results, rows(&benches, &["--isolate"]));
}

#[test]
fn oracle_zeros_of_a_swing_are_events_within_a_nanosecond() {
    let text = ALONE.replace("unconnected", "tolerance = 1e-12\nunconnected");
    for step in ["0.1", "0.7"] {
        let results = rows(
            &made(
                "SWING",
                &text
                    .replace("step = 0.1", &format!("step = {step}"))
                    .replace("stop = 2.0", "stop = 21.0"),
            ),
            &[],
        );
        for row in results {
            let crossings = (row[0] / PI + 0.5).floor();
            let expected = if crossings < 1.0 { 0.0 } else { (crossings - 0.5) * PI };
            assert!((row[3] - expected).abs() < 1e-9, "{row:?} {expected}");
            assert!((row[1] - row[0].cos()).abs() < 1e-9, "{row:?}");
            assert!((row[4] - crossings - 1.0).abs() < 0.5, "{row:?}");
        }
    }
}

/// Where a change of the state within the rounding of time is below the rounding of the state, the
/// integrated state may not have passed a threshold that the interpolated one has passed.
#[test]
fn oracle_thresholds_of_any_size_are_passed_once() {
    for (start, ambient, threshold) in [
        (310.0, 290.0, 300.0),
        (80_000.0, 79_000.0, 79_900.0),
        (1e6 + 1.0, 1e6 - 1.0, 1e6),
        (-1e-6, 1e-6, 0.0),
        (1e9, 0.0, 9e8),
    ] {
        let values = [("START", start), ("AMBIENT", ambient), ("THRESHOLD", threshold)];
        let values = values.map(|(name, value): (_, f64)| format!("-D{name}={value:?}"));
        let flags: Vec<&str> = ["-DKIND=COOLING", "-lm"]
            .into_iter()
            .chain(values.iter().map(String::as_str))
            .collect();
        let passed = ((start - ambient) / (threshold - ambient)).abs().ln();
        // A state of this magnitude, known to the tolerance, passes at this speed.
        let rate = (threshold - ambient).abs();
        for (begin, digits) in [(0.0, 1e-9), (1.7e9, 2e-6)] {
            let text = ALONE
                .replace("unconnected", "tolerance = 1e-13\nunconnected")
                .replace("stop = 2.0", &format!("start = {begin:?}\nstop = {:?}", begin + 2.0));
            let last = rows(&defined(&flags, &text, [["", ""]; 2]), &[]).pop().unwrap();
            let known = digits + 1e-12 * (1.0 + threshold.abs()) / rate;
            assert!((last[3] - begin - passed).abs() < known, "{last:?}, expected {passed}");
            assert_eq!(last[4], 2.0, "{last:?}");
        }
    }
}

#[test]
fn a_unit_without_states_has_time_events_and_ends_the_run() {
    let text = ALONE.replace("[components", "ends_with = \"m\"\n[components");
    let without = [
        ["<Derivatives><Unknown index=\"3\"/><Unknown index=\"4\"/></Derivatives>", ""],
        ["<ContinuousStateDerivative valueReference=\"2\"/>", ""],
    ];
    let benches = changed("TIMER", &text, without);
    let results = rows(&benches, &[]);
    let marks: Vec<f64> = results.iter().map(|row| row[3]).collect();
    for (row, mark) in results.iter().zip(&marks) {
        let events = ((row[0] + 1e-9) / 0.25).floor();
        assert!((mark - 0.25 * events).abs() < 1e-12, "{row:?}");
    }
    assert_eq!(results.len(), 16);
    assert!((results.last().unwrap()[0] - 1.5).abs() < 1e-12);
    ended(&benches, 1.5);
}

#[test]
fn a_completed_step_may_end_the_run() {
    let text = ALONE.replace("[components", "ends_with = \"m\"\n[components");
    let benches = made("ENDING", &text);
    let results = rows(&benches, &[]);
    let [time, x] = [0, 1].map(|column| results.last().unwrap()[column]);
    assert!(0.5 < x && (x - time).abs() < 1e-12, "{results:?}");
    ended(&benches, time);
}

/// Checks that the component has ended the runs at this time, s.
fn ended(benches: &[Bench; 2], time: f64) {
    for bench in benches {
        assert_eq!(bench.json("out/loop/metrics.json")["completed"], true);
        let (_, summary, _) = bench.run(&[]);
        let told = format!("by m: it got as far as t = {time} s (terminateSimulation)");
        assert!(summary.contains(&told), "{summary}");
    }
}

#[test]
fn step_events_are_carried_out_unless_the_unit_needs_no_steps() {
    for (needs, events) in [(true, 4.0), (false, 1.0)] {
        let not_needed = [
            ["<ModelExchange", "<ModelExchange completedIntegratorStepNotNeeded=\"true\""],
            [" needsCompletedIntegratorStep=\"true\"", ""],
        ];
        let changes = if needs { [["", ""]; 2] } else { not_needed };
        let last = rows(&changed("STEPPER", ALONE, changes), &[]).pop().unwrap();
        assert_eq!(last[4], events, "{last:?}");
        assert_eq!(last[6] > 0.0, needs, "{last:?}");
    }
}

#[test]
fn oracle_a_stiff_unit_is_integrated_in_long_steps() {
    let results = rows(&made("STIFF", ALONE), &[]);
    for row in &results {
        let closed = (row[0].cos() + 1e-6 * row[0].sin()) / (1.0 + 1e-12);
        assert!((row[1] - closed).abs() < 1e-8, "{row:?} {closed}");
    }
    let evaluations = results.last().unwrap()[5];
    assert!(evaluations < 3000.0, "{evaluations}");
}

#[test]
fn inputs_are_held_over_a_step_and_change_in_events() {
    let table = "time,rate,whole\n0,0.5,1\n0.1,0.5,1\n0.2,-1,4\n2,-1,4\n";
    let wires = "[components.table]\nfmu = \"t.csv\"\n[[connections]]\nfrom = \"table.rate\"\nto = \"m.input\"\n[record]";
    let text = ALONE
        .replace("unconnected = [\"input\", \"whole\"]", "unconnected = [\"whole\"]")
        .replace("[simulation]", "[simulation]\norder = [\"table\", \"m\"]")
        .replace("stop = 2.0", "stop = 0.3")
        .replace("[record]", wires);
    let benches = made("HELD", &text);
    for bench in &benches {
        fs::write(bench.path("t.csv"), table).unwrap();
    }
    let results = rows(&benches, &["--set", "m.whole=3"]);
    let [states, changes]: [Vec<f64>; 2] =
        [2, 4].map(|c| results.iter().map(|row| row[c]).collect());
    for (state, expected) in states.iter().zip([0.0, 0.05, 0.1, 0.0]) {
        assert!((state - expected).abs() < 1e-12, "{states:?}");
    }
    // Initialization, and the change at 0.2 s
    assert_eq!(changes, [1.0, 1.0, 1.0, 2.0]);
    assert!((results[3][1] - 0.9).abs() < 1e-12, "{results:?}");
}

#[test]
fn states_that_a_unit_discards_shorten_the_step() {
    for row in rows(&made("DOMAIN", ALONE), &[]) {
        let expected = if row[0] < 1.0 - 1e-9 { row[0] } else { row[0] - 1.0 };
        assert!((row[1] - expected).abs() < 1e-9 || (row[0] - 2.0).abs() < 1e-9, "{row:?}");
    }
}

#[test]
fn models_without_progress_are_reported() {
    for isolation in [&[][..], &["--isolate"]] {
        for errors in failures(&made("CHATTER", ALONE), isolation) {
            assert!(errors.contains("1000 events in a row without an advance in time"), "{errors}");
            assert!(
                errors.contains("t = 0.35")
                    && errors.contains("by event indicator 1 of 1: the model chatters"),
                "{errors}"
            );
        }
        let errors = failures(&made("RESTLESS", ALONE), isolation);
        for (errors, call) in errors.iter().zip(["newDiscreteStates", "updateDiscreteStates"]) {
            assert!(errors.contains("the discrete states do not settle at t = 0 s"), "{errors}");
            assert!(errors.contains(call), "{errors}");
        }
    }
}

#[test]
fn the_interface_and_the_tolerance_are_checked() {
    let key = |keys: &str| ALONE.replace("unconnected", &format!("{keys}\nunconnected"));
    for bench in made("BALL", &key("interface = \"coSimulation\"")) {
        let refusal = bench.refusal(&[]);
        assert_has(&refusal, "[components.m] interface: Model.fmu offers no co-simulation");
    }
    let [bench, _] = made("BALL", &key("tolerance = 1.0"));
    assert!(bench.refusal(&[]).contains("it must be from 1e-13 to 0.1"));
    let other = Bench::with(
        &ALONE.replace("[components.m]", "[components.m]\ninterface = \"modelExchange\""),
    );
    assert!(other.refusal(&[]).contains("Model.fmu offers no model exchange"));
    let other = Bench::with(&ALONE.replace("[components.m]", "[components.m]\ntolerance = 1e-6"));
    assert!(other.refusal(&[]).contains("in co-simulation the FMU chooses its accuracy"));
    for bench in made("BALL", ALONE) {
        let (_, told, _) = bench.call(&["inspect", "--check", "Model.fmu"]);
        assert!(told.contains("sound"), "{told}");
        let (_, told, _) = bench.call(&["inspect", "Model.fmu"]);
        assert!(told.contains("continuous states: 2, event indicators: 1\n"), "{told}");
    }
}

#[test]
fn values_that_no_unit_may_give_are_refused_by_name() {
    let announced = "-DKIND=ANNOUNCE";
    let cooling = |start, ambient, threshold| ["-DKIND=COOLING", start, ambient, threshold];
    let [good, bad] = [
        ["-DSTART=1.0", "-DAMBIENT=0.0", "-DTHRESHOLD=0.0"],
        ["-DSTART=NAN", "-DAMBIENT=NAN", "-DTHRESHOLD=NAN"],
    ];
    let next = "its next event (nextEventTime) at t = 0 s for";
    for (flags, expected) in [
        (&[announced, "-DNEXT=NAN"][..], format!("{next} the time NaN")),
        (&[announced, "-DNEXT=-1.0"], format!("{next} t = -1 s, which is past")),
        (&cooling(good[0], bad[1], good[2]), "the derivative of \"x".into()),
        (&cooling(bad[0], good[1], good[2]), "the state \"x".into()),
        (&cooling(good[0], good[1], bad[2]), "event indicator 1 of 1 is not a number".into()),
    ] {
        for errors in failures(&defined(&[flags, &["-lm"]].concat(), ALONE, [["", ""]; 2]), &[]) {
            assert!(errors.contains(&expected), "{errors}");
        }
    }
    // There is no event at infinity.
    let last =
        rows(&defined(&[announced, "-DNEXT=INFINITY", "-lm"], ALONE, [["", ""]; 2]), &[]).pop();
    assert_eq!(last.unwrap()[4], 1.0);
}

#[cfg(unix)]
#[test]
fn a_signal_ends_a_run_within_a_step_of_many_events() {
    let text = ALONE.replace("step = 0.1", "step = 2.0");
    let benches = defined(&["-DKIND=ANNOUNCE", "-DNEXT=m->time+1e-8", "-lm"], &text, [["", ""]; 2]);
    for (bench, isolation) in benches.iter().zip(["--isolate=false", "--isolate"]) {
        let arguments = ["run", "loop.toml", isolation];
        let code = crate::timing::signalled(bench, &arguments, "-TERM", "out/loop/results.csv");
        assert_eq!(code, Some(143));
    }
}
