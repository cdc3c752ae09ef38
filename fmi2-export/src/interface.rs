//! Functions of FMI 2.0 with their C signatures.
//!
//! [`export_fmus!`](crate::export_fmus) makes an exported function of the same name from each of
//! them. They are `unsafe` like any C function, because a pointer that is neither null nor as the
//! standard demands cannot be recognized.
#![allow(
    unsafe_code,
    non_snake_case,
    clippy::missing_safety_doc,
    clippy::too_many_arguments,
    missing_docs
)]
#![allow(clippy::not_unsafe_ptr_arg_deref)]

use crate::call::{Call, Outcome, error, table};
use crate::instance::{Instance, Saved, Setting};
use crate::logger::{Category, Logger};
use crate::model::Failure;
use crate::model_instance::{Described, Export};
use crate::pointer::{apart, check, not_null, put, requested, room, slice, text};
use crate::resource;
use crate::types::{
    CEventInfo, Callbacks, DO_STEP_STATUS, FmiStatus, Interface, LAST_SUCCESSFUL_TIME,
    PENDING_STATUS, TERMINATED,
};
use std::cell::UnsafeCell;
use std::ffi::{CString, c_char, c_int, c_void};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::ptr::null_mut;
use std::sync::atomic::{AtomicBool, Ordering};

/// C type `fmi2Component`, a pointer to [`Shared`].
type Component = *mut c_void;

/// Target of `fmi2Component`: an instance that only one call at a time may use. The standard makes
/// the importer responsible for that, but a logger that calls its instance back, or a second
/// thread, must not find an instance that is being changed.
struct Shared {
    busy: AtomicBool,
    instance: UnsafeCell<Instance>,
}

/// Guard of a call under way. Dropping it, also during a panic, releases the instance.
struct Busy<'a>(&'a AtomicBool);

impl<'a> Busy<'a> {
    /// Claims the instance, or returns `None` if a call is under way.
    fn begin(busy: &'a AtomicBool) -> Option<Self> {
        busy.compare_exchange(false, true, Ordering::Acquire, Ordering::Relaxed)
            .is_ok()
            .then(|| Self(busy))
    }
}

impl Drop for Busy<'_> {
    fn drop(&mut self) {
        self.0.store(false, Ordering::Release);
    }
}

/// Runs a call on the instance behind `component`. A null component has no logger, and the logger
/// of an instance that another call is using must not be touched, so both are refused without a
/// message. The caller promises that `component` is null or came from [`fmi2Instantiate`] and was
/// not freed.
unsafe fn run(
    component: Component,
    call: &Call,
    body: impl FnOnce(&mut Instance) -> Outcome,
) -> FmiStatus {
    // SAFETY: if not null, `component` came from fmi2Instantiate, which leaked a `Box<Shared>`, and
    // was not freed. Only a shared reference is made, so other calls may hold one too.
    let Some(shared) = (unsafe { component.cast::<Shared>().as_ref() }) else {
        return FmiStatus::Error;
    };
    let Some(_busy) = Busy::begin(&shared.busy) else { return FmiStatus::Error };
    // SAFETY: `_busy` holds the flag, so no other call has a reference to the instance. The flag is
    // cleared when `_busy` is dropped, after the last use of this reference.
    let instance = unsafe { &mut *shared.instance.get() };
    instance.run(call, body)
}

// Common functions

/// Returns the descriptions of `exports` as a JSON list in memory of this library, or null if that
/// fails.
pub fn fmu_model_descriptions(exports: &[Export]) -> *mut c_char {
    let json = || {
        let descriptions: Vec<_> =
            exports.iter().map(|export| &*export.described().description).collect();
        CString::new(serde_json::to_vec(&descriptions).ok()?).ok()
    };
    catch_unwind(AssertUnwindSafe(json)).ok().flatten().map_or(null_mut(), CString::into_raw)
}

pub unsafe fn fmu_free_model_descriptions(descriptions: *mut c_char) {
    if !descriptions.is_null() {
        // SAFETY: not null, so it came from `CString::into_raw` in fmu_model_descriptions, and the
        // caller gives it back only once.
        drop(unsafe { CString::from_raw(descriptions) });
    }
}

