//! The functions of a library of FMI 3.0.

#![allow(unsafe_code)]

use crate::fmi::{self, Handle, Text};
use crate::functions::{Common, Completed, EventInfo, NOT_OFFERED, Symbols, Table, functions};
use fmi_master::description::ScalarType;
use std::ffi::{c_int, c_void};
use std::path::Path;

/// Receives a message: the environment, the status, the category and the text.
pub(super) type LogMessage = unsafe extern "C" fn(*mut c_void, c_int, Text, Text);
/// Type of the function fmi3InstantiateCoSimulation. The arguments are name, token, path of the
/// resources, visibility, logging, use of event mode, permission of early return, variables of
/// intermediate updates and their number, environment, and callbacks for messages and for
/// intermediate updates.
type InstantiateCoSimulation = unsafe extern "C" fn(
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
/// A truth value that a unit writes, which may be any byte and not only those of a Rust `bool`.
pub(super) type Truth = u8;
/// Type of the function fmi3InstantiateModelExchange. The arguments are name, token, path of the
/// resources, visibility, logging, environment, and the callback for messages.
type InstantiateModelExchange =
    unsafe extern "C" fn(Text, Text, Text, bool, bool, *mut c_void, LogMessage) -> Handle;
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
type UpdateDiscreteStates = unsafe extern "C" fn(
    Handle,
    *mut Truth,
    *mut Truth,
    *mut Truth,
    *mut Truth,
    *mut Truth,
    *mut f64,
) -> c_int;
/// Type of the function fmi3CompletedIntegratorStep. The argument is whether the state before the
/// step will never be restored; the results are whether there is an event, and whether the
/// simulation ends.
type CompletedStep = unsafe extern "C" fn(Handle, bool, *mut Truth, *mut Truth) -> c_int;
/// Type of the function fmi3DoStep. The arguments are the time, the step, and whether the state
/// before the step will never be restored; the results are whether an event is to be handled,
/// whether the simulation ends, whether the step ended early, and the time that was reached.
pub(super) type DoStep = unsafe extern "C" fn(
    Handle,
    f64,
    f64,
    bool,
    *mut Truth,
    *mut Truth,
    *mut Truth,
    *mut f64,
) -> c_int;

/// The functions of FMI 3.0 that this program calls.
pub(crate) struct Functions {
    pub(super) enter_initialization_mode: EnterInitialization,
    update_discrete_states: UpdateDiscreteStates,
    pub(super) get: [Option<Access>; ACCESS.len()],
    pub(super) set: [Option<Access>; ACCESS.len()],
    pub(super) interface: InterfaceFunctions,
    common: Common,
}

/// The functions of the interface for which a library is loaded. It may lack those of the other.
#[derive(Clone, Copy)]
pub(super) enum InterfaceFunctions {
    CoSimulation(StepFunctions),
    ModelExchange(EventFunctions),
}

functions! {
    /// The functions of co-simulation.
    StepFunctions {
        instantiate: InstantiateCoSimulation = "InstantiateCoSimulation",
        enter_event_mode: fmi::Plain = "EnterEventMode",
        enter_step_mode: fmi::Plain = "EnterStepMode",
        do_step: DoStep = "DoStep",
    }
}

functions! {
    /// The functions of model exchange with types of FMI 3.0.
    EventFunctions {
        instantiate: InstantiateModelExchange = "InstantiateModelExchange",
        completed: CompletedStep = "CompletedIntegratorStep",
    }
}

/// Functions that get and set values of a type, and the names of the calls in failures.
macro_rules! access {
    ($($scalar:ident)*) => {
        [$([
            (concat!("Get", stringify!($scalar)), concat!("get", stringify!($scalar))),
            (concat!("Set", stringify!($scalar)), concat!("set", stringify!($scalar))),
        ]),*]
    };
}

/// Functions of the types whose values are transferred, in the order of [`ScalarType`].
const ACCESS: [[(&str, &str); 2]; 12] = access!(
    Float64 Float32 Int8 UInt8 Int16 UInt16 Int32 UInt32 Int64 UInt64 Boolean String
);

/// Returns the name of the call that gets or sets values of a type.
pub(super) fn call(scalar: ScalarType, sets: bool) -> &'static str {
    ACCESS[scalar as usize][usize::from(sets)].1
}

impl Functions {
    /// Loads a library for model exchange if it `exchanges`, otherwise for co-simulation.
    pub(crate) fn load(file: &Path, exchanges: bool) -> Result<Self, libloading::Error> {
        let symbols = Symbols::open(file, Self::VERSION)?;
        // SAFETY: FMI 3.0 gives each function the type it is loaded as, except for the type of the
        // values that are got or set, and `common` keeps the code loaded as long as the pointers
        // exist.
        unsafe {
            let interface = if exchanges {
                InterfaceFunctions::ModelExchange(EventFunctions::load(&symbols)?)
            } else {
                InterfaceFunctions::CoSimulation(StepFunctions::load(&symbols)?)
            };
            Ok(Self {
                enter_initialization_mode: symbols.get("EnterInitializationMode")?,
                update_discrete_states: symbols.get("UpdateDiscreteStates")?,
                get: ACCESS.map(|[(name, _), _]| symbols.get(name).ok()),
                set: ACCESS.map(|[_, (name, _)]| symbols.get(name).ok()),
                interface,
                common: Common::load(symbols, exchanges)?,
            })
        }
    }
}

impl Table for Functions {
    const VERSION: u8 = 3;
    const DERIVATIVES: &'static str = "getContinuousStateDerivatives";
    const UPDATE: &'static str = "updateDiscreteStates";

    fn common(&self) -> &Common {
        &self.common
    }

    unsafe fn update(&self, handle: Handle) -> (EventInfo, c_int) {
        let ([mut again, mut ends, mut nominals, mut states, mut announces], mut next) =
            ([Truth::MIN; 5], f64::NAN);
        // SAFETY: FMI gives the function this type, and the pointers are valid for the call.
        let status = unsafe {
            (self.update_discrete_states)(
                handle,
                &raw mut again,
                &raw mut ends,
                &raw mut nominals,
                &raw mut states,
                &raw mut announces,
                &raw mut next,
            )
        };
        let info = EventInfo {
            needs_another: again != 0,
            terminates: ends != 0,
            changes_nominals: nominals != 0,
            changes_states: states != 0,
            next_event: (announces != 0).then_some(next),
        };
        (info, status)
    }

    unsafe fn complete_step(&self, handle: Handle) -> (Completed, c_int) {
        let InterfaceFunctions::ModelExchange(functions) = self.interface else {
            return (Completed::default(), NOT_OFFERED);
        };
        let [mut enters, mut ends] = [Truth::MIN; 2];
        // SAFETY: FMI gives the function this type, and both pointers are valid for the call.
        let status = unsafe { (functions.completed)(handle, true, &raw mut enters, &raw mut ends) };
        (Completed { enters_event_mode: enters != 0, terminates: ends != 0 }, status)
    }
}
