//! Tests of getting and setting values: types, limits, causality and laziness.

use crate::support::*;

#[test]
fn parameters_set_in_initialization_mode_are_taken_up_before_the_next_read() {
    let instance = Instance::lag(CO_SIMULATION);
    instance.enter_initialization();
    assert_eq!(instance.real(X), 0.5);
    // Negative zero is another value than zero.
    assert_eq!(instance.set_real(U, -0.0), FmiStatus::Ok);
    assert!(instance.real(U).is_sign_negative());
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
