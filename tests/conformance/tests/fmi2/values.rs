//! Tests of value references: one by one or all at once, wrong ones, repeated ones, and values at
//! the limits.

use crate::prelude::*;

#[test]
fn one_reference_per_call_gives_what_all_in_one_call_give() {
    for fmu in fmus() {
        let everything = fmu.references(|variable| !variable.is_calculated());
        let everything = [everything, fmu.results()].concat();
        for &fmu_type in fmu.interfaces() {
            let instance = fmu.instance(fmu_type).initialized();
            for tick in 0..7 {
                let (input, value) = (fmu.input(), instance.input_at(tick + 1));
                instance.ok(instance.set_real(input, value));
                let saved_state = instance.save();
                let expected = instance.bits(&everything);
                // The first request must update all variables, whichever it is for.
                instance.restore(saved_state);
                let forwards: Vec<_> =
                    everything.iter().flat_map(|&one| instance.bits(&[one])).collect();
                instance.restore(saved_state);
                let backwards = everything.iter().rev().flat_map(|&one| instance.bits(&[one]));
                let mut backwards: Vec<_> = backwards.collect();
                backwards.reverse();
                assert!(forwards == expected && backwards == expected, "{}: {tick}", fmu.name());
                assert_eq!(instance.real(input), value);
                driver(fmu_type)(&instance, tick..tick + 1);
            }
        }
    }
}

/// Call that gets or sets one variable of any type.
type Access = fn(&Instance, u32) -> Status;

fn of_type(kind: &VariableKind) -> usize {
    match kind {
        VariableKind::Real { .. } => 0,
        VariableKind::Integer { .. } | VariableKind::Enumeration { .. } => 1,
        VariableKind::Boolean { .. } => 2,
        VariableKind::String { .. } => 3,
    }
}

/// Each row has the function's name, the type as [`of_type`] numbers it, and a call.
#[rustfmt::skip]
const ACCESS: &[(&str, usize, Access)] = &[
    ("fmi2GetReal",    0, |i, r| c!(i, fmi2GetReal(i.component, &r, 1, &mut 0.0))),
    ("fmi2SetReal",    0, |i, r| c!(i, fmi2SetReal(i.component, &r, 1, &0.1))),
    ("fmi2GetInteger", 1, |i, r| c!(i, fmi2GetInteger(i.component, &r, 1, &mut 0))),
    ("fmi2SetInteger", 1, |i, r| c!(i, fmi2SetInteger(i.component, &r, 1, &1))),
    ("fmi2GetBoolean", 2, |i, r| c!(i, fmi2GetBoolean(i.component, &r, 1, &mut 0))),
    ("fmi2SetBoolean", 2, |i, r| c!(i, fmi2SetBoolean(i.component, &r, 1, &1))),
    ("fmi2GetString",  3, |i, r| c!(i, fmi2GetString(i.component, &r, 1, &mut null()))),
    ("fmi2SetString",  3, |i, r| c!(i, fmi2SetString(i.component, &r, 1, &c"text".as_ptr()))),
];

#[test]
fn references_that_do_not_exist_are_named() {
    for fmu in fmus() {
        let instance = fmu.instance(CO_SIMULATION);
        instance.enter_initialization();
        let (component, saved_state, before) =
            (instance.component, instance.save(), instance.serialize());
        let beyond = fmu.description.variables.len() as u32;
        for wrong in [beyond, beyond + 1, 1 << 31, u32::MAX] {
            let named = format!("value reference {wrong} does not exist");
            let refused = |status, name| {
                instance.refused(status, ERROR, &[name, &named]);
                instance.restore(saved_state);
            };
            for &(name, _, access) in ACCESS {
                refused(access(&instance, wrong), name);
            }
            let status = c!(instance, fmi2SetRealInputDerivatives(component, &wrong, 1, &1, &0.0));
            refused(status, "fmi2SetRealInputDerivatives");
            if fmu.description.directional_derivatives() {
                let (state, derivative) = fmu.description.states()[0];
                for (unknown, by) in [(wrong, state as u32), (derivative as u32, wrong)] {
                    let status = c!(
                        instance,
                        fmi2GetDirectionalDerivative(
                            component, &unknown, 1, &by, 1, &1.0, &mut 0.0
                        )
                    );
                    refused(status, "fmi2GetDirectionalDerivative");
                }
            }
            // The wrong reference stands behind a right one, which keeps its value.
            let (references, values) = ([fmu.input(), wrong], [0.02, 0.02]);
            let before = instance.real(fmu.input());
            let status =
                c!(instance, fmi2SetReal(component, references.as_ptr(), 2, values.as_ptr()));
            assert_eq!(instance.real(fmu.input()), before);
            refused(status, "fmi2SetReal");
        }
        assert!(instance.serialize() == before, "{}", fmu.name());
    }
}

