//! A property of every FMU: whatever finite values it accepts, the values that it then returns with
//! `fmi2OK` are finite, items of their enumerations, or true or false.

use crate::prelude::*;
use conformance::interface::DISCARD;
use proptest::collection::vec;
use proptest::prelude::*;
use proptest::test_runner::{RngAlgorithm, TestRng, TestRunner};
use std::cell::Cell;

/// Number of random sequences of calls for each FMU, unless the environment variable
/// PROPTEST_CASES gives another.
const SEQUENCES: u32 = 40;

/// A variable, chosen by a number, with a value for each type that it may have. A Real is taken as
/// it is, or as that part of the start value by which it differs from it.
type Change = (usize, bool, f64, i32);

/// Calls: parameters that are set, and inputs that are set before each step, with the step's
/// length.
type CallSequence = (Vec<Change>, Vec<(Vec<Change>, f64)>);

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

fn call_sequences() -> impl Strategy<Value = CallSequence> {
    let step = prop_oneof![3 => Just(0.2), 1 => 1e-9..10.0_f64];
    (vec(change(), 0..6), vec((vec(change(), 0..6), step), 1..6))
}

/// Sets a variable to a value. A refusal is in order, and leaves the instance as it was.
fn set(instance: &Instance, reference: u32, &(_, near, real, whole): &Change) {
    let component = instance.component;
    let mut saved_state = instance.save();
    let status = match &instance.fmu.description.variables[reference as usize].kind {
        VariableKind::Real { start, .. } => {
            let near_start = match start {
                Some(start) if *start != 0.0 => start * (1.0 + real),
                _ => real,
            };
            instance.set_real(reference, if near { near_start } else { real })
        }
        VariableKind::Integer { .. } | VariableKind::Enumeration { .. } => {
            c!(instance, fmi2SetInteger(component, &reference, 1, &whole))
        }
        VariableKind::Boolean { .. } => {
            c!(instance, fmi2SetBoolean(component, &reference, 1, &(whole & 1)))
        }
        VariableKind::String { .. } => OK,
    };
    assert!([OK, ERROR].contains(&status), "{}: status {status}", instance.fmu.name());
    if status == ERROR {
        instance.restore(saved_state);
    }
    ok!(instance, fmi2FreeFMUstate(&mut saved_state));
}

/// Follows a sequence of calls until the FMU refuses to continue, and counts the steps. Returns the
/// first value that is not valid.
fn follow(fmu: &Fmu, (parameters, steps): &CallSequence, count: &Cell<u32>) -> Option<String> {
    let references_of = |causality| {
        fmu.references(|variable| {
            variable.causality == causality && !matches!(variable.kind, VariableKind::String { .. })
        })
    };
    let (parameter_references, input_references) =
        (references_of(Causality::Parameter), references_of(Causality::Input));
    let instance = fmu.instance(CO_SIMULATION);
    let component = instance.component;
    let change = |references: &[u32], changes: &[Change]| {
        for change in changes.iter().filter(|_| !references.is_empty()) {
            set(&instance, references[change.0 % references.len()], change);
        }
    };
    change(&parameter_references, parameters);
    let goes_on = |status| {
        assert!([OK, ERROR, DISCARD].contains(&status), "{}: status {status}", fmu.name());
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
        change(&input_references, changes);
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
fn the_values_of_an_fmu_are_finite_whatever_it_accepted() {
    for fmu in fmus() {
        let mut config = ProptestConfig { failure_persistence: None, ..ProptestConfig::default() };
        if std::env::var_os("PROPTEST_CASES").is_none() {
            config.cases = SEQUENCES;
        }
        // Every run uses the same sequences.
        let random = TestRng::deterministic_rng(RngAlgorithm::ChaCha);
        let (sequences_run, count) = (config.cases, Cell::new(0));
        let outcome = TestRunner::new_with_rng(config, random).run(&call_sequences(), |sequence| {
            let wrong = follow(&fmu, &sequence, &count);
            prop_assert!(wrong.is_none(), "{}: {}", fmu.name(), wrong.unwrap_or_default());
            Ok(())
        });
        if let Err(error) = outcome {
            panic!("{}: {error}", fmu.name());
        }
        // The property is weak where most sequences end before the first step.
        assert!(count.get() >= sequences_run, "{}: {} steps", fmu.name(), count.get());
    }
}
