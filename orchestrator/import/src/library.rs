//! Calls an FMU's library.
//!
//! The logger that expands `printf` arguments comes from `fmi-rs`. The calls go through libloading,
//! because `fmi-rs` frees the callback structure after fmi2Instantiate, while FMUs of several
//! exporters keep the pointer to it and crash when they log. The C types are in [`fmi`], because
//! those of `fmi-rs` represent a status as an enumeration.

#![allow(unsafe_code)]

use crate::crash::Calling;
use crate::fmi::{self, Status};
use crate::folder::TemporaryFolder;
use crate::functions::{Functions, InterfaceFunctions, StepFunctions, Table, c_texts};
use crate::log::Log;
use crate::logs::{self, Listed};
use float_environment::in_default;
use fmi_master::instance::{CallFailure, Instance, Outcome};
use fmi_master::quantity::rounded;
use std::ffi::{CString, c_int, c_void};
use std::rc::Rc;

unsafe extern "C" {
    /// Wraps the logger in a C function that expands the `printf` arguments of a message. It is
    /// part of `fmi-rs`.
    fn add_logger_proxy(functions: *mut fmi::Callbacks);
    /// The C library's `calloc`, for FMUs that request memory from their environment.
    fn calloc(count: usize, size: usize) -> *mut c_void;
    /// The C library's `free`, which releases that memory.
    fn free(memory: *mut c_void);
}

/// The logger callback, called by the C function that expands the arguments.
unsafe extern "C" fn receive_message(
    environment: *mut c_void,
    _instance: fmi::Text,
    status: c_int,
    category: fmi::Text,
    message: fmi::Text,
) {
    // SAFETY: the arguments are those of the instance.
    unsafe { logs::receive(environment, status, category, message) };
}

/// Calls a function of a library. Its name is recorded meanwhile, in case it crashes, and the
/// floating-point environment that it leaves behind is not kept.
#[inline]
pub(crate) fn foreign<R>(log: &Log, name: &'static str, function: impl FnOnce() -> R) -> R {
    let _calling = Calling::new(log, name);
    in_default(function)
}

/// Keeps a state under a number, in place of an earlier one with that number.
pub(crate) fn put<T>(kept: &mut Vec<T>, number: usize, state: T) {
    match kept.get_mut(number) {
        Some(kept) => *kept = state,
        None => kept.push(state),
    }
}

/// The data that must live as long as an instance.
struct InstanceData<F> {
    functions: F,
    _callbacks: Option<Rc<fmi::Callbacks>>,
    _listed: Listed,
    log: Rc<Log>,
}

/// An instance of an FMU, in this process. What all versions of FMI have in common is here; as an
/// [`Instance`] it is one of FMI 2.0.
pub(crate) struct FmuInstance<F: Table = Functions> {
    handle: fmi::Handle,
    data: Rc<InstanceData<F>>,
    /// States that the instance keeps, by their numbers.
    kept: Vec<fmi::StateHandle>,
    fatal: bool,
    /// Whether the last call that failed was discarded.
    pub(crate) is_discarded: bool,
    /// Relative tolerance that the instance is told of.
    pub(crate) tolerance: Option<f64>,
    _folder: Option<Rc<TemporaryFolder>>,
}

impl FmuInstance {
    /// Makes an instance with the name in its log. `folder` holds the unpacked archive, if it would
    /// vanish otherwise.
    pub(crate) fn new(
        functions: Functions,
        log: Rc<Log>,
        (guid, resources): (&str, &str),
        folder: Option<Rc<TemporaryFolder>>,
    ) -> Result<Self, String> {
        let texts = c_texts([&log.component, guid, resources])?;
        let [name, guid, resources] = &texts;

        // Some FMUs refuse to start without memory functions although they declare that they need
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
        let listed = Listed::new(&log);

        let kind = match functions.interface {
            InterfaceFunctions::CoSimulation(_) => fmi::CO_SIMULATION,
            InterfaceFunctions::ModelExchange { .. } => fmi::MODEL_EXCHANGE,
        };
        // SAFETY: FMI 2.0 gives the function this type; the texts outlive the call, and the
        // instance keeps callbacks and log alive as long as the instance, as FMI demands.
        let handle = foreign(&log, "instantiate", || unsafe {
            (functions.instantiate)(
                name.as_ptr(),
                kind,
                guid.as_ptr(),
                resources.as_ptr(),
                Rc::as_ptr(&callbacks),
                fmi::FALSE,
                fmi::TRUE,
            )
        });
        Self::made(handle, functions, Some(callbacks), listed, log, folder)
    }

