//! The importer's logger.

use crate::interface::{Callbacks, Logger, Status, Text};
use std::ffi::{CStr, c_void};
use std::sync::Mutex;

/// Message that the importer's logger received.
#[derive(Clone, Debug)]
pub struct Message {
    /// Status as passed to the logger.
    pub status: Status,
    /// Category as passed to the logger.
    pub category: String,
    /// Text of the message.
    pub text: String,
}

/// List in which messages are collected.
pub type Log = Mutex<Vec<Message>>;

extern "C" fn log(
    environment: *mut c_void,
    _instance: Text,
    status: Status,
    category: Text,
    message: Text,
) {
    // SAFETY: the environment is the log that `Instance` keeps alive, and the library passes
    // NUL-terminated texts that live during the call.
    let (log, [category, text]) = unsafe {
        let texts =
            [category, message].map(|text| CStr::from_ptr(text).to_string_lossy().into_owned());
        (&*environment.cast::<Log>(), texts)
    };
    log.lock().expect("no other thread panicked").push(Message { status, category, text });
}

/// Returns callbacks with a logger and nothing else.
pub fn callbacks(log_to: &Log) -> Callbacks {
    type Fixed = extern "C" fn(*mut c_void, Text, Status, Text, Text);
    // SAFETY: the two types differ only in the variadic part, and on the supported platforms a
    // variadic call without variadic arguments passes the fixed ones like any other call.
    let logger = unsafe { std::mem::transmute::<Fixed, Logger>(log) };
    Callbacks {
        logger: Some(logger),
        allocate_memory: None,
        free_memory: None,
        step_finished: None,
        component_environment: std::ptr::from_ref(log_to).cast_mut().cast(),
    }
}
