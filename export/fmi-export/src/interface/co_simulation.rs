//! Co-simulation: steps, the derivatives of inputs over a step, and the status of the last one.

use super::component::{Component, run};
use crate::call::{Call, error, table};
use crate::instance::Instance;
use crate::model::Failure;
use crate::pointer::{put, slice};
use crate::types::{DO_STEP_STATUS, FmiStatus, LAST_SUCCESSFUL_TIME, PENDING_STATUS, TERMINATED};
use std::ffi::{c_char, c_int};

/// Sets derivatives of inputs of order 1 to
/// [`MAX_INPUT_DERIVATIVE_ORDER`](crate::MAX_INPUT_DERIVATIVE_ORDER), for the next step only.
pub unsafe fn fmi2SetRealInputDerivatives(
    component: Component,
    vr: *const u32,
    n: usize,
    order: *const c_int,
    value: *const f64,
) -> FmiStatus {
    let body = |instance: &mut Instance| {
        // SAFETY: the importer vouches for the array, as `slice` requires.
        let (references, orders, values) =
            unsafe { (slice("vr", vr, n)?, slice("order", order, n)?, slice("value", value, n)?) };
        instance.set_input_derivatives(references, orders, values)
    };
    // SAFETY: the importer vouches for `component`, as `run` requires.
    unsafe { run(component, &table::SET_INPUT_DERIVATIVES, body) }
}

pub unsafe fn fmi2GetRealOutputDerivatives(
    component: Component,
    _vr: *const u32,
    n: usize,
    _order: *const c_int,
    _value: *mut f64,
) -> FmiStatus {
    let body = |_: &mut Instance| match n {
        0 => Ok(()),
        _ => error("this FMU provides no output derivatives (maxOutputDerivativeOrder is 0)"),
    };
    // SAFETY: the importer vouches for `component`, as `run` requires.
    unsafe { run(component, &table::GET_OUTPUT_DERIVATIVES, body) }
}

pub unsafe fn fmi2DoStep(
    component: Component,
    point: f64,
    size: f64,
    _no_set_state_prior: c_int,
) -> FmiStatus {
    // SAFETY: the importer vouches for `component`, as `run` requires.
    unsafe { run(component, &table::DO_STEP, |instance| instance.do_step(point, size)) }
}

pub unsafe fn fmi2CancelStep(component: Component) -> FmiStatus {
    // SAFETY: the importer vouches for `component`, as `run` requires.
    unsafe { run(component, &table::CANCEL_STEP, |_| Ok(())) }
}

/// Gives a status of this `kind` if the function `answers` it. The caller promises what [`run`] and
/// [`put`] ask.
unsafe fn status<T>(
    component: Component,
    call: &Call,
    (kind, answers): (c_int, Option<c_int>),
    value: *mut T,
    answer: impl FnOnce(&Instance) -> T,
) -> FmiStatus {
    let body = |instance: &mut Instance| {
        if answers != Some(kind) {
            let problem = format!("there is no status of kind {kind} for this function");
            return Err(Failure::Discard(problem));
        }
        // SAFETY: the caller promises what `put` asks.
        unsafe { put("value", value, answer(instance)) }
    };
    // SAFETY: the caller promises what `run` asks.
    unsafe { run(component, call, body) }
}

pub unsafe fn fmi2GetStatus(component: Component, kind: c_int, value: *mut FmiStatus) -> FmiStatus {
    let kinds = (kind, Some(DO_STEP_STATUS));
    // SAFETY: the importer vouches for `component` and the result pointer, as `status` requires.
    unsafe { status(component, &table::GET_STATUS, kinds, value, Instance::last_step) }
}

pub unsafe fn fmi2GetRealStatus(component: Component, kind: c_int, value: *mut f64) -> FmiStatus {
    let kinds = (kind, Some(LAST_SUCCESSFUL_TIME));
    // SAFETY: the importer vouches for `component` and the result pointer, as `status` requires.
    unsafe { status(component, &table::GET_REAL_STATUS, kinds, value, Instance::time) }
}

pub unsafe fn fmi2GetIntegerStatus(
    component: Component,
    kind: c_int,
    value: *mut c_int,
) -> FmiStatus {
    let kinds = (kind, None);
    // SAFETY: the importer vouches for `component` and the result pointer, as `status` requires.
    unsafe { status(component, &table::GET_INTEGER_STATUS, kinds, value, |_| 0) }
}

pub unsafe fn fmi2GetBooleanStatus(
    component: Component,
    kind: c_int,
    value: *mut c_int,
) -> FmiStatus {
    let kinds = (kind, Some(TERMINATED));
    // SAFETY: the importer vouches for `component` and the result pointer, as `status` requires.
    unsafe {
        status(component, &table::GET_BOOLEAN_STATUS, kinds, value, |instance| {
            c_int::from(instance.has_ended())
        })
    }
}

pub unsafe fn fmi2GetStringStatus(
    component: Component,
    kind: c_int,
    value: *mut *const c_char,
) -> FmiStatus {
    let kinds = (kind, Some(PENDING_STATUS));
    // SAFETY: the importer vouches for `component` and the result pointer, as `status` requires.
    unsafe {
        status(component, &table::GET_STRING_STATUS, kinds, value, |_| {
            c"no step is pending".as_ptr()
        })
    }
}
