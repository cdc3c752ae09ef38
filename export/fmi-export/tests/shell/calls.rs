//! Tests of the calls that are allowed in each state.

use crate::support::{CO_SIMULATION, Instance, MODEL_EXCHANGE, U, X, c};
use fmi_export::types::{CEventInfo, FmiStatus};
use std::ffi::{c_int, c_void};
use std::ptr::{null, null_mut};

/// Function that makes a new instance in one of the states. Letters stand for the states in the
/// tables below.
type Maker = fn() -> Instance;

const CS_STATES: &[(char, Maker)] = &[
    ('I', || Instance::lag(CO_SIMULATION)),
    ('N', || {
        let instance = Instance::lag(CO_SIMULATION);
        instance.enter_initialization();
        instance
    }),
    ('S', Instance::stepping),
    ('F', || {
        let instance = Instance::lag(CO_SIMULATION);
        instance.set_string(crate::support::LABEL, c"refuse");
        instance.initialize();
        assert_eq!(instance.step(0.0, 0.75), FmiStatus::Discard);
        instance
    }),
    ('T', || {
        let instance = Instance::stepping();
        assert_eq!(c!(fmi2Terminate(instance.component)), FmiStatus::Ok);
        instance
    }),
    ('X', || {
        let instance = Instance::stepping();
        assert_eq!(instance.set_real(U, f64::NAN), FmiStatus::Error);
        instance
    }),
];

const ME_STATES: &[(char, Maker)] = &[
    ('I', || Instance::lag(MODEL_EXCHANGE)),
    ('N', || {
        let instance = Instance::lag(MODEL_EXCHANGE);
        instance.enter_initialization();
        instance
    }),
    ('E', Instance::in_event_mode),
    ('C', || {
        let instance = Instance::in_event_mode();
        assert_eq!(c!(fmi2EnterContinuousTimeMode(instance.component)), FmiStatus::Ok);
        instance
    }),
    ('T', || {
        let instance = Instance::in_event_mode();
        assert_eq!(c!(fmi2Terminate(instance.component)), FmiStatus::Ok);
        instance
    }),
    ('X', || {
        let instance = Instance::in_event_mode();
        assert_eq!(instance.set_real(U, f64::INFINITY), FmiStatus::Error);
        instance
    }),
];

type Caller = fn(*mut c_void) -> FmiStatus;

