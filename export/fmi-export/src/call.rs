//! Table of the functions that may be called in each state: FMI 2.0 sections 3.2.3 (model exchange)
//! and 4.2.4 (co-simulation), FMI 3.0 sections 2.3, 3.2.1 and 4.2.1.

use crate::model::Failure;
use crate::types::Interface;
use model_description::Version;
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

/// One function of the interface in both versions of FMI, with the states in which it may be
/// called.
#[derive(Debug)]
pub(crate) struct Call {
    rows: [Row; 2],
    /// Whether a refusal leaves the state as it was instead of changing it to the error state.
    pub(crate) leaves_state: bool,
}

/// A function as one version of FMI has it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Row {
    pub(crate) name: &'static str,
    /// Interface to which the function belongs, or `None` for both.
    pub(crate) interface: Option<Interface>,
    allowed: u16,
}

impl Row {
    pub(crate) fn allowed_in(&self, state: State) -> bool {
        self.allowed & (1 << state as u16) != 0
    }
}

impl Call {
    pub(crate) fn row(&self, version: Version) -> &Row {
        &self.rows[version as usize]
    }

    const fn keeping_state(mut self) -> Self {
        self.leaves_state = true;
        self
    }

    /// Gives the function another name in FMI 3.0.
    const fn named(mut self, name: &'static str) -> Self {
        self.rows[Version::Fmi3 as usize].name = name;
        self
    }

    /// Gives the function another name in FMI 3.0, where it may be called in other states.
    const fn other(mut self, name: &'static str, of: Option<Interface>, columns: &str) -> Self {
        self.rows[Version::Fmi3 as usize] = row(name, of, columns);
        self
    }
}

/// Makes a row of the table of calls. `columns` has a character for every [`State`] but the last,
/// in their order; `-` means that the call is not allowed.
const fn row(name: &'static str, interface: Option<Interface>, columns: &str) -> Row {
    let columns = columns.as_bytes();
    assert!(columns.len() == State::Fatal as usize);
    let (mut allowed, mut i) = (0, 0);
    while i < columns.len() {
        if columns[i] != b'-' {
            allowed |= 1 << i;
        }
        i += 1;
    }
    Row { name, interface, allowed }
}

