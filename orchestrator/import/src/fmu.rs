//! Opens `.fmu` archives and instantiates co-simulation units from them. This is the only file of
//! the crate with `unsafe`.
//!
//! The logger that expands `printf` arguments comes from `fmi-rs`. The calls go through libloading,
//! because `fmi-rs` frees the callback structure after fmi2Instantiate, while units of several
//! exporters keep the pointer to it and crash when they log. The C types are in [`fmi`], because
//! those of `fmi-rs` represent a status as an enumeration.

#![allow(unsafe_code)]

use crate::archive;
use crate::description::ModelDescription;
use crate::error::Error;
use crate::faults;
use crate::fmi::{self, Status};
use crate::unit::{CoSimulationUnit, Outcome, UnitFailure};
use crate::warnings;
use crate::xml;
use fmi_rs::SHARED_LIBRARY_EXTENSION;
use fmi_rs::fmi2::PLATFORM;
use libloading::Library;
use object::{Architecture, BinaryFormat, FileKind, Object, ObjectSegment};
use std::cell::Cell;
use std::ffi::{CStr, CString, c_int, c_void};
use std::path::{Path, PathBuf};
use std::rc::Rc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};
use tempfile::TempDir;
use url::Url;

unsafe extern "C" {
    /// Wraps the logger in a C function that expands the `printf` arguments of a message. It is
    /// part of `fmi-rs`.
    fn add_logger_proxy(functions: *mut fmi::Callbacks);
    /// The C library's `calloc`, for units that request memory from their environment.
    fn calloc(count: usize, size: usize) -> *mut c_void;
    /// The C library's `free`, which releases that memory.
    fn free(memory: *mut c_void);
}

/// An unpacked archive, of which several units can be instantiated.
pub struct Fmu {
    /// Path of the archive.
    pub path: PathBuf,
    /// The model description in the archive.
    pub description: ModelDescription,
    folder: Rc<TempDir>,
    /// Whether the library for this platform has been checked.
    is_sound: Cell<bool>,
}

impl Fmu {
    /// Unpacks an archive and reads its description.
    ///
    /// # Errors
    /// If the archive is unsafe or damaged, or is not an FMI 2.0 FMU.
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

    /// Platforms for which the archive has binaries, by FMI's names.
    pub fn platforms(&self) -> Vec<String> {
        let binaries = self.folder.path().join("binaries");
        names_in(&binaries).into_iter().filter(|name| binaries.join(name).is_dir()).collect()
    }

    /// Faults of the archive that do not keep it from being opened: one line for each fault of the
    /// description and of the library for this platform.
    pub fn faults(&self) -> Vec<String> {
        let mut faults = faults::faults(&self.description);
        if self.description.co_simulation.is_some() {
            match self.load() {
                Ok(functions) => faults.extend(functions.version_fault()),
                Err(fault) => faults.push(fault),
            }
        }
        faults
    }

    /// Loads the shared library of the FMU.
    ///
    /// # Errors
    /// A line that says what is missing or why the library cannot be loaded, and names the entry of
    /// the archive.
    fn load(&self) -> Result<Functions, String> {
        let interface = self.description.co_simulation.as_ref().ok_or("offers no co-simulation")?;
        let platforms = self.platforms();
        if !platforms.iter().any(|platform| platform == PLATFORM) {
            let offered = if platforms.is_empty() { "none".into() } else { platforms.join(", ") };
            return Err(format!("has no binary for {PLATFORM}, only for: {offered}"));
        }
        let identifier = &interface.model_identifier;
        // The identifier becomes part of a path. FMI 2.0, section 2.2.7, requires a C identifier,
        // but other programs accept units with a hyphen in it.
        if identifier.is_empty() || identifier.contains(['/', '\\', '.', ':', '\0']) {
            return Err(format!(
                "the model identifier \"{}\" is refused: it must be the name of a file without folder and ending",
                identifier.escape_default()
            ));
        }
        let folder = self.folder.path().join("binaries").join(PLATFORM);
        let name = format!("{identifier}{SHARED_LIBRARY_EXTENSION}");
        let (file, entry) = (folder.join(&name), format!("binaries/{PLATFORM}/{name}"));
        if !file.is_file() {
            let there = names_in(&folder);
            let there = if there.is_empty() { "nothing".into() } else { there.join(", ") };
            return Err(format!("has no {entry}, which its model identifier asks for; there is: {there}"));
        }
        if !self.is_sound.get() {
            check_library(&file).map_err(|reason| format!("{entry} {reason}"))?;
            self.is_sound.set(true);
        }
        Functions::load(&file).map_err(|error| {
            let text = with_causes(&error);
            let text = text.trim_start_matches("dlopen failed: ");
            match text.split_once(": cannot open shared object file") {
                Some((missing, _)) => format!("{entry} needs {missing}, which is not on this system"),
                // The path of the temporary folder is removed, because it means nothing to a
                // reader.
                None => {
                    format!("{entry}: {}", text.replace(&format!("{}/", self.folder.path().display()), ""))
                }
            }
        })
    }