    /// Describes why a step was discarded. FMI 2.0, section 4.2.3, lets an FMU end the simulation
    /// in this way.
    #[cold]
    fn discarded(&mut self, functions: StepFunctions) -> CallFailure {
        let StepFunctions { get_real_status, get_boolean_status, .. } = functions;
        let (mut time, mut terminated) = (f64::NAN, fmi::FALSE);
        // SAFETY: the instance is alive, both pointers are valid for the calls, and FMI allows
        // these calls after fmi2Discard.
        let statuses = foreign(&self.data.log, "getStatus", || unsafe {
            [
                get_real_status(self.handle, fmi::LAST_SUCCESSFUL_TIME, &raw mut time),
                get_boolean_status(self.handle, fmi::TERMINATED, &raw mut terminated),
            ]
        });
        let [knows_time, knows_end] = statuses.map(|status| fmi::status(status) == Ok(Status::Ok));
        let ends = knows_end && terminated != fmi::FALSE;
        self.stopped(ends, knows_time.then_some(time), &format!("{:?}", Status::Discard))
    }
}

impl<F: Table> FmuInstance<F> {
    /// Takes over an instance that its library has made, or says why it made none.
    pub(crate) fn made(
        handle: fmi::Handle,
        functions: F,
        callbacks: Option<Rc<fmi::Callbacks>>,
        listed: Listed,
        log: Rc<Log>,
        folder: Option<Rc<TemporaryFolder>>,
    ) -> Result<Self, String> {
        if handle.is_null() {
            let message = log.take().unwrap_or_else(|| "its library returned no instance".into());
            return Err(format!("could not be instantiated: {message}"));
        }
        log.is_instantiated();
        let data = Rc::new(InstanceData { functions, _callbacks: callbacks, _listed: listed, log });
        Ok(Self {
            handle,
            data,
            kept: Vec::new(),
            fatal: false,
            is_discarded: false,
            tolerance: None,
            _folder: folder,
        })
    }

    /// Takes the last message that reports no problem.
    pub(crate) fn message(&self) -> Option<String> {
        self.data.log.take_event()
    }

    pub(crate) fn functions(&self) -> &F {
        &self.data.functions
    }

    #[inline]
    pub(crate) fn call(
        &mut self,
        call: &'static str,
        function: impl FnOnce(&F, fmi::Handle) -> c_int,
    ) -> Outcome {
        let status = self.status(call, function);
        self.check(call, status)
    }

    /// Makes a call, and returns its status.
    #[inline]
    pub(crate) fn status(
        &mut self,
        call: &'static str,
        function: impl FnOnce(&F, fmi::Handle) -> c_int,
    ) -> Result<Status, c_int> {
        let (data, handle) = (&self.data, self.handle);
        fmi::status(foreign(&data.log, call, || function(&data.functions, handle)))
    }

    /// Makes a failure of a status that is one.
    #[inline]
    pub(crate) fn check(&mut self, call: &'static str, status: Result<Status, c_int>) -> Outcome {
        match status {
            Ok(Status::Ok | Status::Warning) => Ok(()),
            status => Err(self.failure(call, status)),
        }
    }

    pub(crate) fn call_plain(&mut self, call: &'static str, function: fmi::Plain) -> Outcome {
        // SAFETY: the instance is alive until this value is dropped, and the function is one of its
        // library with the type that FMI gives it.
        self.call(call, |_, handle| unsafe { function(handle) })
    }

    #[cold]
    fn failure(&mut self, call: &'static str, status: Result<Status, c_int>) -> CallFailure {
        self.fatal |= status == Ok(Status::Fatal);
        self.is_discarded = status == Ok(Status::Discard);
        let message = self.data.log.take();
        if status == Ok(Status::Pending) {
            let message = "the step is asynchronous, which is not supported";
            return CallFailure::new(call, format!("{message} ({:?})", Status::Pending));
        }
        let message = message.unwrap_or_else(|| "its log holds no message".into());
        CallFailure::answer(call, format!("{message} ({})", fmi::name_of(status, F::VERSION)))
    }

