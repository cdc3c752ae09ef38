//! Tests of saved states: in memory, as bytes and in another instance; states that do not fit are
//! refused.

use crate::support::*;
use fmi_export::types::FmiStatus;

/// Drives an instance over three steps from `k` on and returns the bits of all its outputs.
fn run(instance: &Instance, from: i32) -> Vec<u64> {
    let h = 0.3;
    let mut bits = vec![];
    for k in from..from + 3 {
        assert_eq!(instance.set_real(U, f64::from(k).sin()), FmiStatus::Ok);
        assert_eq!(instance.step(f64::from(k) * h, h), FmiStatus::Ok);
        bits.extend([X, DERIVATIVE, Y].map(|reference| instance.real(reference).to_bits()));
        bits.push(instance.boolean(SWITCHED) as u64);
    }
    bits
}

#[test]
fn a_state_can_be_written_over() {
    let instance = Instance::stepping();
    let mut state = instance.save();
    run(&instance, 0);
    let before = state;
    assert_eq!(c!(fmi2GetFMUstate(instance.component, &mut state)), FmiStatus::Ok);
    assert_eq!(state, before);
    let expected = run(&instance, 3);
    assert_eq!(c!(fmi2SetFMUstate(instance.component, state)), FmiStatus::Ok);
    assert_eq!(run(&instance, 3), expected);
}

#[test]
fn bytes_restore_another_instance_bit_for_bit() {
    let first = Instance::stepping();
    run(&first, 0);
    let bytes = first.serialize();
    let second = Instance::lag(CO_SIMULATION);
    let (status, state) = second.deserialize(&bytes);
    assert_eq!(status, FmiStatus::Ok);
    assert_eq!(c!(fmi2SetFMUstate(second.component, state)), FmiStatus::Ok);
    assert_eq!(second.serialize(), bytes);
    assert_eq!(run(&second, 3), run(&first, 3));
}

#[test]
fn pending_input_derivatives_are_part_of_the_state() {
    let instance = Instance::stepping();
    let (order, value) = (1, 2.0);
    let component = instance.component;
    let status = c!(fmi2SetRealInputDerivatives(component, &U, 1, &order, &value));
    assert_eq!(status, FmiStatus::Ok);
    let state = instance.save();
    assert_eq!(instance.step(0.0, 0.5), FmiStatus::Ok);
    let expected = instance.real(X);
    assert_eq!(c!(fmi2SetFMUstate(component, state)), FmiStatus::Ok);
    assert_eq!(instance.step(0.0, 0.5), FmiStatus::Ok);
    assert_eq!(instance.real(X).to_bits(), expected.to_bits());
}

#[test]
fn a_handle_that_is_not_ones_own_is_refused() {
    let (one, other) = (Instance::stepping(), Instance::stepping());
    let state = one.save();
    assert_eq!(c!(fmi2SetFMUstate(other.component, state)), FmiStatus::Error);
    other.said(&["not made by this instance"]);
    let mut freed = state;
    assert_eq!(c!(fmi2FreeFMUstate(one.component, &mut freed)), FmiStatus::Ok);
    assert_eq!(c!(fmi2SetFMUstate(one.component, state)), FmiStatus::Error);
    let mut twice = state;
    assert_eq!(c!(fmi2FreeFMUstate(one.component, &mut twice)), FmiStatus::Error);
    let mut size = 0;
    assert_eq!(c!(fmi2SerializedFMUstateSize(one.component, state, &mut size)), FmiStatus::Error);
    // None of these refusals ends the simulation.
    assert_eq!(one.step(0.0, 0.1), FmiStatus::Ok);
    assert_eq!(other.step(0.0, 0.1), FmiStatus::Ok);
}

#[test]
fn an_instance_in_error_goes_on_from_a_saved_state() {
    let instance = Instance::stepping();
    run(&instance, 0);
    let state = instance.save();
    assert_eq!(instance.set_real(U, f64::NAN), FmiStatus::Error);
    assert_eq!(instance.step(0.9, 0.3), FmiStatus::Error);
    assert_eq!(c!(fmi2SetFMUstate(instance.component, state)), FmiStatus::Ok);
    run(&instance, 3);
}

#[test]
fn reset_equals_a_new_instance_bit_for_bit() {
    let new = Instance::lag(CO_SIMULATION);
    let used = Instance::lag(CO_SIMULATION);
    assert_eq!(used.set_real(GAIN, 9.0), FmiStatus::Ok);
    assert_eq!(used.set_string(LABEL, c"used"), FmiStatus::Ok);
    used.initialize();
    run(&used, 0);
    assert_eq!(c!(fmi2Reset(used.component)), FmiStatus::Ok);
    assert_eq!(used.serialize(), new.serialize());
    new.initialize();
    used.initialize();
    assert_eq!(run(&used, 0), run(&new, 0));
    assert_eq!(used.serialize(), new.serialize());
}
