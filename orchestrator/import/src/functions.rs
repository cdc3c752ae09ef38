//! The functions of an FMU's library.

#![allow(unsafe_code)]

use crate::fmi;
use float_environment::in_default;
use libloading::Library;
use std::ffi::{CStr, c_int};
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
    pub(crate) do_step: fmi::DoStep,
    pub(crate) get_real_status: fmi::GetStatus<f64>,
    pub(crate) get_boolean_status: fmi::GetStatus<c_int>,
    /// Optional, because nothing depends on it and some libraries lack it.
    pub(crate) get_version: Option<fmi::GetText>,
    /// Optional, because a new instance does the same.
    pub(crate) reset: Option<fmi::Plain>,
    /// Optional, because FMI asks for them only if the description declares them.
    pub(crate) states: Option<StateFunctions>,
    pub(crate) directional_derivative: Option<fmi::DirectionalDerivative>,
    _library: Library,
}

/// The functions by which an instance keeps its states.
#[derive(Clone, Copy)]
pub(crate) struct StateFunctions {
    pub(crate) get: fmi::StateInPlace,
    pub(crate) set: fmi::SetState,
    pub(crate) free: fmi::StateInPlace,
}

impl StateFunctions {
    /// Returns the functions of a library, if it has all of them.
    ///
    /// # Safety
    /// They must not be called after the library was closed.
    unsafe fn load(library: &Library) -> Option<Self> {
        // SAFETY: FMI 2.0 gives each function the type it is loaded as.
        unsafe {
            Some(Self {
                get: *library.get(b"fmi2GetFMUstate\0").ok()?,
                set: *library.get(b"fmi2SetFMUstate\0").ok()?,
                free: *library.get(b"fmi2FreeFMUstate\0").ok()?,
            })
        }
    }
}

impl Functions {
    pub(crate) fn load(file: &Path) -> Result<Self, libloading::Error> {
        // SAFETY: loading runs the library's own initializers, which are sound only if the library
        // is. Whoever runs an FMU trusts its code. Some leave flushing to zero behind, as those of
        // gcc's option -ffast-math do.
        let library = in_default(|| unsafe { Library::new(file) })?;
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
                do_step: *library.get(b"fmi2DoStep\0")?,
                get_real_status: *library.get(b"fmi2GetRealStatus\0")?,
                get_boolean_status: *library.get(b"fmi2GetBooleanStatus\0")?,
                get_version: library.get(b"fmi2GetVersion\0").ok().map(|function| *function),
                reset: library.get(b"fmi2Reset\0").ok().map(|function| *function),
                states: StateFunctions::load(&library),
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
        let Some(get_version) = self.get_version else {
            return Some("its library has no fmi2GetVersion".into());
        };
        // SAFETY: FMI 2.0 gives the function this type and allows the call at any time.
        let version = text_of(in_default(|| unsafe { get_version() }));
        let is_supported = version == "2.0" || version.starts_with("2.0.");
        (!is_supported)
            .then(|| format!("its library reports version \"{}\" of FMI", version.escape_default()))
    }
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
