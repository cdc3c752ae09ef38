//! Tests of model exchange: states, derivatives, events and directional derivatives.

use crate::support::*;

fn state(instance: &Instance) -> f64 {
    let mut x = f64::NAN;
    assert_eq!(c!(fmi2GetContinuousStates(instance.component, &mut x, 1)), FmiStatus::Ok);
    x
}

fn derivative(instance: &Instance) -> f64 {
    let mut value = f64::NAN;
    assert_eq!(c!(fmi2GetDerivatives(instance.component, &mut value, 1)), FmiStatus::Ok);
    value
}

#[test]
fn oracle_an_euler_loop_with_the_time_event_agrees_with_the_closed_form() {
    let instance = Instance::in_event_mode();
    let component = instance.component;
    assert_eq!(instance.set_real(U, 1.0), FmiStatus::Ok);
    let info = instance.event_info();
    assert_eq!((info.next_event_time_defined, info.next_event_time), (1, 1.25));
    assert_eq!((info.new_discrete_states_needed, info.terminate_simulation), (0, 0));
    assert_eq!(c!(fmi2EnterContinuousTimeMode(component)), FmiStatus::Ok);
    let (n, h) = (20_000, 1e-4);
    for k in 0..n {
        let x = state(&instance) + h * derivative(&instance);
        let t = f64::from(k + 1) * h;
        assert_eq!(c!(fmi2SetTime(component, t)), FmiStatus::Ok);
        assert_eq!(c!(fmi2SetContinuousStates(component, &x, 1)), FmiStatus::Ok);
        let (mut event, mut end) = (-1, -1);
        assert_eq!(
            c!(fmi2CompletedIntegratorStep(component, 1, &mut event, &mut end)),
            FmiStatus::Ok
        );
        assert_eq!((event, end), (0, 0));
        if k + 1 == 12_500 {
            assert_eq!(c!(fmi2EnterEventMode(component)), FmiStatus::Ok);
            assert_eq!(instance.event_info().next_event_time_defined, 0);
            assert_eq!(instance.boolean(SWITCHED), 1);
            assert_eq!(c!(fmi2EnterContinuousTimeMode(component)), FmiStatus::Ok);
        }
    }
    let at_switch = 2.0 + (0.5 - 2.0) * (-1.25f64 / 0.5).exp();
    let exact = 1.0 + (at_switch - 1.0) * (-0.75f64 / 0.5).exp();
    // The error of the explicit Euler method is of the order of h.
    assert!((state(&instance) - exact).abs() < 2.0 * h, "{} {exact}", state(&instance));
    assert_eq!(instance.real(X), state(&instance));
}

#[test]
fn outputs_follow_the_time_that_is_set() {
    const GAIN_NOW: u32 = 13;
    let instance = Instance::in_event_mode();
    let component = instance.component;
    instance.event_info();
    assert_eq!(c!(fmi2EnterContinuousTimeMode(component)), FmiStatus::Ok);
    assert_eq!(instance.real(GAIN_NOW), 2.0);
    assert_eq!(c!(fmi2SetTime(component, 1.5)), FmiStatus::Ok);
    assert_eq!(instance.real(GAIN_NOW), 1.0);
}

#[test]
fn event_indicators_follow_the_states_which_have_nominal_values() {
    let (instance, mut nominal) = (Instance::in_event_mode(), f64::NAN);
    let component = instance.component;
    let status = c!(fmi2GetNominalsOfContinuousStates(component, &mut nominal, 1));
    assert_eq!((status, nominal), (FmiStatus::Ok, 2.0));
    assert_eq!(c!(fmi2EnterContinuousTimeMode(component)), FmiStatus::Ok);
    for x in [0.25, 1.0, 3.0] {
        let mut indicator = f64::NAN;
        assert_eq!(c!(fmi2SetContinuousStates(component, &x, 1)), FmiStatus::Ok);
        assert_eq!(c!(fmi2GetEventIndicators(component, &mut indicator, 1)), FmiStatus::Ok);
        assert_eq!(indicator, x - 1.0);
    }
}

