//! A property of every unit: whatever finite values it accepts, what it then gives with `fmi2OK` is
//! finite, an item of its enumeration, and true or false.

use conformance::interface::{CO_SIMULATION, DISCARD, ERROR, OK};
use conformance::{Instance, Unit, c, units};
use model_description::variable::{Causality, Kind};
use proptest::collection::vec;
use proptest::prelude::*;
use proptest::test_runner::{RngAlgorithm, TestRng, TestRunner};

/// Number of random courses of each unit; the environment variable PROPTEST_CASES asks for others.
const COURSES: u32 = 40;

/// A variable, chosen by a number, with a value for each type that it may have.
type Change = (usize, f64, i32);

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
    (any::<usize>(), number(), prop_oneof![-2..8_i32, any::<i32>()])
}

fn courses() -> impl Strategy<Value = Course> {
    let step = prop_oneof![3 => Just(0.2), 1 => 1e-9..10.0_f64];
    (vec(change(), 0..6), vec((vec(change(), 0..6), step), 1..6))
}

/// Sets a variable to a value. A refusal is in order.
fn set(instance: &Instance, reference: u32, real: f64, whole: i32) {
    let component = instance.component;
    let status = match &instance.unit.description.variables[reference as usize].kind {
        Kind::Real { .. } => instance.set_real(reference, real),
        Kind::Integer { .. } | Kind::Enumeration { .. } => {
            c!(instance, fmi2SetInteger(component, &reference, 1, &whole))
        }
        Kind::Boolean { .. } => {
            c!(instance, fmi2SetBoolean(component, &reference, 1, &(whole & 1)))
        }
        Kind::String { .. } => OK,
    };
    assert!([OK, ERROR].contains(&status), "{}: status {status}", instance.unit.name());
}

/// Returns the first variable whose value is none.
fn wrong(instance: &Instance) -> Option<String> {
    let component = instance.component;
    let variables = &instance.unit.description.variables;
    for (variable, reference) in variables.iter().zip(0_u32..) {
        let (mut real, mut whole) = (0.0, 0);
        let is_wrong = match &variable.kind {
            Kind::Real { .. } => {
                let status = c!(instance, fmi2GetReal(component, &reference, 1, &mut real));
                status == OK && !real.is_finite()
            }
            Kind::Enumeration { of, .. } => {
                let status = c!(instance, fmi2GetInteger(component, &reference, 1, &mut whole));
                status == OK && !(1..).zip(&of.items).any(|(item, _)| item == whole)
            }
            Kind::Boolean { .. } => {
                let status = c!(instance, fmi2GetBoolean(component, &reference, 1, &mut whole));
                status == OK && !(0..=1).contains(&whole)
            }
            Kind::Integer { .. } | Kind::String { .. } => false,
        };
        if is_wrong {
            return Some(format!("{} = {real}, {whole}", variable.name));
        }
    }
    None
}

/// Follows a course until the unit refuses to go on. Returns the first value that is none.
fn follow(unit: &Unit, (parameters, steps): &Course) -> Option<String> {
    let of = |causality| {
        unit.references(|variable| {
            variable.causality == causality && !matches!(variable.kind, Kind::String { .. })
        })
    };
    let (known, inputs) = (of(Causality::Parameter), of(Causality::Input));
    let instance = unit.instance(CO_SIMULATION);
    let component = instance.component;
    let change = |of: &[u32], changes: &[Change]| {
        for (which, real, whole) in changes.iter().filter(|_| !of.is_empty()) {
            set(&instance, of[which % of.len()], *real, *whole);
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
        if let Some(wrong) = wrong(&instance) {
            return Some(wrong);
        }
        if !goes_on(instance.step(time, *step)) {
            return None;
        }
        time += step;
    }
    wrong(&instance)
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
        let outcome = TestRunner::new_with_rng(config, random).run(&courses(), |course| {
            let wrong = follow(&unit, &course);
            prop_assert!(wrong.is_none(), "{}: {}", unit.name(), wrong.unwrap_or_default());
            Ok(())
        });
        if let Err(error) = outcome {
            panic!("{}: {error}", unit.name());
        }
    }
}
