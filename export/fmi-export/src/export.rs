//! Macro that turns models into the exported functions of a library.

/// Exports the models as FMUs of FMI 2.0 and 3.0 in the calling library. Call it once per
/// library.
///
/// The macro defines modules `fmi2` and `fmi3` with all functions of these versions under their C
/// names. The former also has
/// - `fmu_model_descriptions() -> char*`: returns a NUL-terminated JSON list of the FMUs'
///   descriptions, or null on failure. The memory belongs to the library and is given back by
/// - `fmu_free_model_descriptions(char*)`: frees that list; it accepts null.
///
/// The GUID given to `fmi2Instantiate`, or the equal instantiation token of FMI 3.0, selects the
/// FMU. The crate needs `crate-type = ["cdylib", …]` and a build script that calls
/// `fmi_build::link`. The digest of the library's sources, which that build script makes, is put
/// into a section of its own.
///
/// ```ignore
/// fmi_export::export_fmus!(Plant);
/// fmi_export::export_fmus!(crmpc::Crmpc, lqr::Lqr);
/// ```
#[macro_export]
macro_rules! export_fmus {
    ($($model:ty),+ $(,)?) => {
        #[allow(unsafe_code, non_snake_case, missing_docs, unused_imports, unreachable_pub)]
        #[allow(clippy::all, clippy::pedantic, clippy::undocumented_unsafe_blocks)]
        pub mod fmi2 {
            //! C interface of this library, with the functions of FMI 2.0.
            use super::*;
            use $crate::interface as shell;
            use $crate::types::{CEventInfo, Callbacks, FmiStatus};
            use ::std::ffi::{c_char, c_int, c_void};

            const COUNT: usize = [$(stringify!($model)),+].len();
            pub(super) static EXPORTS: [$crate::Export; COUNT] = [$($crate::Export::new::<$model>()),+];

            // fmu-pack reads it from the file, for any platform.
            #[cfg_attr(target_vendor = "apple", unsafe(link_section = "__DATA,__fmi2_sources"))]
            #[cfg_attr(windows, unsafe(link_section = ".fmi2src"))]
            #[cfg_attr(
                not(any(windows, target_vendor = "apple")),
                unsafe(link_section = ".fmi2_sources")
            )]
            static SOURCES: [u8; 64] = $crate::sources(::std::option_env!("FMI2_SOURCES"));

            #[unsafe(no_mangle)]
            pub extern "C" fn fmu_model_descriptions() -> *mut c_char {
                // Without a use the linker would leave the digest out.
                ::std::hint::black_box(&SOURCES);
                shell::fmu_model_descriptions(&EXPORTS)
            }
            $crate::forward! { EXPORTS;
                fmi2Instantiate(name: *const c_char, fmu_type: c_int, guid: *const c_char, resources: *const c_char, callbacks: *const Callbacks, visible: c_int, logging_on: c_int) -> *mut c_void;
            }
            #[unsafe(no_mangle)]
            pub extern "C" fn fmi2GetTypesPlatform() -> *const c_char {
                shell::fmi2GetTypesPlatform()
            }
            #[unsafe(no_mangle)]
            pub extern "C" fn fmi2GetVersion() -> *const c_char {
                shell::fmi2GetVersion()
            }
            $crate::forward! {
                fmu_free_model_descriptions(a: *mut c_char) -> ();
                fmi2FreeInstance(c: *mut c_void) -> ();
                fmi2SetDebugLogging(c: *mut c_void, on: c_int, n: usize, names: *const *const c_char) -> FmiStatus;
                fmi2SetupExperiment(c: *mut c_void, td: c_int, t: f64, start: f64, sd: c_int, stop: f64) -> FmiStatus;
                fmi2EnterInitializationMode(c: *mut c_void) -> FmiStatus;
                fmi2ExitInitializationMode(c: *mut c_void) -> FmiStatus;
                fmi2Terminate(c: *mut c_void) -> FmiStatus;
                fmi2Reset(c: *mut c_void) -> FmiStatus;
                fmi2GetReal(c: *mut c_void, vr: *const u32, n: usize, value: *mut f64) -> FmiStatus;
                fmi2GetInteger(c: *mut c_void, vr: *const u32, n: usize, value: *mut c_int) -> FmiStatus;
                fmi2GetBoolean(c: *mut c_void, vr: *const u32, n: usize, value: *mut c_int) -> FmiStatus;
                fmi2GetString(c: *mut c_void, vr: *const u32, n: usize, value: *mut *const c_char) -> FmiStatus;
                fmi2SetReal(c: *mut c_void, vr: *const u32, n: usize, value: *const f64) -> FmiStatus;
                fmi2SetInteger(c: *mut c_void, vr: *const u32, n: usize, value: *const c_int) -> FmiStatus;
                fmi2SetBoolean(c: *mut c_void, vr: *const u32, n: usize, value: *const c_int) -> FmiStatus;
                fmi2SetString(c: *mut c_void, vr: *const u32, n: usize, value: *const *const c_char) -> FmiStatus;
                fmi2GetFMUstate(c: *mut c_void, state: *mut *mut c_void) -> FmiStatus;
                fmi2SetFMUstate(c: *mut c_void, state: *mut c_void) -> FmiStatus;
                fmi2FreeFMUstate(c: *mut c_void, state: *mut *mut c_void) -> FmiStatus;
                fmi2SerializedFMUstateSize(c: *mut c_void, state: *mut c_void, size: *mut usize) -> FmiStatus;
                fmi2SerializeFMUstate(c: *mut c_void, state: *mut c_void, to: *mut c_char, size: usize) -> FmiStatus;
                fmi2DeSerializeFMUstate(c: *mut c_void, from: *const c_char, size: usize, state: *mut *mut c_void) -> FmiStatus;
                fmi2GetDirectionalDerivative(c: *mut c_void, unknowns: *const u32, nu: usize, knowns: *const u32, nk: usize, seed: *const f64, value: *mut f64) -> FmiStatus;
                fmi2EnterEventMode(c: *mut c_void) -> FmiStatus;
                fmi2NewDiscreteStates(c: *mut c_void, info: *mut CEventInfo) -> FmiStatus;
                fmi2EnterContinuousTimeMode(c: *mut c_void) -> FmiStatus;
                fmi2CompletedIntegratorStep(c: *mut c_void, no_set_prior: c_int, event: *mut c_int, end: *mut c_int) -> FmiStatus;
                fmi2SetTime(c: *mut c_void, time: f64) -> FmiStatus;
                fmi2SetContinuousStates(c: *mut c_void, x: *const f64, n: usize) -> FmiStatus;
                fmi2GetDerivatives(c: *mut c_void, derivatives: *mut f64, n: usize) -> FmiStatus;
                fmi2GetEventIndicators(c: *mut c_void, indicators: *mut f64, n: usize) -> FmiStatus;
                fmi2GetContinuousStates(c: *mut c_void, x: *mut f64, n: usize) -> FmiStatus;
                fmi2GetNominalsOfContinuousStates(c: *mut c_void, nominals: *mut f64, n: usize) -> FmiStatus;
                fmi2SetRealInputDerivatives(c: *mut c_void, vr: *const u32, n: usize, order: *const c_int, value: *const f64) -> FmiStatus;
                fmi2GetRealOutputDerivatives(c: *mut c_void, vr: *const u32, n: usize, order: *const c_int, value: *mut f64) -> FmiStatus;
                fmi2DoStep(c: *mut c_void, point: f64, size: f64, no_set_prior: c_int) -> FmiStatus;
                fmi2CancelStep(c: *mut c_void) -> FmiStatus;
                fmi2GetStatus(c: *mut c_void, kind: c_int, value: *mut FmiStatus) -> FmiStatus;
                fmi2GetRealStatus(c: *mut c_void, kind: c_int, value: *mut f64) -> FmiStatus;
                fmi2GetIntegerStatus(c: *mut c_void, kind: c_int, value: *mut c_int) -> FmiStatus;
                fmi2GetBooleanStatus(c: *mut c_void, kind: c_int, value: *mut c_int) -> FmiStatus;
                fmi2GetStringStatus(c: *mut c_void, kind: c_int, value: *mut *const c_char) -> FmiStatus;
            }
        }

        #[allow(unsafe_code, non_snake_case, missing_docs, unused_imports, unreachable_pub)]
        #[allow(clippy::all, clippy::pedantic, clippy::undocumented_unsafe_blocks)]
        pub mod fmi3 {
            //! C interface of this library, with the functions of FMI 3.0.
            use super::fmi2::EXPORTS;
            use $crate::interface as shell;
            use $crate::types::{FmiStatus, LogMessageCallback};
            use ::std::ffi::{c_char, c_int, c_void};

            $crate::forward! { EXPORTS;
                fmi3InstantiateModelExchange(name: *const c_char, token: *const c_char, resources: *const c_char, visible: bool, logging_on: bool, environment: *mut c_void, log: Option<LogMessageCallback>) -> *mut c_void;
                fmi3InstantiateCoSimulation(name: *const c_char, token: *const c_char, resources: *const c_char, visible: bool, logging_on: bool, event_mode: bool, early_return: bool, vr: *const u32, n: usize, environment: *mut c_void, log: Option<LogMessageCallback>, update: *const c_void) -> *mut c_void;
                fmi3InstantiateScheduledExecution(name: *const c_char, token: *const c_char, resources: *const c_char, visible: bool, logging_on: bool, environment: *mut c_void, log: Option<LogMessageCallback>, update: *const c_void, lock: *const c_void, unlock: *const c_void) -> *mut c_void;
            }
            // These are the functions of FMI 2.0 with another name.
            $crate::forward! {
                fmi3FreeInstance = fmi2FreeInstance(c: *mut c_void) -> ();
                fmi3ExitInitializationMode = fmi2ExitInitializationMode(c: *mut c_void) -> FmiStatus;
                fmi3EnterEventMode = fmi2EnterEventMode(c: *mut c_void) -> FmiStatus;
                fmi3Terminate = fmi2Terminate(c: *mut c_void) -> FmiStatus;
                fmi3Reset = fmi2Reset(c: *mut c_void) -> FmiStatus;
                fmi3EnterContinuousTimeMode = fmi2EnterContinuousTimeMode(c: *mut c_void) -> FmiStatus;
                fmi3GetFMUState = fmi2GetFMUstate(c: *mut c_void, state: *mut *mut c_void) -> FmiStatus;
                fmi3SetFMUState = fmi2SetFMUstate(c: *mut c_void, state: *mut c_void) -> FmiStatus;
                fmi3FreeFMUState = fmi2FreeFMUstate(c: *mut c_void, state: *mut *mut c_void) -> FmiStatus;
                fmi3SerializedFMUStateSize = fmi2SerializedFMUstateSize(c: *mut c_void, state: *mut c_void, size: *mut usize) -> FmiStatus;
                fmi3SerializeFMUState = fmi2SerializeFMUstate(c: *mut c_void, state: *mut c_void, to: *mut c_char, size: usize) -> FmiStatus;
                fmi3DeserializeFMUState = fmi2DeSerializeFMUstate(c: *mut c_void, from: *const c_char, size: usize, state: *mut *mut c_void) -> FmiStatus;
                fmi3SetTime = fmi2SetTime(c: *mut c_void, time: f64) -> FmiStatus;
                fmi3SetContinuousStates = fmi2SetContinuousStates(c: *mut c_void, x: *const f64, n: usize) -> FmiStatus;
                fmi3GetContinuousStateDerivatives = fmi2GetDerivatives(c: *mut c_void, derivatives: *mut f64, n: usize) -> FmiStatus;
                fmi3GetEventIndicators = fmi2GetEventIndicators(c: *mut c_void, indicators: *mut f64, n: usize) -> FmiStatus;
                fmi3GetContinuousStates = fmi2GetContinuousStates(c: *mut c_void, x: *mut f64, n: usize) -> FmiStatus;
                fmi3GetNominalsOfContinuousStates = fmi2GetNominalsOfContinuousStates(c: *mut c_void, nominals: *mut f64, n: usize) -> FmiStatus;
            }
            $crate::without_use! { ($crate::forward) ($crate::forward) }
            $crate::forward! {
                fmi3GetVersion() -> *const c_char;
                fmi3SetDebugLogging(c: *mut c_void, on: bool, n: usize, names: *const *const c_char) -> FmiStatus;
                fmi3EnterInitializationMode(c: *mut c_void, td: bool, t: f64, start: f64, sd: bool, stop: f64) -> FmiStatus;
                fmi3UpdateDiscreteStates(c: *mut c_void, needed: *mut bool, end: *mut bool, nominals: *mut bool, states: *mut bool, defined: *mut bool, next: *mut f64) -> FmiStatus;
                fmi3CompletedIntegratorStep(c: *mut c_void, no_set_prior: bool, event: *mut bool, end: *mut bool) -> FmiStatus;
                fmi3GetNumberOfEventIndicators(c: *mut c_void, n: *mut usize) -> FmiStatus;
                fmi3GetNumberOfContinuousStates(c: *mut c_void, n: *mut usize) -> FmiStatus;
                fmi3EnterStepMode(c: *mut c_void) -> FmiStatus;
                fmi3DoStep(c: *mut c_void, point: f64, size: f64, no_set_prior: bool, event: *mut bool, end: *mut bool, early: *mut bool, time: *mut f64) -> FmiStatus;
                fmi3GetFloat64(c: *mut c_void, vr: *const u32, n: usize, value: *mut f64, m: usize) -> FmiStatus;
                fmi3SetFloat64(c: *mut c_void, vr: *const u32, n: usize, value: *const f64, m: usize) -> FmiStatus;
                fmi3GetInt32(c: *mut c_void, vr: *const u32, n: usize, value: *mut i32, m: usize) -> FmiStatus;
                fmi3SetInt32(c: *mut c_void, vr: *const u32, n: usize, value: *const i32, m: usize) -> FmiStatus;
                fmi3GetInt64(c: *mut c_void, vr: *const u32, n: usize, value: *mut i64, m: usize) -> FmiStatus;
                fmi3SetInt64(c: *mut c_void, vr: *const u32, n: usize, value: *const i64, m: usize) -> FmiStatus;
                fmi3GetBoolean(c: *mut c_void, vr: *const u32, n: usize, value: *mut u8, m: usize) -> FmiStatus;
                fmi3SetBoolean(c: *mut c_void, vr: *const u32, n: usize, value: *const u8, m: usize) -> FmiStatus;
                fmi3GetString(c: *mut c_void, vr: *const u32, n: usize, value: *mut *const c_char, m: usize) -> FmiStatus;
                fmi3SetString(c: *mut c_void, vr: *const u32, n: usize, value: *const *const c_char, m: usize) -> FmiStatus;
                fmi3GetDirectionalDerivative(c: *mut c_void, unknowns: *const u32, nu: usize, knowns: *const u32, nk: usize, seed: *const f64, ns: usize, value: *mut f64, m: usize) -> FmiStatus;
                fmi3GetAdjointDerivative(c: *mut c_void, unknowns: *const u32, nu: usize, knowns: *const u32, nk: usize, seed: *const f64, ns: usize, value: *mut f64, m: usize) -> FmiStatus;
            }
        }
    };
}

