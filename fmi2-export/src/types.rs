//! The C types of FMI 2.0 (fmi2TypesPlatform.h, fmi2FunctionTypes.h).

use serde::{Deserialize, Serialize};
use std::ffi::{c_char, c_int, c_void};

/// `fmi2Status`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[repr(C)]
pub enum Status {
    /// `fmi2OK`
    Ok,
    /// `fmi2Warning`
    Warning,
    /// `fmi2Discard`
    Discard,
    /// `fmi2Error`
    Error,
    /// `fmi2Fatal`
    Fatal,
    /// `fmi2Pending`: never returned, every step is done when `fmi2DoStep` returns.
    Pending,
}

/// `fmi2EventInfo`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C)]
pub struct CEventInfo {
    /// Whether the event iteration goes on.
    pub new_discrete_states_needed: c_int,
    /// Whether the unit asks for the end of the simulation.
    pub terminate_simulation: c_int,
    /// Whether nominal values of states changed.
    pub nominals_of_continuous_states_changed: c_int,
    /// Whether states changed.
    pub values_of_continuous_states_changed: c_int,
    /// Whether the next field holds a time.
    pub next_event_time_defined: c_int,
    /// Time of the next time event, s.
    pub next_event_time: f64,
}

/// `fmi2CallbackLogger`; variadic, but this crate passes no further arguments and messages without `%`.
pub type LogCallback =
    unsafe extern "C" fn(*mut c_void, *const c_char, Status, *const c_char, *const c_char, ...);

/// `fmi2CallbackFunctions`. Memory and step callbacks are not used and may be null.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct Callbacks {
    /// Receives log messages.
    pub logger: Option<LogCallback>,
    /// Not used.
    pub allocate_memory: Option<unsafe extern "C" fn(usize, usize) -> *mut c_void>,
    /// Not used.
    pub free_memory: Option<unsafe extern "C" fn(*mut c_void)>,
    /// Not used: steps are synchronous.
    pub step_finished: Option<unsafe extern "C" fn(*mut c_void, Status)>,
    /// Handed back to the logger.
    pub component_environment: *mut c_void,
}

/// `fmi2Type`: what an instance is used for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Interface {
    ModelExchange,
    CoSimulation,
}

impl Interface {
    pub(crate) fn from_c(fmu_type: c_int) -> Option<Self> {
        match fmu_type {
            0 => Some(Self::ModelExchange),
            1 => Some(Self::CoSimulation),
            _ => None,
        }
    }
}

/// `fmi2StatusKind` as the importer passes it.
pub(crate) const DO_STEP_STATUS: c_int = 0;
pub(crate) const PENDING_STATUS: c_int = 1;
pub(crate) const LAST_SUCCESSFUL_TIME: c_int = 2;
pub(crate) const TERMINATED: c_int = 3;
