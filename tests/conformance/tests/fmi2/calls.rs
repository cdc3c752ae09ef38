//! Tests of the functions that may be called in each state, and for which variables.

use crate::prelude::*;
use conformance::interface::FUNCTIONS;
use conformance::table::{Row, State, settable};
use std::ffi::CString;

#[test]
fn the_table_has_every_function_that_answers_for_an_instance() {
    let others = ["fmi2GetTypesPlatform", "fmi2GetVersion", "fmi2Instantiate", "fmi2FreeInstance"];
    let rows: Vec<_> = TABLE.iter().map(|row| row.0).chain(others).collect();
    assert_eq!(rows.len(), FUNCTIONS.len());
    for function in FUNCTIONS {
        assert!(rows.contains(function), "{function}");
    }
}

/// Functions whose arguments come from the instance itself.
const OWN_ARGUMENTS: [&str; 3] =
    ["fmi2FreeFMUstate", "fmi2DeSerializeFMUstate", "fmi2SetContinuousStates"];

#[test]
fn without_an_instance_every_call_is_an_error() {
    for fmu in fmus() {
        // A refused instantiation leaves NULL.
        let nobody = fmu.instantiate(None, CO_SIMULATION, None, None);
        assert!(nobody.component.is_null());
        nobody.forget();
        for &Row(name, call, ..) in TABLE.iter().filter(|row| !OWN_ARGUMENTS.contains(&row.0)) {
            assert_eq!(call(&nobody, null_mut()), ERROR, "{name}");
        }
        let none = null_mut();
        assert_eq!(c!(nobody, fmi2FreeFMUstate(none, &mut null_mut())), ERROR);
        assert_eq!(c!(nobody, fmi2DeSerializeFMUstate(none, &0, 1, &mut null_mut())), ERROR);
        assert_eq!(c!(nobody, fmi2SetContinuousStates(none, &0.0, 1)), ERROR);
        c!(nobody, fmi2FreeInstance(none));
        assert!(nobody.messages().is_empty(), "there is nobody to say it");
    }
}

fn check(fmu_type: c_int) {
    let fmus: Vec<_> =
        fmus().into_iter().filter(|fmu| fmu.interfaces().contains(&fmu_type)).collect();
    for fmu in &fmus {
        for state in states(fmu_type) {
            let instance = instance_in(fmu, fmu_type, state);
            let (saved_state, before) = (instance.save(), instance.serialize());
            for row @ &Row(name, call, .., answer) in TABLE {
                let what = format!("{}: {name} in {state:?}", fmu.name());
                let allowed = row.is_allowed(fmu_type, state);
                // This is the one function that not every FMU supports.
                let offered = name != "fmi2GetDirectionalDerivative"
                    || fmu.description.directional_derivatives();
                instance.forget();
                let status = call(&instance, saved_state);
                let text = instance
                    .messages()
                    .last()
                    .map_or(String::new(), |message| message.text.clone());
                if allowed && offered {
                    assert_eq!(status, answer, "{what}: {text}");
                } else {
                    assert_eq!(status, ERROR, "{what}: {text}");
                    assert!(text.starts_with(name), "{what}: {text}");
                    if offered {
                        let reasons = ["not allowed in state", "not available"];
                        assert!(
                            reasons.iter().any(|reason| text.contains(reason)),
                            "{what}: {text}"
                        );
                    }
                }
                // The instance returns to its state before the call, bit for bit, whatever was
                // refused.
                instance.restore(saved_state);
                assert!(instance.serialize() == before, "{what}");
            }
        }
    }
}

#[test]
fn oracle_calls_of_co_simulation_are_allowed_where_the_standard_says() {
    check(CO_SIMULATION);
}

#[test]
fn oracle_calls_of_model_exchange_are_allowed_where_the_standard_says() {
    check(MODEL_EXCHANGE);
}

