//! Collects the warnings of instances during a run. Each is printed once, at the end, with the time
//! at which it first came and with its count.

use crate::isolation;
use parking_lot::Mutex;
use std::cell::RefCell;
use std::collections::BTreeSet;

/// Largest number of different warnings that are collected, in case an instance never repeats
/// itself.
const MOST: usize = 100;

/// A warning of an instance, in its own words.
struct Warning {
    text: String,
    first: f64,
    count: u64,
}

/// Current simulated time, s, and the warnings collected so far.
#[derive(Default)]
struct Collected {
    now: f64,
    warnings: Vec<Warning>,
    /// Whether nothing of it is printed.
    is_silent: bool,
}

thread_local! {
    static COLLECTED: RefCell<Option<Collected>> = const { RefCell::new(None) };
}

/// A guard: warnings of this thread's instances are collected as long as this value lives.
pub struct Collection(());

/// Begins to collect warnings. If no collection is active, warnings are printed as they come.
pub fn collect() -> Collection {
    COLLECTED.with_borrow_mut(|collection| *collection = Some(Collected::default()));
    Collection(())
}

/// A guard: warnings and errors of this thread's instances are dropped as long as this value lives.
pub struct Silence(Option<Collected>);

/// Begins to drop warnings and errors, such as those of an instance that is disturbed on purpose.
pub fn silence() -> Silence {
    Silence(COLLECTED.replace(Some(Collected { is_silent: true, ..Collected::default() })))
}

/// Returns whether messages of this thread's instances are dropped.
pub(crate) fn is_silent() -> bool {
    COLLECTED.with_borrow(|collection| collection.as_ref().is_some_and(|one| one.is_silent))
}

impl Drop for Silence {
    fn drop(&mut self) {
        COLLECTED.set(self.0.take());
    }
}

/// Sets the current simulated time, s.
pub fn at(time: f64) {
    isolation::page::at(time);
    COLLECTED.with_borrow_mut(|collection| {
        if let Some(collection) = collection {
            collection.now = time;
        }
    });
}

/// Returns whether a line of the log is a warning that was printed before, by any thread or closed
/// process.
pub(crate) fn is_repeated(line: &str) -> bool {
    static PRINTED: Mutex<BTreeSet<String>> = Mutex::new(BTreeSet::new());
    let mut printed = PRINTED.lock();
    line.trim_start().starts_with("WARN") && !printed.insert(line.to_string())
}

/// Records or prints a warning of an instance.
pub fn warn(text: &str) {
    if !collected(text) {
        tracing::warn!("{text}");
    }
}

/// Records a warning of an instance. Returns whether there was room for it.
pub(crate) fn collected(text: &str) -> bool {
    COLLECTED.with_borrow_mut(|collection| {
        let Some(Collected { now, warnings, .. }) = collection else { return false };
        if let Some(warning) = warnings.iter_mut().find(|warning| warning.text == text) {
            warning.count += 1;
        } else if warnings.len() < MOST {
            isolation::tell_warning(text);
            warnings.push(Warning { text: text.to_string(), first: *now, count: 1 });
        } else {
            return false;
        }
        true
    })
}

impl Warning {
    fn text(&self) -> String {
        let time = fmi_master::quantity::rounded(self.first);
        match self.count {
            1 => format!("{} (at t = {time} s)", self.text),
            count => format!("{} (first at t = {time} s, {count} times)", self.text),
        }
    }
}

impl Drop for Collection {
    /// Prints the warnings that were collected.
    fn drop(&mut self) {
        let collection = COLLECTED.with_borrow_mut(Option::take);
        for warning in collection.iter().flat_map(|collection| &collection.warnings) {
            tracing::warn!("{}", warning.text());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_comes_in_silence_is_dropped_and_what_was_collected_stays() {
        let collection = collect();
        warn("before");
        let silence = silence();
        warn("meanwhile");
        drop(silence);
        warn("after");
        let texts: Vec<String> = COLLECTED.with_borrow(|collection| {
            let warnings = collection.iter().flat_map(|collection| &collection.warnings);
            warnings.map(|warning| warning.text.clone()).collect()
        });
        assert_eq!(texts, ["before", "after"]);
        drop(collection);
    }

    #[test]
    fn a_warning_is_told_once_with_its_first_time_and_its_count() {
        let collection = collect();
        for (time, text) in [(0.0, "late"), (0.1 + 0.2, "lost"), (0.5, "lost"), (0.7, "lost")] {
            at(time);
            warn(text);
        }
        let texts: Vec<String> = COLLECTED.with_borrow(|collection| {
            collection
                .iter()
                .flat_map(|collection| &collection.warnings)
                .map(Warning::text)
                .collect()
        });
        assert_eq!(texts, ["late (at t = 0 s)", "lost (first at t = 0.3 s, 3 times)"]);
        drop(collection);
        assert!(COLLECTED.with_borrow(Option::is_none));
    }
}
