//! Faults of a request of the page.

use fmi_master::master::Failed;

/// Reason why a request is refused or a flight ends early.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The request is not of the form that is expected.
    #[error("the request cannot be read: {0}")]
    Request(#[from] serde_json::Error),
    /// There is no controller with this name.
    #[error("there is no controller '{0}'")]
    Controller(String),
    /// A parameter cannot have the value that it is given, or an experiment that is built in
    /// contradicts itself.
    #[error("{what}: {problem}")]
    Wrong {
        /// Name of the parameter with that of its component, or place in the experiment.
        what: String,
        /// Description of its fault.
        problem: String,
    },
    /// An FMU refused a call, in its own words.
    #[error("{0}")]
    Fmu(String),
}

impl From<Failed> for Error {
    fn from(failed: Failed) -> Self {
        Self::Fmu(failed.failure.message)
    }
}
