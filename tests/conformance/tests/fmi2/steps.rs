//! Tests of the experiment's definition and of the steps of co-simulation.

use crate::prelude::*;

/// Tolerance, start time and stop time; NaN is passed for a value that is not defined.
type Experiment = (Option<f64>, f64, Option<f64>);

fn set_up(instance: &Instance, (tolerance, start, stop): Experiment) -> c_int {
    let defined = |value: Option<f64>| (c_int::from(value.is_some()), value.unwrap_or(f64::NAN));
    let ((with_tolerance, tolerance), (with_stop, stop)) = (defined(tolerance), defined(stop));
    let component = instance.component;
    c!(instance, fmi2SetupExperiment(component, with_tolerance, tolerance, start, with_stop, stop))
}

fn begun(fmu: &Fmu, experiment: Experiment) -> Instance {
    let instance = fmu.instance(CO_SIMULATION);
    instance.ok(set_up(&instance, experiment));
    through_initialization(&instance);
    instance
}

fn through_initialization(instance: &Instance) {
    ok!(instance, fmi2EnterInitializationMode());
    ok!(instance, fmi2ExitInitializationMode());
}

#[test]
fn neither_tolerance_nor_stop_time_changes_a_result() {
    for fmu in fmus() {
        let without = begun(&fmu, (None, 0.0, None)).drive(0..6);
        for (tolerance, stop) in [
            (Some(1e-4), None),
            (Some(0.0), None),
            (None, Some(100.0)),
            (Some(1e-6), Some(100.0)),
            (None, Some(f64::INFINITY)),
        ] {
            let with = begun(&fmu, (tolerance, 0.0, stop)).drive(0..6);
            assert!(with == without, "{}: {tolerance:?} {stop:?}", fmu.name());
        }
        // Some importers do not call this function.
        let instance = fmu.instance(CO_SIMULATION);
        through_initialization(&instance);
        assert!(instance.drive(0..6) == without, "{}", fmu.name());
    }
}

#[test]
fn an_experiment_without_sense_is_refused() {
    for (fmu, fmu_type) in fmus_and_interfaces() {
        for (experiment, part) in [
            ((None, f64::NAN, None), "start time NaN"),
            ((None, f64::INFINITY, None), "start time inf"),
            ((None, 2.0, Some(1.0)), "stop time 1 is not after the start time 2"),
            ((None, 0.0, Some(f64::NAN)), "stop time NaN"),
            ((None, 0.0, Some(f64::NEG_INFINITY)), "stop time -inf"),
            ((Some(f64::NAN), 0.0, None), "tolerance NaN"),
            ((Some(-1e-4), 0.0, None), "tolerance -0.0001"),
            ((Some(f64::INFINITY), 0.0, None), "tolerance inf"),
        ] {
            let instance = fmu.instance(fmu_type);
            instance.refused(set_up(&instance, experiment), ERROR, &["fmi2SetupExperiment", part]);
            ok!(instance, fmi2Reset());
            instance.ok(set_up(&instance, (None, 0.0, Some(0.0))));
        }
    }
}

#[test]
fn an_experiment_may_start_at_any_time_that_ticks_can_be_told_apart_at() {
    for fmu in fmus() {
        let h = fmu.description.default_experiment.step;
        for start in [-3.0, 1.0, 1e6, 1.7e9, -1e10] {
            let instance = begun(&fmu, (None, start, None));
            for k in 0..3 {
                instance.ok(instance.step(start + f64::from(k) * h, h));
                instance.bits(&fmu.results());
            }
            let mut time = f64::NAN;
            ok!(instance, fmi2GetRealStatus(2, &mut time));
            assert!((time - start - 3.0 * h).abs() < 1e-9 * start.abs().max(1.0), "{time}");
        }
    }
}

#[test]
fn a_last_step_that_is_short_by_rounding_ends_in_the_same_place() {
    for fmu in fmus() {
        let h = fmu.description.default_experiment.step;
        let mut reals = fmu.results();
        reals.retain(|&reference| {
            matches!(fmu.description.variables[reference as usize].kind, VariableKind::Real { .. })
        });
        let after = |last: f64| -> Bits {
            let instance = begun(&fmu, (None, 0.0, Some(10.0 * h)));
            instance.drive(0..9);
            instance.ok(instance.step(9.0 * h, last));
            instance.bits(&reals)
        };
        let exact = after(h);
        assert!(after(h - 1e-17) == exact, "{}", fmu.name());
        // A change of 1e-17 is lost in the step's length. The difference of two instants and the
        // neighbouring lengths are not lost.
        for near in [10.0 * h - 9.0 * h, h.next_down(), h.next_up()] {
            for (&a, &b) in after(near).iter().zip(&exact) {
                let (a, b) = (f64::from_bits(a), f64::from_bits(b));
                assert!((a - b).abs() <= 1e-9 * a.abs().max(b.abs()).max(1e-9), "{a} {b}");
            }
        }
    }
}

#[test]
fn a_step_of_no_length_changes_nothing() {
    for fmu in fmus() {
        let instance = begun(&fmu, (None, 0.0, None));
        let h = fmu.description.default_experiment.step;
        instance.drive(0..3);
        let before = instance.bits(&fmu.results());
        for _ in 0..3 {
            instance.ok(instance.step(3.0 * h, 0.0));
            assert!(instance.bits(&fmu.results()) == before, "{}", fmu.name());
        }
        instance.drive(3..6);
        // This is the smallest positive length.
        instance.ok(instance.step(6.0 * h, f64::from_bits(1)));
    }
}