pub fn fmi2GetTypesPlatform() -> *const c_char {
    c"default".as_ptr()
}

pub fn fmi2GetVersion() -> *const c_char {
    c"2.0".as_ptr()
}

pub unsafe fn fmi2Instantiate(
    exports: &[Export],
    instance_name: *const c_char,
    fmu_type: c_int,
    guid: *const c_char,
    resource_location: *const c_char,
    callbacks: *const Callbacks,
    _visible: c_int,
    logging_on: c_int,
) -> Component {
    if !callbacks.is_aligned() {
        // Without a logger there is nobody to tell.
        return null_mut();
    }
    // SAFETY: the standard demands null or a pointer to a callback structure that lives and stays
    // unchanged during the call. Wrong alignment was refused above.
    let callbacks = unsafe { callbacks.as_ref() };
    // SAFETY: the standard demands a NUL-terminated text, and `text` refuses null.
    let name = unsafe { text("instanceName", instance_name) };
    let c_name = CString::new(name.as_deref().unwrap_or_default()).unwrap_or_default();
    let logger = || Logger::new(callbacks, c_name.clone(), logging_on != 0);
    let instantiate = || {
        if name?.is_empty() {
            return Err("the instance name is empty".to_string());
        }
        // SAFETY: the standard demands a NUL-terminated text, and `text` refuses null.
        let guid = unsafe { text("fmuGUID", guid) }?;
        let interface = Interface::from_c(fmu_type).ok_or_else(|| {
            format!("fmuType {fmu_type} is neither 0 (model exchange) nor 1 (co-simulation)")
        })?;
        let export =
            exports.iter().find(|export| export.described().guid == guid).ok_or_else(|| {
                let list: Vec<_> = exports.iter().map(Export::described).collect();
                let list: Vec<_> = list
                    .iter()
                    .map(|fmu| format!("{} {}", fmu.description.name, fmu.guid))
                    .collect();
                format!(
                    "this library has no FMU with GUID '{guid}' but {}: pack the archive again",
                    list.join(", ")
                )
            })?;
        let Described { guid, description } = export.described();
        let (guid, description) = (guid.clone(), description.clone());
        if interface == Interface::ModelExchange && !description.model_exchange {
            return Err(format!("{} is for co-simulation only", description.name));
        }
        let resources = if resource_location.is_null() {
            None
        } else {
            // SAFETY: the standard demands a NUL-terminated text if the pointer is not null.
            Some(resource::folder(unsafe { text("fmuResourceLocation", resource_location) }?)?)
        };
        let setting = Setting { guid, interface, logger: logger(), resources };
        let instance = UnsafeCell::new(Instance::new(export, description, setting));
        Ok(Box::into_raw(Box::new(Shared { busy: AtomicBool::new(false), instance })).cast())
    };
    match catch_unwind(AssertUnwindSafe(instantiate)) {
        Ok(Ok(component)) => component,
        Ok(Err(problem)) => {
            logger().log(Category::Error, &format!("fmi2Instantiate: {problem}"));
            null_mut()
        }
        Err(panic) => {
            logger().log(Category::Fatal, "fmi2Instantiate: defect in the FMU");
            std::mem::forget(panic);
            null_mut()
        }
    }
}

/// Frees the instance. It does nothing while another call uses the instance: a logger cannot free
/// the instance that calls it.
pub unsafe fn fmi2FreeInstance(component: Component) {
    // SAFETY: if not null, `component` came from fmi2Instantiate, which leaked a `Box<Shared>`, and
    // was not freed. Only a shared reference is made, so other calls may hold one too.
    let Some(shared) = (unsafe { component.cast::<Shared>().as_ref() }) else { return };
    let Some(busy) = Busy::begin(&shared.busy) else { return };
    // The guard is never dropped, because the flag goes with the instance.
    std::mem::forget(busy);
    // SAFETY: `component` came from `Box::into_raw` in fmi2Instantiate and is freed once, as the
    // standard demands. The flag is set, so no call is under way that uses the instance.
    let instance = unsafe { Box::from_raw(component.cast::<Shared>()) };
    if let Err(panic) = catch_unwind(AssertUnwindSafe(|| drop(instance))) {
        std::mem::forget(panic);
    }
}

