//! Tests of value references: one by one or all at once, wrong ones, repeated ones, and values at
//! the limits.

use conformance::interface::{CO_SIMULATION, ERROR, MODEL_EXCHANGE, OK, Status};
use conformance::{Instance, c, units};
use model_description::variable::{Causality, Kind};
use std::ffi::c_int;
use std::ptr::null;

#[test]
fn one_reference_per_call_gives_what_all_in_one_call_give() {
    for unit in units() {
        let everything = unit.references(|variable| !variable.is_calculated());
        let everything = [everything, unit.results()].concat();
        for &fmu_type in unit.interfaces() {
            let instance = unit.instance(fmu_type).initialized();
            for tick in 0..7 {
                let (input, value) = (unit.input(), instance.course(tick + 1));
                instance.ok(instance.set_real(input, value));
                let here = instance.save();
                let all = instance.bits(&everything);
                // The first request must update all variables, whichever it is for.
                instance.restore(here);
                let forwards: Vec<_> =
                    everything.iter().flat_map(|&one| instance.bits(&[one])).collect();
                instance.restore(here);
                let backwards = everything.iter().rev().flat_map(|&one| instance.bits(&[one]));
                let mut backwards: Vec<_> = backwards.collect();
                backwards.reverse();
                assert!(forwards == all && backwards == all, "{} at tick {tick}", unit.name());
                assert_eq!(instance.real(input), value);
                if fmu_type == MODEL_EXCHANGE {
                    instance.integrate(tick..tick + 1);
                } else {
                    instance.drive(tick..tick + 1);
                }
            }
        }
    }
}

/// Call that gets or sets one variable of any type.
type Access = fn(&Instance, u32) -> Status;

