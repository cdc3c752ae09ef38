//! Errors of checking and running an experiment. A message names the culprit and what to do about
//! it.

use crate::interrupt::Request;
use fmi_master::instance::CallFailure;
use fmi_master::master::Failed;
use fmi_master::quantity::rounded;
use fmu_import::error::Error as Import;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// An error that occurs between reading an experiment and writing its results.
#[derive(Debug, thiserror::Error, Serialize, Deserialize)]
pub enum Error {
    /// The experiment or the command line asks for something that cannot be done.
    #[error("{at}{message}")]
    Experiment {
        /// File and line, such as `lqr.toml:12: `, or an empty text if there is none.
        at: String,
        /// Description of the problem and its remedy.
        message: String,
    },
    /// An archive cannot be used.
    #[error(transparent)]
    Import(#[from] fmu_import::error::Error),
    /// A call of an instance failed.
    #[error("{component} failed at t = {} s in {}: {}", rounded(*time), failure.call, failure.message)]
    Call {
        /// Name of the component in the experiment.
        component: String,
        /// Simulated time of the communication point, s.
        time: f64,
        /// The call that failed, with the instance's own message.
        failure: CallFailure,
    },
    /// An instance ended the simulation, which FMI allows.
    #[error("{component} ended the simulation at t = {} s: {message}", rounded(*time))]
    EndedByInstance {
        /// Name of the component in the experiment.
        component: String,
        /// Time of the last communication point, s.
        time: f64,
        /// Message of the instance, in its own words.
        message: String,
    },
    /// Signals exceeded the bound beyond which the experiment counts a run as lost, or its goal as
    /// missed.
    #[error("{what} at t = {} s: {reason}", rounded(*time))]
    Lost {
        /// Loss or missed goal, such as "attitude lost".
        what: String,
        /// Time of the first communication point at which this was so, s.
        time: f64,
        /// Description of the bound that was exceeded.
        reason: String,
    },
    /// A run was asked to end before its stop time.
    #[error("ended by {request} at t = {} s", rounded(*time))]
    Interrupted {
        /// Time of the communication point from which no step was completed, s.
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
        #[serde(with = "fmu_import::error::reason")]
        source: std::io::Error,
    },
}

impl From<Failed> for Error {
    fn from(Failed { component, time, failure }: Failed) -> Self {
        if failure.ends.is_some() {
            Self::EndedByInstance { component, time, message: failure.message }
        } else {
            Self::Call { component, time, failure }
        }
    }
}

impl Error {
    /// Returns the request to end the work, if there was one, in place of the failure of a call: it
    /// may have ended that call.
    pub(crate) fn or(self, request: Option<Request>) -> Self {
        match (self, request) {
            (Self::Call { time, .. }, Some(request)) => Self::Interrupted { time, request },
            (failed, _) => failed,
        }
    }

    /// Creates an error of the experiment that refers to no line.
    pub fn experiment(message: impl Into<String>) -> Self {
        Self::Experiment { at: String::new(), message: message.into() }
    }

    /// Adds the name of a file to a system error.
    pub fn file(path: impl Into<PathBuf>) -> impl FnOnce(std::io::Error) -> Self {
        let path = path.into();
        move |source| Self::File { path, source }
    }

    /// Returns the exit code of a process that ends with this error: 1 for a run that failed or that
    /// an instance ended without results, 2 for bad usage or a bad experiment, 3 for a run that was
    /// lost, and 130 or 143 for a run that a signal ended.
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Experiment { .. } | Self::Import(Import::Fmu { .. }) => 2,
            Self::Interrupted { request, .. } | Self::Ended(request) => request.exit_code(),
            Self::Lost { .. } => 3,
            Self::Call { .. }
            | Self::EndedByInstance { .. }
            | Self::Import(Import::File { .. })
            | Self::File { .. } => 1,
        }
    }
}
