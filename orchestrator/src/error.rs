//! The crate's one error type. A message names the culprit and what to do about it.

use crate::interrupt::Request;
use fmu_import::error::Error as Import;
use fmu_import::quantity::rounded;
use fmu_import::unit::UnitFailure;
use std::path::PathBuf;

/// All errors of this crate, from reading an experiment to writing its results.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The experiment or the command line asks for something that cannot be done.
    #[error("{at}{message}")]
    Experiment {
        /// File and line, `lqr.toml:12: `, or empty where there is none.
        at: String,
        /// Description of the problem and its remedy.
        message: String,
    },
    /// An archive cannot be used.
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
    /// A unit failed in a call.
    #[error("{component} failed at t = {} s in {}: {}", rounded(*time), failure.call, failure.message)]
    Unit {
        /// Name of the component in the experiment.
        component: String,
        /// Simulated time of the communication point, s.
        time: f64,
        /// The call that failed, with the unit's own message.
        failure: UnitFailure,
    },
    /// A unit ended the simulation, which FMI lets it do.
    #[error("{component} ended the simulation at t = {} s: {message}", rounded(*time))]
    EndedByUnit {
        /// Name of the component in the experiment.
        component: String,
        /// The last communication point, s.
        time: f64,
        /// Message of the unit, in its own words.
        message: String,
    },
    /// A deadline was missed in a run that was to end then.
    #[error(
        "{component} missed its deadline at t = {} s by {late_ms:.3} ms, which was to end the run (--on-miss stop)",
        rounded(*time)
    )]
    Deadline {
        /// Name of the component whose values were late.
        component: String,
        /// Simulated time of the communication point, s.
        time: f64,
        /// Time from the deadline until the values were ready, ms.
        late_ms: f64,
    },
    /// The attitude is further from its reference than the experiment allows.
    #[error(
        "attitude lost at t = {} s: further than {} deg from its reference ([metrics] lost_deg)",
        rounded(*time),
        rounded(*beyond_deg)
    )]
    Lost {
        /// First communication point at which the attitude was lost, s.
        time: f64,
        /// Largest allowed distance from the reference, deg.
        beyond_deg: f64,
    },
    /// A run was asked to end before its stop time.
    #[error("ended by {request} before t = {} s", rounded(*time))]
    Interrupted {
        /// The first communication point that was not reached, s.
        time: f64,
        /// The request that ended the run.
        request: Request,
    },
    /// A study was asked to end before all of its runs were complete.
    #[error(
        "ended by {request}: {done} of {all} parts are finished and kept in {}; the same command goes on from there",
        out.display()
    )]
    Unfinished {
        /// Number of parts that are complete and kept.
        done: usize,
        /// Number of parts in the study.
        all: usize,
        /// Folder of the study's results.
        out: PathBuf,
        /// The request that ended the study.
        request: Request,
    },
    /// Work that has no results of its own was asked to end.
    #[error("ended by {0}")]
    Ended(Request),
    /// A run of a study failed.
    #[error("run {run}: {source}")]
    Run {
        /// Id of the run in the study.
        run: String,
        /// The error of that run.
        source: Box<Error>,
    },
    /// A file or folder could not be read or written.
    #[error("{}: {source}", path.display())]
    File {
        /// Path of the file or folder.
        path: PathBuf,
        /// Reason that the system gave.
        source: std::io::Error,
    },
    /// Standard output could not be written.
    #[error("standard output: {0}")]
    Output(#[from] std::io::Error),
}

impl Error {
    /// Creates an error of the experiment that refers to no line.
    pub fn experiment(message: impl Into<String>) -> Self {
        Self::Experiment { at: String::new(), message: message.into() }
    }

    /// Adds the name of a file to a system error.
    pub fn file(path: impl Into<PathBuf>) -> impl FnOnce(std::io::Error) -> Self {
        let path = path.into();
        move |source| Self::File { path, source }
    }

    /// The process's exit code: 1 for a run that failed, 2 for bad usage or a bad experiment,
    /// 3 for an attitude that was lost, 130 or 143 for one that a signal ended.
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Experiment { .. } | Self::Import(Import::Fmu { .. }) => 2,
            // A case that ends early has no result to compare.
            Self::Run { source, .. } if matches!(**source, Self::EndedByUnit { .. }) => 1,
            Self::Run { source, .. } => source.exit_code(),
            Self::Interrupted { request, .. } | Self::Unfinished { request, .. } | Self::Ended(request) => {
                request.exit_code()
            }
            Self::EndedByUnit { .. } => 0,
            Self::Lost { .. } => 3,
            Self::Faults { .. }
            | Self::Unit { .. }
            | Self::Deadline { .. }
            | Self::Import(Import::File { .. })
            | Self::File { .. }
            | Self::Output(_) => 1,
        }
    }

    /// Whether standard output was closed by its reader, which is no failure.
    pub fn is_broken_pipe(&self) -> bool {
        matches!(self, Self::Output(source) if source.kind() == std::io::ErrorKind::BrokenPipe)
    }
}