fn of_type(kind: &Kind) -> usize {
    match kind {
        Kind::Real { .. } => 0,
        Kind::Integer { .. } | Kind::Enumeration { .. } => 1,
        Kind::Boolean { .. } => 2,
        Kind::String { .. } => 3,
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
    for unit in units() {
        let instance = unit.instance(CO_SIMULATION);
        instance.enter_initialization();
        let (component, here, before) = (instance.component, instance.save(), instance.serialize());
        let beyond = unit.description.variables.len() as u32;
        for wrong in [beyond, beyond + 1, 1 << 31, u32::MAX] {
            let named = format!("value reference {wrong} does not exist");
            let refused = |status, name| {
                instance.refused(status, ERROR, &[name, &named]);
                instance.restore(here);
            };
            for &(name, _, access) in ACCESS {
                refused(access(&instance, wrong), name);
            }
            let status = c!(instance, fmi2SetRealInputDerivatives(component, &wrong, 1, &1, &0.0));
            refused(status, "fmi2SetRealInputDerivatives");
            if unit.description.directional_derivatives() {
                let (state, derivative) = unit.description.states()[0];
                for (of, by) in [(wrong, state as u32), (derivative as u32, wrong)] {
                    let status = c!(
                        instance,
                        fmi2GetDirectionalDerivative(component, &of, 1, &by, 1, &1.0, &mut 0.0)
                    );
                    refused(status, "fmi2GetDirectionalDerivative");
                }
            }
            // The wrong reference stands behind a right one, which keeps its value.
            let (references, values) = ([unit.input(), wrong], [0.02, 0.02]);
            let before = instance.real(unit.input());
            let status =
                c!(instance, fmi2SetReal(component, references.as_ptr(), 2, values.as_ptr()));
            assert_eq!(instance.real(unit.input()), before);
            refused(status, "fmi2SetReal");
        }
        assert!(instance.serialize() == before, "{}", unit.name());
    }
}

#[test]
fn references_of_another_type_are_named() {
    for unit in units() {
        let instance = unit.instance(CO_SIMULATION);
        instance.enter_initialization();
        let (here, before) = (instance.save(), instance.serialize());
        for (variable, reference) in unit.description.variables.iter().zip(0..) {
            let named = format!("'{}' (value reference {reference}) is not of type", variable.name);
            for &(name, kind, access) in ACCESS {
                if kind != of_type(&variable.kind) {
                    instance.refused(access(&instance, reference), ERROR, &[name, &named]);
                    instance.restore(here);
                }
            }
        }
        assert!(instance.serialize() == before, "{}", unit.name());
    }
}

#[test]
fn repeated_references_are_taken_one_after_the_other() {
    for unit in units() {
        let instance = unit.instance(CO_SIMULATION).initialized();
        let (references, values) = ([unit.input(); 3], [0.01, -0.02, 0.03]);
        let (component, list) = (instance.component, references.as_ptr());
        instance.ok(c!(instance, fmi2SetReal(component, list, 3, values.as_ptr())));
        let mut read = [f64::NAN; 3];
        instance.ok(c!(instance, fmi2GetReal(component, list, 3, read.as_mut_ptr())));
        assert_eq!(read, [0.03; 3]);
        let results = unit.results();
        let once = instance.bits(&results);
        let twice = instance.bits(&[results.clone(), results].concat());
        assert!(twice == [once.clone(), once].concat(), "{}", unit.name());
    }
}

#[test]
fn values_up_to_the_declared_limits_are_taken_and_none_beyond() {
    for unit in units() {
        let instance = unit.instance(CO_SIMULATION);
        let (component, here) = (instance.component, instance.save());
        let integer = |reference: u32, value: c_int| {
            c!(instance, fmi2SetInteger(component, &reference, 1, &value))
        };
        for reference in unit.references(|variable| !variable.is_calculated()) {
            let variable = &unit.description.variables[reference as usize];
            let named = format!("'{}'", variable.name);
            let refused = |status| {
                instance.refused(status, ERROR, &[&named]);
                instance.restore(here);
            };
            match &variable.kind {
                Kind::Real { min, max, .. } => {
                    for edge in [min, max].into_iter().flatten() {
                        instance.ok(instance.set_real(reference, *edge));
                    }
                    let beyond = [min.map(f64::next_down), max.map(f64::next_up)];
                    let beyond = beyond.into_iter().flatten();
                    for value in beyond.chain([f64::NAN, f64::INFINITY, f64::NEG_INFINITY]) {
                        refused(instance.set_real(reference, value));
                    }
                }
                Kind::Integer { min, max, .. } => {
                    for edge in [min, max].into_iter().flatten() {
                        instance.ok(integer(reference, *edge));
                    }
                    let below = min.and_then(|min| min.checked_sub(1));
                    let above = max.and_then(|max| max.checked_add(1));
                    for value in [below, above].into_iter().flatten() {
                        refused(integer(reference, value));
                    }
                }
                Kind::Enumeration { of, .. } => {
                    let last = c_int::try_from(of.items.len()).unwrap();
                    for item in 1..=last {
                        instance.ok(integer(reference, item));
                    }
                    for value in [0, -1, last + 1, c_int::MIN, c_int::MAX] {
                        refused(integer(reference, value));
                    }
                }
                Kind::Boolean { .. } => {
                    for value in [2, -1] {
                        refused(c!(instance, fmi2SetBoolean(component, &reference, 1, &value)));
                    }
                }
                Kind::String { .. } => refused(instance.set_string(&variable.name, c"\xff")),
            }
            instance.restore(here);
        }
    }
}

#[test]
fn what_is_calculated_from_the_largest_inputs_is_a_number_or_an_error() {
    let large = [1e10, 1e100, 1e154, 1e160, 1e300, f64::MAX];
    for unit in units() {
        let inputs = unit.references(|variable| {
            variable.causality == Causality::Input && matches!(variable.kind, Kind::Real { .. })
        });
        let results = unit.references(|v| v.is_calculated() && matches!(v.kind, Kind::Real { .. }));
        for value in large.into_iter().flat_map(|value| [value, -value]) {
            // Each input is set alone, and then all of them.
            for set in inputs.chunks(1).chain([inputs.as_slice()]) {
                let instance = unit.instance(CO_SIMULATION).initialized();
                for tick in 0..2 {
                    for reference in set {
                        let (component, name) = (instance.component, unit.name());
                        if c!(instance, fmi2SetReal(component, reference, 1, &value)) != OK {
                            break;
                        }
                        let mut found = vec![0.0_f64; results.len()];
                        let (all, n) = (results.as_ptr(), results.len());
                        let status =
                            c!(instance, fmi2GetReal(component, all, n, found.as_mut_ptr()));
                        assert!(status == OK || status == ERROR, "{name}: status {status}");
                        let wrong =
                            found.iter().zip(&results).find(|(value, _)| !value.is_finite());
                        let which =
                            wrong.map(|(_, &i)| &unit.description.variables[i as usize].name);
                        assert!(
                            which.is_none(),
                            "{name}: {which:?} is not finite for {reference} = {value}"
                        );
                    }
                    if c!(instance, fmi2DoStep(instance.component, f64::from(tick) * 0.2, 0.2, 1))
                        != OK
                    {
                        break;
                    }
                }
            }
        }
    }
}
