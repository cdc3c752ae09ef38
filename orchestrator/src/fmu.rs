//! Opens `.fmu` archives and makes co-simulation units of them. The only file of this crate with `unsafe`.
//!
//! The C types and the logger that expands `printf` arguments come from `fmi-rs`. The calls go through libloading, because
//! `fmi-rs` lets the callback structure go after fmi2Instantiate, while units of several exporters keep the pointer to it
//! and crash when they log.

#![allow(unsafe_code)]

use crate::archive;
use crate::description::ModelDescription;
use crate::error::{Error, UnitFailure};
use crate::heard;
use crate::unit::{CoSimulationUnit, Outcome};
use crate::xml;
use fmi_rs::SHARED_LIBRARY_EXTENSION;
use fmi_rs::fmi2::PLATFORM;
use fmi_rs::fmi2::types::{
    fmi2CallbackFunctions, fmi2Component, fmi2ComponentEnvironment, fmi2DoStepTYPE,
    fmi2EnterInitializationModeTYPE, fmi2ExitInitializationModeTYPE, fmi2False, fmi2FreeInstanceTYPE,
    fmi2GetBooleanTYPE, fmi2GetIntegerTYPE, fmi2GetRealStatusTYPE, fmi2GetRealTYPE, fmi2InstantiateTYPE,
    fmi2SetBooleanTYPE, fmi2SetIntegerTYPE, fmi2SetRealTYPE, fmi2SetStringTYPE, fmi2SetupExperimentTYPE,
    fmi2Status, fmi2StatusKind, fmi2String, fmi2TerminateTYPE, fmi2True, fmi2Type,
};
use libloading::Library;
use object::{Object, ObjectSegment};
use std::cell::Cell;
use std::ffi::{CStr, CString, c_void};
use std::path::{Path, PathBuf};
use std::rc::Rc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};
use tempfile::TempDir;
use url::Url;

unsafe extern "C" {
    /// Puts a C function in front of the logger that expands the `printf` arguments of a message. Part of `fmi-rs`.
    fn add_logger_proxy(functions: *mut fmi2CallbackFunctions);
    /// The C library's, for units that want memory from their environment.
    fn calloc(count: usize, size: usize) -> *mut c_void;
    /// Its counterpart.
    fn free(memory: *mut c_void);
}

/// An unpacked archive. Several units can be made of it.
pub struct Fmu {
    /// Where the archive is.
    pub path: PathBuf,
    /// What it says of itself.
    pub description: ModelDescription,
    folder: Rc<TempDir>,
    /// Whether the library for this platform was looked at.
    is_sound: Cell<bool>,
}

impl Fmu {
    /// Unpacks an archive and reads its description.
    ///
    /// # Errors
    /// If the archive is unsafe or broken, or no FMI 2.0 FMU.
    pub fn open(path: &Path) -> Result<Self, Error> {
        let refuse = |message: String| Error::Fmu { path: path.to_path_buf(), message };
        let folder = archive::unpack(path)?;
        let bytes = std::fs::read(folder.path().join("modelDescription.xml"))
            .map_err(|source| refuse(format!("is no FMU, modelDescription.xml cannot be read: {source}")))?;
        let description = xml::decode(&bytes)
            .and_then(|text| ModelDescription::parse(&text))
            .map_err(|reason| refuse(format!("modelDescription.xml: {reason}")))?;
        Ok(Self {
            path: path.to_path_buf(),
            description,
            folder: Rc::new(folder),
            is_sound: Cell::new(false),
        })
    }

    /// The platforms there are binaries for, in FMI's names.
    pub fn platforms(&self) -> Vec<String> {
        let mut platforms: Vec<String> = std::fs::read_dir(self.folder.path().join("binaries"))
            .into_iter()
            .flatten()
            .flatten()
            .filter(|entry| entry.path().is_dir())
            .map(|entry| entry.file_name().to_string_lossy().into_owned())
            .collect();
        platforms.sort();
        platforms
    }