#[test]
fn after_a_refused_call_a_reset_makes_a_new_instance() {
    for (fmu, fmu_type) in fmus_and_interfaces() {
        let drive = driver(fmu_type);
        let expected = drive(&fmu.instance(fmu_type).initialized(), 0..3);
        for state in states(fmu_type) {
            let instance = instance_in(&fmu, fmu_type, state);
            assert_eq!(c!(instance, fmi2CancelStep(instance.component)), ERROR);
            ok!(instance, fmi2Reset());
            assert!(drive(&instance.initialized(), 0..3) == expected, "{} {state:?}", fmu.name());
        }
    }
}

/// Sets a variable to its start value, and a calculated one to any value.
fn set(instance: &Instance, reference: u32) -> (&'static str, Status) {
    let component = instance.component;
    match &instance.fmu.description.variables[reference as usize].kind {
        VariableKind::Real { start, .. } => {
            ("fmi2SetReal", instance.set_real(reference, start.unwrap_or_default()))
        }
        VariableKind::Integer { start, .. } | VariableKind::Enumeration { start, .. } => {
            let value = start.unwrap_or(1);
            ("fmi2SetInteger", c!(instance, fmi2SetInteger(component, &reference, 1, &value)))
        }
        VariableKind::Boolean { start } => {
            let value = c_int::from(start.unwrap_or_default());
            ("fmi2SetBoolean", c!(instance, fmi2SetBoolean(component, &reference, 1, &value)))
        }
        VariableKind::String { start } => {
            let value = CString::new(start.clone().unwrap_or_default()).unwrap();
            (
                "fmi2SetString",
                c!(instance, fmi2SetString(component, &reference, 1, &value.as_ptr())),
            )
        }
    }
}

#[test]
fn oracle_variables_can_be_set_where_the_standard_says() {
    for (fmu, fmu_type) in fmus_and_interfaces() {
        for state in states(fmu_type) {
            let instance = instance_in(&fmu, fmu_type, state);
            let saved_state = instance.save();
            for (variable, reference) in fmu.description.variables.iter().zip(0..) {
                instance.forget();
                let (function, status) = set(&instance, reference);
                let what = format!("{}: {} in {state:?}", fmu.name(), variable.name);
                if settable(&fmu.description, reference, state) {
                    assert_eq!(status, OK, "{what}: {:?}", instance.messages());
                } else {
                    assert_eq!(status, ERROR, "{what}");
                    let text = &instance.messages()[0].text;
                    let named = text.contains(&format!("'{}'", variable.name));
                    assert!(text.starts_with(function), "{what}: {text}");
                    assert!(named || text.contains("not allowed in state"), "{what}: {text}");
                    instance.restore(saved_state);
                }
            }
        }
    }
}

#[test]
fn a_state_set_as_a_variable_is_the_state() {
    for fmu in fmus() {
        if !fmu.interfaces().contains(&MODEL_EXCHANGE) {
            continue;
        }
        let states = fmu.description.states();
        let instance = instance_in(&fmu, MODEL_EXCHANGE, State::ContinuousTimeMode);
        let read = || {
            let mut values = vec![0.0; states.len()];
            let status = c!(
                instance,
                fmi2GetContinuousStates(instance.component, values.as_mut_ptr(), values.len())
            );
            instance.ok(status);
            values
        };
        let mut expected = read();
        for (place, &(position, _)) in states.iter().enumerate() {
            expected[place] += 1e-3;
            instance.ok(instance.set_real(position as u32, expected[place]));
            assert_eq!(read(), expected, "{}", fmu.description.variables[position].name);
        }
        let all = fmu.results();
        let one_by_one = instance.bits(&all);
        let as_vector = instance_in(&fmu, MODEL_EXCHANGE, State::ContinuousTimeMode);
        let count = expected.len();
        ok!(as_vector, fmi2SetContinuousStates(expected.as_ptr(), count));
        assert!(as_vector.bits(&all) == one_by_one);
    }
}
