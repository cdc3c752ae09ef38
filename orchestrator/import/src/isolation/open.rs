//! Where the system cannot close a process, there is none.

use super::{Closing, Ended};
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::io::{self, Write};
use std::ops::ControlFlow;

/// A closed process, of which there is none.
pub enum Closed {}

impl Closed {
    /// Refuses to start a process.
    ///
    /// # Errors
    /// Returns that this system cannot close a process.
    pub fn begin(_closing: &Closing, _work: impl FnOnce(&mut Link)) -> Result<Self, Ended> {
        Err(Ended::Refused("this system cannot close a process: only Linux can".into()))
    }

    /// Hears nothing.
    ///
    /// # Errors
    /// There are none.
    pub fn hear<M: DeserializeOwned>(
        &mut self,
        _asked: impl Fn() -> Option<i32>,
        _hear: impl FnMut(M) -> ControlFlow<()>,
    ) -> Result<(), Ended> {
        match *self {}
    }
}

/// A closed process's connection with its supervisor, of which there is none.
pub enum Link {}

impl Link {
    /// Sends nothing.
    ///
    /// # Errors
    /// There are none.
    pub fn send(&self, _message: &impl Serialize) -> io::Result<()> {
        match *self {}
    }

    /// Records nothing.
    pub fn begin_part(&self, _place: usize) {
        match *self {}
    }
}

/// A writer of log messages to standard error.
pub struct Messages;

impl Write for Messages {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if crate::warnings::is_repeated(&String::from_utf8_lossy(bytes)) {
            return Ok(bytes.len());
        }
        io::stderr().write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// Calls are recorded in closed processes only.
pub(crate) mod page {
    pub(crate) fn begin(_component: &str, _call: &str) {}
    pub(crate) fn end() {}
    pub(crate) fn problem(_text: &str) {}
    pub(crate) fn ends() {}
    pub(crate) fn at(_time: f64) {}
    pub(crate) fn in_case(_case: Option<u64>) {}
}

/// Does nothing, because this process is not closed.
pub(crate) fn tell_warning(_text: &str) {}