    /// Loads the library and makes a co-simulation unit called `name`.
    ///
    /// # Errors
    /// If the FMU has no binary for this platform or offers no co-simulation, if the library cannot be loaded, or if the
    /// FMU refuses.
    pub fn instantiate(&self, name: &str) -> Result<FmuUnit, Error> {
        let refuse = |message: String| Error::Fmu { path: self.path.clone(), message };
        let interface = self
            .description
            .co_simulation
            .as_ref()
            .ok_or_else(|| refuse("offers no co-simulation".into()))?;
        let platforms = self.platforms();
        if !platforms.iter().any(|platform| platform == PLATFORM) {
            let offered = if platforms.is_empty() { "none".into() } else { platforms.join(", ") };
            return Err(refuse(format!("has no binary for {PLATFORM}, only for: {offered}")));
        }
        let identifier = &interface.model_identifier;
        // It becomes part of a path: FMI 2.0, section 2.2.7, wants a C identifier.
        if identifier.is_empty() || !identifier.chars().all(|c| c.is_ascii_alphanumeric() || c == '_') {
            return Err(refuse(format!(
                "the model identifier \"{}\" is refused",
                identifier.escape_default()
            )));
        }
        let file = format!("{identifier}{SHARED_LIBRARY_EXTENSION}");
        let file = self.folder.path().join("binaries").join(PLATFORM).join(file);
        if !self.is_sound.get() {
            check_library(&file).map_err(|reason| {
                let name = file.strip_prefix(self.folder.path()).unwrap_or(&file);
                refuse(format!("{}: {reason}", name.display()))
            })?;
            self.is_sound.set(true);
        }
        let functions = Functions::load(&file).map_err(|error| refuse(with_causes(&error)))?;

        let text =
            |text: &str| CString::new(text).map_err(|_| refuse(format!("\"{text:?}\" holds a zero byte")));
        let resources = Url::from_directory_path(self.folder.path().join("resources"))
            .map_err(|()| refuse("the temporary folder has no absolute path".into()))?;
        let (name_text, guid, resources) =
            (text(name)?, text(&self.description.guid)?, text(resources.as_str())?);

        let log = Rc::new(Log {
            component: name.to_string(),
            last: Mutex::default(),
            instantiates: AtomicBool::new(true),
        });
        let memory = !interface.has("canNotUseMemoryManagementFunctions");
        let mut callbacks = fmi2CallbackFunctions {
            logger: receive_message,
            allocateMemory: memory.then_some(calloc),
            freeMemory: memory.then_some(free),
            stepFinished: None,
            componentEnvironment: Rc::as_ptr(&log).cast_mut().cast(),
        };
        // SAFETY: the structure is valid; the call only exchanges the logger in it for one that expands the arguments.
        unsafe { add_logger_proxy(&raw mut callbacks) };
        let callbacks = Rc::new(callbacks);

        // SAFETY: the function has the type FMI gives it; the texts outlive the call, callbacks and log the instance.
        let component = unsafe {
            (functions.instantiate)(
                name_text.as_ptr(),
                fmi2Type::CoSimulation,
                guid.as_ptr(),
                resources.as_ptr(),
                Rc::as_ptr(&callbacks),
                fmi2False,
                fmi2True,
            )
        };
        if component.is_null() {
            let message = log.take().unwrap_or_else(|| "fmi2Instantiate gave no instance".into());
            return Err(refuse(format!("the component \"{name}\" could not be made of it: {message}")));
        }
        log.instantiates.store(false, Ordering::Relaxed);
        let instance = Rc::new(Instance { functions, _callbacks: callbacks, log });
        Ok(FmuUnit { component, instance, fatal: false, _folder: Rc::clone(&self.folder) })
    }
}

/// Whether everything is in a library file that will be mapped into memory: a program that touches what is missing is killed.
fn check_library(file: &Path) -> Result<(), String> {
    let bytes = std::fs::read(file).map_err(|error| error.to_string())?;
    let fault = |error: object::Error| format!("is no sound library: {error}");
    let library = object::File::parse(&*bytes).map_err(fault)?;
    library.segments().try_for_each(|segment| segment.data().map(drop)).map_err(fault)
}

/// An error and what caused it, in one line.
fn with_causes(error: &dyn std::error::Error) -> String {
    let causes = std::iter::successors(Some(error), |error| error.source());
    causes.map(ToString::to_string).collect::<Vec<_>>().join(": ")
}

