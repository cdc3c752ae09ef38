//! C types of FMI 2.0, from fmi2TypesPlatform.h and fmi2FunctionTypes.h, and of FMI 3.0, from
//! fmi3FunctionTypes.h.

use serde::{Deserialize, Serialize};
use std::ffi::{c_char, c_int, c_void};

/// C types `fmi2Status` and `fmi3Status`, the result of a call.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[repr(C)]
pub enum FmiStatus {
    /// Status `fmi2OK`: the call succeeded.
    Ok,
    /// Status `fmi2Warning`: the call succeeded with a warning.
    Warning,
    /// Status `fmi2Discard`: the call was refused, and the simulation can go on.
    Discard,
    /// Status `fmi2Error`: the instance cannot go on as it is.
    Error,
    /// Status `fmi2Fatal`: the instance can only be freed.
    Fatal,
    /// Status `fmi2Pending`, which is never returned, because a step is finished when `fmi2DoStep`
    /// returns. FMI 3.0 does not have it.
    Pending,
}

/// C type `fmi2EventInfo`, the result of an event iteration.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C)]
pub struct CEventInfo {
    /// Whether the event iteration must go on.
    pub new_discrete_states_needed: c_int,
    /// Whether the FMU asks for the end of the simulation.
    pub terminate_simulation: c_int,
    /// Whether the event changed nominal values of states.
    pub nominals_of_continuous_states_changed: c_int,
    /// Whether the event changed values of states.
    pub values_of_continuous_states_changed: c_int,
    /// Whether `next_event_time` holds a time.
    pub next_event_time_defined: c_int,
    /// Time of the next time event, s.
    pub next_event_time: f64,
}

/// C type `fmi2CallbackLogger`. It is variadic, but this crate passes no further arguments and
/// messages without `%`. An importer in C++ may throw in it: the exception passes through the call
/// that it made, and the instance can be used further.
pub type LogCallback = unsafe extern "C-unwind" fn(
    *mut c_void,
    *const c_char,
    FmiStatus,
    *const c_char,
    *const c_char,
    ...
);

/// C type `fmi3LogMessageCallback`. Its message is no format.
pub type LogMessageCallback =
    unsafe extern "C-unwind" fn(*mut c_void, FmiStatus, *const c_char, *const c_char);

/// C type `fmi2CallbackFunctions`. The memory and step callbacks are not used and may be null.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct Callbacks {
    /// Function that receives the log messages.
    pub logger: Option<LogCallback>,
    /// Memory allocator of the importer, which is not used.
    pub allocate_memory: Option<unsafe extern "C" fn(usize, usize) -> *mut c_void>,
    /// Memory release of the importer, which is not used.
    pub free_memory: Option<unsafe extern "C" fn(*mut c_void)>,
    /// Notification of a finished step, which is not used because steps are synchronous.
    pub step_finished: Option<unsafe extern "C" fn(*mut c_void, FmiStatus)>,
    /// Pointer that is handed back to the logger.
    pub component_environment: *mut c_void,
}

/// C type `fmi2Type`, the interface for which an instance is used.
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

/// Values of the C type `fmi2StatusKind`, as the importer passes them.
pub(crate) const DO_STEP_STATUS: c_int = 0;
pub(crate) const PENDING_STATUS: c_int = 1;
pub(crate) const LAST_SUCCESSFUL_TIME: c_int = 2;
pub(crate) const TERMINATED: c_int = 3;
