//! The instance behind a `fmi2Component`: made, used by one call at a time, and freed.

use crate::call::{Call, Outcome};
use crate::instance::{Instance, Setting, Stops};
use crate::logger::{Category, Logger};
use crate::model_instance::{Described, Export};
use crate::pointer::text;
use crate::resource;
use crate::types::{Callbacks, FmiStatus, Interface};
use float_environment::in_default;
use model_description::Version;
use std::cell::UnsafeCell;
use std::ffi::{CString, c_char, c_int, c_void};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::PathBuf;
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
/// message. The caller promises that `component` is null or came from [`instantiate`] and was
/// not freed.
pub(super) unsafe fn run(
    component: Component,
    call: &Call,
    body: impl FnOnce(&mut Instance) -> Outcome,
) -> FmiStatus {
    // SAFETY: if not null, `component` came from `instantiate`, which leaked a `Box<Shared>`, and
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

/// Arguments of an instantiation that all versions of FMI have.
pub(super) struct Request {
    /// Name of the function, for messages.
    pub(super) function: &'static str,
    pub(super) version: Version,
    pub(super) interface: Result<Interface, String>,
    pub(super) stops: Stops,
    pub(super) instance_name: *const c_char,
    /// GUID, or the instantiation token of FMI 3.0.
    pub(super) identity: *const c_char,
    pub(super) resources: *const c_char,
}

/// Makes an instance, or returns null and says why in the log. The caller promises that the texts
/// are null or NUL-terminated and live during the call.
pub(super) unsafe fn instantiate(
    exports: &[Export],
    request: Request,
    logger: impl Fn(CString) -> Logger,
) -> Component {
    let Request { function, version, interface, stops, instance_name, identity, resources } =
        request;
    // SAFETY: the caller promises what `text` asks.
    let name = unsafe { text("instanceName", instance_name) };
    let c_name = CString::new(name.as_deref().unwrap_or_default()).unwrap_or_default();
    let logger = || logger(c_name.clone());
    let instantiate = || {
        if name?.is_empty() {
            return Err("the instance name is empty".to_string());
        }
        let argument = if version == Version::Fmi2 { "fmuGUID" } else { "instantiationToken" };
        // SAFETY: the caller promises what `text` asks.
        let guid = unsafe { text(argument, identity) }?;
        let interface = interface?;
        let export = find(exports, guid)?;
        let Described { guid, description } = export.described();
        let (guid, description) = (guid.clone(), description.clone());
        if interface == Interface::ModelExchange && !description.model_exchange {
            return Err(format!("{} is for co-simulation only", description.name));
        }
        let resources = if resources.is_null() {
            None
        } else {
            // SAFETY: the caller promises what `text` asks.
            let place = unsafe { text("the location of the resources", resources) }?;
            Some(match version {
                Version::Fmi2 => resource::folder(place)?,
                Version::Fmi3 => PathBuf::from(place),
            })
        };
        let setting = Setting { guid, version, interface, stops, logger: logger(), resources };
        let instance = UnsafeCell::new(Instance::new(export, description, setting));
        Ok(Box::into_raw(Box::new(Shared { busy: AtomicBool::new(false), instance })).cast())
    };
    let (category, text) = match in_default(|| catch_unwind(AssertUnwindSafe(instantiate))) {
        Ok(Ok(component)) => return component,
        Ok(Err(problem)) => (Category::Error, format!("{function}: {problem}")),
        Err(panic) => {
            std::mem::forget(panic);
            (Category::Fatal, format!("{function}: defect in the FMU"))
        }
    };
    let mut logger = logger();
    logger.log(category, &text);
    logger.deliver();
    null_mut()
}

/// Returns the FMU with this GUID.
fn find<'a>(exports: &'a [Export], guid: &str) -> Result<&'a Export, String> {
    exports.iter().find(|export| export.described().guid == guid).ok_or_else(|| {
        let list: Vec<_> = exports.iter().map(Export::described).collect();
        let list: Vec<_> =
            list.iter().map(|fmu| format!("{} {}", fmu.description.name, fmu.guid)).collect();
        format!(
            "this library has no FMU with GUID '{guid}' but {}: pack the archive again",
            list.join(", ")
        )
    })
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
    let interface = Interface::from_c(fmu_type).ok_or_else(|| {
        format!("fmuType {fmu_type} is neither 0 (model exchange) nor 1 (co-simulation)")
    });
    let request = Request {
        function: "fmi2Instantiate",
        version: Version::Fmi2,
        interface,
        stops: Stops::default(),
        instance_name,
        identity: guid,
        resources: resource_location,
    };
    // SAFETY: the standard demands NUL-terminated texts, of which the location may be null.
    unsafe { instantiate(exports, request, |name| Logger::new(callbacks, name, logging_on != 0)) }
}

/// Frees the instance. It does nothing while another call uses the instance: a logger cannot free
/// the instance that calls it.
pub unsafe fn fmi2FreeInstance(component: Component) {
    // SAFETY: if not null, `component` came from `instantiate`, which leaked a `Box<Shared>`, and
    // was not freed. Only a shared reference is made, so other calls may hold one too.
    let Some(shared) = (unsafe { component.cast::<Shared>().as_ref() }) else { return };
    let Some(busy) = Busy::begin(&shared.busy) else { return };
    // The guard is never dropped, because the flag goes with the instance.
    std::mem::forget(busy);
    // SAFETY: `component` came from `Box::into_raw` in `instantiate` and is freed once, as the
    // standard demands. The flag is set, so no call is under way that uses the instance.
    let instance = unsafe { Box::from_raw(component.cast::<Shared>()) };
    if let Err(panic) = in_default(|| catch_unwind(AssertUnwindSafe(|| drop(instance)))) {
        std::mem::forget(panic);
    }
}
