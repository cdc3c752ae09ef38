//! Errors of checking and running an experiment. A message names the culprit and what to do about it.

use crate::interrupt::Request;
use fmu_import::error::Error as Import;
use fmu_import::quantity::rounded;
use fmu_import::unit::UnitFailure;
use std::path::PathBuf;

/// What can go wrong from reading an experiment to writing its results.
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
    /// Signals left the bounds beyond which the experiment gives a run up.
    #[error("{what} lost at t = {} s: {reason}", rounded(*time))]
    Lost {
        /// What was lost.
        what: String,
        /// First communication point at which it was lost, s.
        time: f64,
        /// The bound that was left.
        reason: String,
    },
    /// A run was asked to end before its stop time.
    #[error("ended by {request} before t = {} s", rounded(*time))]
    Interrupted {
        /// The first communication point that was not reached, s.
        time: f64,
        /// The request that ended the run.
        request: Request,
    },
    /// Work that has no results of its own was asked to end.
    #[error("ended by {0}")]
    Ended(Request),
    /// A file or folder could not be read or written.
    #[error("{}: {source}", path.display())]
    File {
        /// Path of the file or folder.
        path: PathBuf,
        /// Reason that the system gave.
        source: std::io::Error,
    },
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

    /// The exit code of a process that ends with this error: 1 for a run that failed, 2 for bad usage or a bad experiment,
    /// 3 for a run that was lost, 130 or 143 for one that a signal ended.
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Experiment { .. } | Self::Import(Import::Fmu { .. }) => 2,
            Self::Interrupted { request, .. } | Self::Ended(request) => request.exit_code(),
            Self::EndedByUnit { .. } => 0,
            Self::Lost { .. } => 3,
            Self::Unit { .. }
            | Self::Deadline { .. }
            | Self::Import(Import::File { .. })
            | Self::File { .. } => 1,
        }
    }
}
