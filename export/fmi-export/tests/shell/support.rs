//! A small importer: an instance with its log, and calls that return their results.
#![allow(unsafe_code)]

use crate::fmi2;
pub(crate) use fmi_export::types::FmiStatus;
use fmi_export::types::{CEventInfo, Callbacks, LogCallback};
use std::ffi::{CStr, CString, c_char, c_int, c_void};
use std::ptr::{null, null_mut};
use std::sync::Mutex;

pub(crate) const MODEL_EXCHANGE: c_int = 0;
pub(crate) const CO_SIMULATION: c_int = 1;

/// Value references of the variables of the FMU `Lag`.
pub(crate) const GAIN: u32 = 1;
pub(crate) const INITIAL: u32 = 4;
pub(crate) const LABEL: u32 = 8;
pub(crate) const U: u32 = 9;
pub(crate) const X: u32 = 10;
pub(crate) const DERIVATIVE: u32 = 11;
pub(crate) const Y: u32 = 12;
pub(crate) const SWITCHED: u32 = 14;
pub(crate) const TEXT: u32 = 15;
pub(crate) const OFFSET: u32 = 16;

/// Message that the importer's logger received.
#[derive(Clone, Debug)]
pub(crate) struct Message {
    pub(crate) status: FmiStatus,
    pub(crate) category: String,
    pub(crate) text: String,
    pub(crate) instance: String,
}

type Log = Mutex<Vec<Message>>;

/// A logger without its variadic arguments: environment, instance, status, category, message.
pub(crate) type Logger = unsafe extern "C-unwind" fn(
    *mut c_void,
    *const c_char,
    FmiStatus,
    *const c_char,
    *const c_char,
);

extern "C-unwind" fn log_message(
    environment: *mut c_void,
    instance: *const c_char,
    status: FmiStatus,
    category: *const c_char,
    message: *const c_char,
) {
    // SAFETY: the environment is the log that `Instance` keeps alive, and the shell passes
    // NUL-terminated texts that live during the call.
    let (log, [instance, category, text]) = unsafe {
        let texts = [instance, category, message]
            .map(|text| CStr::from_ptr(text).to_str().unwrap().to_owned());
        (&*environment.cast::<Log>(), texts)
    };
    log.lock().unwrap().push(Message { status, category, text, instance });
}

/// Returns callbacks of which this logger gets the environment.
pub(crate) fn callbacks<T>(logger: Logger, environment: *const T) -> Callbacks {
    // SAFETY: the two types differ only in the variadic part, and on the supported platforms a
    // variadic call without variadic arguments passes the fixed ones like any other call.
    let logger = unsafe { std::mem::transmute::<Logger, LogCallback>(logger) };
    Callbacks {
        logger: Some(logger),
        allocate_memory: None,
        free_memory: None,
        step_finished: None,
        component_environment: environment.cast_mut().cast(),
    }
}

/// Calls an exported function with the given arguments.
macro_rules! c {
    ($function:ident($($argument:expr),* $(,)?)) => {{
        // SAFETY: every pointer that a test passes is null or valid for the duration of the call,
        // as the standard demands.
        #[allow(unsafe_code)]
        let result = unsafe { crate::fmi2::$function($($argument),*) };
        result
    }};
}
pub(crate) use c;

/// An instance with its log.
pub(crate) struct Instance {
    pub(crate) component: *mut c_void,
    log: Box<Log>,
}

impl Drop for Instance {
    fn drop(&mut self) {
        c!(fmi2FreeInstance(self.component));
    }
}

/// Returns the GUID of the FMU with that name in this library.
pub(crate) fn guid(name: &str) -> CString {
    let text = fmi2::fmu_model_descriptions();
    assert!(!text.is_null());
    // SAFETY: fmu_model_descriptions returned a NUL-terminated text, which is freed only after this
    // use.
    let json = unsafe { CStr::from_ptr(text) }.to_str().unwrap().to_owned();
    c!(fmu_free_model_descriptions(text));
    let fmus: Vec<model_description::ModelDescription> = serde_json::from_str(&json).unwrap();
    let fmu = fmus.iter().find(|fmu| fmu.name == name).unwrap();
    CString::new(fmu.guid()).unwrap()
}