/// Defines exported functions that call the shell's functions of the same name, or of another one
/// after `=`. Those after `EXPORTS;` get the FMUs of the library as well. An exception that the
/// importer's logger throws may pass through them.
#[doc(hidden)]
#[macro_export]
macro_rules! forward {
    ($exports:ident; $($name:ident($($argument:ident: $type:ty),*) -> $result:ty;)*) => {$(
        #[unsafe(no_mangle)]
        pub unsafe extern "C-unwind" fn $name($($argument: $type),*) -> $result {
            unsafe { shell::$name(&$exports, $($argument),*) }
        }
    )*};
    ($($name:ident($($argument:ident: $type:ty),*) -> $result:ty;)*) => {
        $crate::forward! { $($name = $name($($argument: $type),*) -> $result;)* }
    };
    ($($name:ident = $to:ident($($argument:ident: $type:ty),*) -> $result:ty;)*) => {$(
        #[unsafe(no_mangle)]
        pub unsafe extern "C-unwind" fn $name($($argument: $type),*) -> $result {
            unsafe { shell::$to($($argument),*) }
        }
    )*};
}

/// Returns the digest that [`export_fmus!`](crate::export_fmus) puts into the library: 64
/// hexadecimal digits of the build script, or zero bytes if it gave none.
#[doc(hidden)]
pub const fn sources(digest: Option<&str>) -> [u8; 64] {
    let mut bytes = [0; 64];
    if let Some(digest) = digest {
        assert!(digest.len() == bytes.len(), "FMI2_SOURCES has 64 digits");
        bytes.copy_from_slice(digest.as_bytes());
    }
    bytes
}
