//! Instances of FMUs, as far as they do not depend on the version of FMI.

#![allow(unsafe_code)]

use crate::crash::Calling;
use crate::fmi::{self, Status};
use crate::folder::TemporaryFolder;
use crate::functions::{Functions, Table};
use crate::log::Log;
use crate::logs::Listed;
use float_environment::in_default;
use fmi_master::instance::{CallFailure, Outcome};
use fmi_master::quantity::rounded;
use std::ffi::c_int;
use std::mem::ManuallyDrop;
use std::rc::Rc;

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
    functions: ManuallyDrop<F>,
    _callbacks: Option<Rc<fmi::Callbacks>>,
    _listed: Listed,
    log: Rc<Log>,
}

impl<F> Drop for InstanceData<F> {
    fn drop(&mut self) {
        // Unloading the library runs code of it as well.
        let _calling = Calling::new(&self.log, "freeInstance");
        // SAFETY: the functions are dropped only here.
        unsafe { ManuallyDrop::drop(&mut self.functions) };
    }
}

/// An instance of an FMU, in this process.
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
        let functions = ManuallyDrop::new(functions);
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
            Ok(Status::Ok | Status::Warning) => {
                self.data.log.flush();
                Ok(())
            }
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

    /// Keeps the present state under a number.
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

    /// Goes back to the state with this number.
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
