//! Functions of FMI 3.0 whose signatures differ from those of FMI 2.0. All others call those of FMI
//! 2.0 with another name.

mod values;
mod without_use;

pub use values::*;
pub use without_use::*;

use super::component::{Component, Request, instantiate, run};
use super::fmi2SetDebugLogging;
use crate::call::table;
use crate::instance::{Instance, Stops};
use crate::logger::{Logger, Receiver};
use crate::model_instance::Export;
use crate::pointer::put;
use crate::types::{FmiStatus, Interface, LogMessageCallback};
use model_description::Version;
use std::ffi::{c_char, c_int, c_void};

pub unsafe fn fmi3GetVersion() -> *const c_char {
    c"3.0".as_ptr()
}

/// Defines functions that make an instance. The arguments in brackets come before and after those
/// of the logger.
macro_rules! instantiate {
    ($(#[$doc:meta] $name:ident($($before:ident: $type:ty),*)($($after:ident),*)
        = $interface:expr, $stops:expr;)*) => {$(
        #[$doc]
        pub unsafe fn $name(
            exports: &[Export],
            instance_name: *const c_char,
            identity: *const c_char,
            resources: *const c_char,
            _visible: bool,
            logging_on: bool,
            $($before: $type,)*
            environment: *mut c_void,
            log: Option<LogMessageCallback>,
            $($after: *const c_void,)*
        ) -> Component {
            let (function, version) = (stringify!($name), Version::Fmi3);
            let (interface, stops) = ($interface, $stops);
            let request =
                Request { function, version, interface, stops, instance_name, identity, resources };
            let receiver = log.map(Receiver::Fmi3);
            let logger = |name| Logger::to(receiver, environment, name, logging_on);
            // SAFETY: the standard demands NUL-terminated texts, of which the path may be null.
            unsafe { instantiate(exports, request, logger) }
        }
    )*};
}

instantiate! {
    /// Makes an instance for model exchange.
    fmi3InstantiateModelExchange()() = Ok(Interface::ModelExchange), Stops::default();
    /// Makes an instance for co-simulation. Intermediate updates are not provided.
    fmi3InstantiateCoSimulation(event_mode: bool, early_return: bool, _vr: *const u32, _n: usize)(_update)
        = Ok(Interface::CoSimulation), Stops { event_mode, early_return };
    /// Refuses.
    fmi3InstantiateScheduledExecution()(_clock_update, _lock, _unlock)
        = Err("the FMUs of this library have no scheduled execution".into()), Stops::default();
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

/// Defines functions by their calls and what they do.
macro_rules! functions {
    ($($(#[$doc:meta])? $name:ident($($argument:ident: $type:ty),*) = $call:ident $body:expr;)*) => {$(
        $(#[$doc])?
        pub unsafe fn $name(component: Component, $($argument: $type),*) -> FmiStatus {
            // SAFETY: the importer vouches for `component` and the result pointers, as `run` and
            // `put` require.
            unsafe { run(component, &table::$call, $body) }
        }
    )*};
}

functions! {
    fmi3EnterInitializationMode(has_tolerance: bool, tolerance: f64, start: f64, has_stop: bool, stop: f64)
    = ENTER_INITIALIZATION_MODE |instance: &mut Instance| {
        instance.setup_experiment(start, has_stop.then_some(stop), has_tolerance.then_some(tolerance))?;
        instance.enter_initialization_mode();
        Ok(())
    };
    /// Handles an event. One iteration is enough for all FMUs.
    fmi3UpdateDiscreteStates(
        needs_update: *mut bool,
        terminate: *mut bool,
        nominals_changed: *mut bool,
        states_changed: *mut bool,
        has_next_event: *mut bool,
        next_event_time: *mut f64
    ) = NEW_DISCRETE_STATES |instance: &mut Instance| {
        let event = instance.new_discrete_states()?;
        put("discreteStatesNeedUpdate", needs_update, false)?;
        put("terminateSimulation", terminate, event.terminates)?;
        put("nominalsOfContinuousStatesChanged", nominals_changed, false)?;
        put("valuesOfContinuousStatesChanged", states_changed, event.states_changed)?;
        put("nextEventTimeDefined", has_next_event, event.next_event_time.is_some())?;
        put("nextEventTime", next_event_time, event.next_event_time.unwrap_or_default())
    };
    /// Completes an integrator step, which never asks for event mode, as in FMI 2.0.
    fmi3CompletedIntegratorStep(_no_set_prior: bool, enter_event_mode: *mut bool, terminate: *mut bool)
    = COMPLETED_STEP |_: &mut Instance| {
        put("enterEventMode", enter_event_mode, false)?;
        put("terminateSimulation", terminate, false)
    };
    fmi3GetNumberOfEventIndicators(n: *mut usize) = NUMBER_OF_INDICATORS
        |instance: &mut Instance| put("nEventIndicators", n, instance.sizes().1);
    fmi3GetNumberOfContinuousStates(n: *mut usize) = NUMBER_OF_STATES
        |instance: &mut Instance| put("nContinuousStates", n, instance.sizes().0);
    fmi3EnterStepMode() = ENTER_STEP_MODE |instance: &mut Instance| {
        instance.enter_step_mode();
        Ok(())
    };
    /// Performs a step. The end of the simulation is reported, and is no failure as in FMI 2.0.
    fmi3DoStep(
        point: f64,
        size: f64,
        _no_set_state_prior: bool,
        event: *mut bool,
        terminate: *mut bool,
        early: *mut bool,
        time: *mut f64
    ) = DO_STEP |instance: &mut Instance| {
        let stepped = instance.step_to_event(point, size)?;
        put("eventHandlingNeeded", event, stepped.event)?;
        put("terminateSimulation", terminate, stepped.ended)?;
        put("earlyReturn", early, stepped.early)?;
        put("lastSuccessfulTime", time, stepped.time)
    };
}
