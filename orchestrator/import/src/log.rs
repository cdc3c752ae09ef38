//! Log messages of units.

use crate::fmi::Status;
use crate::warnings;
use std::ffi::c_int;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};

/// Forwards an FMU's log messages to `tracing`, and keeps the last one that reports a problem.
pub(crate) struct Log {
    pub(crate) component: String,
    pub(crate) last: Mutex<Option<String>>,
    /// Whether the unit is being instantiated. Messages about problems are then part of the error
    /// that follows.
    pub(crate) instantiates: AtomicBool,
}

impl Log {
    pub(crate) fn take(&self) -> Option<String> {
        self.last.lock().unwrap_or_else(PoisonError::into_inner).take()
    }

    pub(crate) fn message(&self, status: Result<Status, c_int>, category: &str, message: &str) {
        let (component, message) = (&self.component, message.trim_end().replace('\n', " "));
        match status {
            Ok(Status::Ok | Status::Pending) => {
                tracing::info!("{component}: [{category}] {message}");
            }
            Ok(Status::Warning) => warnings::warn(&format!("{component}: [{category}] {message}")),
            Ok(Status::Discard | Status::Error | Status::Fatal) | Err(_) => {
                if !self.instantiates.load(Ordering::Relaxed) {
                    tracing::error!("{component}: [{category}] {message}");
                }
                *self.last.lock().unwrap_or_else(PoisonError::into_inner) = Some(message);
            }
        }
    }
}
