//! Saved states. Their handles are addresses that are compared and never dereferenced.

use super::component::{Component, run};
use crate::call::{error, table};
use crate::instance::{Instance, Saved};
use crate::pointer::{check, not_null, put, room, slice};
use crate::types::FmiStatus;
use std::ffi::{c_char, c_void};
use std::ptr::null_mut;

/// Saves the present state. It overwrites the state behind `*state` if `*state` is not null.
pub unsafe fn fmi2GetFMUstate(component: Component, state: *mut *mut c_void) -> FmiStatus {
    let body = |instance: &mut Instance| {
        check("FMUstate", state, 1)?;
        // SAFETY: `check` refused null and wrong alignment, and the standard demands that `*state`
        // is initialized, with null or a handle.
        let present = unsafe { state.read() };
        let handle =
            instance.save((!present.is_null()).then(|| present.cast::<Saved>().cast_const()))?;
        // SAFETY: the importer vouches for the result pointer, as `put` requires.
        unsafe { put("FMUstate", state, handle.cast_mut().cast()) }
    };
    // SAFETY: the importer vouches for `component`, as `run` requires.
    unsafe { run(component, &table::GET_FMU_STATE, body) }
}

pub unsafe fn fmi2SetFMUstate(component: Component, state: *mut c_void) -> FmiStatus {
    let body = |instance: &mut Instance| {
        not_null("FMUstate", state)?;
        instance.restore(state.cast())
    };
    // SAFETY: the importer vouches for `component`, as `run` requires.
    unsafe { run(component, &table::SET_FMU_STATE, body) }
}

/// Frees the saved state and sets `*state` to null. It does nothing if `*state` or `state` is null
/// already.
pub unsafe fn fmi2FreeFMUstate(component: Component, state: *mut *mut c_void) -> FmiStatus {
    let body = |instance: &mut Instance| {
        if state.is_null() {
            return Ok(());
        }
        check("FMUstate", state, 1)?;
        // SAFETY: `check` refused wrong alignment, and the standard demands that `*state` is
        // initialized, with null or a handle.
        let handle = unsafe { state.read() };
        if handle.is_null() {
            return Ok(());
        }
        instance.free_saved(handle.cast())?;
        // SAFETY: the importer vouches for the result pointer, as `put` requires.
        unsafe { put("FMUstate", state, null_mut()) }
    };
    // SAFETY: the importer vouches for `component`, as `run` requires.
    unsafe { run(component, &table::FREE_FMU_STATE, body) }
}

pub unsafe fn fmi2SerializedFMUstateSize(
    component: Component,
    state: *mut c_void,
    size: *mut usize,
) -> FmiStatus {
    let body = |instance: &mut Instance| {
        not_null("FMUstate", state)?;
        let length = instance.serialized(state.cast())?.len();
        // SAFETY: the importer vouches for the result pointer, as `put` requires.
        unsafe { put("size", size, length) }
    };
    // SAFETY: the importer vouches for `component`, as `run` requires.
    unsafe { run(component, &table::SERIALIZED_SIZE, body) }
}

pub unsafe fn fmi2SerializeFMUstate(
    component: Component,
    state: *mut c_void,
    serialized: *mut c_char,
    size: usize,
) -> FmiStatus {
    let body = |instance: &mut Instance| {
        not_null("FMUstate", state)?;
        let bytes = instance.serialized(state.cast())?;
        if size < bytes.len() {
            return error(format!("room for {size} bytes, but the state has {}", bytes.len()));
        }
        // SAFETY: the importer vouches for the array, as `room` requires.
        unsafe { room("serializedState", serialized.cast::<u8>(), bytes.len()) }?
            .fill(bytes.iter().copied());
        Ok(())
    };
    // SAFETY: the importer vouches for `component`, as `run` requires.
    unsafe { run(component, &table::SERIALIZE, body) }
}

/// Makes a new state from the bytes. It ignores the previous value of `*state`.
pub unsafe fn fmi2DeSerializeFMUstate(
    component: Component,
    serialized: *const c_char,
    size: usize,
    state: *mut *mut c_void,
) -> FmiStatus {
    let body = |instance: &mut Instance| {
        check("FMUstate", state, 1)?;
        // SAFETY: the importer vouches for the array, as `slice` requires.
        let handle = instance
            .deserialize(unsafe { slice("serializedState", serialized.cast::<u8>(), size) }?)?;
        // SAFETY: the importer vouches for the result pointer, as `put` requires.
        unsafe { put("FMUstate", state, handle.cast_mut().cast()) }
    };
    // SAFETY: the importer vouches for `component`, as `run` requires.
    unsafe { run(component, &table::DESERIALIZE, body) }
}
