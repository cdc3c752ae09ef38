//! Functions for what no FMU has: variables of other types, clocks, structural parameters,
//! partitions of the model. The former do nothing without variables; all others are refused.

use super::super::component::{Component, run};
use crate::call::{error, without_use};
use crate::instance::Instance;
use crate::pointer::slice;
use crate::types::FmiStatus;
use std::ffi::c_int;

/// Refuses a call for variables of a type that none has. The caller promises what [`run`] and
/// [`slice`] ask.
unsafe fn without(
    component: Component,
    name: &'static str,
    kind: &str,
    (vr, n): (*const u32, usize),
) -> FmiStatus {
    let body = |instance: &mut Instance| {
        // SAFETY: the caller promises what `slice` asks.
        let references = unsafe { slice("valueReferences", vr, n) }?;
        references.first().map_or(Ok(()), |first| Err(instance.no_variable(*first, kind)))
    };
    // SAFETY: the caller promises what `run` asks.
    unsafe { run(component, &without_use(name), body) }
}

/// Defines functions for variables of a type that none has.
macro_rules! without {
    ($($name:ident $kind:literal ($($rest:ident: $type:ty),*);)*) => {$(
        pub unsafe fn $name(
            component: Component,
            vr: *const u32,
            n: usize,
            $($rest: $type),*
        ) -> FmiStatus {
            let _ = ($($rest,)*);
            // SAFETY: the importer vouches for `component` and the array.
            unsafe { without(component, stringify!($name), $kind, (vr, n)) }
        }
    )*};
}

without! {
    fmi3GetFloat32 "Float32" (value: *mut f32, m: usize);
    fmi3GetInt8 "Int8" (value: *mut i8, m: usize);
    fmi3GetUInt8 "UInt8" (value: *mut u8, m: usize);
    fmi3GetInt16 "Int16" (value: *mut i16, m: usize);
    fmi3GetUInt16 "UInt16" (value: *mut u16, m: usize);
    fmi3GetUInt32 "UInt32" (value: *mut u32, m: usize);
    fmi3GetUInt64 "UInt64" (value: *mut u64, m: usize);
    fmi3GetBinary "Binary" (size: *mut usize, value: *mut *const u8, m: usize);
    fmi3GetClock "Clock" (value: *mut bool);
    fmi3SetFloat32 "Float32" (value: *const f32, m: usize);
    fmi3SetInt8 "Int8" (value: *const i8, m: usize);
    fmi3SetUInt8 "UInt8" (value: *const u8, m: usize);
    fmi3SetInt16 "Int16" (value: *const i16, m: usize);
    fmi3SetUInt16 "UInt16" (value: *const u16, m: usize);
    fmi3SetUInt32 "UInt32" (value: *const u32, m: usize);
    fmi3SetUInt64 "UInt64" (value: *const u64, m: usize);
    fmi3SetBinary "Binary" (size: *const usize, value: *const *const u8, m: usize);
    fmi3SetClock "Clock" (value: *const bool);
    fmi3GetIntervalDecimal "Clock" (interval: *mut f64, qualifier: *mut c_int);
    fmi3GetIntervalFraction "Clock" (counter: *mut u64, resolution: *mut u64, qualifier: *mut c_int);
    fmi3GetShiftDecimal "Clock" (shift: *mut f64);
    fmi3GetShiftFraction "Clock" (counter: *mut u64, resolution: *mut u64);
    fmi3SetIntervalDecimal "Clock" (interval: *const f64);
    fmi3SetIntervalFraction "Clock" (counter: *const u64, resolution: *const u64);
    fmi3SetShiftDecimal "Clock" (shift: *const f64);
    fmi3SetShiftFraction "Clock" (counter: *const u64, resolution: *const u64);
    fmi3GetOutputDerivatives "output with derivatives" (order: *const i32, value: *mut f64, m: usize);
}

/// Defines functions that are refused, with the reason.
macro_rules! refused {
    ($($name:ident($($argument:ident: $type:ty),*) $reason:literal;)*) => {$(
        pub unsafe fn $name(component: Component, $($argument: $type),*) -> FmiStatus {
            let _ = ($($argument,)*);
            let body = |_: &mut Instance| error($reason);
            // SAFETY: the importer vouches for `component`, as `run` requires.
            unsafe { run(component, &without_use(stringify!($name)), body) }
        }
    )*};
}

refused! {
    fmi3GetNumberOfVariableDependencies(vr: u32, n: *mut usize)
        "dependencies do not change and are in the model description";
    fmi3GetVariableDependencies(vr: u32, dependent: *mut usize, independents: *mut u32,
        elements: *mut usize, kinds: *mut c_int, n: usize)
        "dependencies do not change and are in the model description";
    fmi3EnterConfigurationMode() "this FMU has no structural parameters";
    fmi3ExitConfigurationMode() "this FMU has no structural parameters";
    fmi3EvaluateDiscreteStates() "this FMU evaluates its discrete states with their update";
    fmi3ActivateModelPartition(clock: u32, time: f64) "this FMU has no scheduled execution";
}
