//! Functions of FMI 3.0 whose signatures differ from those of FMI 2.0. All others call those of FMI
//! 2.0 with another name.

mod values;
mod without_use;

pub use values::*;
pub use without_use::*;

use super::component::{Component, Request, instantiate, run, run_always};
use super::fmi2SetDebugLogging;
use crate::call::table;
use crate::instance::{Instance, Stops};
use crate::logger::{Logger, Receiver};
use crate::model_instance::Export;
use crate::pointer::{check, put};
use crate::types::{FmiStatus, Interface, LogMessageCallback};
use model_description::Version;
use std::ffi::{CString, c_char, c_int, c_void};

pub fn fmi3GetVersion() -> *const c_char {
    c"3.0".as_ptr()
}

/// Returns what makes the logger of an instance of this name.
fn logger(
    log: Option<LogMessageCallback>,
    environment: *mut c_void,
    on: bool,
) -> impl Fn(CString) -> Logger {
    move |name| Logger::to(log.map(Receiver::Fmi3), environment, name, on)
}

pub unsafe fn fmi3InstantiateModelExchange(
    exports: &[Export],
    instance_name: *const c_char,
    token: *const c_char,
    resources: *const c_char,
    logging_on: bool,
    environment: *mut c_void,
    log: Option<LogMessageCallback>,
) -> Component {
    let request = Request {
        function: "fmi3InstantiateModelExchange",
        version: Version::Fmi3,
        interface: Ok(Interface::ModelExchange),
        stops: Stops::default(),
        instance_name,
        identity: token,
        resources,
    };
    // SAFETY: the standard demands NUL-terminated texts, of which the path may be null.
    unsafe { instantiate(exports, request, logger(log, environment, logging_on)) }
}

pub unsafe fn fmi3InstantiateCoSimulation(
    exports: &[Export],
    instance_name: *const c_char,
    token: *const c_char,
    resources: *const c_char,
    logging_on: bool,
    event_mode: bool,
    early_return: bool,
    environment: *mut c_void,
    log: Option<LogMessageCallback>,
) -> Component {
    let request = Request {
        function: "fmi3InstantiateCoSimulation",
        version: Version::Fmi3,
        interface: Ok(Interface::CoSimulation),
        stops: Stops { event_mode, early_return },
        instance_name,
        identity: token,
        resources,
    };
    // SAFETY: the standard demands NUL-terminated texts, of which the path may be null.
    unsafe { instantiate(exports, request, logger(log, environment, logging_on)) }
}

/// Refuses: no FMU is for scheduled execution.
pub unsafe fn fmi3InstantiateScheduledExecution(
    exports: &[Export],
    instance_name: *const c_char,
    token: *const c_char,
    resources: *const c_char,
    logging_on: bool,
    environment: *mut c_void,
    log: Option<LogMessageCallback>,
) -> Component {
    let request = Request {
        function: "fmi3InstantiateScheduledExecution",
        version: Version::Fmi3,
        interface: Err("the FMUs of this library have no scheduled execution".into()),
        stops: Stops::default(),
        instance_name,
        identity: token,
        resources,
    };
    // SAFETY: the standard demands NUL-terminated texts, of which the path may be null.
    unsafe { instantiate(exports, request, logger(log, environment, logging_on)) }
}

pub unsafe fn fmi3SetDebugLogging(
    component: Component,
    logging_on: bool,
    n: usize,
    categories: *const *const c_char,
) -> FmiStatus {
    // SAFETY: the importer vouches for `component` and the array.
    unsafe { fmi2SetDebugLogging(component, c_int::from(logging_on), n, categories) }
}

pub unsafe fn fmi3EnterInitializationMode(
    component: Component,
    tolerance_defined: bool,
    tolerance: f64,
    start_time: f64,
    stop_time_defined: bool,
    stop_time: f64,
) -> FmiStatus {
    let body = |instance: &mut Instance| {
        let tolerance = tolerance_defined.then_some(tolerance);
        instance.setup_experiment(start_time, stop_time_defined.then_some(stop_time), tolerance)?;
        instance.enter_initialization_mode();
        Ok(())
    };
    // SAFETY: the importer vouches for `component`, as `run` requires.
    unsafe { run(component, &table::ENTER_INITIALIZATION_MODE, body) }
}