pub unsafe fn fmi2SetDebugLogging(
    component: Component,
    logging_on: c_int,
    n_categories: usize,
    categories: *const *const c_char,
) -> FmiStatus {
    let body = |instance: &mut Instance| {
        // SAFETY: the importer vouches for the array, as `slice` requires.
        let categories = unsafe { slice("categories", categories, n_categories) }?;
        // SAFETY: the standard demands NUL-terminated texts, and `text` refuses null.
        let names = categories
            .iter()
            .map(|&name| unsafe { text("categories", name) })
            .collect::<Result<Vec<_>, _>>();
        let names = names.map_err(Failure::Error)?;
        if let Some(unknown) = instance.logger().choose(logging_on != 0, &names) {
            instance.warn(&format!("fmi2SetDebugLogging: there is no log category '{unknown}'"));
        }
        Ok(())
    };
    // SAFETY: the importer vouches for `component`, as `run` requires.
    unsafe { run(component, &table::SET_DEBUG_LOGGING, body) }
}

pub unsafe fn fmi2SetupExperiment(
    component: Component,
    tolerance_defined: c_int,
    tolerance: f64,
    start_time: f64,
    stop_time_defined: c_int,
    stop_time: f64,
) -> FmiStatus {
    let tolerance = (tolerance_defined != 0).then_some(tolerance);
    let stop = (stop_time_defined != 0).then_some(stop_time);
    let body = |instance: &mut Instance| instance.setup_experiment(start_time, stop, tolerance);
    // SAFETY: the importer vouches for `component`, as `run` requires.
    unsafe { run(component, &table::SETUP_EXPERIMENT, body) }
}

pub unsafe fn fmi2EnterInitializationMode(component: Component) -> FmiStatus {
    let body = |instance: &mut Instance| {
        instance.enter_initialization_mode();
        Ok(())
    };
    // SAFETY: the importer vouches for `component`, as `run` requires.
    unsafe { run(component, &table::ENTER_INITIALIZATION_MODE, body) }
}

pub unsafe fn fmi2ExitInitializationMode(component: Component) -> FmiStatus {
    // SAFETY: the importer vouches for `component`, as `run` requires.
    unsafe { run(component, &table::EXIT_INITIALIZATION_MODE, Instance::exit_initialization_mode) }
}

pub unsafe fn fmi2Terminate(component: Component) -> FmiStatus {
    let body = |instance: &mut Instance| {
        instance.terminate();
        Ok(())
    };
    // SAFETY: the importer vouches for `component`, as `run` requires.
    unsafe { run(component, &table::TERMINATE, body) }
}

pub unsafe fn fmi2Reset(component: Component) -> FmiStatus {
    let body = |instance: &mut Instance| {
        instance.reset();
        Ok(())
    };
    // SAFETY: the importer vouches for `component`, as `run` requires.
    unsafe { run(component, &table::RESET, body) }
}

// Getting and setting

pub unsafe fn fmi2GetReal(
    component: Component,
    vr: *const u32,
    n: usize,
    value: *mut f64,
) -> FmiStatus {
    let body = |instance: &mut Instance| {
        // SAFETY: the importer vouches for both arrays, as `requested` requires.
        let (references, mut values) = unsafe { requested(vr, n, value) }?;
        instance.get::<f64>(references, |i, value| values.put(i, *value))
    };
    // SAFETY: the importer vouches for `component`, as `run` requires.
    unsafe { run(component, &table::GET_REAL, body) }
}

pub unsafe fn fmi2GetInteger(
    component: Component,
    vr: *const u32,
    n: usize,
    value: *mut c_int,
) -> FmiStatus {
    let body = |instance: &mut Instance| {
        // SAFETY: the importer vouches for both arrays, as `requested` requires.
        let (references, mut values) = unsafe { requested(vr, n, value) }?;
        instance.get::<i32>(references, |i, value| values.put(i, *value))
    };
    // SAFETY: the importer vouches for `component`, as `run` requires.
    unsafe { run(component, &table::GET_INTEGER, body) }
}