#[test]
fn references_of_another_type_are_named() {
    for fmu in fmus() {
        let instance = fmu.instance(CO_SIMULATION);
        instance.enter_initialization();
        let (saved_state, before) = (instance.save(), instance.serialize());
        for (variable, reference) in fmu.description.variables.iter().zip(0..) {
            let named = format!("'{}' (value reference {reference}) is not of type", variable.name);
            for &(name, kind, access) in ACCESS {
                if kind != of_type(&variable.kind) {
                    instance.refused(access(&instance, reference), ERROR, &[name, &named]);
                    instance.restore(saved_state);
                }
            }
        }
        assert!(instance.serialize() == before, "{}", fmu.name());
    }
}

#[test]
fn repeated_references_are_taken_one_after_the_other() {
    for fmu in fmus() {
        let instance = fmu.instance(CO_SIMULATION).initialized();
        let (references, values) = ([fmu.input(); 3], [0.01, -0.02, 0.03]);
        let list = references.as_ptr();
        ok!(instance, fmi2SetReal(list, 3, values.as_ptr()));
        let mut read = [f64::NAN; 3];
        ok!(instance, fmi2GetReal(list, 3, read.as_mut_ptr()));
        assert_eq!(read, [0.03; 3]);
        let results = fmu.results();
        let once = instance.bits(&results);
        let twice = instance.bits(&[results.clone(), results].concat());
        assert!(twice == [once.clone(), once].concat(), "{}", fmu.name());
    }
}

#[test]
fn values_up_to_the_declared_limits_are_taken_and_none_beyond() {
    for fmu in fmus() {
        let instance = fmu.instance(CO_SIMULATION);
        let (component, saved_state) = (instance.component, instance.save());
        let integer = |reference: u32, value: c_int| {
            c!(instance, fmi2SetInteger(component, &reference, 1, &value))
        };
        for reference in fmu.references(|variable| !variable.is_calculated()) {
            let variable = &fmu.description.variables[reference as usize];
            let named = format!("'{}'", variable.name);
            let refused = |status| {
                instance.refused(status, ERROR, &[&named]);
                instance.restore(saved_state);
            };
            match &variable.kind {
                VariableKind::Real { min, max, .. } => {
                    for edge in [min, max].into_iter().flatten() {
                        instance.ok(instance.set_real(reference, *edge));
                    }
                    let beyond = [min.map(f64::next_down), max.map(f64::next_up)];
                    let beyond = beyond.into_iter().flatten();
                    for value in beyond.chain([f64::NAN, f64::INFINITY, f64::NEG_INFINITY]) {
                        refused(instance.set_real(reference, value));
                    }
                }
                VariableKind::Integer { min, max, .. } => {
                    for edge in [min, max].into_iter().flatten() {
                        instance.ok(integer(reference, *edge));
                    }
                    let below = min.and_then(|min| min.checked_sub(1));
                    let above = max.and_then(|max| max.checked_add(1));
                    for value in [below, above].into_iter().flatten() {
                        refused(integer(reference, value));
                    }
                }
                VariableKind::Enumeration { enumeration_type, .. } => {
                    let last = c_int::try_from(enumeration_type.items.len()).unwrap();
                    for item in 1..=last {
                        instance.ok(integer(reference, item));
                    }
                    for value in [0, -1, last + 1, c_int::MIN, c_int::MAX] {
                        refused(integer(reference, value));
                    }
                }
                VariableKind::Boolean { .. } => {
                    for value in [2, -1] {
                        refused(c!(instance, fmi2SetBoolean(component, &reference, 1, &value)));
                    }
                }
                VariableKind::String { .. } => {
                    refused(instance.set_string(&variable.name, c"\xff"));
                }
            }
            instance.restore(saved_state);
        }
    }
}

#[test]
fn what_is_calculated_from_the_largest_inputs_is_a_number_or_an_error() {
    let large = [1e10, 1e100, 1e154, 1e160, 1e300, f64::MAX];
    for fmu in fmus() {
        let inputs = fmu.references(|variable| {
            variable.causality == Causality::Input
                && matches!(variable.kind, VariableKind::Real { .. })
        });
        for value in large.into_iter().flat_map(|value| [value, -value]) {
            // Each input is set alone, and then all of them.
            for set in inputs.chunks(1).chain([inputs.as_slice()]) {
                let instance = fmu.instance(CO_SIMULATION).initialized();
                for tick in 0..2 {
                    for reference in set {
                        if instance.set_real(*reference, value) != OK {
                            break;
                        }
                        let wrong = instance.wrong_value();
                        assert!(wrong.is_none(), "{}: {wrong:?} for {value}", fmu.name());
                    }
                    if instance.step(f64::from(tick) * 0.2, 0.2) != OK {
                        break;
                    }
                }
            }
        }
    }
}