/// Handles an event. One iteration is enough for all FMUs.
pub unsafe fn fmi3UpdateDiscreteStates(
    component: Component,
    needs_update: *mut bool,
    terminate: *mut bool,
    nominals_changed: *mut bool,
    states_changed: *mut bool,
    next_event_time_defined: *mut bool,
    next_event_time: *mut f64,
) -> FmiStatus {
    let body = |instance: &mut Instance| {
        check("discreteStatesNeedUpdate", needs_update, 1)?;
        let event = instance.new_discrete_states()?;
        // SAFETY: the importer vouches for the result pointers, as `put` requires.
        unsafe {
            put("discreteStatesNeedUpdate", needs_update, false)?;
            put("terminateSimulation", terminate, event.terminates)?;
            put("nominalsOfContinuousStatesChanged", nominals_changed, false)?;
            put("valuesOfContinuousStatesChanged", states_changed, event.states_changed)?;
            let next = event.next_event_time;
            put("nextEventTimeDefined", next_event_time_defined, next.is_some())?;
            put("nextEventTime", next_event_time, next.unwrap_or_default())
        }
    };
    // SAFETY: the importer vouches for `component`, as `run` requires.
    unsafe { run(component, &table::NEW_DISCRETE_STATES, body) }
}

/// Completes an integrator step, which never asks for event mode (see fmi2CompletedIntegratorStep).
pub unsafe fn fmi3CompletedIntegratorStep(
    component: Component,
    _no_set_state_prior: bool,
    enter_event_mode: *mut bool,
    terminate: *mut bool,
) -> FmiStatus {
    // SAFETY: the importer vouches for the result pointers, as `put` requires.
    let body = |_: &mut Instance| unsafe {
        put("enterEventMode", enter_event_mode, false)?;
        put("terminateSimulation", terminate, false)
    };
    // SAFETY: the importer vouches for `component`, as `run` requires.
    unsafe { run(component, &table::COMPLETED_STEP, body) }
}

pub unsafe fn fmi3GetNumberOfEventIndicators(component: Component, n: *mut usize) -> FmiStatus {
    // SAFETY: the importer vouches for the result pointer, as `put` requires.
    let body = |instance: &mut Instance| unsafe { put("nEventIndicators", n, instance.sizes().1) };
    // SAFETY: the importer vouches for `component`, as `run` requires.
    unsafe { run(component, &table::NUMBER_OF_INDICATORS, body) }
}

pub unsafe fn fmi3GetNumberOfContinuousStates(component: Component, n: *mut usize) -> FmiStatus {
    // SAFETY: the importer vouches for the result pointer, as `put` requires.
    let body = |instance: &mut Instance| unsafe { put("nContinuousStates", n, instance.sizes().0) };
    // SAFETY: the importer vouches for `component`, as `run` requires.
    unsafe { run(component, &table::NUMBER_OF_STATES, body) }
}

pub unsafe fn fmi3EnterStepMode(component: Component) -> FmiStatus {
    // SAFETY: the importer vouches for `component`, as `run` requires.
    unsafe { run_always(component, &table::ENTER_STEP_MODE, Instance::enter_step_mode) }
}

/// Performs a step. Its end is reported, and is no failure as in FMI 2.0.
pub unsafe fn fmi3DoStep(
    component: Component,
    point: f64,
    size: f64,
    _no_set_state_prior: bool,
    event_needed: *mut bool,
    terminate: *mut bool,
    early_return: *mut bool,
    last_successful_time: *mut f64,
) -> FmiStatus {
    let body = |instance: &mut Instance| {
        check("eventHandlingNeeded", event_needed, 1)?;
        check("terminateSimulation", terminate, 1)?;
        check("earlyReturn", early_return, 1)?;
        check("lastSuccessfulTime", last_successful_time, 1)?;
        let stepped = instance.step_to_event(point, size)?;
        // SAFETY: the importer vouches for the result pointers, as `put` requires.
        unsafe {
            put("eventHandlingNeeded", event_needed, stepped.event)?;
            put("terminateSimulation", terminate, stepped.ended)?;
            put("earlyReturn", early_return, stepped.early)?;
            put("lastSuccessfulTime", last_successful_time, stepped.time)
        }
    };
    // SAFETY: the importer vouches for `component`, as `run` requires.
    unsafe { run(component, &table::DO_STEP, body) }
}