pub unsafe fn fmi2GetBoolean(
    component: Component,
    vr: *const u32,
    n: usize,
    value: *mut c_int,
) -> FmiStatus {
    let body = |instance: &mut Instance| {
        // SAFETY: the importer vouches for both arrays, as `requested` requires.
        let (references, mut values) = unsafe { requested(vr, n, value) }?;
        instance.get::<bool>(references, |i, value| values.put(i, c_int::from(*value)))
    };
    // SAFETY: the importer vouches for `component`, as `run` requires.
    unsafe { run(component, &table::GET_BOOLEAN, body) }
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
    let body = |instance: &mut Instance| {
        // SAFETY: the importer vouches for the array, as `slice` requires.
        let (references, values) = unsafe { (slice("vr", vr, n)?, slice("value", value, n)?) };
        instance.set(references, |i| Ok(values[i]))
    };
    // SAFETY: the importer vouches for `component`, as `run` requires.
    unsafe { run(component, &table::SET_REAL, body) }
}

pub unsafe fn fmi2SetInteger(
    component: Component,
    vr: *const u32,
    n: usize,
    value: *const c_int,
) -> FmiStatus {
    let body = |instance: &mut Instance| {
        // SAFETY: the importer vouches for the array, as `slice` requires.
        let (references, values) = unsafe { (slice("vr", vr, n)?, slice("value", value, n)?) };
        instance.set(references, |i| Ok(values[i]))
    };
    // SAFETY: the importer vouches for `component`, as `run` requires.
    unsafe { run(component, &table::SET_INTEGER, body) }
}

pub unsafe fn fmi2SetBoolean(
    component: Component,
    vr: *const u32,
    n: usize,
    value: *const c_int,
) -> FmiStatus {
    let body = |instance: &mut Instance| {
        // SAFETY: the importer vouches for the array, as `slice` requires.
        let (references, values) = unsafe { (slice("vr", vr, n)?, slice("value", value, n)?) };
        instance.set(references, |i| match values[i] {
            0 => Ok(false),
            1 => Ok(true),
            other => Err(format!("{other} is neither fmi2False (0) nor fmi2True (1)")),
        })
    };
    // SAFETY: the importer vouches for `component`, as `run` requires.
    unsafe { run(component, &table::SET_BOOLEAN, body) }
}

pub unsafe fn fmi2SetString(
    component: Component,
    vr: *const u32,
    n: usize,
    value: *const *const c_char,
) -> FmiStatus {
    let body = |instance: &mut Instance| {
        // SAFETY: the importer vouches for the array, as `slice` requires.
        let (references, values) = unsafe { (slice("vr", vr, n)?, slice("value", value, n)?) };
        // SAFETY: the standard demands NUL-terminated texts, and `text` refuses null.
        instance.set(references, |i| unsafe { text("value", values[i]) }.map(String::from))
    };
    // SAFETY: the importer vouches for `component`, as `run` requires.
    unsafe { run(component, &table::SET_STRING, body) }
}

// Saved states. Their handles are addresses that are compared and never dereferenced.

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

pub unsafe fn fmi2GetDirectionalDerivative(
    component: Component,
    unknowns: *const u32,
    n_unknown: usize,
    knowns: *const u32,
    n_known: usize,
    dv_known: *const f64,
    dv_unknown: *mut f64,
) -> FmiStatus {
    let body = |instance: &mut Instance| {
        // SAFETY: the importer vouches for the array, as `slice` requires.
        let (unknown_references, known_references, seed) = unsafe {
            (
                slice("vUnknown_ref", unknowns, n_unknown)?,
                slice("vKnown_ref", knowns, n_known)?,
                slice("dvKnown", dv_known, n_known)?,
            )
        };
        let written = ("dvUnknown", dv_unknown, n_unknown);
        apart(("dvKnown", dv_known, n_known), written)?;
        apart(("vUnknown_ref", unknowns, n_unknown), written)?;
        apart(("vKnown_ref", knowns, n_known), written)?;
        // SAFETY: the importer vouches for the array, as `room` requires. It overlaps none of the
        // others.
        let derivative = unsafe { room("dvUnknown", dv_unknown, n_unknown) }?;
        instance.directional_derivative(unknown_references, known_references, seed, derivative)
    };
    // SAFETY: the importer vouches for `component`, as `run` requires.
    unsafe { run(component, &table::DIRECTIONAL_DERIVATIVE, body) }
}