/// The functions this program calls, and the library they are in.
struct Functions {
    instantiate: fmi2InstantiateTYPE,
    free_instance: fmi2FreeInstanceTYPE,
    setup_experiment: fmi2SetupExperimentTYPE,
    enter_initialization_mode: fmi2EnterInitializationModeTYPE,
    exit_initialization_mode: fmi2ExitInitializationModeTYPE,
    terminate: fmi2TerminateTYPE,
    get_real: fmi2GetRealTYPE,
    get_integer: fmi2GetIntegerTYPE,
    get_boolean: fmi2GetBooleanTYPE,
    set_real: fmi2SetRealTYPE,
    set_integer: fmi2SetIntegerTYPE,
    set_boolean: fmi2SetBooleanTYPE,
    set_string: fmi2SetStringTYPE,
    do_step: fmi2DoStepTYPE,
    get_real_status: fmi2GetRealStatusTYPE,
    _library: Library,
}

impl Functions {
    fn load(file: &Path) -> Result<Self, libloading::Error> {
        // SAFETY: loading runs the library's own initializers. Whoever runs an FMU trusts its code.
        let library = unsafe { Library::new(file) }?;
        // SAFETY: FMI 2.0 gives each function the type it is loaded as, and the library stays as long as the pointers.
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
                _library: library,
            })
        }
    }
}

/// Passes an FMU's log messages on to `tracing`, and keeps the last one that tells of trouble.
struct Log {
    component: String,
    last: Mutex<Option<String>>,
    /// Whether trouble is told by an error that is to come anyway.
    instantiates: AtomicBool,
}

impl Log {
    fn take(&self) -> Option<String> {
        self.last.lock().unwrap_or_else(PoisonError::into_inner).take()
    }

    fn message(&self, status: fmi2Status, category: &str, message: &str) {
        let (component, message) = (&self.component, message.trim_end().replace('\n', " "));
        match status {
            fmi2Status::Ok | fmi2Status::Pending => tracing::info!("{component}: [{category}] {message}"),
            fmi2Status::Warning => heard::warn(&format!("{component}: [{category}] {message}")),
            fmi2Status::Discard | fmi2Status::Error | fmi2Status::Fatal => {
                if !self.instantiates.load(Ordering::Relaxed) {
                    tracing::error!("{component}: [{category}] {message}");
                }
                *self.last.lock().unwrap_or_else(PoisonError::into_inner) = Some(message);
            }
        }
    }
}

/// The logger callback, behind the one that expands the arguments.
unsafe extern "C" fn receive_message(
    environment: fmi2ComponentEnvironment,
    _instance: fmi2String,
    status: fmi2Status,
    category: fmi2String,
    message: fmi2String,
) {
    let text = |text: fmi2String| {
        if text.is_null() {
            return String::new();
        }
        // SAFETY: FMI passes texts that end with a zero byte.
        unsafe { CStr::from_ptr(text) }.to_string_lossy().into_owned()
    };
    // SAFETY: the environment is the `Log` given with the callbacks, which lives as long as the instance.
    if let Some(log) = unsafe { environment.cast::<Log>().as_ref() } {
        log.message(status, &text(category), &text(message));
    }
}

/// What must live as long as a unit's instance.
struct Instance {
    functions: Functions,
    _callbacks: Rc<fmi2CallbackFunctions>,
    log: Rc<Log>,
}

/// A unit made of an FMU.
pub struct FmuUnit {
    component: fmi2Component,
    instance: Rc<Instance>,
    fatal: bool,
    _folder: Rc<TempDir>,
}

impl FmuUnit {
    #[inline]
    fn check(&mut self, call: &'static str, status: fmi2Status) -> Outcome {
        match status {
            fmi2Status::Ok | fmi2Status::Warning => Ok(()),
            _ => Err(self.failure(call, status)),
        }
    }

