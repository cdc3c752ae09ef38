//! The C interface as an importer declares it, from fmi2TypesPlatform.h, fmi2FunctionTypes.h and
//! fmi2Functions.h. It uses nothing of the crate under test.
#![allow(non_snake_case, clippy::missing_safety_doc)]

use std::ffi::{c_char, c_int, c_void};
use std::path::Path;

/// C type `fmi2Component`, a pointer to an instance.
pub type Component = *mut c_void;
/// C type `fmi2FMUstate`, a handle of a saved state.
pub type FmuState = *mut c_void;
/// C type `fmi2String`, a NUL-terminated text.
pub type Text = *const c_char;
/// C type `fmi2Status` as a plain number, because a library may return any value.
pub type Status = c_int;

/// Status `fmi2OK`: the call succeeded.
pub const OK: Status = 0;
/// Status `fmi2Discard`: the call was refused, and the simulation can go on.
pub const DISCARD: Status = 2;
/// Status `fmi2Error`: the instance cannot go on as it is.
pub const ERROR: Status = 3;
/// Status `fmi2Fatal`: the instance cannot be used any more.
pub const FATAL: Status = 4;

/// Interface type `fmi2ModelExchange` of an instance.
pub const MODEL_EXCHANGE: c_int = 0;
/// Interface type `fmi2CoSimulation` of an instance.
pub const CO_SIMULATION: c_int = 1;

/// C type `fmi2EventInfo`, the result of an event iteration.
#[derive(Clone, Copy, Debug, Default)]
#[repr(C)]
#[allow(missing_docs)]
pub struct EventInfo {
    pub new_discrete_states_needed: c_int,
    pub terminate_simulation: c_int,
    pub nominals_of_continuous_states_changed: c_int,
    pub values_of_continuous_states_changed: c_int,
    pub next_event_time_defined: c_int,
    pub next_event_time: f64,
}

/// C type `fmi2CallbackLogger`, which is variadic.
pub type Logger = unsafe extern "C" fn(*mut c_void, Text, Status, Text, Text, ...);

/// C type `fmi2CallbackFunctions`, the callbacks of the importer.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
#[allow(missing_docs)]
pub struct Callbacks {
    pub logger: Option<Logger>,
    pub allocate_memory: Option<unsafe extern "C" fn(usize, usize) -> *mut c_void>,
    pub free_memory: Option<unsafe extern "C" fn(*mut c_void)>,
    pub step_finished: Option<unsafe extern "C" fn(*mut c_void, Status)>,
    pub component_environment: *mut c_void,
}

macro_rules! interface {
    ($($name:ident($($argument:ty),*) -> $result:ty;)*) => {
        /// Functions of one opened library, which stays open with them.
        #[allow(missing_docs)]
        pub struct Interface {
            $(pub $name: unsafe extern "C" fn($($argument),*) -> $result,)*
            // The library comes after the functions, because fields are dropped in order.
            _library: libloading::Library,
        }

        /// Names of the functions of FMI 2.0.
        pub const FUNCTIONS: &[&str] = &[$(stringify!($name)),*];

        impl Interface {
            /// Opens a library that has all functions.
            ///
            /// # Errors
            /// Returns the loader's error, which also names a function that is missing.
            pub fn open(path: &Path) -> Result<Self, libloading::Error> {
                // SAFETY: opening runs the initializers of the library under test, which are
                // trusted here.
                let library = unsafe { libloading::Library::new(path) }?;
                Ok(Self {
                    // SAFETY: the types are those that the standard gives to these names.
                    $($name: *unsafe { library.get(concat!(stringify!($name), "\0").as_bytes()) }?,)*
                    _library: library,
                })
            }
        }
    };
}

interface! {
    fmi2GetTypesPlatform() -> Text;
    fmi2GetVersion() -> Text;
    fmi2SetDebugLogging(Component, c_int, usize, *const Text) -> Status;
    fmi2Instantiate(Text, c_int, Text, Text, *const Callbacks, c_int, c_int) -> Component;
    fmi2FreeInstance(Component) -> ();
    fmi2SetupExperiment(Component, c_int, f64, f64, c_int, f64) -> Status;
    fmi2EnterInitializationMode(Component) -> Status;
    fmi2ExitInitializationMode(Component) -> Status;
    fmi2Terminate(Component) -> Status;
    fmi2Reset(Component) -> Status;
    fmi2GetReal(Component, *const u32, usize, *mut f64) -> Status;
    fmi2GetInteger(Component, *const u32, usize, *mut c_int) -> Status;
    fmi2GetBoolean(Component, *const u32, usize, *mut c_int) -> Status;
    fmi2GetString(Component, *const u32, usize, *mut Text) -> Status;
    fmi2SetReal(Component, *const u32, usize, *const f64) -> Status;
    fmi2SetInteger(Component, *const u32, usize, *const c_int) -> Status;
    fmi2SetBoolean(Component, *const u32, usize, *const c_int) -> Status;
    fmi2SetString(Component, *const u32, usize, *const Text) -> Status;
    fmi2GetFMUstate(Component, *mut FmuState) -> Status;
    fmi2SetFMUstate(Component, FmuState) -> Status;
    fmi2FreeFMUstate(Component, *mut FmuState) -> Status;
    fmi2SerializedFMUstateSize(Component, FmuState, *mut usize) -> Status;
    fmi2SerializeFMUstate(Component, FmuState, *mut c_char, usize) -> Status;
    fmi2DeSerializeFMUstate(Component, *const c_char, usize, *mut FmuState) -> Status;
    fmi2GetDirectionalDerivative(Component, *const u32, usize, *const u32, usize, *const f64, *mut f64) -> Status;
    fmi2EnterEventMode(Component) -> Status;
    fmi2NewDiscreteStates(Component, *mut EventInfo) -> Status;
    fmi2EnterContinuousTimeMode(Component) -> Status;
    fmi2CompletedIntegratorStep(Component, c_int, *mut c_int, *mut c_int) -> Status;
    fmi2SetTime(Component, f64) -> Status;
    fmi2SetContinuousStates(Component, *const f64, usize) -> Status;
    fmi2GetDerivatives(Component, *mut f64, usize) -> Status;
    fmi2GetEventIndicators(Component, *mut f64, usize) -> Status;
    fmi2GetContinuousStates(Component, *mut f64, usize) -> Status;
    fmi2GetNominalsOfContinuousStates(Component, *mut f64, usize) -> Status;
    fmi2SetRealInputDerivatives(Component, *const u32, usize, *const c_int, *const f64) -> Status;
    fmi2GetRealOutputDerivatives(Component, *const u32, usize, *const c_int, *mut f64) -> Status;
    fmi2DoStep(Component, f64, f64, c_int) -> Status;
    fmi2CancelStep(Component) -> Status;
    fmi2GetStatus(Component, c_int, *mut Status) -> Status;
    fmi2GetRealStatus(Component, c_int, *mut f64) -> Status;
    fmi2GetIntegerStatus(Component, c_int, *mut c_int) -> Status;
    fmi2GetBooleanStatus(Component, c_int, *mut c_int) -> Status;
    fmi2GetStringStatus(Component, c_int, *mut Text) -> Status;
}