/// Functions that take a component and return a status, with valid arguments, and the states of
/// co-simulation and model exchange in which FMI 2.0 (4.2.4, 3.2.3) allows each.
const FUNCTIONS: &[(&str, Caller, &str, &str)] = &[
    ("fmi2SetDebugLogging", |c| c!(fmi2SetDebugLogging(c, 1, 0, null())), "INSFTX", "INECTX"),
    ("fmi2SetupExperiment", |c| c!(fmi2SetupExperiment(c, 0, 0.0, 0.0, 0, 0.0)), "I", "I"),
    ("fmi2EnterInitializationMode", |c| c!(fmi2EnterInitializationMode(c)), "I", "I"),
    ("fmi2ExitInitializationMode", |c| c!(fmi2ExitInitializationMode(c)), "N", "N"),
    ("fmi2Terminate", |c| c!(fmi2Terminate(c)), "SF", "EC"),
    ("fmi2Reset", |c| c!(fmi2Reset(c)), "INSFTX", "INECTX"),
    ("fmi2GetReal", |c| c!(fmi2GetReal(c, &X, 1, &mut 0.0)), "NSFTX", "NECTX"),
    ("fmi2GetInteger", |c| c!(fmi2GetInteger(c, null(), 0, null_mut())), "NSFTX", "NECTX"),
    ("fmi2GetBoolean", |c| c!(fmi2GetBoolean(c, null(), 0, null_mut())), "NSFTX", "NECTX"),
    ("fmi2GetString", |c| c!(fmi2GetString(c, null(), 0, null_mut())), "NSFTX", "NECTX"),
    ("fmi2SetReal", |c| c!(fmi2SetReal(c, &U, 1, &UNIT)), "INS", "INEC"),
    ("fmi2SetInteger", |c| c!(fmi2SetInteger(c, null(), 0, null())), "INS", "INE"),
    ("fmi2SetBoolean", |c| c!(fmi2SetBoolean(c, null(), 0, null())), "INS", "INE"),
    ("fmi2SetString", |c| c!(fmi2SetString(c, null(), 0, null())), "INS", "INE"),
    ("fmi2GetFMUstate", |c| c!(fmi2GetFMUstate(c, &mut null_mut())), "INSFTX", "INECTX"),
    ("fmi2FreeFMUstate", |c| c!(fmi2FreeFMUstate(c, &mut null_mut())), "INSFTX", "INECTX"),
    (
        "fmi2SetFMUstate",
        |c| {
            let mut state = null_mut();
            assert_eq!(c!(fmi2GetFMUstate(c, &mut state)), FmiStatus::Ok);
            c!(fmi2SetFMUstate(c, state))
        },
        "INSFTX",
        "INECTX",
    ),
    (
        "fmi2GetDirectionalDerivative",
        |c| c!(fmi2GetDirectionalDerivative(c, null(), 0, null(), 0, null(), null_mut())),
        "NSFTX",
        "NECTX",
    ),
    ("fmi2EnterEventMode", |c| c!(fmi2EnterEventMode(c)), "", "EC"),
    (
        "fmi2NewDiscreteStates",
        |c| c!(fmi2NewDiscreteStates(c, &mut CEventInfo::default())),
        "",
        "E",
    ),
    ("fmi2EnterContinuousTimeMode", |c| c!(fmi2EnterContinuousTimeMode(c)), "", "E"),
    (
        "fmi2CompletedIntegratorStep",
        |c| c!(fmi2CompletedIntegratorStep(c, 1, &mut 0, &mut 0)),
        "",
        "C",
    ),
    ("fmi2SetTime", |c| c!(fmi2SetTime(c, 0.0)), "", "EC"),
    ("fmi2SetContinuousStates", |c| c!(fmi2SetContinuousStates(c, &UNIT, 1)), "", "C"),
    ("fmi2GetDerivatives", |c| c!(fmi2GetDerivatives(c, &mut 0.0, 1)), "", "NECTX"),
    ("fmi2GetEventIndicators", |c| c!(fmi2GetEventIndicators(c, &mut 0.0, 1)), "", "NECTX"),
    ("fmi2GetContinuousStates", |c| c!(fmi2GetContinuousStates(c, &mut 0.0, 1)), "", "NECTX"),
    (
        "fmi2GetNominalsOfContinuousStates",
        |c| c!(fmi2GetNominalsOfContinuousStates(c, &mut 0.0, 1)),
        "",
        "IECTX",
    ),
    (
        "fmi2SetRealInputDerivatives",
        |c| c!(fmi2SetRealInputDerivatives(c, &U, 1, &ONE, &UNIT)),
        "INS",
        "",
    ),
    (
        "fmi2GetRealOutputDerivatives",
        |c| c!(fmi2GetRealOutputDerivatives(c, null(), 0, null(), null_mut())),
        "SFTX",
        "",
    ),
    ("fmi2DoStep", |c| c!(fmi2DoStep(c, 0.0, 0.1, 1)), "S", ""),
    ("fmi2CancelStep", |c| c!(fmi2CancelStep(c)), "", ""),
    ("fmi2GetStatus", |c| c!(fmi2GetStatus(c, 0, &mut { FmiStatus::Ok })), "SFT", ""),
    ("fmi2GetRealStatus", |c| c!(fmi2GetRealStatus(c, 2, &mut 0.0)), "SFT", ""),
    ("fmi2GetBooleanStatus", |c| c!(fmi2GetBooleanStatus(c, 3, &mut 0)), "SFT", ""),
    ("fmi2GetStringStatus", |c| c!(fmi2GetStringStatus(c, 1, &mut null())), "SFT", ""),
];

const UNIT: f64 = 1.0;
const ONE: c_int = 1;

fn check(
    states: &[(char, Maker)],
    allowed: impl Fn(&(&str, Caller, &'static str, &'static str)) -> &'static str,
) {
    for function in FUNCTIONS {
        let &(name, caller, ..) = function;
        for &(letter, make) in states {
            let instance = make();
            let before = instance.messages().len();
            let status = caller(instance.component);
            if allowed(function).contains(letter) {
                assert_eq!(
                    status,
                    FmiStatus::Ok,
                    "{name} in {letter}: {:?}",
                    instance.messages().last()
                );
                continue;
            }
            assert_eq!(status, FmiStatus::Error, "{name} in {letter} must be refused");
            let messages = instance.messages();
            assert_eq!(messages.len(), before + 1, "{name} in {letter} says so once");
            let text = &messages[before].text;
            assert!(text.starts_with(name), "{text}");
            assert!(
                text.contains("not allowed in state") || text.contains("not available"),
                "{text}"
            );
            // After that call the instance is usable again.
            assert_eq!(c!(fmi2Reset(instance.component)), FmiStatus::Ok);
            instance.initialize();
            assert_eq!(instance.real(X), 0.5);
        }
    }
}

#[test]
fn oracle_calls_of_co_simulation_are_allowed_where_the_standard_says() {
    check(CS_STATES, |function| function.2);
}

#[test]
fn oracle_calls_of_model_exchange_are_allowed_where_the_standard_says() {
    check(ME_STATES, |function| function.3);
}
