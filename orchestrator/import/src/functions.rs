//! The functions of an FMU's library.

#![allow(unsafe_code)]

use crate::fmi;
use float_environment::in_default;
use libloading::Library;
use std::ffi::{CStr, CString, c_int};
use std::path::Path;

/// Declares functions, each with its type and with its name in all versions of FMI, or in FMI 2 and
/// FMI 3.
macro_rules! functions {
    ($(#[$doc:meta])* $name:ident { $($field:ident: $type:ty = $symbol:literal $(/ $later:literal)?,)+ }) => {
        $(#[$doc])*
        #[derive(Clone, Copy)]
        pub(crate) struct $name {
            $(pub(crate) $field: $type,)+
        }

        impl $name {
            /// Returns the functions of a library.
            ///
            /// # Safety
            /// They must not be called after the library was closed.
            pub(crate) unsafe fn load(
                symbols: &$crate::functions::Symbols,
            ) -> Result<Self, libloading::Error> {
                // SAFETY: FMI gives each function the type it is loaded as.
                unsafe { Ok(Self { $($field: symbols.named(&[$symbol $(, $later)?])?,)+ }) }
            }
        }
    };
}
pub(crate) use functions;

/// The functions of FMI 2.0 that this program calls.
pub(crate) struct Functions {
    pub(crate) own: OwnFunctions,
    /// Optional, because FMI asks for it only if the description declares it.
    pub(crate) interface: InterfaceFunctions,
    common: Common,
}

functions! {
    /// The functions of FMI 2.0 that every library has, beside those of all versions.
    OwnFunctions {
        instantiate: fmi::Instantiate = "Instantiate",
        setup_experiment: fmi::SetupExperiment = "SetupExperiment",
        enter_initialization_mode: fmi::Plain = "EnterInitializationMode",
        get_real: fmi::Get<f64> = "GetReal",
        get_integer: fmi::Get<i32> = "GetInteger",
        get_boolean: fmi::Get<i32> = "GetBoolean",
        set_real: fmi::Set<f64> = "SetReal",
        set_integer: fmi::Set<i32> = "SetInteger",
        set_boolean: fmi::Set<i32> = "SetBoolean",
        set_string: fmi::Set<fmi::Text> = "SetString",
    }
}

/// The functions of the interface for which a library is loaded. It may lack those of the other.
#[derive(Clone, Copy)]
pub(crate) enum InterfaceFunctions {
    CoSimulation(StepFunctions),
    ModelExchange(EventFunctions),
}

functions! {
    /// The functions of co-simulation.
    StepFunctions {
        do_step: fmi::DoStep = "DoStep",
        get_real_status: fmi::GetStatus<f64> = "GetRealStatus",
        get_boolean_status: fmi::GetStatus<c_int> = "GetBooleanStatus",
    }
}

functions! {
    /// The functions of model exchange with types of FMI 2.0.
    EventFunctions {
        new_discrete_states: fmi::NewDiscreteStates = "NewDiscreteStates",
        completed: fmi::CompletedStep = "CompletedIntegratorStep",
    }
}

/// The functions that have the same types in all versions of FMI, and the library that holds them.
pub(crate) struct Common {
    pub(crate) free_instance: fmi::FreeInstance,
    pub(crate) exit_initialization_mode: fmi::Plain,
    pub(crate) terminate: fmi::Plain,
    /// Optional, because a new instance does the same.
    pub(crate) reset: Option<fmi::Plain>,
    /// Optional, because FMI asks for them only if the description declares them.
    pub(crate) states: Option<StateFunctions>,
    /// Functions of model exchange, for which the library is loaded then.
    pub(crate) exchange: Option<ExchangeFunctions>,
    /// Optional, because nothing depends on it and some libraries lack it.
    get_version: Option<fmi::GetText>,
    symbols: Symbols,
}

functions! {
    /// The functions of model exchange that have the same types in all versions of FMI.
    ExchangeFunctions {
        set_time: fmi::SetTime = "SetTime",
        set_states: fmi::SetVector = "SetContinuousStates",
        get_states: fmi::GetVector = "GetContinuousStates",
        get_nominals: fmi::GetVector = "GetNominalsOfContinuousStates",
        get_derivatives: fmi::GetVector = "GetDerivatives" / "GetContinuousStateDerivatives",
        get_indicators: fmi::GetVector = "GetEventIndicators",
        enter_event_mode: fmi::Plain = "EnterEventMode",
        enter_continuous_time_mode: fmi::Plain = "EnterContinuousTimeMode",
    }
}

functions! {
    /// The functions by which an instance keeps its states.
    StateFunctions {
        get: fmi::StateInPlace = "GetFMUstate" / "GetFMUState",
        set: fmi::SetState = "SetFMUstate" / "SetFMUState",
        free: fmi::StateInPlace = "FreeFMUstate" / "FreeFMUState",
    }
}

/// A library, whose functions begin with the version of FMI.
pub(crate) struct Symbols {
    library: Library,
    version: u8,
}

impl Symbols {
    /// Loads a library.
    pub(crate) fn open(file: &Path, version: u8) -> Result<Self, libloading::Error> {
        // SAFETY: loading runs the library's own initializers, which are sound only if the library
        // is. Whoever runs an FMU trusts its code. Some leave flushing to zero behind, as those of
        // gcc's option -ffast-math do.
        in_default(|| unsafe { Library::new(file) }).map(|library| Self { library, version })
    }

    /// Returns a function by its names in FMI 2 and FMI 3, if they differ.
    ///
    /// # Safety
    /// As for [`Self::get`].
    pub(crate) unsafe fn named<T: Copy>(&self, names: &[&str]) -> Result<T, libloading::Error> {
        let place = usize::from(self.version > 2).min(names.len() - 1);
        // SAFETY: as above.
        unsafe { self.get(names[place]) }
    }

    /// Returns a function by its name without `fmi2` or `fmi3`.
    ///
    /// # Safety
    /// The function must have this type, and must not be called after the library was closed.
    pub(crate) unsafe fn get<T: Copy>(&self, name: &str) -> Result<T, libloading::Error> {
        let name = format!("fmi{}{name}\0", self.version);
        // SAFETY: as above.
        unsafe { self.library.get(name.as_bytes()) }.map(|function| *function)
    }
}

impl Common {
    /// Loads the functions, with those of model exchange if it `exchanges`.
    pub(crate) fn load(symbols: Symbols, exchanges: bool) -> Result<Self, libloading::Error> {
        // SAFETY: FMI gives each function the type it is loaded as, and `symbols` keeps the code
        // loaded as long as the pointers exist.
        unsafe {
            Ok(Self {
                free_instance: symbols.get("FreeInstance")?,
                exit_initialization_mode: symbols.get("ExitInitializationMode")?,
                terminate: symbols.get("Terminate")?,
                reset: symbols.get("Reset").ok(),
                states: StateFunctions::load(&symbols).ok(),
                exchange: exchanges.then(|| ExchangeFunctions::load(&symbols)).transpose()?,
                get_version: symbols.get("GetVersion").ok(),
                symbols,
            })
        }
    }

    /// Returns a line about the version that the library reports, if it is missing or another one.
    /// A later revision is not.
    pub(crate) fn version_fault(&self) -> Option<String> {
        let version = self.symbols.version;
        let Some(get_version) = self.get_version else {
            return Some(format!("its library has no fmi{version}GetVersion"));
        };
        // SAFETY: FMI gives the function this type and allows the call at any time.
        let reported = text_of(in_default(|| unsafe { get_version() }));
        let rest = reported.strip_prefix(if version == 2 { "2.0" } else { "3" });
        let is_supported = rest.is_some_and(|rest| rest.is_empty() || rest.starts_with('.'));
        (!is_supported).then(|| {
            format!("its library reports version \"{}\" of FMI", reported.escape_default())
        })
    }
}

/// Result of an update of the discrete states.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[expect(clippy::struct_excessive_bools, reason = "FMI defines these flags")]
pub(crate) struct EventInfo {
    /// Whether the discrete states must be updated again.
    pub(crate) needs_another: bool,
    /// Whether the simulation has to end.
    pub(crate) terminates: bool,
    /// Whether the nominal values of the continuous states have changed.
    pub(crate) changes_nominals: bool,
    /// Whether the continuous states have changed.
    pub(crate) changes_states: bool,
    /// Time of the next time event, s.
    pub(crate) next_event: Option<f64>,
}

/// Answer to a completed step of the integrator.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Completed {
    /// Whether there is an event at the end of the step.
    pub(crate) enters_event_mode: bool,
    /// Whether the simulation has to end.
    pub(crate) terminates: bool,
}

/// Functions of one version of FMI, as far as all instances need them.
pub(crate) trait Table {
    /// The major version of FMI.
    const VERSION: u8;
    /// Names of the calls that compute derivatives and update discrete states, in failures.
    const DERIVATIVES: &'static str;
    const UPDATE: &'static str;

    fn common(&self) -> &Common;

    /// Updates the discrete states of an instance. Returns the result and the status.
    ///
    /// # Safety
    /// The instance must be one of the library.
    unsafe fn update(&self, handle: fmi::Handle) -> (EventInfo, c_int);

    /// Tells an instance that a step of the integrator is complete. Returns the answer and the
    /// status.
    ///
    /// # Safety
    /// The instance must be one of the library.
    unsafe fn complete_step(&self, handle: fmi::Handle) -> (Completed, c_int);
}

/// Status of a call that the interface of the instance does not have.
pub(crate) const NOT_OFFERED: c_int = fmi::Status::Error as c_int;

impl Table for Functions {
    const VERSION: u8 = 2;
    const DERIVATIVES: &'static str = "getDerivatives";
    const UPDATE: &'static str = "newDiscreteStates";

    fn common(&self) -> &Common {
        &self.common
    }

    unsafe fn update(&self, handle: fmi::Handle) -> (EventInfo, c_int) {
        let InterfaceFunctions::ModelExchange(functions) = self.interface else {
            return (EventInfo::default(), NOT_OFFERED);
        };
        let mut info = fmi::EventInfo::default();
        // SAFETY: FMI gives the function this type, and the structure is valid for the call.
        let status = unsafe { (functions.new_discrete_states)(handle, &raw mut info) };
        let is_true = |value| value != fmi::FALSE;
        let info = EventInfo {
            needs_another: is_true(info.new_discrete_states_needed),
            terminates: is_true(info.terminate_simulation),
            changes_nominals: is_true(info.nominals_of_states_changed),
            changes_states: is_true(info.values_of_states_changed),
            next_event: is_true(info.next_event_time_defined).then_some(info.next_event_time),
        };
        (info, status)
    }

    unsafe fn complete_step(&self, handle: fmi::Handle) -> (Completed, c_int) {
        let InterfaceFunctions::ModelExchange(functions) = self.interface else {
            return (Completed::default(), NOT_OFFERED);
        };
        let (mut event, mut ends) = (fmi::FALSE, fmi::FALSE);
        // SAFETY: FMI gives the function this type, and both pointers are valid for the call.
        let status =
            unsafe { (functions.completed)(handle, fmi::TRUE, &raw mut event, &raw mut ends) };
        let [enters_event_mode, terminates] = [event, ends].map(|value| value != fmi::FALSE);
        (Completed { enters_event_mode, terminates }, status)
    }
}

impl Functions {
    /// Loads a library for model exchange if it `exchanges`, otherwise for co-simulation.
    pub(crate) fn load(file: &Path, exchanges: bool) -> Result<Self, libloading::Error> {
        let symbols = Symbols::open(file, Self::VERSION)?;
        // SAFETY: FMI 2.0 gives each function the type it is loaded as, and `common` keeps the code
        // loaded as long as the pointers exist.
        unsafe {
            let interface = if exchanges {
                InterfaceFunctions::ModelExchange(EventFunctions::load(&symbols)?)
            } else {
                InterfaceFunctions::CoSimulation(StepFunctions::load(&symbols)?)
            };
            Ok(Self {
                own: OwnFunctions::load(&symbols)?,
                interface,
                common: Common::load(symbols, exchanges)?,
            })
        }
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

/// Copies texts for C.
pub(crate) fn c_texts<const N: usize>(texts: [&str; N]) -> Result<[CString; N], String> {
    let copy =
        |text: &str| CString::new(text).map_err(|_| format!("\"{text:?}\" contains a zero byte"));
    let copies = texts.into_iter().map(copy).collect::<Result<Vec<_>, _>>()?;
    Ok(copies.try_into().expect("as many copies as texts"))
}
