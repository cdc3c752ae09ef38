//! Errors of a campaign, and their exit codes.

use cosim::error::Error as Single;
use cosim::interrupt::Request;
use std::path::PathBuf;

/// An error that occurs between reading a campaign and writing its report.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The campaign is faulty, or something outside any case failed.
    #[error(transparent)]
    Single(#[from] Single),
    /// A campaign was asked to end before all of its cases were flown.
    #[error(
        "ended by {request}: {done} of {total} cases are flown and kept in {}; the same command continues from there",
        out.display()
    )]
    Unfinished {
        /// Number of cases that are kept.
        done: u64,
        /// Number of cases in the campaign.
        total: u64,
        /// Folder of the results.
        out: PathBuf,
        /// The request that ended the campaign.
        request: Request,
    },
}

impl Error {
    /// Returns the exit code of a process that ends with this error.
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Single(source) => source.exit_code(),
            Self::Unfinished { request, .. } => request.exit_code(),
        }
    }
}