    /// Describes a step that an instance did not complete, with the time (s) that it has `reached`
    /// and what it `returned`. With `ends` it has ended the simulation.
    #[cold]
    pub(crate) fn stopped(
        &mut self,
        ends: bool,
        reached: Option<f64>,
        returned: &str,
    ) -> CallFailure {
        let told = self.data.log.take().or_else(|| self.data.log.take_event().filter(|_| ends));
        let mut parts: Vec<String> = told.into_iter().collect();
        if !ends && parts.is_empty() {
            parts.push("its log holds no message".into());
        }
        let reached = reached.filter(|time| time.is_finite());
        if let Some(time) = reached {
            parts.push(format!("it got as far as t = {} s", rounded(time)));
        }
        CallFailure {
            ends: ends.then_some(reached.unwrap_or(f64::NAN)),
            ..CallFailure::answer("doStep", format!("{} ({returned})", parts.join("; ")))
        }
    }

    /// Leaves initialization mode.
    pub(crate) fn begin(&mut self) -> Outcome {
        let function = self.data.functions.common().exit_initialization_mode;
        self.call_plain("exitInitializationMode", function)
    }

    /// Ends the simulation.
    pub(crate) fn end(&mut self) -> Outcome {
        self.call_plain("terminate", self.data.functions.common().terminate)
    }

    /// Goes back to the state behind instantiation.
    pub(crate) fn start_anew(&mut self) -> Outcome {
        let Some(reset) = self.data.functions.common().reset else {
            let text = format!("its library has no fmi{}Reset", F::VERSION);
            return Err(CallFailure::new("reset", text));
        };
        self.call_plain("reset", reset)
    }

    /// Keeps the present state under a number, as [`Instance::save`] does.
    pub(crate) fn keep(&mut self, number: usize) -> Outcome {
        let Some(functions) = self.data.functions.common().states else {
            return Err(CallFailure::new("getFMUstate", "its library keeps no states"));
        };
        // A null pointer asks for a new state.
        let mut state = self.kept.get(number).copied().unwrap_or(std::ptr::null_mut());
        // SAFETY: the instance is alive, and the state is null or one that it made.
        self.call("getFMUstate", |_, handle| unsafe { (functions.get)(handle, &raw mut state) })?;
        put(&mut self.kept, number, state);
        Ok(())
    }

    /// Goes back to the state with this number, as [`Instance::restore`] does.
    pub(crate) fn go_back(&mut self, number: usize) -> Outcome {
        let (Some(functions), Some(&state)) =
            (self.data.functions.common().states, self.kept.get(number))
        else {
            return Err(CallFailure::new("setFMUstate", "no such state was kept"));
        };
        // SAFETY: the instance is alive and made this state.
        self.call("setFMUstate", |_, handle| unsafe { (functions.set)(handle, state) })
    }
}

impl<F: Table> Drop for FmuInstance<F> {
    fn drop(&mut self) {
        if self.fatal {
            // After a fatal error no function of the FMU may be called, not even fmi2FreeInstance,
            // so the instance is leaked.
            std::mem::forget(Rc::clone(&self.data));
        } else {
            let free_instance = self.data.functions.common().free_instance;
            if let Some(functions) = self.data.functions.common().states {
                for state in &mut self.kept {
                    foreign(&self.data.log, "freeFMUstate", || {
                        // SAFETY: the instance is alive, made this state, and frees it only here.
                        unsafe { (functions.free)(self.handle, state) }
                    });
                }
            }
            // SAFETY: the instance is alive, is freed only here, and is not used afterwards.
            foreign(&self.data.log, "freeInstance", || unsafe { free_instance(self.handle) });
        }
    }
}

/// Performs a get or set call for arrays of references and values.
macro_rules! call_with_values {
    ($self:ident, $function:ident, $name:literal, $references:ident, $values:ident, $pointer:expr) => {{
        assert_eq!($references.len(), $values.len(), "as many values as references");
        // SAFETY: the instance is alive, and both arrays have the length that is passed.
        $self.call($name, |functions, handle| unsafe {
            (functions.$function)(handle, $references.as_ptr(), $references.len(), $pointer)
        })
    }};
}

