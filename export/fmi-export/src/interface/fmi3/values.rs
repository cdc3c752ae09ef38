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

/// Defines functions that access variables, once the number of values is checked.
macro_rules! values {
    ($($name:ident = $call:ident(*$access:tt $type:ty) $then:expr;)*) => {$(
        pub unsafe fn $name(
            component: Component,
            vr: *const u32,
            n: usize,
            value: *$access $type,
            m: usize,
        ) -> FmiStatus {
            let call = &table::$call;
            // SAFETY: the importer vouches for `component` and the arrays.
            unsafe { counted(component, call, (n, m), || $then(component, call, (vr, n, value))) }
        }
    )*};
}

values! {
    fmi3GetFloat64 = GET_REAL(*mut f64) get_reals;
    fmi3GetInt32 = GET_INTEGER(*mut c_int) |c, _, (vr, n, value)| fmi2GetInteger(c, vr, n, value);
    fmi3GetInt64 = GET_INT64(*mut i64)
        |c, call, array| get(c, call, array, |value: &i32| i64::from(*value));
    fmi3GetBoolean = GET_BOOLEAN(*mut u8)
        |c, call, array| get(c, call, array, |value: &bool| u8::from(*value));
    fmi3GetString = GET_STRING(*mut *const c_char)
        |c, _, (vr, n, value)| fmi2GetString(c, vr, n, value);
    fmi3SetFloat64 = SET_REAL(*const f64) |c, _, (vr, n, value)| fmi2SetReal(c, vr, n, value);
    fmi3SetInt32 = SET_INTEGER(*const c_int) |c, _, (vr, n, value)| fmi2SetInteger(c, vr, n, value);
    fmi3SetInt64 = SET_INT64(*const i64) |c, call, array| set(c, call, array, item);
    fmi3SetBoolean = SET_BOOLEAN(*const u8) |c, call, array| set(c, call, array, truth);
    fmi3SetString = SET_STRING(*const *const c_char)
        |c, _, (vr, n, value)| fmi2SetString(c, vr, n, value);
}

/// Gets Reals, among which may be the time and event indicators. The caller promises what [`run`]
/// and [`requested`] ask.
unsafe fn get_reals(
    component: Component,
    call: &Call,
    (vr, n, value): (*const u32, usize, *mut f64),
) -> FmiStatus {
    let body = |instance: &mut Instance| {
        // SAFETY: the caller promises what `requested` asks.
        let (references, mut values) = unsafe { requested(vr, n, value) }?;
        for (i, reference) in references.iter().enumerate() {
            match instance.beyond_table(*reference)? {
                Some(number) => values.put(i, number),
                None => instance.get(&[*reference], |_, value| values.put(i, *value))?,
            }
        }
        Ok(())
    };
    // SAFETY: the caller promises what `run` asks.
    unsafe { run(component, call, body) }
}

/// Reads an item of an enumeration.
fn item(value: i64) -> Result<i32, String> {
    i32::try_from(value).map_err(|_| format!("{value} is not an item of the enumeration"))
}

/// Reads a truth value, which is a byte, as importers may pass others than 0 and 1.
fn truth(value: u8) -> Result<bool, String> {
    match value {
        0 => Ok(false),
        1 => Ok(true),
        other => Err(format!("{other} is neither fmi3False (0) nor fmi3True (1)")),
    }
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
            let call = &table::$call;
            // SAFETY: the importer vouches for `component` and the arrays.
            unsafe {
                counted(component, call, (seeds, n_seed), || {
                    counted(component, call, (results, n_sensitivity), || {
                        derivatives(component, call, &arguments)
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
