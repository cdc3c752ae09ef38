//! Tests of saved states: in memory, as bytes and in another instance; states that do not fit are
//! refused.

use crate::support::*;

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