impl Instance for FmuInstance {
    fn get_real(&mut self, references: &[u32], values: &mut [f64]) -> Outcome {
        call_with_values!(self, get_real, "getReal", references, values, values.as_mut_ptr())
    }

    fn get_integer(&mut self, references: &[u32], values: &mut [i32]) -> Outcome {
        call_with_values!(self, get_integer, "getInteger", references, values, values.as_mut_ptr())
    }

    fn get_boolean(&mut self, references: &[u32], values: &mut [i32]) -> Outcome {
        call_with_values!(self, get_boolean, "getBoolean", references, values, values.as_mut_ptr())
    }

    fn set_real(&mut self, references: &[u32], values: &[f64]) -> Outcome {
        call_with_values!(self, set_real, "setReal", references, values, values.as_ptr())
    }

    fn set_integer(&mut self, references: &[u32], values: &[i32]) -> Outcome {
        call_with_values!(self, set_integer, "setInteger", references, values, values.as_ptr())
    }

    fn set_boolean(&mut self, references: &[u32], values: &[i32]) -> Outcome {
        call_with_values!(self, set_boolean, "setBoolean", references, values, values.as_ptr())
    }

    fn set_string(&mut self, reference: u32, value: &str) -> Outcome {
        let text = CString::new(value).map_err(|_| {
            CallFailure::new("setString", format!("the text {value:?} contains a zero byte"))
        })?;
        let (references, values) = ([reference], [text.as_ptr()]);
        call_with_values!(self, set_string, "setString", references, values, values.as_ptr())
    }

    fn enter_initialization(&mut self, start: f64, stop: f64) -> Outcome {
        let is_told = self.tolerance.map_or(fmi::FALSE, |_| fmi::TRUE);
        let tolerance = self.tolerance.unwrap_or(0.0);
        // SAFETY: the instance is alive, and the function has the type FMI gives it.
        self.call("setupExperiment", |functions, handle| unsafe {
            (functions.setup_experiment)(handle, is_told, tolerance, start, fmi::TRUE, stop)
        })?;
        self.call_plain("enterInitializationMode", self.data.functions.enter_initialization_mode)
    }

    fn exit_initialization(&mut self) -> Outcome {
        self.begin()
    }

    fn do_step(&mut self, time: f64, step: f64) -> Outcome {
        let InterfaceFunctions::CoSimulation(functions) = self.data.functions.interface else {
            return Err(CallFailure::new("doStep", "it is an instance for model exchange"));
        };
        // SAFETY: the instance is alive, and the function has the type FMI gives it.
        let status = self.status("doStep", |_, handle| unsafe {
            (functions.do_step)(handle, time, step, fmi::TRUE)
        });
        if status == Ok(Status::Discard) {
            return Err(self.discarded(functions));
        }
        self.check("doStep", status)
    }

    fn terminate(&mut self) -> Outcome {
        self.end()
    }

    fn reset(&mut self) -> Outcome {
        self.start_anew()
    }

    fn save(&mut self, number: usize) -> Outcome {
        self.keep(number)
    }

    fn restore(&mut self, number: usize) -> Outcome {
        self.go_back(number)
    }

    fn directional_derivative(
        &mut self,
        unknown: &[u32],
        known: &[u32],
        seed: &[f64],
        added: &mut [f64],
    ) -> Outcome {
        assert_eq!((known.len(), unknown.len()), (seed.len(), added.len()), "one value for each");
        let Some(function) = self.data.functions.directional_derivative else {
            let call = "getDirectionalDerivative";
            return Err(CallFailure::new(call, "its library computes no derivatives"));
        };
        // SAFETY: the instance is alive, and all arrays have the lengths that are passed.
        self.call("getDirectionalDerivative", |_, handle| unsafe {
            function(
                handle,
                unknown.as_ptr(),
                unknown.len(),
                known.as_ptr(),
                known.len(),
                seed.as_ptr(),
                added.as_mut_ptr(),
            )
        })
    }
}
