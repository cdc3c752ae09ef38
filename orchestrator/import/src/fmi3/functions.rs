//! The functions of a library of FMI 3.0.

#![allow(unsafe_code)]

use crate::fmi::{self, Handle, Text};
use crate::functions::{self, StateFunctions, Table};
use fmi_master::description::ScalarType;
use libloading::Library;
use std::ffi::{c_int, c_void};
use std::path::Path;

/// Receives a message: the environment, the status, the category and the text.
pub(super) type LogMessage = unsafe extern "C" fn(*mut c_void, c_int, Text, Text);
/// Type of the function fmi3InstantiateCoSimulation. The arguments are name, token, path of the
/// resources, visibility, logging, use of event mode, permission of early return, variables of
/// intermediate updates and their number, environment, and callbacks for messages and for
/// intermediate updates.
pub(super) type Instantiate = unsafe extern "C" fn(
    Text,
    Text,
    Text,
    bool,
    bool,
    bool,
    bool,
    *const u32,
    usize,
    *mut c_void,
    LogMessage,
    *const c_void,
) -> Handle;
/// Type of the function fmi3EnterInitializationMode. The arguments are whether there is a
/// tolerance, the tolerance, the start time, whether there is a stop time, and the stop time.
pub(super) type EnterInitialization =
    unsafe extern "C" fn(Handle, bool, f64, f64, bool, f64) -> c_int;
/// Type of the functions that get or set values of a type, which is not that of C here. The
/// arguments are the value references, their number, the values, and their number.
pub(super) type Access =
    unsafe extern "C" fn(Handle, *const u32, usize, *mut c_void, usize) -> c_int;
/// Type of the function fmi3UpdateDiscreteStates. The results are whether another update is needed,
/// whether the simulation ends, whether nominal values and values of states have changed, whether
/// the time of the next event is known, and that time.
pub(super) type UpdateDiscreteStates = unsafe extern "C" fn(
    Handle,
    *mut bool,
    *mut bool,
    *mut bool,
    *mut bool,
    *mut bool,
    *mut f64,
) -> c_int;
/// Type of the function fmi3DoStep. The arguments are the time, the step, and whether the state
/// before the step will never be restored; the results are whether an event is to be handled,
/// whether the simulation ends, whether the step ended early, and the time that was reached.
pub(super) type DoStep = unsafe extern "C" fn(
    Handle,
    f64,
    f64,
    bool,
    *mut bool,
    *mut bool,
    *mut bool,
    *mut f64,
) -> c_int;
/// Type of the function fmi3GetDirectionalDerivative. The arguments are the unknown and the known
/// variables, the seed and the result, each with the number of its elements.
pub(super) type DirectionalDerivative = unsafe extern "C" fn(
    Handle,
    *const u32,
    usize,
    *const u32,
    usize,
    *const f64,
    usize,
    *mut f64,
    usize,
) -> c_int;

/// The functions that this program calls, and the library that holds them.
pub(crate) struct Functions {
    pub(super) instantiate: Instantiate,
    free_instance: fmi::FreeInstance,
    pub(super) enter_initialization_mode: EnterInitialization,
    pub(super) exit_initialization_mode: fmi::Plain,
    pub(super) enter_event_mode: fmi::Plain,
    pub(super) update_discrete_states: UpdateDiscreteStates,
    pub(super) enter_step_mode: fmi::Plain,
    pub(super) do_step: DoStep,
    pub(super) terminate: fmi::Plain,
    pub(super) reset: fmi::Plain,
    pub(super) get: [Option<Access>; ACCESS.len()],
    pub(super) set: [Option<Access>; ACCESS.len()],
    pub(super) directional_derivative: Option<DirectionalDerivative>,
    states: Option<StateFunctions>,
    get_version: Option<fmi::GetText>,
    _library: Library,
}

/// Functions that get and set values of a type, and the names of the calls in failures.
macro_rules! access {
    ($($scalar:ident)*) => {
        [$([
            (concat!("fmi3Get", stringify!($scalar), "\0"), concat!("get", stringify!($scalar))),
            (concat!("fmi3Set", stringify!($scalar), "\0"), concat!("set", stringify!($scalar))),
        ]),*]
    };
}

/// Functions of the types whose values are transferred, in the order of [`ScalarType`].
const ACCESS: [[(&str, &str); 2]; 12] = access!(
    Float64 Float32 Int8 UInt8 Int16 UInt16 Int32 UInt32 Int64 UInt64 Boolean String
);
const STATES: [&[u8]; 3] = [b"fmi3GetFMUState\0", b"fmi3SetFMUState\0", b"fmi3FreeFMUState\0"];

/// Returns the name of the call that gets or sets values of a type.
pub(super) fn call(scalar: ScalarType, sets: bool) -> &'static str {
    ACCESS[scalar as usize][usize::from(sets)].1
}

impl Functions {
    pub(crate) fn load(file: &Path) -> Result<Self, libloading::Error> {
        let library = functions::open(file)?;
        let access = |place: usize| {
            // SAFETY: FMI 3.0 gives these functions this type, except for that of the values.
            ACCESS.map(|names| unsafe { library.get(names[place].0.as_bytes()) }.ok().map(|f| *f))
        };
        let (get, set) = (access(0), access(1));
        // SAFETY: FMI 3.0 gives each function the type it is loaded as, and `_library` keeps the
        // code loaded as long as the pointers exist.
        unsafe {
            Ok(Self {
                instantiate: *library.get(b"fmi3InstantiateCoSimulation\0")?,
                free_instance: *library.get(b"fmi3FreeInstance\0")?,
                enter_initialization_mode: *library.get(b"fmi3EnterInitializationMode\0")?,
                exit_initialization_mode: *library.get(b"fmi3ExitInitializationMode\0")?,
                enter_event_mode: *library.get(b"fmi3EnterEventMode\0")?,
                update_discrete_states: *library.get(b"fmi3UpdateDiscreteStates\0")?,
                enter_step_mode: *library.get(b"fmi3EnterStepMode\0")?,
                do_step: *library.get(b"fmi3DoStep\0")?,
                terminate: *library.get(b"fmi3Terminate\0")?,
                reset: *library.get(b"fmi3Reset\0")?,
                get,
                set,
                directional_derivative: library
                    .get(b"fmi3GetDirectionalDerivative\0")
                    .ok()
                    .map(|function| *function),
                states: StateFunctions::load(&library, STATES),
                get_version: library.get(b"fmi3GetVersion\0").ok().map(|function| *function),
                _library: library,
            })
        }
    }

    /// Returns a line about the version that the library reports, if it is missing or not FMI 3.
    pub(crate) fn version_fault(&self) -> Option<String> {
        functions::version_fault(self.get_version, "fmi3GetVersion", "3")
    }
}

impl Table for Functions {
    const VERSION: u8 = 3;

    fn free_instance(&self) -> fmi::FreeInstance {
        self.free_instance
    }

    fn states(&self) -> Option<StateFunctions> {
        self.states
    }
}
