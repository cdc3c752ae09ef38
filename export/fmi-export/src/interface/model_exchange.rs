//! Model exchange: events, time, and the continuous states that the importer integrates.

use super::component::{Component, run, run_always};
use crate::call::table;
use crate::instance::Instance;
use crate::pointer::{check, put, room, slice};
use crate::types::{CEventInfo, FmiStatus};
use std::ffi::c_int;

pub unsafe fn fmi2EnterEventMode(component: Component) -> FmiStatus {
    // SAFETY: the importer vouches for `component`, as `run` requires.
    unsafe { run(component, &table::ENTER_EVENT_MODE, Instance::enter_event_mode) }
}

pub unsafe fn fmi2NewDiscreteStates(
    component: Component,
    event_info: *mut CEventInfo,
) -> FmiStatus {
    let body = |instance: &mut Instance| {
        check("fmi2eventInfo", event_info, 1)?;
        let event = instance.new_discrete_states()?;
        let info = CEventInfo {
            values_of_continuous_states_changed: c_int::from(event.states_changed),
            next_event_time_defined: c_int::from(event.next_event_time.is_some()),
            next_event_time: event.next_event_time.unwrap_or_default(),
            terminate_simulation: c_int::from(event.terminates),
            ..CEventInfo::default()
        };
        // SAFETY: the importer vouches for the result pointer, as `put` requires.
        unsafe { put("fmi2eventInfo", event_info, info) }
    };
    // SAFETY: the importer vouches for `component`, as `run` requires.
    unsafe { run(component, &table::NEW_DISCRETE_STATES, body) }
}

pub unsafe fn fmi2EnterContinuousTimeMode(component: Component) -> FmiStatus {
    let body = Instance::enter_continuous_time_mode;
    // SAFETY: the importer vouches for `component`, as `run` requires.
    unsafe { run_always(component, &table::ENTER_CONTINUOUS_TIME, body) }
}

/// Completes an integrator step. The FMUs detect their events by time or indicator, so a completed
/// step never asks for event mode.
pub unsafe fn fmi2CompletedIntegratorStep(
    component: Component,
    _no_set_state_prior: c_int,
    enter_event_mode: *mut c_int,
    terminate: *mut c_int,
) -> FmiStatus {
    // SAFETY: the importer vouches for the result pointer, as `put` requires.
    let body = |_: &mut Instance| unsafe {
        put("enterEventMode", enter_event_mode, 0)?;
        put("terminateSimulation", terminate, 0)
    };
    // SAFETY: the importer vouches for `component`, as `run` requires.
    unsafe { run(component, &table::COMPLETED_STEP, body) }
}

pub unsafe fn fmi2SetTime(component: Component, time: f64) -> FmiStatus {
    // SAFETY: the importer vouches for `component`, as `run` requires.
    unsafe { run(component, &table::SET_TIME, |instance| instance.set_time(time)) }
}

pub unsafe fn fmi2SetContinuousStates(component: Component, x: *const f64, nx: usize) -> FmiStatus {
    // SAFETY: the importer vouches for the array, as `slice` requires.
    let body =
        |instance: &mut Instance| instance.set_continuous_states(unsafe { slice("x", x, nx) }?);
    // SAFETY: the importer vouches for `component`, as `run` requires.
    unsafe { run(component, &table::SET_CONTINUOUS_STATES, body) }
}

pub unsafe fn fmi2GetDerivatives(
    component: Component,
    derivatives: *mut f64,
    nx: usize,
) -> FmiStatus {
    let body = |instance: &mut Instance| {
        // SAFETY: the importer vouches for the array, as `room` requires.
        instance.derivatives(unsafe { room("derivatives", derivatives, nx) }?)
    };
    // SAFETY: the importer vouches for `component`, as `run` requires.
    unsafe { run(component, &table::GET_DERIVATIVES, body) }
}

pub unsafe fn fmi2GetEventIndicators(
    component: Component,
    indicators: *mut f64,
    ni: usize,
) -> FmiStatus {
    let body =
        // SAFETY: the importer vouches for the array, as `room` requires.
        |instance: &mut Instance| instance.event_indicators(unsafe { room("eventIndicators", indicators, ni) }?);
    // SAFETY: the importer vouches for `component`, as `run` requires.
    unsafe { run(component, &table::GET_EVENT_INDICATORS, body) }
}

pub unsafe fn fmi2GetContinuousStates(component: Component, x: *mut f64, nx: usize) -> FmiStatus {
    // SAFETY: the importer vouches for the array, as `room` requires.
    let body = |instance: &mut Instance| instance.continuous_states(unsafe { room("x", x, nx) }?);
    // SAFETY: the importer vouches for `component`, as `run` requires.
    unsafe { run(component, &table::GET_CONTINUOUS_STATES, body) }
}

pub unsafe fn fmi2GetNominalsOfContinuousStates(
    component: Component,
    nominals: *mut f64,
    nx: usize,
) -> FmiStatus {
    // SAFETY: the importer vouches for the array, as `room` requires.
    let body =
        |instance: &mut Instance| instance.nominals(unsafe { room("x_nominal", nominals, nx) }?);
    // SAFETY: the importer vouches for `component`, as `run` requires.
    unsafe { run(component, &table::GET_NOMINALS, body) }
}
