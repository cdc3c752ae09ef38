//! Test of the calls that are allowed in state stepFailed, which no FMU of the project reaches.
//! Those of the other states are tested with every FMU: tests/conformance.

use crate::support::{CO_SIMULATION, FmiStatus, Instance, LABEL, U, X, c};
use std::ffi::c_void;
use std::ptr::{null, null_mut};

type Caller = fn(*mut c_void) -> FmiStatus;

/// Functions with valid arguments that FMI 2.0, section 4.2.4, allows after a discarded step.
const ALLOWED: &[(&str, Caller)] = &[
    ("fmi2SetDebugLogging", |c| c!(fmi2SetDebugLogging(c, 1, 0, null()))),
    ("fmi2Terminate", |c| c!(fmi2Terminate(c))),
    ("fmi2Reset", |c| c!(fmi2Reset(c))),
    ("fmi2GetReal", |c| c!(fmi2GetReal(c, &X, 1, &mut 0.0))),
    ("fmi2GetInteger", |c| c!(fmi2GetInteger(c, null(), 0, null_mut()))),
    ("fmi2GetBoolean", |c| c!(fmi2GetBoolean(c, null(), 0, null_mut()))),
    ("fmi2GetString", |c| c!(fmi2GetString(c, null(), 0, null_mut()))),
    ("fmi2SetFMUstate", |c| {
        let mut state = null_mut();
        assert_eq!(c!(fmi2GetFMUstate(c, &mut state)), FmiStatus::Ok);
        c!(fmi2SetFMUstate(c, state))
    }),
    ("fmi2FreeFMUstate", |c| c!(fmi2FreeFMUstate(c, &mut null_mut()))),
    ("fmi2GetDirectionalDerivative", |c| {
        c!(fmi2GetDirectionalDerivative(c, null(), 0, null(), 0, null(), null_mut()))
    }),
    ("fmi2GetRealOutputDerivatives", |c| {
        c!(fmi2GetRealOutputDerivatives(c, null(), 0, null(), null_mut()))
    }),
    ("fmi2GetStatus", |c| c!(fmi2GetStatus(c, 0, &mut { FmiStatus::Ok }))),
    ("fmi2GetRealStatus", |c| c!(fmi2GetRealStatus(c, 2, &mut 0.0))),
    ("fmi2GetBooleanStatus", |c| c!(fmi2GetBooleanStatus(c, 3, &mut 0))),
    ("fmi2GetStringStatus", |c| c!(fmi2GetStringStatus(c, 1, &mut null()))),
];

/// The functions of co-simulation that it does not allow there.
const REFUSED: &[(&str, Caller)] = &[
    ("fmi2SetupExperiment", |c| c!(fmi2SetupExperiment(c, 0, 0.0, 0.0, 0, 0.0))),
    ("fmi2EnterInitializationMode", |c| c!(fmi2EnterInitializationMode(c))),
    ("fmi2ExitInitializationMode", |c| c!(fmi2ExitInitializationMode(c))),
    ("fmi2SetReal", |c| c!(fmi2SetReal(c, &U, 1, &1.0))),
    ("fmi2SetInteger", |c| c!(fmi2SetInteger(c, null(), 0, null()))),
    ("fmi2SetBoolean", |c| c!(fmi2SetBoolean(c, null(), 0, null()))),
    ("fmi2SetString", |c| c!(fmi2SetString(c, null(), 0, null()))),
    ("fmi2SetRealInputDerivatives", |c| c!(fmi2SetRealInputDerivatives(c, &U, 1, &1, &1.0))),
    ("fmi2DoStep", |c| c!(fmi2DoStep(c, 0.0, 0.1, 1))),
    ("fmi2CancelStep", |c| c!(fmi2CancelStep(c))),
];

fn after_a_discarded_step() -> Instance {
    let instance = Instance::lag(CO_SIMULATION);
    assert_eq!(instance.set_string(LABEL, c"refuse"), FmiStatus::Ok);
    instance.initialize();
    assert_eq!(instance.step(0.0, 0.75), FmiStatus::Discard);
    instance
}

#[test]
fn oracle_calls_after_a_discarded_step_are_allowed_where_the_standard_says() {
    for (name, call) in ALLOWED {
        let instance = after_a_discarded_step();
        let status = call(instance.component);
        assert_eq!(status, FmiStatus::Ok, "{name}: {:?}", instance.messages().last());
    }
    for (name, call) in REFUSED {
        let instance = after_a_discarded_step();
        let before = instance.messages().len();
        assert_eq!(call(instance.component), FmiStatus::Error, "{name} must be refused");
        let messages = instance.messages();
        assert_eq!(messages.len(), before + 1, "{name} says so once");
        let text = &messages[before].text;
        assert!(text.starts_with(name) && text.contains("not allowed in state"), "{text}");
        // After that call the instance is usable again.
        assert_eq!(c!(fmi2Reset(instance.component)), FmiStatus::Ok);
        instance.initialize();
        assert_eq!(instance.real(X), 0.5);
    }
}
