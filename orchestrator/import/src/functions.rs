//! The functions of an FMU's library.

#![allow(unsafe_code)]

use crate::fmi;
use float_environment::in_default;
use libloading::Library;
use std::ffi::{CStr, CString, c_int};
use std::path::Path;

/// The FMI functions that this program calls, and the library that holds them.
pub(crate) struct Functions {
    pub(crate) instantiate: fmi::Instantiate,
    pub(crate) free_instance: fmi::FreeInstance,
    pub(crate) setup_experiment: fmi::SetupExperiment,
    pub(crate) enter_initialization_mode: fmi::Plain,
    pub(crate) exit_initialization_mode: fmi::Plain,
    pub(crate) terminate: fmi::Plain,
    pub(crate) get_real: fmi::Get<f64>,
    pub(crate) get_integer: fmi::Get<i32>,
    pub(crate) get_boolean: fmi::Get<i32>,
    pub(crate) set_real: fmi::Set<f64>,
    pub(crate) set_integer: fmi::Set<i32>,
    pub(crate) set_boolean: fmi::Set<i32>,
    pub(crate) set_string: fmi::Set<fmi::Text>,
    pub(crate) interface: InterfaceFunctions,
    /// Optional, because nothing depends on it and some libraries lack it.
    pub(crate) get_version: Option<fmi::GetText>,
    /// Optional, because a new instance does the same.
    pub(crate) reset: Option<fmi::Plain>,
    /// Optional, because FMI asks for them only if the description declares them.
    pub(crate) states: Option<StateFunctions>,
    pub(crate) directional_derivative: Option<fmi::DirectionalDerivative>,
    _library: Library,
}

/// The functions of the interface for which a library is loaded. It may lack those of the other.
#[derive(Clone, Copy)]
pub(crate) enum InterfaceFunctions {
    CoSimulation(StepFunctions),
    ModelExchange(ExchangeFunctions),
}

/// The functions of co-simulation.
#[derive(Clone, Copy)]
pub(crate) struct StepFunctions {
    pub(crate) do_step: fmi::DoStep,
    pub(crate) get_real_status: fmi::GetStatus<f64>,
    pub(crate) get_boolean_status: fmi::GetStatus<c_int>,
}

/// The functions of model exchange.
#[derive(Clone, Copy)]
pub(crate) struct ExchangeFunctions {
    pub(crate) set_time: fmi::SetTime,
    pub(crate) set_states: fmi::SetVector,
    pub(crate) get_states: fmi::GetVector,
    pub(crate) get_nominals: fmi::GetVector,
    pub(crate) get_derivatives: fmi::GetVector,
    pub(crate) get_indicators: fmi::GetVector,
    pub(crate) enter_event_mode: fmi::Plain,
    pub(crate) new_discrete_states: fmi::NewDiscreteStates,
    pub(crate) enter_continuous_time_mode: fmi::Plain,
    pub(crate) completed_integrator_step: fmi::CompletedStep,
}

impl InterfaceFunctions {
    /// Returns the functions of a library.
    ///
    /// # Safety
    /// They must not be called after the library was closed.
    unsafe fn load(library: &Library, exchanges: bool) -> Result<Self, libloading::Error> {
        // SAFETY: FMI 2.0 gives each function the type it is loaded as.
        unsafe {
            if !exchanges {
                return Ok(Self::CoSimulation(StepFunctions {
                    do_step: *library.get(b"fmi2DoStep\0")?,
                    get_real_status: *library.get(b"fmi2GetRealStatus\0")?,
                    get_boolean_status: *library.get(b"fmi2GetBooleanStatus\0")?,
                }));
            }
            Ok(Self::ModelExchange(ExchangeFunctions {
                set_time: *library.get(b"fmi2SetTime\0")?,
                set_states: *library.get(b"fmi2SetContinuousStates\0")?,
                get_states: *library.get(b"fmi2GetContinuousStates\0")?,
                get_nominals: *library.get(b"fmi2GetNominalsOfContinuousStates\0")?,
                get_derivatives: *library.get(b"fmi2GetDerivatives\0")?,
                get_indicators: *library.get(b"fmi2GetEventIndicators\0")?,
                enter_event_mode: *library.get(b"fmi2EnterEventMode\0")?,
                new_discrete_states: *library.get(b"fmi2NewDiscreteStates\0")?,
                enter_continuous_time_mode: *library.get(b"fmi2EnterContinuousTimeMode\0")?,
                completed_integrator_step: *library.get(b"fmi2CompletedIntegratorStep\0")?,
            }))
        }
    }
}

/// The functions by which an instance keeps its states.
#[derive(Clone, Copy)]
pub(crate) struct StateFunctions {
    pub(crate) get: fmi::StateInPlace,
    pub(crate) set: fmi::SetState,
    pub(crate) free: fmi::StateInPlace,
}

