//! Tests of getting and setting values: types, limits, causality and laziness.

use crate::support::*;
use fmi_export::types::FmiStatus;

fn initializing() -> Instance {
    let instance = Instance::lag(CO_SIMULATION);
    instance.enter_initialization();
    instance
}

#[test]
fn a_refused_value_leaves_the_old_one_in_place() {
    let cases: &[(u32, f64, &str)] = &[
        (TIME_CONSTANT, f64::NAN, "'timeConstant' = NaN is not a finite number"),
        (TIME_CONSTANT, f64::NEG_INFINITY, "is not a finite number"),
        (TIME_CONSTANT, 0.0, "'timeConstant' = 0.0 is below the minimum 0.001"),
        (U, 100.5, "'u' = 100.5 is above the maximum 100"),
        (X, 1.0, "'x' is calculated by the FMU"),
        (ORDER, 1.0, "'order' (value reference 5) is not of type Real"),
        (17, 1.0, "value reference 17 does not exist"),
        (u32::MAX, 1.0, "does not exist"),
    ];
    for &(reference, value, part) in cases {
        let instance = initializing();
        let before = (reference < 5 || reference == U).then(|| instance.real(reference));
        assert_eq!(instance.set_real(reference, value), FmiStatus::Error);
        instance.said(&["fmi2SetReal", part]);
        if let Some(before) = before {
            assert_eq!(instance.real(reference), before);
        }
    }
}

#[test]
fn one_refused_value_refuses_all_of_the_call() {
    let instance = initializing();
    let references = [GAIN, TIME_CONSTANT];
    let values = [7.0, -1.0];
    assert_eq!(
        c!(fmi2SetReal(instance.component, references.as_ptr(), 2, values.as_ptr())),
        FmiStatus::Error
    );
    assert_eq!(instance.real(GAIN), 2.0);
}

#[test]
fn parameters_set_in_initialization_mode_are_taken_up_before_the_next_read() {
    let instance = initializing();
    assert_eq!(instance.real(X), 0.5);
    assert_eq!(instance.set_real(INITIAL, 3.0), FmiStatus::Ok);
    assert_eq!(instance.real(X), 3.0);
    assert_eq!(instance.set_real(U, 1.0), FmiStatus::Ok);
    assert_eq!(instance.real(Y), 4.0);
    // The derivative is der(x) = (k u − x) / T.
    assert_eq!(instance.real(DERIVATIVE), (2.0 * 1.0 - 3.0) / 0.5);
    assert_eq!(instance.set_real(INITIAL, -1.0), FmiStatus::Ok);
    assert_eq!(c!(fmi2ExitInitializationMode(instance.component)), FmiStatus::Ok);
    assert_eq!(instance.real(X), -1.0);
}

#[test]
fn negative_zero_is_another_value_than_zero() {
    let instance = initializing();
    assert_eq!(instance.set_real(U, -0.0), FmiStatus::Ok);
    assert!(instance.real(U).is_sign_negative());
}
