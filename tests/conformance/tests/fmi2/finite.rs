//! A property of every unit: whatever finite values it accepts, what it then gives with `fmi2OK` is
//! finite, an item of its enumeration, and true or false.

use conformance::interface::{CO_SIMULATION, DISCARD, ERROR, OK};
use conformance::{Instance, Unit, c, units};
use model_description::variable::{Causality, Kind};
use proptest::collection::vec;
use proptest::prelude::*;
use proptest::test_runner::{RngAlgorithm, TestRng, TestRunner};
use std::cell::Cell;

/// Number of random courses of each unit; the environment variable PROPTEST_CASES asks for others.
const COURSES: u32 = 40;

/// A variable, chosen by a number, with a value for each type that it may have. A Real is taken as
/// it is, or as that part of the start value by which it differs from it.
type Change = (usize, bool, f64, i32);

/// Calls: parameters that are set, and inputs that are set before each step, with the step's
/// length.
type Course = (Vec<Change>, Vec<(Vec<Change>, f64)>);

/// Finite numbers of all sizes, with those at the edges more often.
fn number() -> impl Strategy<Value = f64> {
    let size = (-320..308_i32, -1.0..1.0_f64).prop_map(|(size, sign)| sign * 10_f64.powi(size));
    let edge = prop::sample::select(vec![0.0, -0.0, 1.0, -1.0, 1e-308, 1e308, f64::MAX, f64::MIN]);
    prop_oneof![4 => -10.0..10.0_f64, 2 => size, 1 => edge]
}

fn change() -> impl Strategy<Value = Change> {
    let real = prop_oneof![
        3 => (Just(true), -0.5..0.5_f64),
        1 => (Just(false), number()),
    ];
    let whole = prop_oneof![4 => -2..8_i32, 1 => any::<i32>()];
    (any::<usize>(), real, whole)
        .prop_map(|(which, (near, real), whole)| (which, near, real, whole))
}

fn courses() -> impl Strategy<Value = Course> {
    let step = prop_oneof![3 => Just(0.2), 1 => 1e-9..10.0_f64];
    (vec(change(), 0..6), vec((vec(change(), 0..6), step), 1..6))
}

/// Sets a variable to a value. A refusal is in order, and leaves the instance as it was.
fn set(instance: &Instance, reference: u32, &(_, near, real, whole): &Change) {
    let component = instance.component;
    let mut here = instance.save();
    let status = match &instance.unit.description.variables[reference as usize].kind {
        Kind::Real { start, .. } => {
            let near_start = match start {
                Some(start) if *start != 0.0 => start * (1.0 + real),
                _ => real,
            };
            instance.set_real(reference, if near { near_start } else { real })
        }
        Kind::Integer { .. } | Kind::Enumeration { .. } => {
            c!(instance, fmi2SetInteger(component, &reference, 1, &whole))
        }
        Kind::Boolean { .. } => {
            c!(instance, fmi2SetBoolean(component, &reference, 1, &(whole & 1)))
        }
        Kind::String { .. } => OK,
    };
    assert!([OK, ERROR].contains(&status), "{}: status {status}", instance.unit.name());
    if status == ERROR {
        instance.restore(here);
    }
    instance.ok(c!(instance, fmi2FreeFMUstate(component, &mut here)));
}

/// Follows a course until the unit refuses to go on, and counts the steps. Returns the first value
/// that is none.
fn follow(unit: &Unit, (parameters, steps): &Course, count: &Cell<u32>) -> Option<String> {
    let of = |causality| {
        unit.references(|variable| {
            variable.causality == causality && !matches!(variable.kind, Kind::String { .. })
        })
    };
    let (known, inputs) = (of(Causality::Parameter), of(Causality::Input));
    let instance = unit.instance(CO_SIMULATION);
    let component = instance.component;
    let change = |of: &[u32], changes: &[Change]| {
        for change in changes.iter().filter(|_| !of.is_empty()) {
            set(&instance, of[change.0 % of.len()], change);
        }
    };
    change(&known, parameters);
    let goes_on = |status| {
        assert!([OK, ERROR, DISCARD].contains(&status), "{}: status {status}", unit.name());
        status == OK
    };
    if !goes_on(c!(instance, fmi2SetupExperiment(component, 0, 0.0, 0.0, 0, 0.0)))
        || !goes_on(c!(instance, fmi2EnterInitializationMode(component)))
        || !goes_on(c!(instance, fmi2ExitInitializationMode(component)))
    {
        return None;
    }
    let mut time = 0.0;
    for (changes, step) in steps {
        change(&inputs, changes);
        if let Some(wrong) = instance.wrong_value() {
            return Some(wrong);
        }
        if !goes_on(instance.step(time, *step)) {
            return None;
        }
        time += step;
        count.set(count.get() + 1);
    }
    instance.wrong_value()
}

#[test]
fn what_a_unit_gives_is_finite_whatever_it_accepted() {
    for unit in units() {
        let mut config = ProptestConfig { failure_persistence: None, ..ProptestConfig::default() };
        if std::env::var_os("PROPTEST_CASES").is_none() {
            config.cases = COURSES;
        }
        // The same courses in every run.
        let random = TestRng::deterministic_rng(RngAlgorithm::ChaCha);
        let (courses_run, count) = (config.cases, Cell::new(0));
        let outcome = TestRunner::new_with_rng(config, random).run(&courses(), |course| {
            let wrong = follow(&unit, &course, &count);
            prop_assert!(wrong.is_none(), "{}: {}", unit.name(), wrong.unwrap_or_default());
            Ok(())
        });
        if let Err(error) = outcome {
            panic!("{}: {error}", unit.name());
        }
        // The property says little where most courses end before the first step.
        assert!(count.get() >= courses_run, "{}: {} steps", unit.name(), count.get());
    }
}
