//! Errors with which the program ends, and their exit codes.

use cosim::error::Error as Single;
use std::io;
use std::path::PathBuf;
use sweep::error::Error as Sweep;

/// An error with which the program ends.
#[derive(Debug, thiserror::Error)]
pub(crate) enum Failure {
    /// A run failed, or it could not start.
    #[error(transparent)]
    Single(#[from] Single),
    /// A study or a campaign failed, or it could not start.
    #[error(transparent)]
    Sweep(#[from] Sweep),
    /// An FMU cannot be used.
    #[error(transparent)]
    Import(#[from] fmu_import::error::Error),
    /// An FMU has faults, which have already been reported.
    #[error("{}: {count} {}", path.display(), if *count == 1 { "fault" } else { "faults" })]
    Faults {
        /// Path of the archive.
        path: PathBuf,
        /// Number of faults that were found.
        count: usize,
    },
    /// Standard output could not be written.
    #[error("standard output cannot be written: {0}")]
    Output(#[from] io::Error),
}

impl Failure {
    /// Returns the exit code of the program: 1 for a run that failed, for an FMU with faults and
    /// for output that cannot be written, 2 for bad usage or a bad experiment, 3 for a run that was
    /// lost, and 130 or 143 for a run that a signal ended.
    pub(crate) fn exit_code(&self) -> u8 {
        match self {
            Self::Single(error) => error.exit_code(),
            Self::Sweep(error) => error.exit_code(),
            Self::Import(_) => 2,
            Self::Faults { .. } | Self::Output(_) => 1,
        }
    }

    /// Returns whether standard output was closed by its reader, which is no failure.
    pub(crate) fn is_broken_pipe(&self) -> bool {
        matches!(self, Self::Output(source) if source.kind() == io::ErrorKind::BrokenPipe)
    }
}
