//! Finds the log that a message belongs to. FMI lets an FMU hand back the pointer to the
//! environment that it was given, but some hand back another one, which must not be followed.

#![allow(unsafe_code)]

use crate::crash;
use crate::fmi::{self, Status, Text};
use crate::functions::text_of;
use crate::log::Log;
use float_environment::in_default;
use parking_lot::RwLock;
use std::collections::BTreeSet;
use std::ffi::{c_int, c_void};
use std::rc::Rc;
use std::sync::LazyLock;

/// Addresses of the logs of all instances in this process.
static LIVE: RwLock<BTreeSet<usize>> = RwLock::new(BTreeSet::new());

/// Receives messages whose instance is not known.
static UNKNOWN: LazyLock<Log> = LazyLock::new(|| Log::new("an FMU"));

/// A guard: messages find the log by its address as long as this value lives, which must be dropped
/// before the log.
pub(crate) struct Listed(usize);

impl Listed {
    /// Lets messages find this log.
    pub(crate) fn new(log: &Rc<Log>) -> Self {
        let address = Rc::as_ptr(log).expose_provenance();
        LIVE.write().insert(address);
        Self(address)
    }
}

impl Drop for Listed {
    fn drop(&mut self) {
        LIVE.write().remove(&self.0);
    }
}

/// The logger callback of FMI 3.0, to which that of FMI 2.0 hands on its messages.
pub(crate) unsafe extern "C" fn receive(
    environment: *mut c_void,
    status: c_int,
    category: Text,
    message: Text,
) {
    let receive =
        || hand_over(environment, fmi::status(status), &text_of(category), &text_of(message));
    // A panic must not reach the instance. It has been reported on standard error.
    let _ = in_default(|| std::panic::catch_unwind(receive));
}

/// Hands a message to the log at the address `environment`. If there is none, the message belongs
/// to the instance that this thread calls, or else to the only one that there is.
fn hand_over(
    environment: *const c_void,
    status: Result<Status, c_int>,
    category: &str,
    message: &str,
) {
    let live = LIVE.read();
    let at = |address: usize| {
        // SAFETY: the address is that of a log, which lives until its entry is removed. That waits
        // for this function. A log may be used by several threads.
        let log = unsafe { &*std::ptr::with_exposed_provenance::<Log>(address) };
        log.message(status, category, message);
    };
    if live.contains(&environment.addr()) {
        at(environment.addr());
    } else if crash::with_called(|log| log.message(status, category, message)).is_none() {
        match live.first() {
            Some(only) if live.len() == 1 => at(*only),
            _ => {
                UNKNOWN.message(status, category, message);
                UNKNOWN.flush();
            }
        }
    }
}
