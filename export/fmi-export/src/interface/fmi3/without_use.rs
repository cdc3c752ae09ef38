//! Functions for what no FMU has: variables of other types, clocks, structural parameters,
//! partitions of the model. They are refused, unless they are called for no variables at all.

use super::super::component::{Component, run};
use crate::call::{Outcome, error, without_use};
use crate::instance::Instance;
use crate::types::FmiStatus;
use std::ffi::{c_int, c_void};

/// Gives lists of these functions to two macros: those for variables, whose third argument is the
/// number of variables, and the others.
#[doc(hidden)]
#[macro_export]
macro_rules! without_use {
    (($($variables:tt)*) ($($others:tt)*)) => {
        $($variables)*! {
            fmi3GetFloat32(c: *mut c_void, vr: *const u32, n: usize, value: *mut f32, m: usize) -> FmiStatus;
            fmi3SetFloat32(c: *mut c_void, vr: *const u32, n: usize, value: *const f32, m: usize) -> FmiStatus;
            fmi3GetInt8(c: *mut c_void, vr: *const u32, n: usize, value: *mut i8, m: usize) -> FmiStatus;
            fmi3SetInt8(c: *mut c_void, vr: *const u32, n: usize, value: *const i8, m: usize) -> FmiStatus;
            fmi3GetUInt8(c: *mut c_void, vr: *const u32, n: usize, value: *mut u8, m: usize) -> FmiStatus;
            fmi3SetUInt8(c: *mut c_void, vr: *const u32, n: usize, value: *const u8, m: usize) -> FmiStatus;
            fmi3GetInt16(c: *mut c_void, vr: *const u32, n: usize, value: *mut i16, m: usize) -> FmiStatus;
            fmi3SetInt16(c: *mut c_void, vr: *const u32, n: usize, value: *const i16, m: usize) -> FmiStatus;
            fmi3GetUInt16(c: *mut c_void, vr: *const u32, n: usize, value: *mut u16, m: usize) -> FmiStatus;
            fmi3SetUInt16(c: *mut c_void, vr: *const u32, n: usize, value: *const u16, m: usize) -> FmiStatus;
            fmi3GetUInt32(c: *mut c_void, vr: *const u32, n: usize, value: *mut u32, m: usize) -> FmiStatus;
            fmi3SetUInt32(c: *mut c_void, vr: *const u32, n: usize, value: *const u32, m: usize) -> FmiStatus;
            fmi3GetUInt64(c: *mut c_void, vr: *const u32, n: usize, value: *mut u64, m: usize) -> FmiStatus;
            fmi3SetUInt64(c: *mut c_void, vr: *const u32, n: usize, value: *const u64, m: usize) -> FmiStatus;
            fmi3GetBinary(c: *mut c_void, vr: *const u32, n: usize, size: *mut usize, value: *mut *const u8, m: usize) -> FmiStatus;
            fmi3SetBinary(c: *mut c_void, vr: *const u32, n: usize, size: *const usize, value: *const *const u8, m: usize) -> FmiStatus;
            fmi3GetClock(c: *mut c_void, vr: *const u32, n: usize, value: *mut bool) -> FmiStatus;
            fmi3SetClock(c: *mut c_void, vr: *const u32, n: usize, value: *const bool) -> FmiStatus;
            fmi3GetOutputDerivatives(c: *mut c_void, vr: *const u32, n: usize, order: *const i32, value: *mut f64, m: usize) -> FmiStatus;
            fmi3GetIntervalDecimal(c: *mut c_void, vr: *const u32, n: usize, interval: *mut f64, qualifier: *mut c_int) -> FmiStatus;
            fmi3GetIntervalFraction(c: *mut c_void, vr: *const u32, n: usize, counter: *mut u64, resolution: *mut u64, qualifier: *mut c_int) -> FmiStatus;
            fmi3GetShiftDecimal(c: *mut c_void, vr: *const u32, n: usize, shift: *mut f64) -> FmiStatus;
            fmi3GetShiftFraction(c: *mut c_void, vr: *const u32, n: usize, counter: *mut u64, resolution: *mut u64) -> FmiStatus;
            fmi3SetIntervalDecimal(c: *mut c_void, vr: *const u32, n: usize, interval: *const f64) -> FmiStatus;
            fmi3SetIntervalFraction(c: *mut c_void, vr: *const u32, n: usize, counter: *const u64, resolution: *const u64) -> FmiStatus;
            fmi3SetShiftDecimal(c: *mut c_void, vr: *const u32, n: usize, shift: *const f64) -> FmiStatus;
            fmi3SetShiftFraction(c: *mut c_void, vr: *const u32, n: usize, counter: *const u64, resolution: *const u64) -> FmiStatus;
        }
        $($others)*! {
            fmi3GetNumberOfVariableDependencies(c: *mut c_void, vr: u32, n: *mut usize) -> FmiStatus;
            fmi3GetVariableDependencies(c: *mut c_void, vr: u32, dependent: *mut usize, independents: *mut u32, elements: *mut usize, kinds: *mut c_int, n: usize) -> FmiStatus;
            fmi3EnterConfigurationMode(c: *mut c_void) -> FmiStatus;
            fmi3ExitConfigurationMode(c: *mut c_void) -> FmiStatus;
            fmi3EvaluateDiscreteStates(c: *mut c_void) -> FmiStatus;
            fmi3ActivateModelPartition(c: *mut c_void, clock: u32, time: f64) -> FmiStatus;
        }
    };
}

/// Runs a call that is refused for this reason if it `asks` for something. The caller promises what
/// [`run`] asks.
unsafe fn refuse(component: Component, name: &'static str, asks: bool, reason: &str) -> FmiStatus {
    let body = |_: &mut Instance| -> Outcome { if asks { error(reason) } else { Ok(()) } };
    // SAFETY: the caller promises what `run` asks.
    unsafe { run(component, &without_use(name), body) }
}

macro_rules! variables {
    ($($name:ident($c:ident: $component:ty, $vr:ident: $references:ty, $n:ident: $count:ty
        $(, $rest:ident: $type:ty)*) -> $result:ty;)*) => {$(
        pub unsafe fn $name(
            $c: $component, $vr: $references, $n: $count, $($rest: $type),*
        ) -> $result {
            let _ = ($vr, $($rest),*);
            // SAFETY: the importer vouches for `component`, as `refuse` requires.
            unsafe { refuse($c, stringify!($name), $n > 0, "this FMU has no such variables") }
        }
    )*};
}

macro_rules! others {
    ($($name:ident($c:ident: $component:ty $(, $rest:ident: $type:ty)*) -> $result:ty;)*) => {$(
        pub unsafe fn $name($c: $component, $($rest: $type),*) -> $result {
            let _ = ($($rest,)*);
            let reason = "this FMU has no structural parameters, no clocks, no discrete states to \
                be evaluated alone, and no dependencies other than in the model description";
            // SAFETY: the importer vouches for `component`, as `refuse` requires.
            unsafe { refuse($c, stringify!($name), true, reason) }
        }
    )*};
}

without_use! { (variables) (others) }
