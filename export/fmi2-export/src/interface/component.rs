//! The instance behind a `fmi2Component`: made, used by one call at a time, and freed.

use crate::call::{Call, Outcome};
use crate::instance::{Instance, Setting};
use crate::logger::{Category, Logger};
use crate::model_instance::{Described, Export};
use crate::pointer::text;
use crate::resource;
use crate::types::{Callbacks, FmiStatus, Interface};
use float_environment::in_default;
use std::cell::UnsafeCell;
use std::ffi::{CString, c_char, c_int, c_void};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::ptr::null_mut;
use std::sync::atomic::{AtomicBool, Ordering};

/// C type `fmi2Component`, a pointer to [`Shared`].
pub(super) type Component = *mut c_void;

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

/// Runs a call on the instance behind `component`, in the default floating-point environment, and
/// delivers its messages in that of the importer. A null component has no logger, and the logger
/// of an instance that another call is using must not be touched, so both are refused without a
/// message. The caller promises that `component` is null or came from [`fmi2Instantiate`] and was
/// not freed.
pub(super) unsafe fn run(
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
    let status = in_default(|| instance.run(call, body));
    instance.logger().deliver();
    status
}

/// Runs a call that cannot fail once it is allowed. The caller promises what [`run`] asks.
pub(super) unsafe fn run_always(
    component: Component,
    call: &Call,
    body: fn(&mut Instance),
) -> FmiStatus {
    let body = |instance: &mut Instance| {
        body(instance);
        Ok(())
    };
    // SAFETY: the caller promises what `run` asks.
    unsafe { run(component, call, body) }
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
        // Without a logger no message can be delivered.
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
    let (category, text) = match in_default(|| catch_unwind(AssertUnwindSafe(instantiate))) {
        Ok(Ok(component)) => return component,
        Ok(Err(problem)) => (Category::Error, format!("fmi2Instantiate: {problem}")),
        Err(panic) => {
            std::mem::forget(panic);
            (Category::Fatal, "fmi2Instantiate: defect in the FMU".into())
        }
    };
    let mut logger = logger();
    logger.log(category, &text);
    logger.deliver();
    null_mut()
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
    if let Err(panic) = in_default(|| catch_unwind(AssertUnwindSafe(|| drop(instance)))) {
        std::mem::forget(panic);
    }
}
