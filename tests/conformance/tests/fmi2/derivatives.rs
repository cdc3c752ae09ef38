//! Tests of the time derivatives of inputs and outputs in co-simulation, and of the FMUs that
//! offer directional derivatives.

use crate::prelude::*;
use conformance::is_continuous_real;
use model_description::variable::Variable;

fn set(instance: &Instance, reference: u32, order: i32, value: f64) -> Status {
    c!(instance, fmi2SetRealInputDerivatives(instance.component, &reference, 1, &order, &value))
}

fn takes_derivatives(variable: &Variable) -> bool {
    variable.causality == Causality::Input && is_continuous_real(variable)
}

#[test]
fn derivatives_of_continuous_inputs_are_taken_and_no_others() {
    for fmu in fmus() {
        let instance = fmu.instance(CO_SIMULATION).initialized();
        let saved_state = instance.save();
        for (variable, reference) in fmu.description.variables.iter().zip(0..) {
            let named = format!("'{}'", variable.name);
            let refused = |status, parts: &[&str]| {
                instance.refused(status, ERROR, parts);
                instance.restore(saved_state);
            };
            if !takes_derivatives(variable) {
                refused(
                    set(&instance, reference, 1, 0.5),
                    &["fmi2SetRealInputDerivatives", &named],
                );
                continue;
            }
            for order in 1..=3 {
                instance.ok(set(&instance, reference, order, 0.5));
            }
            for order in [0, -1, 4, i32::MIN, i32::MAX] {
                let part = format!("{named}: order {order} is not between 1 and 3");
                refused(set(&instance, reference, order, 0.5), &[&part]);
            }
            for value in [f64::NAN, f64::INFINITY] {
                refused(set(&instance, reference, 1, value), &[&named, "not finite"]);
            }
        }
    }
}

#[test]
fn oracle_inputs_follow_their_derivatives_for_one_step() {
    for fmu in fmus() {
        let h = fmu.description.default_experiment.step;
        for reference in fmu.references(takes_derivatives) {
            let instance = fmu.instance(CO_SIMULATION).initialized();
            let name = &fmu.description.variables[reference as usize].name;
            let start = instance.real(reference);
            // The derivatives are small and together do not move the value away from zero.
            let [first, second, third] =
                [1e-4, 2e-4, -3e-4].map(|value: f64| -value * start.signum());
            let (references, orders, values) = ([reference; 3], [3, 1, 2], [third, first, second]);
            let list = references.as_ptr();
            let (orders, values) = (orders.as_ptr(), values.as_ptr());
            ok!(instance, fmi2SetRealInputDerivatives(list, 3, orders, values));
            instance.ok(instance.step(0.0, h));
            // By section 4.2.1 the value is u + u' h + u'' h² / 2 + u''' h³ / 6.
            let expected = start + first * h + second * h * h / 2.0 + third * h * h * h / 6.0;
            let end = instance.real(reference);
            let near = (end - expected).abs() <= 2.0 * f64::EPSILON * expected.abs();
            assert!(near, "{}: {name} = {end}, not {expected}", fmu.name());
            assert_ne!(end, start, "{}: {name}", fmu.name());
            instance.ok(instance.step(h, h));
            assert_eq!(instance.real(reference), end, "{}: {name} in the next step", fmu.name());
        }
    }
}

#[test]
fn a_derivative_acts_within_the_step() {
    for fmu in fmus() {
        // The end is no tick of any FMU, so values sampled within the step are still held there.
        let (input, size) = (fmu.input(), 4.33 * fmu.description.default_experiment.step);
        let after = |slope: f64| {
            let instance = fmu.instance(CO_SIMULATION).initialized();
            instance.ok(set(&instance, input, 1, slope));
            instance.ok(instance.step(0.0, size));
            // The input is reset, so that only its change within the step can make a difference.
            instance.ok(instance.set_real(input, 0.0));
            instance.bits(&fmu.results())
        };
        let slope = fmu.instance(CO_SIMULATION).input_at(100);
        assert!(after(0.0) != after(slope), "{}", fmu.name());
        assert!(after(slope) == after(slope), "{}", fmu.name());
    }
}
