//! Values of variables, and their partial derivatives.

use super::component::{Component, run};
use crate::call::{Call, table};
use crate::instance::{Instance, Typed};
use crate::pointer::{apart, requested, room, slice, text};
use crate::types::FmiStatus;
use std::ffi::{c_char, c_int};

/// Gets variables of type `T`, whose values `convert` turns into those of C. The caller promises
/// what [`run`] and [`requested`] ask.
pub(super) unsafe fn get<T: Typed, C: Copy + Default>(
    component: Component,
    call: &Call,
    (vr, n, value): (*const u32, usize, *mut C),
    convert: impl Fn(&T) -> C,
) -> FmiStatus {
    let body = |instance: &mut Instance| {
        // SAFETY: the caller promises what `requested` asks.
        let (references, mut values) = unsafe { requested(vr, n, value) }?;
        instance.get::<T>(references, |i, value| values.put(i, convert(value)))
    };
    // SAFETY: the caller promises what `run` asks.
    unsafe { run(component, call, body) }
}

/// Sets variables of type `T` to the values of C, converted by `convert`, or says why that is
/// refused. The caller promises what [`run`] and [`slice`] ask.
pub(super) unsafe fn set<T: Typed + std::fmt::Debug, C: Copy>(
    component: Component,
    call: &Call,
    (vr, n, value): (*const u32, usize, *const C),
    convert: impl Fn(C) -> Result<T, String>,
) -> FmiStatus {
    let body = |instance: &mut Instance| {
        // SAFETY: the caller promises what `slice` asks.
        let (references, values) = unsafe { (slice("vr", vr, n)?, slice("value", value, n)?) };
        instance.set(references, |i| convert(values[i]))
    };
    // SAFETY: the caller promises what `run` asks.
    unsafe { run(component, call, body) }
}

pub unsafe fn fmi2GetReal(
    component: Component,
    vr: *const u32,
    n: usize,
    value: *mut f64,
) -> FmiStatus {
    // SAFETY: the importer vouches for `component` and the arrays, as `get` requires.
    unsafe { get(component, &table::GET_REAL, (vr, n, value), |value: &f64| *value) }
}

pub unsafe fn fmi2GetInteger(
    component: Component,
    vr: *const u32,
    n: usize,
    value: *mut c_int,
) -> FmiStatus {
    // SAFETY: the importer vouches for `component` and the arrays, as `get` requires.
    unsafe { get(component, &table::GET_INTEGER, (vr, n, value), |value: &i32| *value) }
}

pub unsafe fn fmi2GetBoolean(
    component: Component,
    vr: *const u32,
    n: usize,
    value: *mut c_int,
) -> FmiStatus {
    // SAFETY: the importer vouches for `component` and the arrays, as `get` requires.
    unsafe {
        get(component, &table::GET_BOOLEAN, (vr, n, value), |value: &bool| c_int::from(*value))
    }
}

/// Hands out texts that live until the next call of this function on the same instance.
pub unsafe fn fmi2GetString(
    component: Component,
    vr: *const u32,
    n: usize,
    value: *mut *const c_char,
) -> FmiStatus {
    let body = |instance: &mut Instance| {
        // SAFETY: the importer vouches for both arrays, as `requested` requires.
        let (references, mut values) = unsafe { requested(vr, n, value) }?;
        for (i, text) in instance.get_strings(references)?.iter().enumerate() {
            values.put(i, text.as_ptr());
        }
        Ok(())
    };
    // SAFETY: the importer vouches for `component`, as `run` requires.
    unsafe { run(component, &table::GET_STRING, body) }
}

pub unsafe fn fmi2SetReal(
    component: Component,
    vr: *const u32,
    n: usize,
    value: *const f64,
) -> FmiStatus {
    // SAFETY: the importer vouches for `component` and the arrays, as `set` requires.
    unsafe { set(component, &table::SET_REAL, (vr, n, value), Ok) }
}

pub unsafe fn fmi2SetInteger(
    component: Component,
    vr: *const u32,
    n: usize,
    value: *const c_int,
) -> FmiStatus {
    // SAFETY: the importer vouches for `component` and the arrays, as `set` requires.
    unsafe { set(component, &table::SET_INTEGER, (vr, n, value), Ok) }
}

pub unsafe fn fmi2SetBoolean(
    component: Component,
    vr: *const u32,
    n: usize,
    value: *const c_int,
) -> FmiStatus {
    let convert = |value| match value {
        0 => Ok(false),
        1 => Ok(true),
        other => Err(format!("{other} is neither fmi2False (0) nor fmi2True (1)")),
    };
    // SAFETY: the importer vouches for `component` and the arrays, as `set` requires.
    unsafe { set(component, &table::SET_BOOLEAN, (vr, n, value), convert) }
}

pub unsafe fn fmi2SetString(
    component: Component,
    vr: *const u32,
    n: usize,
    value: *const *const c_char,
) -> FmiStatus {
    // SAFETY: the standard demands NUL-terminated texts, and `text` refuses null.
    let convert = |value| unsafe { text("value", value) }.map(String::from);
    // SAFETY: the importer vouches for `component` and the arrays, as `set` requires.
    unsafe { set(component, &table::SET_STRING, (vr, n, value), convert) }
}

pub unsafe fn fmi2GetDirectionalDerivative(
    component: Component,
    unknowns: *const u32,
    n_unknown: usize,
    knowns: *const u32,
    n_known: usize,
    dv_known: *const f64,
    dv_unknown: *mut f64,
) -> FmiStatus {
    let arguments = Derivatives {
        unknowns: ("vUnknown_ref", unknowns, n_unknown),
        knowns: ("vKnown_ref", knowns, n_known),
        seed: ("dvKnown", dv_known, n_known),
        result: ("dvUnknown", dv_unknown, n_unknown),
        adjoint: false,
    };
    // SAFETY: the importer vouches for `component` and the arrays, as `derivatives` requires.
    unsafe { derivatives(component, &table::DIRECTIONAL_DERIVATIVE, &arguments) }
}

/// Arguments of a call for derivatives: each array with its name and length.
pub(super) struct Derivatives {
    pub(super) unknowns: (&'static str, *const u32, usize),
    pub(super) knowns: (&'static str, *const u32, usize),
    pub(super) seed: (&'static str, *const f64, usize),
    pub(super) result: (&'static str, *mut f64, usize),
    pub(super) adjoint: bool,
}

/// Gives directional or adjoint derivatives. The caller promises what [`run`], [`slice`] and
/// [`room`] ask.
pub(super) unsafe fn derivatives(
    component: Component,
    call: &Call,
    arguments: &Derivatives,
) -> FmiStatus {
    let Derivatives { unknowns, knowns, seed, result, adjoint } = *arguments;
    let body = |instance: &mut Instance| {
        // SAFETY: the caller promises what `slice` asks.
        let (references, values) = unsafe {
            let unknowns = slice(unknowns.0, unknowns.1, unknowns.2)?;
            let knowns = slice(knowns.0, knowns.1, knowns.2)?;
            ((unknowns, knowns), slice(seed.0, seed.1, seed.2)?)
        };
        apart(seed, result)?;
        apart(unknowns, result)?;
        apart(knowns, result)?;
        // SAFETY: the caller promises what `room` asks. The room overlaps none of the others.
        let derivative = unsafe { room(result.0, result.1, result.2) }?;
        instance.derivatives_along(references, values, derivative, adjoint)
    };
    // SAFETY: the caller promises what `run` asks.
    unsafe { run(component, call, body) }
}