impl StateFunctions {
    /// Returns the functions of a library that get, set and free a state, if it has all of them.
    ///
    /// # Safety
    /// They must not be called after the library was closed.
    pub(crate) unsafe fn load(library: &Library, [get, set, free]: [&[u8]; 3]) -> Option<Self> {
        // SAFETY: FMI gives each function the type it is loaded as.
        unsafe {
            Some(Self {
                get: *library.get(get).ok()?,
                set: *library.get(set).ok()?,
                free: *library.get(free).ok()?,
            })
        }
    }
}

/// Functions of one version of FMI, as far as all instances need them.
pub(crate) trait Table {
    /// The major version of FMI.
    const VERSION: u8;
    fn free_instance(&self) -> fmi::FreeInstance;
    fn states(&self) -> Option<StateFunctions>;
}

impl Table for Functions {
    const VERSION: u8 = 2;

    fn free_instance(&self) -> fmi::FreeInstance {
        self.free_instance
    }

    fn states(&self) -> Option<StateFunctions> {
        self.states
    }
}

/// Loads a library.
pub(crate) fn open(file: &Path) -> Result<Library, libloading::Error> {
    // SAFETY: loading runs the library's own initializers, which are sound only if the library is.
    // Whoever runs an FMU trusts its code. Some leave flushing to zero behind, as those of gcc's
    // option -ffast-math do.
    in_default(|| unsafe { Library::new(file) })
}

impl Functions {
    /// Loads a library for model exchange if it `exchanges`, otherwise for co-simulation.
    pub(crate) fn load(file: &Path, exchanges: bool) -> Result<Self, libloading::Error> {
        let library = open(file)?;
        // SAFETY: FMI 2.0 gives each function the type it is loaded as, and `_library` keeps the
        // code loaded as long as the pointers exist.
        unsafe {
            Ok(Self {
                instantiate: *library.get(b"fmi2Instantiate\0")?,
                free_instance: *library.get(b"fmi2FreeInstance\0")?,
                setup_experiment: *library.get(b"fmi2SetupExperiment\0")?,
                enter_initialization_mode: *library.get(b"fmi2EnterInitializationMode\0")?,
                exit_initialization_mode: *library.get(b"fmi2ExitInitializationMode\0")?,
                terminate: *library.get(b"fmi2Terminate\0")?,
                get_real: *library.get(b"fmi2GetReal\0")?,
                get_integer: *library.get(b"fmi2GetInteger\0")?,
                get_boolean: *library.get(b"fmi2GetBoolean\0")?,
                set_real: *library.get(b"fmi2SetReal\0")?,
                set_integer: *library.get(b"fmi2SetInteger\0")?,
                set_boolean: *library.get(b"fmi2SetBoolean\0")?,
                set_string: *library.get(b"fmi2SetString\0")?,
                interface: InterfaceFunctions::load(&library, exchanges)?,
                get_version: library.get(b"fmi2GetVersion\0").ok().map(|function| *function),
                reset: library.get(b"fmi2Reset\0").ok().map(|function| *function),
                states: StateFunctions::load(
                    &library,
                    [b"fmi2GetFMUstate\0", b"fmi2SetFMUstate\0", b"fmi2FreeFMUstate\0"],
                ),
                directional_derivative: library
                    .get(b"fmi2GetDirectionalDerivative\0")
                    .ok()
                    .map(|function| *function),
                _library: library,
            })
        }
    }

    /// Returns a line about the version that the library reports, if it is missing or not FMI 2.0.
    pub(crate) fn version_fault(&self) -> Option<String> {
        version_fault(self.get_version, "fmi2GetVersion", "2.0")
    }
}

/// Returns a line about the version that a library reports by this function, if it is missing or
/// another one. A later revision is not.
pub(crate) fn version_fault(
    get_version: Option<fmi::GetText>,
    name: &str,
    expected: &str,
) -> Option<String> {
    let Some(get_version) = get_version else {
        return Some(format!("its library has no {name}"));
    };
    // SAFETY: FMI gives the function this type and allows the call at any time.
    let version = text_of(in_default(|| unsafe { get_version() }));
    let rest = version.strip_prefix(expected);
    let is_supported = rest.is_some_and(|rest| rest.is_empty() || rest.starts_with('.'));
    (!is_supported)
        .then(|| format!("its library reports version \"{}\" of FMI", version.escape_default()))
}

/// Copies the C string at `text`; a null pointer gives an empty string.
pub(crate) fn text_of(text: fmi::Text) -> String {
    if text.is_null() {
        return String::new();
    }
    // SAFETY: FMI passes strings that end with a zero byte and stay valid during the call; the null
    // pointer was excluded above.
    unsafe { CStr::from_ptr(text) }.to_string_lossy().into_owned()
}

/// Copies texts for C.
pub(crate) fn c_texts<const N: usize>(texts: [&str; N]) -> Result<[CString; N], String> {
    let copy =
        |text: &str| CString::new(text).map_err(|_| format!("\"{text:?}\" contains a zero byte"));
    let copies = texts.into_iter().map(copy).collect::<Result<Vec<_>, _>>()?;
    Ok(copies.try_into().expect("as many copies as texts"))
}
