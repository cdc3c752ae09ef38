//! Table of the functions that may be called in each state: FMI 2.0 sections 3.2.3 (model exchange)
//! and 4.2.4 (co-simulation).

use crate::model::Failure;
use crate::types::Interface;
use serde::{Deserialize, Serialize};

/// Result of the body of a call.
pub(crate) type Outcome = Result<(), Failure>;

pub(crate) fn error<T>(text: impl Into<String>) -> Result<T, Failure> {
    Err(Failure::Error(text.into()))
}

/// State of an instance in the standard's state machine. stepInProgress and stepCanceled do not
/// occur, because a step is finished when `fmi2DoStep` returns.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) enum State {
    Instantiated,
    InitializationMode,
    EventMode,
    ContinuousTimeMode,
    StepComplete,
    StepFailed,
    Terminated,
    Error,
    /// State after a panic: the instance can only be freed, so no call has a column for it.
    Fatal,
}

impl State {
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Instantiated => "instantiated",
            Self::InitializationMode => "initialization mode",
            Self::EventMode => "event mode",
            Self::ContinuousTimeMode => "continuous-time mode",
            Self::StepComplete => "step complete",
            Self::StepFailed => "step failed",
            Self::Terminated => "terminated",
            Self::Error => "error (reset the instance or restore a saved state)",
            Self::Fatal => "fatal (free the instance)",
        }
    }
}

/// One function of the interface, with the states in which it may be called.
#[derive(Debug)]
pub(crate) struct Call {
    pub(crate) name: &'static str,
    /// Interface to which the function belongs, or `None` for both.
    pub(crate) interface: Option<Interface>,
    /// Whether a refusal leaves the state as it was instead of changing it to the error state.
    pub(crate) leaves_state: bool,
    allowed: u16,
}

impl Call {
    pub(crate) fn allowed_in(&self, state: State) -> bool {
        self.allowed & (1 << state as u16) != 0
    }

    const fn keeping_state(mut self) -> Self {
        self.leaves_state = true;
        self
    }
}

/// Makes a row of the table of calls. `columns` has a character for every [`State`] but the last,
/// in their order; `-` means that the call is not allowed.
const fn call(name: &'static str, interface: Option<Interface>, columns: &str) -> Call {
    let columns = columns.as_bytes();
    assert!(columns.len() == State::Fatal as usize);
    let (mut allowed, mut i) = (0, 0);
    while i < columns.len() {
        if columns[i] != b'-' {
            allowed |= 1 << i;
        }
        i += 1;
    }
    Call { name, interface, leaves_state: false, allowed }
}

const ME: Option<Interface> = Some(Interface::ModelExchange);
const CS: Option<Interface> = Some(Interface::CoSimulation);