/// Makes an instance; its component is null if the library refused it.
pub(crate) fn instantiate(
    name: Option<&CStr>,
    fmu_type: c_int,
    guid: Option<&CStr>,
    resources: Option<&CStr>,
    logging: bool,
) -> Instance {
    let pointer = |text: Option<&CStr>| text.map_or(null(), CStr::as_ptr);
    let log: Box<Log> = Box::default();
    // The callbacks live only during the call, as with some importers.
    let callbacks = Box::new(callbacks(log_message, &raw const *log));
    let component = c!(fmi2Instantiate(
        pointer(name),
        fmu_type,
        pointer(guid),
        pointer(resources),
        &raw const *callbacks,
        0,
        c_int::from(logging),
    ));
    drop(callbacks);
    Instance { component, log }
}

impl Instance {
    pub(crate) fn lag(fmu_type: c_int) -> Self {
        Self::new("Lag", fmu_type)
    }

    pub(crate) fn new(fmu: &str, fmu_type: c_int) -> Self {
        let instance = instantiate(Some(c"it"), fmu_type, Some(&guid(fmu)), None, true);
        assert!(!instance.component.is_null(), "{:?}", instance.messages());
        instance
    }

    /// Returns a `Lag` for co-simulation at t = 0.
    pub(crate) fn stepping() -> Self {
        let instance = Self::lag(CO_SIMULATION);
        instance.initialize();
        instance
    }

    /// Returns a `Lag` for model exchange in event mode at t = 0.
    pub(crate) fn in_event_mode() -> Self {
        let instance = Self::lag(MODEL_EXCHANGE);
        instance.initialize();
        instance
    }

    pub(crate) fn initialize(&self) {
        self.enter_initialization();
        assert_eq!(
            c!(fmi2ExitInitializationMode(self.component)),
            FmiStatus::Ok,
            "{:?}",
            self.messages()
        );
    }

    pub(crate) fn enter_initialization(&self) {
        assert_eq!(c!(fmi2SetupExperiment(self.component, 1, 1e-4, 0.0, 0, 0.0)), FmiStatus::Ok);
        assert_eq!(c!(fmi2EnterInitializationMode(self.component)), FmiStatus::Ok);
    }

    pub(crate) fn messages(&self) -> Vec<Message> {
        self.log.lock().unwrap().clone()
    }

    /// Checks that the last message holds all of `parts`.
    #[track_caller]
    pub(crate) fn said(&self, parts: &[&str]) {
        let messages = self.messages();
        let last = messages.last().expect("no message at all");
        for part in parts {
            assert!(last.text.contains(part), "no '{part}' in '{}'", last.text);
        }
    }

    pub(crate) fn set_real(&self, reference: u32, value: f64) -> FmiStatus {
        c!(fmi2SetReal(self.component, &reference, 1, &value))
    }

    pub(crate) fn set_string(&self, reference: u32, value: &CStr) -> FmiStatus {
        let value = value.as_ptr();
        c!(fmi2SetString(self.component, &reference, 1, &value))
    }

    pub(crate) fn get_real(&self, reference: u32) -> (FmiStatus, f64) {
        let mut value = f64::NAN;
        (c!(fmi2GetReal(self.component, &reference, 1, &mut value)), value)
    }

    #[track_caller]
    pub(crate) fn real(&self, reference: u32) -> f64 {
        let (status, value) = self.get_real(reference);
        assert_eq!(status, FmiStatus::Ok, "{:?}", self.messages());
        value
    }

    pub(crate) fn integer(&self, reference: u32) -> i32 {
        let mut value = i32::MIN;
        assert_eq!(c!(fmi2GetInteger(self.component, &reference, 1, &mut value)), FmiStatus::Ok);
        value
    }

    pub(crate) fn boolean(&self, reference: u32) -> i32 {
        let mut value = i32::MIN;
        assert_eq!(c!(fmi2GetBoolean(self.component, &reference, 1, &mut value)), FmiStatus::Ok);
        value
    }

    pub(crate) fn step(&self, point: f64, size: f64) -> FmiStatus {
        c!(fmi2DoStep(self.component, point, size, 1))
    }

    pub(crate) fn event_info(&self) -> CEventInfo {
        let mut info = CEventInfo::default();
        assert_eq!(c!(fmi2NewDiscreteStates(self.component, &mut info)), FmiStatus::Ok);
        info
    }

    pub(crate) fn save(&self) -> *mut c_void {
        let mut state = null_mut();
        assert_eq!(
            c!(fmi2GetFMUstate(self.component, &mut state)),
            FmiStatus::Ok,
            "{:?}",
            self.messages()
        );
        assert!(!state.is_null());
        state
    }
}
