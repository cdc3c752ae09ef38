//! What can be wrong with a request of the page.

use fmi2_export::Failure;

/// Reason why a request is refused or a flight ends early.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The request is not of the form that is expected.
    #[error("the request cannot be read: {0}")]
    Request(#[from] serde_json::Error),
    /// There is no controller with this name.
    #[error("there is no controller '{0}'")]
    Controller(String),
    /// An experiment that is built in contradicts itself.
    #[error("{file}: {problem}")]
    Experiment {
        /// File of the experiment.
        file: String,
        /// What is wrong with it.
        problem: String,
    },
    /// A parameter cannot have the value that it is given.
    #[error("{name}: {problem}")]
    Setting {
        /// Name of the parameter, with that of its component.
        name: String,
        /// What is wrong with its value.
        problem: String,
    },
    /// An FMU refused a call.
    #[error("{0}")]
    Fmu(#[from] Failure),
}