    #[cold]
    fn failure(&mut self, call: &'static str, status: fmi2Status) -> UnitFailure {
        self.fatal |= status == fmi2Status::Fatal;
        let mut message = self.instance.log.take().unwrap_or_else(|| "no message in its log".into());
        if status == fmi2Status::Discard && call == "doStep" {
            let mut time = 0.0;
            // SAFETY: the instance is alive, and after fmi2Discard this call is allowed.
            let status = unsafe {
                (self.instance.functions.get_real_status)(
                    self.component,
                    fmi2StatusKind::LastSuccessfulTime,
                    &raw mut time,
                )
            };
            if status == fmi2Status::Ok {
                message = format!("{message}; it got as far as t = {time} s");
            }
        }
        if status == fmi2Status::Pending {
            message = "it wants to step asynchronously, which is not supported".into();
        }
        UnitFailure { call, message: format!("{message} ({status:?})") }
    }
}

impl Drop for FmuUnit {
    fn drop(&mut self) {
        if self.fatal {
            // No function of the FMU may be called any more, not even fmi2FreeInstance: leave everything as it is.
            std::mem::forget(Rc::clone(&self.instance));
        } else {
            // SAFETY: the instance is alive, and nobody uses it after this.
            unsafe { (self.instance.functions.free_instance)(self.component) };
        }
    }
}

/// A get or set call for arrays of references and values.
macro_rules! call_with_values {
    ($self:ident, $function:ident, $name:literal, $references:ident, $values:expr, $length:expr) => {{
        assert_eq!($references.len(), $length, "as many values as references");
        // SAFETY: the instance is alive, and both arrays have the length that is passed.
        let status = unsafe {
            ($self.instance.functions.$function)(
                $self.component,
                $references.as_ptr(),
                $references.len(),
                $values,
            )
        };
        $self.check($name, status)
    }};
}

impl CoSimulationUnit for FmuUnit {
    fn get_real(&mut self, references: &[u32], values: &mut [f64]) -> Outcome {
        call_with_values!(self, get_real, "getReal", references, values.as_mut_ptr(), values.len())
    }

    fn get_integer(&mut self, references: &[u32], values: &mut [i32]) -> Outcome {
        call_with_values!(self, get_integer, "getInteger", references, values.as_mut_ptr(), values.len())
    }

    fn get_boolean(&mut self, references: &[u32], values: &mut [i32]) -> Outcome {
        call_with_values!(self, get_boolean, "getBoolean", references, values.as_mut_ptr(), values.len())
    }

    fn set_real(&mut self, references: &[u32], values: &[f64]) -> Outcome {
        call_with_values!(self, set_real, "setReal", references, values.as_ptr(), values.len())
    }

    fn set_integer(&mut self, references: &[u32], values: &[i32]) -> Outcome {
        call_with_values!(self, set_integer, "setInteger", references, values.as_ptr(), values.len())
    }

    fn set_boolean(&mut self, references: &[u32], values: &[i32]) -> Outcome {
        call_with_values!(self, set_boolean, "setBoolean", references, values.as_ptr(), values.len())
    }

    fn set_string(&mut self, reference: u32, value: &str) -> Outcome {
        let text = CString::new(value).map_err(|_| UnitFailure {
            call: "setString",
            message: format!("the text {value:?} holds a zero byte"),
        })?;
        let (references, values) = ([reference], [text.as_ptr()]);
        call_with_values!(self, set_string, "setString", references, values.as_ptr(), values.len())
    }

    fn enter_initialization(&mut self, start: f64, stop: f64) -> Outcome {
        // SAFETY: the instance is alive.
        let status = unsafe {
            (self.instance.functions.setup_experiment)(self.component, fmi2False, 0.0, start, fmi2True, stop)
        };
        self.check("setupExperiment", status)?;
        // SAFETY: the instance is alive.
        let status = unsafe { (self.instance.functions.enter_initialization_mode)(self.component) };
        self.check("enterInitializationMode", status)
    }

    fn exit_initialization(&mut self) -> Outcome {
        // SAFETY: the instance is alive.
        let status = unsafe { (self.instance.functions.exit_initialization_mode)(self.component) };
        self.check("exitInitializationMode", status)
    }

    fn do_step(&mut self, time: f64, step: f64) -> Outcome {
        // SAFETY: the instance is alive.
        let status = unsafe { (self.instance.functions.do_step)(self.component, time, step, fmi2True) };
        self.check("doStep", status)
    }

    fn terminate(&mut self) -> Outcome {
        // SAFETY: the instance is alive.
        let status = unsafe { (self.instance.functions.terminate)(self.component) };
        self.check("terminate", status)
    }
}