#[test]
fn steps_without_sense_are_refused() {
    for fmu in fmus() {
        let h = fmu.description.default_experiment.step;
        let instance = begun(&fmu, (None, 0.0, Some(10.0 * h)));
        instance.drive(0..5);
        let (saved_state, before, now) = (instance.save(), instance.serialize(), 5.0 * h);
        for (point, size, part) in [
            (now, -h, "cannot step"),
            (now, f64::NAN, "cannot step"),
            (now, f64::INFINITY, "cannot step"),
            (now, f64::NEG_INFINITY, "cannot step"),
            (f64::NAN, h, "cannot step"),
            (f64::INFINITY, h, "cannot step"),
            (now + h, h, "communication point"),
            (now - h, h, "communication point"),
            (now + 1e-6 * h, h, "communication point"),
            (0.0, h, "communication point"),
            (now, 5.01 * h, "beyond the stop time"),
            (now, 1e300, "beyond the stop time"),
        ] {
            instance.refused(instance.step(point, size), ERROR, &["fmi2DoStep", part]);
            // The instance is in state error until its state is restored or it is reset.
            instance.refused(
                instance.step(now, h),
                ERROR,
                &["fmi2DoStep", "not allowed in state error"],
            );
            instance.restore(saved_state);
            assert!(instance.serialize() == before, "{}: {point} {size}", fmu.name());
        }
        instance.drive(5..10);
        // At the stop time only a step of zero length is possible.
        instance.ok(instance.step(10.0 * h, 0.0));
        instance.refused(instance.step(10.0 * h, h), ERROR, &["beyond the stop time"]);
    }
}

#[test]
fn times_of_model_exchange_are_checked() {
    for fmu in fmus().iter().filter(|fmu| fmu.description.model_exchange) {
        // Solvers look back, even before the start, and disturbances are functions of time.
        for time in [-1e-3, -1.0, -1e300, 1e300] {
            let instance = fmu.instance(MODEL_EXCHANGE);
            instance.choose("disturbance.kind", "white");
            let instance = instance.initialized();
            ok!(instance, fmi2SetTime(time));
            let before = instance.bits(&fmu.results());
            ok!(instance, fmi2SetTime(0.0));
            instance.bits(&fmu.results());
            ok!(instance, fmi2SetTime(time));
            assert!(instance.bits(&fmu.results()) == before, "{time}");
        }
        for time in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            let instance = fmu.instance(MODEL_EXCHANGE).initialized();
            let status = c!(instance, fmi2SetTime(instance.component, time));
            instance.refused(status, ERROR, &["fmi2SetTime", "not finite"]);
        }
    }
}

/// Steps an instance over 50 s from `start` on, by 0.04 s on a clock that the importer accumulates.
fn step_for_50_seconds(instance: &Instance, start: f64) {
    let mut time = start;
    for _ in 0..1250 {
        ok!(instance, fmi2DoStep(time, 0.04, 1));
        time += 0.04;
    }
}

#[test]
fn an_experiment_that_starts_at_unix_time_has_the_same_ticks() {
    for name in ["CRMPC", "DLMPC"] {
        let fmu = conformance::fmu(name);
        for start in [0.0, 1e6, 1.7e9, -1.7e9] {
            let instance = fmu.instance(CO_SIMULATION);
            instance.choose("reference.profile", "constant");
            instance.ok(set_up(&instance, (None, start, None)));
            through_initialization(&instance);
            step_for_50_seconds(&instance, start);
            let mut solves = 0;
            ok!(instance, fmi2GetInteger(&fmu.reference("solver.solves"), 1, &mut solves));
            // The tick that is due after the last step is not evaluated.
            assert_eq!(solves, 250, "{name} from {start} s on");
        }
    }
    // The noise of the disturbance is a function of the tick's number.
    let plant = conformance::fmu("ReentryPlant");
    let after = |start: f64| {
        let instance = begun(&plant, (None, start, None));
        step_for_50_seconds(&instance, start);
        let names = ["attitude.alpha", "attitude.sigma", "rate.p", "rate.q", "rate.r"];
        names.map(|name| instance.real(plant.reference(name)))
    };
    for start in [1e6, 1.7e9] {
        for (actual, expected) in after(start).iter().zip(after(0.0)) {
            assert!((actual / expected - 1.0).abs() < 1e-4, "{start}: {actual} {expected}");
        }
    }
}

#[test]
fn a_start_at_which_ticks_cannot_be_told_apart_is_refused() {
    for fmu in fmus() {
        for start in [1e16, 1e300, f64::MAX, -1e300] {
            let instance = fmu.instance(CO_SIMULATION);
            instance.ok(set_up(&instance, (None, start, None)));
            ok!(instance, fmi2EnterInitializationMode());
            let status = c!(instance, fmi2ExitInitializationMode(instance.component));
            instance.refused(
                status,
                ERROR,
                &[&format!("start time = {start} s"), "a period of 0.0"],
            );
        }
    }
}
