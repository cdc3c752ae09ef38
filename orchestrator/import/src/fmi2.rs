//! Instances of FMI 2.0.
//!
//! The logger that expands `printf` arguments comes from `fmi-rs`. The calls go through libloading,
//! because `fmi-rs` frees the callback structure after fmi2Instantiate, while FMUs of several
//! exporters keep the pointer to it and crash when they log. The C types are in [`fmi`], because
//! those of `fmi-rs` represent a status as an enumeration.

#![allow(unsafe_code)]

use crate::fmi::{self, Status};
use crate::folder::TemporaryFolder;
use crate::functions::{Functions, InterfaceFunctions, StepFunctions, c_texts};
use crate::library::{FmuInstance, foreign};
use crate::log::Log;
use crate::logs::{self, Listed};
use fmi_master::instance::{CallFailure, Instance, Outcome};
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
            (functions.own.instantiate)(
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
        let [knows_time, knows_end] = [
            self.status("getStatus", |_, handle| unsafe {
                get_real_status(handle, fmi::LAST_SUCCESSFUL_TIME, &raw mut time)
            }),
            // SAFETY: as above.
            self.status("getStatus", |_, handle| unsafe {
                get_boolean_status(handle, fmi::TERMINATED, &raw mut terminated)
            }),
        ]
        .map(|status| status == Ok(Status::Ok));
        let ends = knows_end && terminated != fmi::FALSE;
        self.stopped(ends, knows_time.then_some(time), &format!("{:?}", Status::Discard))
    }
}

/// Performs a get or set call for arrays of references and values.
macro_rules! call_with_values {
    ($self:ident, $function:ident, $name:literal, $references:ident, $values:ident, $pointer:expr) => {{
        assert_eq!($references.len(), $values.len(), "as many values as references");
        // SAFETY: the instance is alive, and both arrays have the length that is passed.
        $self.call($name, |functions, handle| unsafe {
            (functions.own.$function)(handle, $references.as_ptr(), $references.len(), $pointer)
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
            (functions.own.setup_experiment)(handle, is_told, tolerance, start, fmi::TRUE, stop)
        })?;
        self.call_plain("enterInitializationMode", self.functions().own.enter_initialization_mode)
    }

    fn exit_initialization(&mut self) -> Outcome {
        self.begin()
    }

    fn do_step(&mut self, time: f64, step: f64) -> Outcome {
        let InterfaceFunctions::CoSimulation(functions) = self.functions().interface else {
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
}
