//! Messages to the importer, which leave the FMU through the importer's callback only.
//!
//! Errors and fatal errors are always reported, so that nobody has to repeat a run with logging on
//! to find them. Everything else is reported only while logging is on (`loggingOn` of
//! fmi2Instantiate, fmi2SetDebugLogging), and then only in the chosen categories.
#![allow(unsafe_code)]

use crate::types::{Callbacks, FmiStatus, LogCallback};
use model_description::LOG_CATEGORIES;
use std::cell::RefCell;
use std::ffi::{CString, c_void};

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

/// Logger of the importer, with the categories that it is to receive.
pub(crate) struct Logger {
    callback: Option<LogCallback>,
    environment: *mut c_void,
    instance: CString,
    /// Bit set of the categories that are reported.
    active: u8,
    /// Warnings for a program that is linked with the FMU.
    warnings: Option<RefCell<Vec<String>>>,
}

const EVERYTHING: u8 = u8::MAX;
const ALWAYS: u8 = 1 << Category::Error as u8 | 1 << Category::Fatal as u8;

impl Logger {
    /// Copies the parts of `callbacks` that are needed, because the importer may free them
    /// afterwards.
    pub(crate) fn new(callbacks: Option<&Callbacks>, instance: CString, on: bool) -> Self {
        Self {
            callback: callbacks.and_then(|callbacks| callbacks.logger),
            environment: callbacks
                .map_or(std::ptr::null_mut(), |callbacks| callbacks.component_environment),
            instance,
            active: if on { EVERYTHING } else { ALWAYS },
            warnings: None,
        }
    }

    /// Returns a logger that lists warnings until they are taken, and reports nothing else: who is
    /// linked with the FMU gets failures as results.
    pub(crate) fn listing() -> Self {
        Self { warnings: Some(RefCell::default()), ..Self::new(None, CString::default(), false) }
    }

    /// Returns the listed warnings, which are then forgotten.
    pub(crate) fn take_warnings(&mut self) -> Vec<String> {
        self.warnings.as_mut().map(|list| std::mem::take(list.get_mut())).unwrap_or_default()
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
        self.active = ALWAYS | if on { chosen } else { self.active & !chosen };
        unknown
    }

    pub(crate) fn log(&self, category: Category, text: &str) {
        if let (Category::Warning, Some(list)) = (category, &self.warnings) {
            list.borrow_mut().push(text.into());
        }
        let Some(callback) = self.callback else { return };
        if self.active & (1 << category as u8) == 0 {
            return;
        }
        let message = to_c(text);
        let category_name = to_c(category.name());
        // SAFETY: the callback is the importer's function and gets its own environment. All strings
        // live until it returns. The message holds no `%`, so the variadic function reads no
        // further argument.
        unsafe {
            callback(
                self.environment,
                self.instance.as_ptr(),
                category.status(),
                category_name.as_ptr(),
                message.as_ptr(),
            );
        }
    }
}

/// Converts a text for the importer. The importer reads it as a printf format, so it must not hold
/// a `%`.
fn to_c(text: &str) -> CString {
    CString::new(text.replace('%', "percent").replace('\0', " ")).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn silent(on: bool) -> Logger {
        Logger::new(None, CString::default(), on)
    }

    fn hears(logger: &Logger, category: Category) -> bool {
        logger.active & (1 << category as u8) != 0
    }

    #[test]
    fn rows_are_in_the_order_of_the_declared_categories() {
        for (i, category) in Category::ROWS.into_iter().enumerate() {
            assert_eq!(category as usize, i);
        }
    }

    #[test]
    fn errors_are_heard_even_if_logging_is_off() {
        let logger = silent(false);
        assert!(hears(&logger, Category::Error) && hears(&logger, Category::Fatal));
        assert!(!hears(&logger, Category::Warning) && !hears(&logger, Category::Events));
    }

    #[test]
    fn only_chosen_categories_are_heard() {
        let mut logger = silent(true);
        assert_eq!(logger.choose(true, &["logStatusWarning"]), None);
        assert!(hears(&logger, Category::Warning) && !hears(&logger, Category::Events));
        assert_eq!(logger.choose(true, &["logAll"]), None);
        assert!(hears(&logger, Category::Events));
        assert_eq!(logger.choose(false, &["logEvents"]), None);
        assert!(hears(&logger, Category::Warning) && !hears(&logger, Category::Events));
        assert_eq!(logger.choose(true, &["logWeather"]), Some("logWeather"));
    }

    #[test]
    fn warnings_are_listed_until_they_are_taken() {
        let mut logger = Logger::listing();
        logger.log(Category::Warning, "one");
        logger.log(Category::Events, "initialized");
        assert_eq!(logger.take_warnings(), ["one"]);
        assert_eq!(logger.take_warnings(), Vec::<String>::new());
    }

    #[test]
    fn messages_hold_no_format() {
        assert_eq!(to_c("at 5 %\0s").to_str(), Ok("at 5 percent s"));
    }
}
