//! Flies the parts of sweeps on several threads, for studies and campaigns, and keeps what is
//! finished. A part that is kept is not flown again.

use crate::cases::Sweep;
use crate::closed;
use crate::error::Error;
use crate::parts::{PartResult, Store};
use crate::threads::Worked;
use cosim::error::Error as Single;
use cosim::interrupt::Interrupt;
use cosim::system::System;
use cosim_metrics::progress::Parts;
use fmu_import::isolation::Ended;
use std::collections::BTreeMap;
use std::num::NonZero;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::thread;

/// Options of the work on many cases.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// Folder for the results, in place of the usual one below `out`.
    pub out: Option<PathBuf>,
    /// Number of threads; 0 means one for each core.
    pub jobs: usize,
    /// Whether cases that are kept already are flown again, and the results of an earlier search
    /// replaced.
    pub fresh: bool,
    /// Whether the progress display is suppressed.
    pub quiet: bool,
    /// Interrupt through which the work can be ended from outside.
    pub interrupt: Interrupt,
}

/// A part of the work: some cases of one of several sweeps.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Part {
    /// Position of the sweep.
    pub sweep: usize,
    /// Cases of the sweep that belong to this part.
    pub cases: Range<u64>,
}

impl Part {
    /// Returns the number of its cases.
    pub fn count(&self) -> u64 {
        self.cases.end - self.cases.start
    }
}

/// Work of which the results are kept in files.
pub struct Work<'a> {
    /// Title of the work, for the progress display.
    pub title: &'a str,
    /// Folder of the results.
    pub out: &'a Path,
    /// Files of the parts, for each sweep.
    pub stores: Vec<Store<'a>>,
    /// Number of cases whose results are there.
    cases: u64,
    /// Remarks, for example why cases are flown again.
    pub notes: Vec<String>,
}

impl<'a> Work<'a> {
    /// Returns work of which nothing is known to be done.
    pub fn new(title: &'a str, out: &'a Path, stores: Vec<Store<'a>>) -> Self {
        Self { title, out, stores, cases: 0, notes: Vec::new() }
    }

    /// Looks for these parts, and returns the missing ones.
    pub fn missing(&mut self, parts: impl IntoIterator<Item = Part>) -> Vec<Part> {
        let mut missing = Vec::new();
        let mut reasons: BTreeMap<String, u64> = BTreeMap::new();
        for part in parts {
            match self.stores[part.sweep].find(&part.cases) {
                Ok(_) => self.cases += part.count(),
                Err(reason) => {
                    missing.push(part);
                    if let Some(reason) = reason {
                        *reasons.entry(reason).or_default() += 1;
                    }
                }
            }
        }
        self.notes.extend(reasons.into_iter().map(|(reason, count)| {
            let s = if count == 1 { "" } else { "s" };
            format!("flown again because {reason} ({count} part{s})")
        }));
        missing
    }

    /// Flies parts of these `systems` on several threads, each with a state of its own. If an FMU
    /// fails, the other parts are flown and kept, so that little is left for the next time.
    /// `failed` names what could not be flown: the case, if it is known, or the part.
    ///
    /// # Errors
    /// Returns an error if the work was asked to end before all `total` cases are there, if a case
    /// could not be flown, or if a file cannot be written.
    pub fn fly<S>(
        &mut self,
        parts: &[Part],
        (threads, total): (usize, u64),
        (systems, options): (&[System], &Options),
        begin: impl Fn() -> Result<S, Error> + Sync,
        fly: impl Fn(&mut S, &Part, &Parts) -> Result<PartResult, Error> + Sync,
        failed: impl Fn(&Part, Option<u64>, Single) -> Error,
    ) -> Result<(), Error> {
        if parts.is_empty() {
            return Ok(());
        }
        let (done, left) = (self.cases, parts.iter().map(Part::count).sum::<u64>());
        let progress = Parts::new("cases", self.title, done + left, done, options.quiet);
        let (stores, closing) = (&self.stores, closed::closing(systems));
        // A closed process does not draw.
        let hidden = || closing.is_some().then(|| Parts::new("cases", "", 0, 0, true));
        if closing.is_some() {
            progress.draw_here();
        }
        let Worked { results, failures } = closed::on_parts(
            parts,
            threads,
            (closing.as_ref(), &options.interrupt),
            || Ok((begin()?, hidden())),
            |(state, hidden), part| fly(state, part, hidden.as_ref().unwrap_or(&progress)),
            |part, result| {
                if closing.is_some() {
                    progress.advance(part.count());
                }
                Ok(stores[part.sweep].write(&part.cases, &result)?)
            },
            |part, ended| {
                let case = if let Ended::Failed(last) = &ended { last.case } else { None };
                match systems[part.sweep].ended(ended, &options.interrupt) {
                    error @ Single::Interrupted { .. } => Error::Single(error),
                    error => failed(part, case, error),
                }
            },
            |error| matches!(error, Error::Case { .. }),
        );
        progress.finish();
        self.cases += results.into_keys().map(|at| parts[at].count()).sum::<u64>();
        let (cases, mut others): (Vec<Error>, Vec<Error>) =
            failures.into_values().partition(|error| matches!(error, Error::Case { .. }));
        let more = cases.len().saturating_sub(1);
        others.extend(cases);
        match others.into_iter().next() {
            None => Ok(()),
            Some(Error::Single(Single::Interrupted { request, .. })) => {
                let (done, out) = (self.cases, self.out.into());
                Err(Error::Unfinished { done, total, out, request })
            }
            Some(Error::Case { case, source, .. }) => Err(Error::Case { case, more, source }),
            Some(error) => Err(error),
        }
    }
}

/// Returns the number of threads for `jobs`, where 0 means one for each core. It is one if an FMU
/// can be instantiated only once in a process.
pub fn threads<'a>(jobs: usize, sweeps: impl IntoIterator<Item = &'a Sweep>) -> usize {
    if let Some(path) = sweeps.into_iter().find_map(|sweep| sweep.single.as_ref()) {
        tracing::warn!(
            "{} can be instantiated only once per process: one thread flies all cases",
            path.display()
        );
        return 1;
    }
    match jobs {
        0 => thread::available_parallelism().map_or(1, NonZero::get),
        jobs => jobs,
    }
}
