//! Messages to the importer, which leave the FMU through the importer's callback only.
//!
//! The reason of every failure is always reported, so that nobody has to repeat a run with logging
//! on to find it: errors, discarded calls and the end of a simulation. FMI 2.0.5, section 2.1.3,
//! has the logger called for these statuses whatever `loggingOn` is; for fmi2Discard the importer's
//! logger decides whether to show the message. FMI 3.0 allows that for errors only. Everything else
//! is reported only while logging is on (`loggingOn` of fmi2Instantiate, fmi2SetDebugLogging), and
//! then only in the chosen categories.
//!
//! Messages are delivered at the end of a call, when the instance has done its work: an importer in
//! C++ may throw an exception in its logger, which then passes through the call to the importer.
//! Rust could not let it pass in the midst of the work, where panics are caught.
#![allow(unsafe_code)]

use crate::types::{Callbacks, FmiStatus, LogCallback, LogMessageCallback};
use model_description::LOG_CATEGORIES;
use std::ffi::{CString, c_void};
use std::mem;

/// Log category, one for each row of [`LOG_CATEGORIES`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Category {
    All,
    Events,
    Warning,
    Discard,
    Error,
    Fatal,
}

impl Category {
    const ROWS: [Self; LOG_CATEGORIES.len()] =
        [Self::All, Self::Events, Self::Warning, Self::Discard, Self::Error, Self::Fatal];

    fn named(name: &str) -> Option<Self> {
        Self::ROWS.into_iter().find(|category| category.name() == name)
    }

    fn name(self) -> &'static str {
        LOG_CATEGORIES[self as usize].0
    }

    fn status(self) -> FmiStatus {
        match self {
            Self::All | Self::Events => FmiStatus::Ok,
            Self::Warning => FmiStatus::Warning,
            Self::Discard => FmiStatus::Discard,
            Self::Error => FmiStatus::Error,
            Self::Fatal => FmiStatus::Fatal,
        }
    }
}

/// Function of the importer that receives messages.
#[derive(Clone, Copy)]
pub(crate) enum Receiver {
    Fmi2(LogCallback),
    Fmi3(LogMessageCallback),
}

/// Logger of the importer, with the categories that it is to receive.
pub(crate) struct Logger {
    receiver: Option<Receiver>,
    environment: *mut c_void,
    instance: CString,
    /// Bit set of the categories that are reported even if logging is off.
    always: u8,
    /// Bit set of the categories that are reported.
    active: u8,
    /// Messages that are not delivered yet.
    messages: Vec<(Category, String)>,
}

const EVERYTHING: u8 = u8::MAX;
const ERRORS: u8 = 1 << Category::Error as u8 | 1 << Category::Fatal as u8;
const REFUSALS: u8 = ERRORS | 1 << Category::Discard as u8;

impl Logger {
    /// Copies the parts of `callbacks` that are needed, because the importer may free them
    /// afterwards.
    pub(crate) fn new(callbacks: Option<&Callbacks>, instance: CString, on: bool) -> Self {
        let receiver = callbacks.and_then(|callbacks| callbacks.logger).map(Receiver::Fmi2);
        let environment =
            callbacks.map_or(std::ptr::null_mut(), |callbacks| callbacks.component_environment);
        Self::to(receiver, environment, instance, on)
    }

    /// Makes a logger that delivers to `receiver`.
    pub(crate) fn to(
        receiver: Option<Receiver>,
        environment: *mut c_void,
        instance: CString,
        on: bool,
    ) -> Self {
        let always = if matches!(receiver, Some(Receiver::Fmi3(_))) { ERRORS } else { REFUSALS };
        let active = if on { EVERYTHING } else { always };
        Self { receiver, environment, instance, always, active, messages: Vec::new() }
    }

    /// Returns a logger that keeps warnings until they are taken, and reports nothing else: a
    /// program that is linked with the FMU gets failures as results.
    pub(crate) fn of_warnings() -> Self {
        let active = 1 << Category::Warning as u8;
        Self { active, ..Self::new(None, CString::default(), false) }
    }

    /// Returns the texts that are not delivered, which are then forgotten.
    pub(crate) fn take(&mut self) -> Vec<String> {
        mem::take(&mut self.messages).into_iter().map(|(_, text)| text).collect()
    }

    /// Switches the named categories on or off, or all if none is named. Returns a name that is not
    /// a category.
    pub(crate) fn choose<'a>(&mut self, on: bool, names: &[&'a str]) -> Option<&'a str> {
        let mut unknown = None;
        let mut chosen = if names.is_empty() { EVERYTHING } else { 0 };
        for name in names {
            match Category::named(name) {
                Some(Category::All) => chosen = EVERYTHING,
                Some(category) => chosen |= 1 << category as u8,
                None => unknown = Some(*name),
            }
        }
        // Switching categories on selects these and no others; switching off leaves the others as
        // they were.
        self.active = self.always | if on { chosen } else { self.active & !chosen };
        unknown
    }

    /// Keeps a message until it is delivered, if its category is reported.
    pub(crate) fn log(&mut self, category: Category, text: &str) {
        if self.active & (1 << category as u8) != 0 {
            self.messages.push((category, text.into()));
        }
    }

    /// Delivers all messages. An exception of the importer's logger passes through, and the
    /// messages that follow are lost. So nothing that catches panics may call this.
    pub(crate) fn deliver(&mut self) {
        if self.messages.is_empty() {
            return;
        }
        let messages = mem::take(&mut self.messages);
        let Some(receiver) = self.receiver else { return };
        for (category, text) in messages {
            let status = category.status();
            let name = to_c(category.name());
            match receiver {
                Receiver::Fmi2(callback) => {
                    let message = to_format(&text);
                    // SAFETY: the callback is the importer's function and gets its own environment.
                    // All strings live until it returns. The message holds no `%`, so the variadic
                    // function reads no further argument.
                    unsafe {
                        callback(
                            self.environment,
                            self.instance.as_ptr(),
                            status,
                            name.as_ptr(),
                            message.as_ptr(),
                        );
                    }
                }
                Receiver::Fmi3(callback) => {
                    // FMI 3.0 reads `#` as the beginning of a value reference.
                    let message = to_c(&text.replace('#', "##"));
                    // SAFETY: the callback is the importer's function and gets its own environment.
                    // Both strings live until it returns.
                    unsafe {
                        callback(self.environment, status, name.as_ptr(), message.as_ptr());
                    }
                }
            }
        }
    }
}

/// Converts a text for FMI 2.0, whose importers read it as a printf format, so that it must not
/// hold a `%`.
fn to_format(text: &str) -> CString {
    to_c(&text.replace('%', "percent"))
}

fn to_c(text: &str) -> CString {
    CString::new(text.replace('\0', " ")).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_are_in_the_order_of_the_declared_categories() {
        for (i, category) in Category::ROWS.into_iter().enumerate() {
            assert_eq!(category as usize, i);
        }
    }

    #[test]
    fn warnings_are_kept_until_they_are_taken() {
        let mut logger = Logger::of_warnings();
        logger.log(Category::Warning, "one");
        logger.log(Category::Events, "initialized");
        assert_eq!(logger.take(), ["one"]);
        assert_eq!(logger.take(), Vec::<String>::new());
    }

    #[test]
    fn messages_hold_no_format() {
        assert_eq!(to_format("at 5 %\0s").to_str(), Ok("at 5 percent s"));
    }
}
