//! Values of variables, with the number of values that FMI 3.0 passes besides. No variable is an
//! array, so it is that of the variables.

use super::super::component::{Component, run};
use super::super::variables::{Derivatives, derivatives, get, set};
use super::super::{fmi2GetInteger, fmi2GetString, fmi2SetInteger, fmi2SetReal, fmi2SetString};
use crate::call::{Call, Outcome, error, table};
use crate::instance::Instance;
use crate::pointer::requested;
use crate::types::FmiStatus;
use std::ffi::{c_char, c_int};

/// Runs `then` if `n` variables have `m` values, and otherwise reports the error as that of `call`.
/// The caller promises what [`run`] asks.
unsafe fn counted(
    component: Component,
    call: &Call,
    (n, m): (usize, usize),
    then: impl FnOnce() -> FmiStatus,
) -> FmiStatus {
    if n == m {
        return then();
    }
    let body = |_: &mut Instance| -> Outcome {
        error(format!("{n} variables have {n} values, but the call has {m}"))
    };
    // SAFETY: the caller promises what `run` asks.
    unsafe { run(component, call, body) }
}

/// Gets Reals, among which may be the time and event indicators.
pub unsafe fn fmi3GetFloat64(
    component: Component,
    vr: *const u32,
    n: usize,
    value: *mut f64,
    m: usize,
) -> FmiStatus {
    let body = |instance: &mut Instance| {
        // SAFETY: the importer vouches for the arrays, as `requested` requires.
        let (references, mut values) = unsafe { requested(vr, n, value) }?;
        for (i, reference) in references.iter().enumerate() {
            match instance.beyond_table(*reference)? {
                Some(number) => values.put(i, number),
                None => instance.get::<f64>(std::slice::from_ref(reference), |_, value| {
                    values.put(i, *value)
                })?,
            }
        }
        Ok(())
    };
    // SAFETY: the importer vouches for `component`, as `run` requires.
    unsafe {
        counted(component, &table::GET_REAL, (n, m), || run(component, &table::GET_REAL, body))
    }
}

/// Defines functions that do as those of FMI 2.0, once the number of values is checked.
macro_rules! as_in_fmi2 {
    ($($name:ident = $call:ident $other:ident(*$access:tt $type:ty);)*) => {$(
        pub unsafe fn $name(
            component: Component,
            vr: *const u32,
            n: usize,
            value: *$access $type,
            m: usize,
        ) -> FmiStatus {
            // SAFETY: the importer vouches for `component` and the arrays.
            unsafe {
                counted(component, &table::$call, (n, m), || $other(component, vr, n, value))
            }
        }
    )*};
}

as_in_fmi2! {
    fmi3GetInt32 = GET_INTEGER fmi2GetInteger(*mut c_int);
    fmi3GetInt64 = GET_INT64 get_item(*mut i64);
    fmi3GetBoolean = GET_BOOLEAN get_boolean(*mut u8);
    fmi3GetString = GET_STRING fmi2GetString(*mut *const c_char);
    fmi3SetFloat64 = SET_REAL fmi2SetReal(*const f64);
    fmi3SetInt32 = SET_INTEGER fmi2SetInteger(*const c_int);
    fmi3SetInt64 = SET_INT64 set_item(*const i64);
    fmi3SetBoolean = SET_BOOLEAN set_boolean(*const u8);
    fmi3SetString = SET_STRING fmi2SetString(*const *const c_char);
}

unsafe fn get_item(component: Component, vr: *const u32, n: usize, value: *mut i64) -> FmiStatus {
    // SAFETY: the importer vouches for `component` and the arrays, as `get` requires.
    unsafe { get(component, &table::GET_INT64, (vr, n, value), |value: &i64| *value) }
}

unsafe fn set_item(component: Component, vr: *const u32, n: usize, value: *const i64) -> FmiStatus {
    // SAFETY: the importer vouches for `component` and the arrays, as `set` requires.
    unsafe { set(component, &table::SET_INT64, (vr, n, value), Ok) }
}

unsafe fn get_boolean(component: Component, vr: *const u32, n: usize, value: *mut u8) -> FmiStatus {
    // SAFETY: the importer vouches for `component` and the arrays, as `get` requires.
    unsafe { get(component, &table::GET_BOOLEAN, (vr, n, value), |value: &bool| u8::from(*value)) }
}

/// Sets truth values. They are read as bytes, as those of an importer may be other than 0 and 1.
unsafe fn set_boolean(
    component: Component,
    vr: *const u32,
    n: usize,
    value: *const u8,
) -> FmiStatus {
    let convert = |value| match value {
        0 => Ok(false),
        1 => Ok(true),
        other => Err(format!("{other} is neither fmi3False (0) nor fmi3True (1)")),
    };
    // SAFETY: the importer vouches for `component` and the arrays, as `set` requires.
    unsafe { set(component, &table::SET_BOOLEAN, (vr, n, value), convert) }
}

/// Defines functions for derivatives, whose seeds and results belong to these variables.
macro_rules! derivatives {
    ($($name:ident $call:ident $adjoint:literal;)*) => {$(
        pub unsafe fn $name(
            component: Component,
            unknowns: *const u32,
            n_unknowns: usize,
            knowns: *const u32,
            n_knowns: usize,
            seed: *const f64,
            n_seed: usize,
            sensitivity: *mut f64,
            n_sensitivity: usize,
        ) -> FmiStatus {
            let arguments = Derivatives {
                unknowns: ("unknowns", unknowns, n_unknowns),
                knowns: ("knowns", knowns, n_knowns),
                seed: ("seed", seed, n_seed),
                result: ("sensitivity", sensitivity, n_sensitivity),
                adjoint: $adjoint,
            };
            let (seeds, results) =
                if $adjoint { (n_unknowns, n_knowns) } else { (n_knowns, n_unknowns) };
            // SAFETY: the importer vouches for `component` and the arrays.
            unsafe {
                counted(component, &table::$call, (seeds, n_seed), || {
                    counted(component, &table::$call, (results, n_sensitivity), || {
                        derivatives(component, &table::$call, &arguments)
                    })
                })
            }
        }
    )*};
}

derivatives! {
    fmi3GetDirectionalDerivative DIRECTIONAL_DERIVATIVE false;
    fmi3GetAdjointDerivative ADJOINT_DERIVATIVE true;
}