/// The table of calls. Where the standard allows setting some variables only, [`crate::instance`]
/// checks the variable. Getting values in initialization mode is not restricted to outputs, states
/// and derivatives.
#[rustfmt::skip]
pub(crate) mod table {
    use super::{CS, Call, ME, call};
    // Instantiated | iNitialization mode | | Event mode | | | Continuous-time mode | | | | Step
    // complete | | | | | step Failed | | | | | | Terminated INECSFTX  (X: error)
    pub(crate) const SET_DEBUG_LOGGING:         Call = call("fmi2SetDebugLogging",                None, "INECSFTX").keeping_state();
    pub(crate) const SETUP_EXPERIMENT:          Call = call("fmi2SetupExperiment",                None, "I-------");
    pub(crate) const ENTER_INITIALIZATION_MODE: Call = call("fmi2EnterInitializationMode",        None, "I-------");
    pub(crate) const EXIT_INITIALIZATION_MODE:  Call = call("fmi2ExitInitializationMode",         None, "-N------");
    pub(crate) const TERMINATE:                 Call = call("fmi2Terminate",                      None, "--ECSF--");
    pub(crate) const RESET:                     Call = call("fmi2Reset",                          None, "INECSFTX");
    pub(crate) const GET_REAL:                  Call = call("fmi2GetReal",                        None, "-NECSFTX");
    pub(crate) const GET_INTEGER:               Call = call("fmi2GetInteger",                     None, "-NECSFTX");
    pub(crate) const GET_BOOLEAN:               Call = call("fmi2GetBoolean",                     None, "-NECSFTX");
    pub(crate) const GET_STRING:                Call = call("fmi2GetString",                      None, "-NECSFTX");
    pub(crate) const SET_REAL:                  Call = call("fmi2SetReal",                        None, "INECS---");
    pub(crate) const SET_INTEGER:               Call = call("fmi2SetInteger",                     None, "INE-S---");
    pub(crate) const SET_BOOLEAN:               Call = call("fmi2SetBoolean",                     None, "INE-S---");
    pub(crate) const SET_STRING:                Call = call("fmi2SetString",                      None, "INE-S---");
    pub(crate) const GET_FMU_STATE:             Call = call("fmi2GetFMUstate",                    None, "INECSFTX").keeping_state();
    pub(crate) const SET_FMU_STATE:             Call = call("fmi2SetFMUstate",                    None, "INECSFTX").keeping_state();
    pub(crate) const FREE_FMU_STATE:            Call = call("fmi2FreeFMUstate",                   None, "INECSFTX").keeping_state();
    pub(crate) const SERIALIZED_SIZE:           Call = call("fmi2SerializedFMUstateSize",         None, "INECSFTX").keeping_state();
    pub(crate) const SERIALIZE:                 Call = call("fmi2SerializeFMUstate",              None, "INECSFTX").keeping_state();
    pub(crate) const DESERIALIZE:               Call = call("fmi2DeSerializeFMUstate",            None, "INECSFTX").keeping_state();
    pub(crate) const DIRECTIONAL_DERIVATIVE:    Call = call("fmi2GetDirectionalDerivative",       None, "-NECSFTX");

    pub(crate) const ENTER_EVENT_MODE:          Call = call("fmi2EnterEventMode",                 ME,   "--EC----");
    pub(crate) const NEW_DISCRETE_STATES:       Call = call("fmi2NewDiscreteStates",              ME,   "--E-----");
    pub(crate) const ENTER_CONTINUOUS_TIME:     Call = call("fmi2EnterContinuousTimeMode",        ME,   "--E-----");
    pub(crate) const COMPLETED_STEP:            Call = call("fmi2CompletedIntegratorStep",        ME,   "---C----");
    pub(crate) const SET_TIME:                  Call = call("fmi2SetTime",                        ME,   "--EC----");
    pub(crate) const SET_CONTINUOUS_STATES:     Call = call("fmi2SetContinuousStates",            ME,   "---C----");
    pub(crate) const GET_DERIVATIVES:           Call = call("fmi2GetDerivatives",                 ME,   "-NEC--TX");
    pub(crate) const GET_EVENT_INDICATORS:      Call = call("fmi2GetEventIndicators",             ME,   "-NEC--TX");
    pub(crate) const GET_CONTINUOUS_STATES:     Call = call("fmi2GetContinuousStates",            ME,   "-NEC--TX");
    pub(crate) const GET_NOMINALS:              Call = call("fmi2GetNominalsOfContinuousStates",  ME,   "I-EC--TX");

    pub(crate) const SET_INPUT_DERIVATIVES:     Call = call("fmi2SetRealInputDerivatives",        CS,   "IN--S---");
    pub(crate) const GET_OUTPUT_DERIVATIVES:    Call = call("fmi2GetRealOutputDerivatives",       CS,   "----SFTX");
    pub(crate) const DO_STEP:                   Call = call("fmi2DoStep",                         CS,   "----S---");
    pub(crate) const CANCEL_STEP:               Call = call("fmi2CancelStep",                     CS,   "--------");
    pub(crate) const GET_STATUS:                Call = call("fmi2GetStatus",                      CS,   "----SFT-");
    pub(crate) const GET_REAL_STATUS:           Call = call("fmi2GetRealStatus",                  CS,   "----SFT-");
    pub(crate) const GET_INTEGER_STATUS:        Call = call("fmi2GetIntegerStatus",               CS,   "----SFT-");
    pub(crate) const GET_BOOLEAN_STATUS:        Call = call("fmi2GetBooleanStatus",               CS,   "----SFT-");
    pub(crate) const GET_STRING_STATUS:         Call = call("fmi2GetStringStatus",                CS,   "----SFT-");
}
