//! The types of FMI 2.0's C interface as the master uses them, of which FMI 3.0 has many as well.
//! Values that an instance returns are taken as the integers that C passes: an instance may return
//! anything, and a Rust enumeration must not hold a value that is none of its items.

pub(crate) use fmi_rs::fmi2::types::{
    fmi2False as FALSE, fmi2Status as Status, fmi2StatusKind, fmi2True as TRUE, fmi2Type,
};
use std::ffi::{c_char, c_int, c_uint, c_void};

/// VariableKind of an instance for co-simulation, fmi2CoSimulation.
pub(crate) const CO_SIMULATION: c_int = fmi2Type::CoSimulation as c_int;
/// Kind of an instance for model exchange, fmi2ModelExchange.
pub(crate) const MODEL_EXCHANGE: c_int = fmi2Type::ModelExchange as c_int;
/// VariableKind of the status fmi2LastSuccessfulTime.
pub(crate) const LAST_SUCCESSFUL_TIME: c_int = fmi2StatusKind::LastSuccessfulTime as c_int;
/// VariableKind of the status fmi2Terminated.
pub(crate) const TERMINATED: c_int = fmi2StatusKind::Terminated as c_int;

/// Converts the integer that a call returned into a status.
///
/// # Errors
/// The integer itself, if FMI 2.0 defines no such status.
#[inline]
pub(crate) fn status(code: c_int) -> Result<Status, c_int> {
    Status::try_from(code).map_err(|()| code)
}

/// Formats the status that a call returned, as this version of FMI calls it.
pub(crate) fn name_of(status: Result<Status, c_int>, version: u8) -> String {
    match status {
        Ok(status) => format!("{status:?}").replace('2', &version.to_string()),
        Err(code) => format!("status {code}, which FMI {version}.0 does not have"),
    }
}

/// Pointer to an instance, which FMI calls fmi2Component.
pub(crate) type Handle = *mut c_void;
/// Pointer to a C string that ends with a zero byte.
pub(crate) type Text = *const c_char;
/// Type of the logger callback, which receives messages whose `printf` arguments are already
/// expanded.
pub(crate) type Logger = unsafe extern "C" fn(*mut c_void, Text, c_int, Text, Text);

/// The callback structure of FMI 2.0, fmi2CallbackFunctions.
#[repr(C)]
pub(crate) struct Callbacks {
    /// Receives the log messages of the instance.
    pub logger: Logger,
    /// Allocates zeroed memory, given the number and the size of objects.
    pub allocate: Option<unsafe extern "C" fn(usize, usize) -> *mut c_void>,
    /// Frees memory that `allocate` returned.
    pub free: Option<unsafe extern "C" fn(*mut c_void)>,
    /// Reports the end of an asynchronous step.
    pub step_finished: Option<unsafe extern "C" fn(*mut c_void, c_int)>,
    /// Pointer that is passed to the callbacks unchanged.
    pub environment: *mut c_void,
}

/// Type of the functions fmi2GetVersion and fmi2GetTypesPlatform.
pub(crate) type GetText = unsafe extern "C" fn() -> Text;
/// Type of the function fmi2Instantiate. The arguments are name, type, GUID, resources, callbacks,
/// visibility and logging.
pub(crate) type Instantiate =
    unsafe extern "C" fn(Text, c_int, Text, Text, *const Callbacks, c_int, c_int) -> Handle;
/// Type of the function fmi2FreeInstance.
pub(crate) type FreeInstance = unsafe extern "C" fn(Handle);
/// Type of the function fmi2SetupExperiment. The arguments are whether there is a tolerance, the
/// tolerance, the start time, whether there is a stop time, and the stop time.
pub(crate) type SetupExperiment =
    unsafe extern "C" fn(Handle, c_int, f64, f64, c_int, f64) -> c_int;
/// Type of the functions fmi2EnterInitializationMode, fmi2ExitInitializationMode, fmi2Terminate and
/// fmi2Reset.
pub(crate) type Plain = unsafe extern "C" fn(Handle) -> c_int;
/// Type of the functions fmi2GetReal, fmi2GetInteger and fmi2GetBoolean. The arguments are the
/// value references, their number, and the values.
pub(crate) type Get<T> = unsafe extern "C" fn(Handle, *const c_uint, usize, *mut T) -> c_int;
/// Type of the functions fmi2SetReal, fmi2SetInteger, fmi2SetBoolean and fmi2SetString.
pub(crate) type Set<T> = unsafe extern "C" fn(Handle, *const c_uint, usize, *const T) -> c_int;
/// Type of the function fmi2DoStep. The arguments are the time, the step, and whether the state
/// before the step will never be restored.
pub(crate) type DoStep = unsafe extern "C" fn(Handle, f64, f64, c_int) -> c_int;
/// Type of the functions fmi2GetRealStatus and fmi2GetBooleanStatus. The arguments are the kind of
/// the status and its value.
pub(crate) type GetStatus<T> = unsafe extern "C" fn(Handle, c_int, *mut T) -> c_int;

/// Type of the function fmi2SetTime.
pub(crate) type SetTime = unsafe extern "C" fn(Handle, f64) -> c_int;
/// Type of the function fmi2SetContinuousStates. The arguments are the values and their number.
pub(crate) type SetVector = unsafe extern "C" fn(Handle, *const f64, usize) -> c_int;
/// Type of the functions fmi2GetContinuousStates, fmi2GetDerivatives, fmi2GetEventIndicators and
/// fmi2GetNominalsOfContinuousStates.
pub(crate) type GetVector = unsafe extern "C" fn(Handle, *mut f64, usize) -> c_int;
/// Type of the function fmi2NewDiscreteStates.
pub(crate) type NewDiscreteStates = unsafe extern "C" fn(Handle, *mut EventInfo) -> c_int;
/// Type of the function fmi2CompletedIntegratorStep. The arguments are whether the state before
/// the step will never be restored, whether there is an event, and whether the simulation ends.
pub(crate) type CompletedStep =
    unsafe extern "C" fn(Handle, c_int, *mut c_int, *mut c_int) -> c_int;

/// The structure fmi2EventInfo.
#[derive(Default)]
#[repr(C)]
pub(crate) struct EventInfo {
    pub new_discrete_states_needed: c_int,
    pub terminate_simulation: c_int,
    pub nominals_of_states_changed: c_int,
    pub values_of_states_changed: c_int,
    pub next_event_time_defined: c_int,
    pub next_event_time: f64,
}

/// Pointer to a state that an instance keeps, which FMI calls fmi2FMUstate.
pub(crate) type StateHandle = *mut c_void;
/// Type of the functions fmi2GetFMUstate and fmi2FreeFMUstate.
pub(crate) type StateInPlace = unsafe extern "C" fn(Handle, *mut StateHandle) -> c_int;
/// Type of the function fmi2SetFMUstate.
pub(crate) type SetState = unsafe extern "C" fn(Handle, StateHandle) -> c_int;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_status_that_fmi_does_not_have_is_kept_as_a_number() {
        assert_eq!(status(2), Ok(Status::Discard));
        assert_eq!(name_of(status(-7), 2), "status -7, which FMI 2.0 does not have");
        assert_eq!(name_of(status(4), 2), "fmi2Fatal");
        assert_eq!(name_of(status(3), 3), "fmi3Error");
    }
}