/// Makes a function that is the same in both versions, or is in one of them only.
const fn call(name: &'static str, interface: Option<Interface>, columns: &str) -> Call {
    Call { rows: [row(name, interface, columns); 2], leaves_state: false }
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
    pub(crate) const SET_DEBUG_LOGGING:         Call = call("fmi2SetDebugLogging",                None, "INECSFTX").named("fmi3SetDebugLogging").keeping_state();
    pub(crate) const SETUP_EXPERIMENT:          Call = call("fmi2SetupExperiment",                None, "I-------");
    pub(crate) const ENTER_INITIALIZATION_MODE: Call = call("fmi2EnterInitializationMode",        None, "I-------").named("fmi3EnterInitializationMode");
    pub(crate) const EXIT_INITIALIZATION_MODE:  Call = call("fmi2ExitInitializationMode",         None, "-N------").named("fmi3ExitInitializationMode");
    pub(crate) const TERMINATE:                 Call = call("fmi2Terminate",                      None, "--ECSF--").named("fmi3Terminate");
    pub(crate) const RESET:                     Call = call("fmi2Reset",                          None, "INECSFTX").named("fmi3Reset");
    pub(crate) const GET_REAL:                  Call = call("fmi2GetReal",                        None, "-NECSFTX").other("fmi3GetFloat64", None, "INECSFTX");
    pub(crate) const GET_INTEGER:               Call = call("fmi2GetInteger",                     None, "-NECSFTX").other("fmi3GetInt32", None, "INECSFTX");
    pub(crate) const GET_BOOLEAN:               Call = call("fmi2GetBoolean",                     None, "-NECSFTX").other("fmi3GetBoolean", None, "INECSFTX");
    pub(crate) const GET_STRING:                Call = call("fmi2GetString",                      None, "-NECSFTX").other("fmi3GetString", None, "INECSFTX");
    pub(crate) const SET_REAL:                  Call = call("fmi2SetReal",                        None, "INECS---").named("fmi3SetFloat64");
    pub(crate) const SET_INTEGER:               Call = call("fmi2SetInteger",                     None, "INE-S---").named("fmi3SetInt32");
    pub(crate) const SET_BOOLEAN:               Call = call("fmi2SetBoolean",                     None, "INE-S---").named("fmi3SetBoolean");
    pub(crate) const SET_STRING:                Call = call("fmi2SetString",                      None, "INE-S---").named("fmi3SetString");
    pub(crate) const GET_FMU_STATE:             Call = call("fmi2GetFMUstate",                    None, "INECSFTX").named("fmi3GetFMUState").keeping_state();
    pub(crate) const SET_FMU_STATE:             Call = call("fmi2SetFMUstate",                    None, "INECSFTX").named("fmi3SetFMUState").keeping_state();
    pub(crate) const FREE_FMU_STATE:            Call = call("fmi2FreeFMUstate",                   None, "INECSFTX").named("fmi3FreeFMUState").keeping_state();
    pub(crate) const SERIALIZED_SIZE:           Call = call("fmi2SerializedFMUstateSize",         None, "INECSFTX").named("fmi3SerializedFMUStateSize").keeping_state();
    pub(crate) const SERIALIZE:                 Call = call("fmi2SerializeFMUstate",              None, "INECSFTX").named("fmi3SerializeFMUState").keeping_state();
    pub(crate) const DESERIALIZE:               Call = call("fmi2DeSerializeFMUstate",            None, "INECSFTX").named("fmi3DeserializeFMUState").keeping_state();
    pub(crate) const DIRECTIONAL_DERIVATIVE:    Call = call("fmi2GetDirectionalDerivative",       None, "-NECSFTX").named("fmi3GetDirectionalDerivative");

    pub(crate) const ENTER_EVENT_MODE:          Call = call("fmi2EnterEventMode",                 ME,   "--EC----").other("fmi3EnterEventMode", None, "--ECS---");
    pub(crate) const NEW_DISCRETE_STATES:       Call = call("fmi2NewDiscreteStates",              ME,   "--E-----").other("fmi3UpdateDiscreteStates", None, "--E-----");
    pub(crate) const ENTER_CONTINUOUS_TIME:     Call = call("fmi2EnterContinuousTimeMode",        ME,   "--E-----").named("fmi3EnterContinuousTimeMode");
    pub(crate) const COMPLETED_STEP:            Call = call("fmi2CompletedIntegratorStep",        ME,   "---C----").named("fmi3CompletedIntegratorStep");
    pub(crate) const SET_TIME:                  Call = call("fmi2SetTime",                        ME,   "--EC----").named("fmi3SetTime");
    pub(crate) const SET_CONTINUOUS_STATES:     Call = call("fmi2SetContinuousStates",            ME,   "---C----").named("fmi3SetContinuousStates");
    pub(crate) const GET_DERIVATIVES:           Call = call("fmi2GetDerivatives",                 ME,   "-NEC--TX").named("fmi3GetContinuousStateDerivatives");
    pub(crate) const GET_EVENT_INDICATORS:      Call = call("fmi2GetEventIndicators",             ME,   "-NEC--TX").named("fmi3GetEventIndicators");
    pub(crate) const GET_CONTINUOUS_STATES:     Call = call("fmi2GetContinuousStates",            ME,   "-NEC--TX").named("fmi3GetContinuousStates");
    pub(crate) const GET_NOMINALS:              Call = call("fmi2GetNominalsOfContinuousStates",  ME,   "I-EC--TX").other("fmi3GetNominalsOfContinuousStates", ME, "INEC--TX");

    pub(crate) const SET_INPUT_DERIVATIVES:     Call = call("fmi2SetRealInputDerivatives",        CS,   "IN--S---");
    pub(crate) const GET_OUTPUT_DERIVATIVES:    Call = call("fmi2GetRealOutputDerivatives",       CS,   "----SFTX");
    pub(crate) const DO_STEP:                   Call = call("fmi2DoStep",                         CS,   "----S---").named("fmi3DoStep");
    pub(crate) const CANCEL_STEP:               Call = call("fmi2CancelStep",                     CS,   "--------");
    pub(crate) const GET_STATUS:                Call = call("fmi2GetStatus",                      CS,   "----SFT-");
    pub(crate) const GET_REAL_STATUS:           Call = call("fmi2GetRealStatus",                  CS,   "----SFT-");
    pub(crate) const GET_INTEGER_STATUS:        Call = call("fmi2GetIntegerStatus",               CS,   "----SFT-");
    pub(crate) const GET_BOOLEAN_STATUS:        Call = call("fmi2GetBooleanStatus",               CS,   "----SFT-");
    pub(crate) const GET_STRING_STATUS:         Call = call("fmi2GetStringStatus",                CS,   "----SFT-");

    // In FMI 3.0 only.
    pub(crate) const GET_INT64:                 Call = call("fmi3GetInt64",                       None, "INECSFTX");
    pub(crate) const SET_INT64:                 Call = call("fmi3SetInt64",                       None, "INE-S---");
    pub(crate) const ADJOINT_DERIVATIVE:        Call = call("fmi3GetAdjointDerivative",           None, "-NECSFTX");
    pub(crate) const NUMBER_OF_INDICATORS:      Call = call("fmi3GetNumberOfEventIndicators",     ME,   "INEC--TX");
    pub(crate) const NUMBER_OF_STATES:          Call = call("fmi3GetNumberOfContinuousStates",    ME,   "INEC--TX");
    pub(crate) const ENTER_STEP_MODE:           Call = call("fmi3EnterStepMode",                  CS,   "--E-----");
}

/// Makes the call of a function of FMI 3.0 that needs what no FMU has, such as clocks. It is
/// refused wherever it is called, and leaves the state as it was.
pub(crate) const fn without_use(name: &'static str) -> Call {
    call(name, None, "INECSFTX").keeping_state()
}
