//! Log messages of instances.

use crate::fmi::Status;
use crate::isolation::page;
use crate::warnings;
use parking_lot::Mutex;
use std::ffi::c_int;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Largest number of messages of an instance that are printed in a second.
const MOST: u64 = 100;
/// Largest number of bytes of a message.
const LONGEST: usize = 2000;

/// Forwards the log messages of an instance. The last one that reports a problem waits until the call
/// returns, as it is part of the error that follows if the call fails.
pub(crate) struct Log {
    pub(crate) component: String,
    problem: Mutex<Option<Problem>>,
    /// Whether a problem waits, so that calls need no lock.
    waits: AtomicBool,
    event: Mutex<Option<String>>,
    pace: Mutex<Pace>,
}

/// A message that reports a problem: its status, its category and its text.
type Problem = (Result<Status, c_int>, String, String);

/// Number of messages in the current second.
#[derive(Default)]
struct Pace {
    since: Option<Instant>,
    count: u64,
}

impl Pace {
    /// Returns the number of messages of this second that were not printed.
    fn lost(&self) -> u64 {
        self.count.saturating_sub(MOST)
    }

    /// Counts a message. Returns whether it may be printed, and the number of messages of the last
    /// second that were not.
    fn count(&mut self) -> (bool, u64) {
        let now = Instant::now();
        let mut lost = 0;
        if self.since.is_none_or(|since| now.duration_since(since) > Duration::from_secs(1)) {
            lost = self.lost();
            *self = Self { since: Some(now), count: 0 };
        }
        self.count += 1;
        (self.count <= MOST, lost)
    }
}

impl Log {
    /// Creates a log of a component.
    pub(crate) fn new(component: &str) -> Self {
        Self {
            component: component.to_string(),
            problem: Mutex::default(),
            waits: AtomicBool::new(false),
            event: Mutex::default(),
            pace: Mutex::default(),
        }
    }

    /// Takes the problem that waits.
    pub(crate) fn take(&self) -> Option<String> {
        self.problem.lock().take().map(|(_, _, message)| message)
    }

    /// Prints the problem that waits, which has not become part of an error.
    #[inline]
    pub(crate) fn flush(&self) {
        if self.waits.load(Ordering::Relaxed) {
            self.waits.store(false, Ordering::Relaxed);
            let problem = self.problem.lock().take();
            if let Some((status, category, message)) = problem {
                self.print(status, &category, &message);
            }
        }
    }

    /// Hands over the problem that waits, without waiting itself, as a signal handler must not.
    pub(crate) fn with_problem(&self, function: impl FnOnce(&str)) {
        let problem = self.problem.try_lock();
        if let Some((_, _, message)) = problem.as_deref().and_then(Option::as_ref) {
            function(message);
        }
    }

    /// Takes the last message that reports no problem, such as why a simulation ends.
    pub(crate) fn take_event(&self) -> Option<String> {
        self.event.lock().take()
    }

    pub(crate) fn message(&self, status: Result<Status, c_int>, category: &str, message: &str) {
        let message = cut(message).trim_end().replace('\n', " ");
        let is_problem = !matches!(status, Ok(Status::Ok | Status::Pending | Status::Warning));
        if is_problem {
            page::problem(&message);
            self.flush();
            *self.problem.lock() = Some((status, cut(category).into(), message));
            self.waits.store(true, Ordering::Relaxed);
        } else {
            self.print(status, cut(category), &message);
            *self.event.lock() = Some(message);
        }
    }

    fn report_lost(&self, lost: u64) {
        if lost > 0 {
            tracing::warn!("{}: {lost} further messages are left out", self.component);
        }
    }

    fn print(&self, status: Result<Status, c_int>, category: &str, message: &str) {
        let component = &self.component;
        match status {
            Ok(Status::Ok | Status::Pending | Status::Discard)
                if !tracing::enabled!(tracing::Level::INFO) =>
            {
                return;
            }
            // Warnings are collected, each once.
            Ok(Status::Warning)
                if warnings::collected(&format!("{component}: [{category}] {message}")) =>
            {
                return;
            }
            Ok(Status::Error) if warnings::is_silent() => return,
            _ => {}
        }
        let (may_print, lost) = self.pace.lock().count();
        self.report_lost(lost);
        if !may_print {
            return;
        }
        match status {
            // The message of the discarded call gives the reason, such as the end of a run.
            Ok(Status::Ok | Status::Pending | Status::Discard) => {
                tracing::info!("{component}: [{category}] {message}");
            }
            Ok(Status::Warning) => tracing::warn!("{component}: [{category}] {message}"),
            Ok(Status::Error | Status::Fatal) | Err(_) => {
                tracing::error!("{component}: [{category}] {message}");
            }
        }
    }
}

// Instances may log from threads of their own.
const _: () = {
    const fn is_sync<T: Sync>() {}
    is_sync::<Log>();
};

impl Drop for Log {
    fn drop(&mut self) {
        self.flush();
        let lost = self.pace.lock().lost();
        self.report_lost(lost);
    }
}

/// Returns the beginning of a text that is too long.
fn cut(text: &str) -> &str {
    let end = (0..=LONGEST.min(text.len())).rev().find(|end| text.is_char_boundary(*end));
    &text[..end.unwrap_or(0)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_flood_is_counted_and_a_long_message_cut() {
        let log = Log::new("a");
        for number in 0..1000 {
            log.message(Ok(Status::Error), "c", &format!("{number} {}", "é".repeat(2000)));
        }
        assert_eq!(log.pace.lock().lost(), 999 - MOST);
        let last = log.take().unwrap();
        assert!(last.starts_with("999 ") && last.len() <= LONGEST && log.take().is_none());

        log.message(Ok(Status::Error), "c", "of a call that succeeds");
        log.flush();
        assert_eq!(log.take(), None, "it is no part of a later failure");

        let mut pace = Pace::default();
        let printed = (0..1000).filter(|_| pace.count().0).count() as u64;
        assert_eq!(printed, MOST);
    }
}
