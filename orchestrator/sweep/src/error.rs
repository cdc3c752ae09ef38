//! Errors of work on many cases, and their exit codes.

use cosim::error::Error as Single;
use cosim::interrupt::Request;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// An error that occurs between reading a campaign or a study and writing its report.
#[derive(Debug, thiserror::Error, Serialize, Deserialize)]
pub enum Error {
    /// The file is faulty, or something outside any case failed.
    #[error(transparent)]
    Single(#[from] Single),
    /// A run of a study failed.
    #[error("run {run}: {source}")]
    Run {
        /// Id of the run in the study.
        run: Box<str>,
        /// The error of that run.
        source: Single,
    },
    /// Cases could not be flown, for a reason that is independent of their values.
    #[error(
        "{case} could not be flown: {source}{}; the same command flies what is missing",
        if *more > 0 { format!(" ({more} more parts have such cases)") } else { String::new() }
    )]
    Case {
        /// The first of them in words, for example `case 12`.
        case: String,
        /// Number of other parts with such cases.
        more: usize,
        /// Reason of the first of them.
        source: Box<Single>,
    },
    /// Every case failed, so that there are no statistics.
    #[error("{0}")]
    Failed(String),
    /// The work was asked to end before it was complete.
    #[error(
        "ended by {request}: {done} of {total} cases are flown and kept in {}; the same command continues from there",
        out.display()
    )]
    Unfinished {
        /// Number of cases that are flown and kept.
        done: u64,
        /// Number of all.
        total: u64,
        /// Folder of the results.
        out: PathBuf,
        /// The request that ended the work.
        request: Request,
    },
}

impl Error {
    /// Names the case, in words, in which an FMU could not be flown.
    pub fn of_case(case: String, source: Single) -> Self {
        match source {
            Single::Call { .. } => Self::Case { case, more: 0, source: Box::new(source) },
            source => source.into(),
        }
    }

    /// Returns the exit code of a process that ends with this error.
    pub fn exit_code(&self) -> u8 {
        match self {
            // A run that ends early has no result to compare, so that this is a failure of the
            // study.
            Self::Run { source: Single::EndedByInstance { .. }, .. } | Self::Failed(_) => 1,
            Self::Single(source) | Self::Run { source, .. } => source.exit_code(),
            Self::Case { source, .. } => source.exit_code(),
            Self::Unfinished { request, .. } => request.exit_code(),
        }
    }
}