    /// Loads the library and instantiates a co-simulation unit called `name`.
    ///
    /// # Errors
    /// If the FMU has no binary for this platform or offers no co-simulation, if the library cannot be loaded, or if the
    /// FMU refuses.
    pub fn instantiate(&self, name: &str) -> Result<FmuUnit, Error> {
        let refuse = |message: String| Error::Fmu { path: self.path.clone(), message };
        let functions = self.load().map_err(refuse)?;
        if let Some(fault) = functions.version_fault() {
            warnings::warn_once(format!("{}: {fault}", self.path.display()));
        }

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
        // Some units refuse to start without memory functions although they declare that they need
        // none.
        let mut callbacks = fmi::Callbacks {
            logger: receive_message,
            allocate: Some(calloc),
            free: Some(free),
            step_finished: None,
            environment: Rc::as_ptr(&log).cast_mut().cast(),
        };
        // SAFETY: `callbacks` is a valid, exclusively borrowed structure for the whole call, which
        // only replaces the logger in it by one that expands the arguments.
        unsafe { add_logger_proxy(&raw mut callbacks) };
        let callbacks = Rc::new(callbacks);

        // SAFETY: FMI 2.0 gives the function this type; the texts outlive the call, and the unit
        // keeps callbacks and log alive as long as the instance, as FMI demands.
        let component = unsafe {
            (functions.instantiate)(
                name_text.as_ptr(),
                fmi::CO_SIMULATION,
                guid.as_ptr(),
                resources.as_ptr(),
                Rc::as_ptr(&callbacks),
                fmi::FALSE,
                fmi::TRUE,
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

/// Names of the entries of a folder, sorted; empty if the folder does not exist.
fn names_in(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let mut names: Vec<String> =
        entries.map(|entry| entry.file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

/// Checks that a library file is complete and made for this machine. Without the check, access to a
/// missing part would kill the program.
fn check_library(file: &Path) -> Result<(), String> {
    let bytes = std::fs::read(file).map_err(|error| format!("cannot be read: {error}"))?;
    let fault = |error: object::Error| format!("is no sound library: {error}");
    // The file holds libraries for several architectures, among which the loader chooses.
    if matches!(FileKind::parse(&*bytes), Ok(FileKind::MachOFat32 | FileKind::MachOFat64)) {
        return Ok(());
    }
    let library = object::File::parse(&*bytes).map_err(fault)?;
    let (own, wanted) = ((library.format(), library.architecture()), HOST);
    if own != wanted {
        return Err(format!(
            "is for {:?} ({:?}), this program needs {:?} ({:?})",
            own.1, own.0, wanted.1, wanted.0
        ));
    }
    library.segments().try_for_each(|segment| segment.data().map(drop)).map_err(fault)
}

/// Format and architecture that a library needs to run on this machine.
const HOST: (BinaryFormat, Architecture) = (
    if cfg!(windows) {
        BinaryFormat::Pe
    } else if cfg!(target_os = "macos") {
        BinaryFormat::MachO
    } else {
        BinaryFormat::Elf
    },
    if cfg!(target_arch = "aarch64") {
        Architecture::Aarch64
    } else if cfg!(target_arch = "x86") {
        Architecture::I386
    } else {
        Architecture::X86_64
    },
);

/// Returns an error and its causes as one line.
fn with_causes(error: &dyn std::error::Error) -> String {
    let causes = std::iter::successors(Some(error), |error| error.source());
    causes.map(ToString::to_string).collect::<Vec<_>>().join(": ")
}

/// The FMI functions that this program calls, and the library that holds them.
struct Functions {
    instantiate: fmi::Instantiate,
    free_instance: fmi::FreeInstance,
    setup_experiment: fmi::SetupExperiment,
    enter_initialization_mode: fmi::Plain,
    exit_initialization_mode: fmi::Plain,
    terminate: fmi::Plain,
    get_real: fmi::Get<f64>,
    get_integer: fmi::Get<i32>,
    get_boolean: fmi::Get<i32>,
    set_real: fmi::Set<f64>,
    set_integer: fmi::Set<i32>,
    set_boolean: fmi::Set<i32>,
    set_string: fmi::Set<fmi::Text>,
    do_step: fmi::DoStep,
    get_real_status: fmi::GetStatus<f64>,
    get_boolean_status: fmi::GetStatus<c_int>,
    /// Optional, because nothing depends on it and some units lack it.
    get_version: Option<fmi::GetText>,
    _library: Library,
}

impl Functions {
    fn load(file: &Path) -> Result<Self, libloading::Error> {
        // SAFETY: loading runs the library's own initializers, which are sound only if the library
        // is. Whoever runs an FMU trusts its code.
        let library = unsafe { Library::new(file) }?;
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
                _library: library,
            })
        }
    }

    /// A line about the version that the library reports, if it is missing or not FMI 2.0.
    fn version_fault(&self) -> Option<String> {
        let Some(get_version) = self.get_version else {
            return Some("its library has no fmi2GetVersion".into());
        };
        // SAFETY: FMI 2.0 gives the function this type and allows the call at any time.
        let version = text_of(unsafe { get_version() });
        let is_known = version == "2.0" || version.starts_with("2.0.");
        (!is_known).then(|| format!("its library says that it is of FMI \"{}\"", version.escape_default()))
    }
}

/// Copies the C string at `text`; a null pointer gives an empty string.
fn text_of(text: fmi::Text) -> String {
    if text.is_null() {
        return String::new();
    }
    // SAFETY: FMI passes strings that end with a zero byte and stay valid during the call; the null
    // pointer was excluded above.
    unsafe { CStr::from_ptr(text) }.to_string_lossy().into_owned()
}

/// Forwards an FMU's log messages to `tracing`, and keeps the last one that reports a problem.
struct Log {
    component: String,
    last: Mutex<Option<String>>,
    /// Whether the unit is being instantiated. Messages about problems are then part of the error
    /// that follows.
    instantiates: AtomicBool,
}

impl Log {
    fn take(&self) -> Option<String> {
        self.last.lock().unwrap_or_else(PoisonError::into_inner).take()
    }

    fn message(&self, status: Result<Status, c_int>, category: &str, message: &str) {
        let (component, message) = (&self.component, message.trim_end().replace('\n', " "));
        match status {
            Ok(Status::Ok | Status::Pending) => tracing::info!("{component}: [{category}] {message}"),
            Ok(Status::Warning) => warnings::warn(&format!("{component}: [{category}] {message}")),
            Ok(Status::Discard | Status::Error | Status::Fatal) | Err(_) => {
                if !self.instantiates.load(Ordering::Relaxed) {
                    tracing::error!("{component}: [{category}] {message}");
                }
                *self.last.lock().unwrap_or_else(PoisonError::into_inner) = Some(message);
            }
        }
    }
}

/// The logger callback, called by the C function that expands the arguments.
unsafe extern "C" fn receive_message(
    environment: *mut c_void,
    _instance: fmi::Text,
    status: c_int,
    category: fmi::Text,
    message: fmi::Text,
) {
    // SAFETY: the environment is the `Log` passed with the callbacks, which lives as long as the
    // instance.
    if let Some(log) = unsafe { environment.cast::<Log>().as_ref() } {
        log.message(fmi::status(status), &text_of(category), &text_of(message));
    }
}

/// The data that must live as long as a unit's instance.
struct Instance {
    functions: Functions,
    _callbacks: Rc<fmi::Callbacks>,
    log: Rc<Log>,
}

/// A co-simulation unit that was instantiated from an FMU.
pub struct FmuUnit {
    component: fmi::Component,
    instance: Rc<Instance>,
    fatal: bool,
    _folder: Rc<TempDir>,
}

impl FmuUnit {
    #[inline]
    fn check(&mut self, call: &'static str, status: c_int) -> Outcome {
        match fmi::status(status) {
            Ok(Status::Ok | Status::Warning) => Ok(()),
            status => Err(self.failure(call, status)),
        }
    }

    #[cold]
    fn failure(&mut self, call: &'static str, status: Result<Status, c_int>) -> UnitFailure {
        self.fatal |= status == Ok(Status::Fatal);
        let said = self.instance.log.take();
        if status == Ok(Status::Discard) && call == "doStep" {
            return self.discarded(said);
        }
        if status == Ok(Status::Pending) {
            let message = "it wants to step asynchronously, which is not supported";
            return UnitFailure::new(call, format!("{message} ({:?})", Status::Pending));
        }
        let said = said.unwrap_or_else(|| "no message in its log".into());
        UnitFailure::new(call, format!("{said} ({})", fmi::name_of(status)))
    }

    /// Describes why a step was discarded. FMI 2.0, section 4.2.3, lets a unit end the simulation
    /// in this way.
    fn discarded(&mut self, said: Option<String>) -> UnitFailure {
        let Functions { get_real_status, get_boolean_status, .. } = self.instance.functions;
        let (mut time, mut terminated) = (f64::NAN, fmi::FALSE);
        // SAFETY: the instance is alive, both pointers are valid for the calls, and FMI allows
        // these calls after fmi2Discard.
        let statuses = unsafe {
            [
                get_real_status(self.component, fmi::LAST_SUCCESSFUL_TIME, &raw mut time),
                get_boolean_status(self.component, fmi::TERMINATED, &raw mut terminated),
            ]
        };
        let [knows_time, knows_end] = statuses.map(|status| fmi::status(status) == Ok(Status::Ok));
        let ends = knows_end && terminated != fmi::FALSE;
        let mut parts: Vec<String> = said.into_iter().collect();
        if !ends && parts.is_empty() {
            parts.push("no message in its log".into());
        }
        if knows_time && time.is_finite() {
            parts.push(format!("it got as far as t = {time} s"));
        }
        UnitFailure {
            ends,
            ..UnitFailure::new("doStep", format!("{} ({:?})", parts.join("; "), Status::Discard))
        }
    }
}

impl Drop for FmuUnit {
    fn drop(&mut self) {
        if self.fatal {
            // After a fatal error no function of the FMU may be called, not even fmi2FreeInstance,
            // so the instance is leaked.
            std::mem::forget(Rc::clone(&self.instance));
        } else {
            // SAFETY: the instance is alive, is freed only here, and is not used afterwards.
            unsafe { (self.instance.functions.free_instance)(self.component) };
        }
    }
}

/// Performs a get or set call for arrays of references and values.
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
        let text = CString::new(value)
            .map_err(|_| UnitFailure::new("setString", format!("the text {value:?} holds a zero byte")))?;
        let (references, values) = ([reference], [text.as_ptr()]);
        call_with_values!(self, set_string, "setString", references, values.as_ptr(), values.len())
    }

    fn enter_initialization(&mut self, start: f64, stop: f64) -> Outcome {
        // SAFETY: the instance is alive until the unit is dropped, and the function has the type
        // FMI gives it.
        let status = unsafe {
            (self.instance.functions.setup_experiment)(
                self.component,
                fmi::FALSE,
                0.0,
                start,
                fmi::TRUE,
                stop,
            )
        };
        self.check("setupExperiment", status)?;
        // SAFETY: the instance is alive until the unit is dropped, and the function has the type
        // FMI gives it.
        let status = unsafe { (self.instance.functions.enter_initialization_mode)(self.component) };
        self.check("enterInitializationMode", status)
    }

    fn exit_initialization(&mut self) -> Outcome {
        // SAFETY: the instance is alive until the unit is dropped, and the function has the type
        // FMI gives it.
        let status = unsafe { (self.instance.functions.exit_initialization_mode)(self.component) };
        self.check("exitInitializationMode", status)
    }

    fn do_step(&mut self, time: f64, step: f64) -> Outcome {
        // SAFETY: the instance is alive until the unit is dropped, and the function has the type
        // FMI gives it.
        let status = unsafe { (self.instance.functions.do_step)(self.component, time, step, fmi::TRUE) };
        self.check("doStep", status)
    }

    fn terminate(&mut self) -> Outcome {
        // SAFETY: the instance is alive until the unit is dropped, and the function has the type
        // FMI gives it.
        let status = unsafe { (self.instance.functions.terminate)(self.component) };
        self.check("terminate", status)
    }
}
