//! Errors of a study, and their exit codes.

use cosim::error::Error as Single;
use cosim::interrupt::Request;
use std::path::PathBuf;

/// An error that occurs between reading a study and writing its report.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// Something outside any run failed, or the study is faulty.
    #[error(transparent)]
    Single(#[from] Single),
    /// A run of the study failed.
    #[error("run {run}: {source}")]
    Run {
        /// Id of the run in the study.
        run: String,
        /// The error of that run.
        source: Single,
    },
    /// A study was asked to end before all of its runs were complete.
    #[error(
        "ended by {request}: {done} of {total} parts are finished and kept in {}; the same command continues from there",
        out.display()
    )]
    Unfinished {
        /// Number of parts that are complete and kept.
        done: usize,
        /// Number of parts in the study.
        total: usize,
        /// Folder of the study's results.
        out: PathBuf,
        /// The request that ended the study.
        request: Request,
    },
}

impl Error {
    /// Returns the exit code of a process that ends with this error.
    pub fn exit_code(&self) -> u8 {
        match self {
            // A run that ends early has no result to compare, so that this is a failure of the
            // study.
            Self::Run { source: Single::EndedByInstance { .. }, .. } => 1,
            Self::Single(source) | Self::Run { source, .. } => source.exit_code(),
            Self::Unfinished { request, .. } => request.exit_code(),
        }
    }
}