#[test]
fn a_discrete_input_is_taken_at_events() {
    let instance = Instance::in_event_mode();
    let component = instance.component;
    assert_eq!(instance.set_real(OFFSET, 5.0), FmiStatus::Ok);
    instance.event_info();
    assert_eq!(instance.real(Y), 0.5 + 5.0);
    assert_eq!(c!(fmi2EnterContinuousTimeMode(component)), FmiStatus::Ok);
    // The standard does not ask importers for this order of calls, but FMPy uses it.
    assert_eq!(instance.set_real(OFFSET, 7.0), FmiStatus::Ok);
    assert_eq!((instance.real(OFFSET), instance.real(Y)), (7.0, 0.5 + 5.0));
    assert_eq!(c!(fmi2EnterEventMode(component)), FmiStatus::Ok);
    instance.event_info();
    assert_eq!(instance.real(Y), 0.5 + 7.0);
    let stepping = Instance::stepping();
    assert_eq!(stepping.set_real(OFFSET, 5.0), FmiStatus::Ok);
    assert_eq!(stepping.real(Y), 0.5 + 5.0);
}

#[test]
fn a_state_that_is_not_finite_is_discarded() {
    let instance = Instance::in_event_mode();
    assert_eq!(c!(fmi2EnterContinuousTimeMode(instance.component)), FmiStatus::Ok);
    let x = f64::INFINITY;
    assert_eq!(c!(fmi2SetContinuousStates(instance.component, &x, 1)), FmiStatus::Discard);
    instance.said(&["state 'x' = inf is not finite"]);
    assert_eq!(state(&instance), 0.5);
    assert_eq!(c!(fmi2SetTime(instance.component, f64::NAN)), FmiStatus::Error);
}

#[test]
fn oracle_directional_derivatives_agree_with_differences() {
    let instance = Instance::in_event_mode();
    let component = instance.component;
    let (unknown, known, seed) = ([DERIVATIVE, Y], [U, X], [0.5, -2.0]);
    let mut analytic = [f64::NAN; 2];
    let (unknowns, knowns) = (unknown.as_ptr(), known.as_ptr());
    let status = c!(fmi2GetDirectionalDerivative(
        component,
        unknowns,
        2,
        knowns,
        2,
        seed.as_ptr(),
        analytic.as_mut_ptr()
    ));
    assert_eq!(status, FmiStatus::Ok);
    let values = || unknown.map(|reference| instance.real(reference));
    let before = values();
    assert_eq!(c!(fmi2EnterContinuousTimeMode(component)), FmiStatus::Ok);
    // The model is linear, so a difference of any size is exact except for rounding.
    let x = state(&instance) + seed[1];
    assert_eq!(instance.set_real(U, seed[0]), FmiStatus::Ok);
    assert_eq!(c!(fmi2SetContinuousStates(component, &x, 1)), FmiStatus::Ok);
    let after = values();
    for i in 0..2 {
        assert!((after[i] - before[i] - analytic[i]).abs() < 1e-12);
    }
}

#[test]
fn directional_derivatives_by_or_of_the_wrong_variables_are_refused() {
    for (unknown, known, part) in [
        (U, X, "'u' is a parameter or an input"),
        (Y, GAIN, "'gain.early' is neither an input nor a state"),
        (Y, Y, "'y' is neither an input nor a state"),
        (TEXT, U, "not of type Real"),
    ] {
        let instance = Instance::in_event_mode();
        let (seed, mut value) = (1.0, 0.0);
        let component = instance.component;
        let status =
            c!(fmi2GetDirectionalDerivative(component, &unknown, 1, &known, 1, &seed, &mut value,));
        assert_eq!(status, FmiStatus::Error);
        instance.said(&["fmi2GetDirectionalDerivative", part]);
    }
}