// Model exchange

pub unsafe fn fmi2EnterEventMode(component: Component) -> FmiStatus {
    let body = |instance: &mut Instance| {
        instance.enter_event_mode();
        Ok(())
    };
    // SAFETY: the importer vouches for `component`, as `run` requires.
    unsafe { run(component, &table::ENTER_EVENT_MODE, body) }
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
            ..CEventInfo::default()
        };
        // SAFETY: the importer vouches for the result pointer, as `put` requires.
        unsafe { put("fmi2eventInfo", event_info, info) }
    };
    // SAFETY: the importer vouches for `component`, as `run` requires.
    unsafe { run(component, &table::NEW_DISCRETE_STATES, body) }
}

pub unsafe fn fmi2EnterContinuousTimeMode(component: Component) -> FmiStatus {
    let body = |instance: &mut Instance| {
        instance.enter_continuous_time_mode();
        Ok(())
    };
    // SAFETY: the importer vouches for `component`, as `run` requires.
    unsafe { run(component, &table::ENTER_CONTINUOUS_TIME, body) }
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

// Co-simulation

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

fn no_status(kind: c_int) -> Outcome {
    Err(Failure::Discard(format!("there is no status of kind {kind} for this function")))
}

pub unsafe fn fmi2GetStatus(component: Component, kind: c_int, value: *mut FmiStatus) -> FmiStatus {
    let body = |instance: &mut Instance| match kind {
        // SAFETY: the importer vouches for the result pointer, as `put` requires.
        DO_STEP_STATUS => unsafe { put("value", value, instance.last_step()) },
        _ => no_status(kind),
    };
    // SAFETY: the importer vouches for `component`, as `run` requires.
    unsafe { run(component, &table::GET_STATUS, body) }
}

pub unsafe fn fmi2GetRealStatus(component: Component, kind: c_int, value: *mut f64) -> FmiStatus {
    let body = |instance: &mut Instance| match kind {
        // SAFETY: the importer vouches for the result pointer, as `put` requires.
        LAST_SUCCESSFUL_TIME => unsafe { put("value", value, instance.time()) },
        _ => no_status(kind),
    };
    // SAFETY: the importer vouches for `component`, as `run` requires.
    unsafe { run(component, &table::GET_REAL_STATUS, body) }
}

pub unsafe fn fmi2GetIntegerStatus(
    component: Component,
    kind: c_int,
    _value: *mut c_int,
) -> FmiStatus {
    // SAFETY: the importer vouches for `component`, as `run` requires.
    unsafe { run(component, &table::GET_INTEGER_STATUS, |_| no_status(kind)) }
}

pub unsafe fn fmi2GetBooleanStatus(
    component: Component,
    kind: c_int,
    value: *mut c_int,
) -> FmiStatus {
    let body = |_: &mut Instance| match kind {
        // SAFETY: the importer vouches for the result pointer, as `put` requires.
        TERMINATED => unsafe { put("value", value, 0) },
        _ => no_status(kind),
    };
    // SAFETY: the importer vouches for `component`, as `run` requires.
    unsafe { run(component, &table::GET_BOOLEAN_STATUS, body) }
}

pub unsafe fn fmi2GetStringStatus(
    component: Component,
    kind: c_int,
    value: *mut *const c_char,
) -> FmiStatus {
    let body = |_: &mut Instance| match kind {
        // SAFETY: the importer vouches for the result pointer, as `put` requires.
        PENDING_STATUS => unsafe { put("value", value, c"no step is pending".as_ptr()) },
        _ => no_status(kind),
    };
    // SAFETY: the importer vouches for `component`, as `run` requires.
    unsafe { run(component, &table::GET_STRING_STATUS, body) }
}
