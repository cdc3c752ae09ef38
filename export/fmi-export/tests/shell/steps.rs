//! Tests of co-simulation: time, input derivatives and status.

use crate::support::*;

/// Returns an instance at that time, which it reached in one step.
fn at(time: f64, stop: Option<f64>) -> Instance {
    let instance = Instance::lag(CO_SIMULATION);
    let (component, stops) = (instance.component, i32::from(stop.is_some()));
    let stop = stop.unwrap_or_default();
    assert_eq!(c!(fmi2SetupExperiment(component, 0, 0.0, time, stops, stop)), FmiStatus::Ok);
    assert_eq!(c!(fmi2EnterInitializationMode(component)), FmiStatus::Ok);
    assert_eq!(c!(fmi2ExitInitializationMode(component)), FmiStatus::Ok);
    instance
}

fn has_terminated(instance: &Instance) -> i32 {
    let mut terminated = -1;
    assert_eq!(c!(fmi2GetBooleanStatus(instance.component, 3, &mut terminated)), FmiStatus::Ok);
    terminated
}

#[test]
fn the_communication_point_may_differ_by_rounding_only() {
    // The time, and differences that are taken and refused: 1e-9 of the time, but at most 0.1 ms
    // unless the numbers themselves are coarser.
    for (time, near, far) in [
        (1e3, 5e-7, 2e-6),
        (-1e3, 5e-7, 2e-6),
        (1e7, 9e-5, 2e-4),
        (1e13, 5e-3, 2e-2),
        (1e-3, 5e-13, 2e-10),
    ] {
        assert_eq!(at(time, None).step(time + near, 1e-6), FmiStatus::Ok, "{time}");
        assert_eq!(at(time, None).step(time - near, 1e-6), FmiStatus::Ok, "{time}");
        assert_eq!(at(time, None).step(time + far, 1e-6), FmiStatus::Error, "{time}");
        assert_eq!(at(time, None).step(time - far, 1e-6), FmiStatus::Error, "{time}");
    }
}

#[test]
fn the_stop_time_may_be_passed_by_rounding_only() {
    // 1e-6 of the stop time, but never more than the step.
    assert_eq!(at(99.0, Some(100.0)).step(99.0, 1.0 + 5e-5), FmiStatus::Ok);
    assert_eq!(at(99.0, Some(100.0)).step(99.0, 1.0 + 2e-4), FmiStatus::Error);
    assert_eq!(at(0.0, Some(1e-9)).step(0.0, 1e-9 + 5e-16), FmiStatus::Ok);
    assert_eq!(at(0.0, Some(1e-9)).step(0.0, 1e-9 + 5e-15), FmiStatus::Error);
}

#[test]
fn a_step_that_the_model_refuses_can_be_repeated_from_a_saved_state() {
    let instance = Instance::lag(CO_SIMULATION);
    assert_eq!(instance.set_string(LABEL, c"refuse"), FmiStatus::Ok);
    instance.initialize();
    assert_eq!(instance.step(0.0, 0.5), FmiStatus::Ok);
    let state = instance.save();
    assert_eq!(instance.step(0.5, 0.75), FmiStatus::Discard);
    instance.said(&["fmi2DoStep: steps above 0.5 s are too long"]);
    let mut time = f64::NAN;
    assert_eq!(c!(fmi2GetRealStatus(instance.component, 2, &mut time)), FmiStatus::Ok);
    assert_eq!(time, 0.5);
    // There is no Real status 7.
    assert_eq!(c!(fmi2GetRealStatus(instance.component, 7, &mut 0.0)), FmiStatus::Discard);
    let mut status = FmiStatus::Ok;
    assert_eq!(c!(fmi2GetStatus(instance.component, 0, &mut status)), FmiStatus::Ok);
    assert_eq!(status, FmiStatus::Discard);
    assert_eq!(has_terminated(&instance), 0);
    assert_eq!(c!(fmi2SetFMUstate(instance.component, state)), FmiStatus::Ok);
    assert_eq!(instance.step(0.5, 0.25), FmiStatus::Ok);
}

/// FMI 2.0.5, section 4.2.3: the importer learns by fmi2Discard and the Boolean status
/// fmi2Terminated that the simulation ends, and by the Real status fmi2LastSuccessfulTime when.
#[test]
fn a_step_to_the_end_of_the_simulation_is_discarded() {
    const DEFECT: u32 = 0;
    const COUNT: u32 = 2;
    let instance = Instance::new("Counter", CO_SIMULATION);
    assert_eq!(instance.set_string(DEFECT, c"end"), FmiStatus::Ok);
    instance.initialize();
    assert_eq!(instance.step(0.0, 0.5), FmiStatus::Ok);
    assert_eq!(has_terminated(&instance), 0);
    let state = instance.save();
    assert_eq!(instance.step(0.5, 0.5), FmiStatus::Discard);
    instance.said(&["the count is over"]);
    assert_eq!(has_terminated(&instance), 1);
    let mut time = f64::NAN;
    assert_eq!(c!(fmi2GetRealStatus(instance.component, 2, &mut time)), FmiStatus::Ok);
    assert_eq!(time, crate::counter::ENDS_AT);
    // The outputs are those of the end, and no step leads beyond it.
    assert_eq!(instance.real(COUNT), 2.0);
    assert_eq!(instance.step(time, 0.5), FmiStatus::Error);
    // A state from before the end has not ended.
    assert_eq!(c!(fmi2SetFMUstate(instance.component, state)), FmiStatus::Ok);
    assert_eq!(has_terminated(&instance), 0);
    assert_eq!(c!(fmi2Reset(instance.component)), FmiStatus::Ok);
    instance.initialize();
    assert_eq!(instance.step(0.0, 0.5), FmiStatus::Ok);
    assert_eq!(has_terminated(&instance), 0);
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
