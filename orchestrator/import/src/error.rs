//! Errors of opening an archive. Each message names the archive and what is wrong with it.

use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// An archive that cannot be used.
#[derive(Debug, thiserror::Error, Serialize, Deserialize)]
pub enum Error {
    /// A file is not an FMU that this program can use.
    #[error("{}: {message}", path.display())]
    Fmu {
        /// Path of the archive.
        path: PathBuf,
        /// Description of the problem with the archive.
        message: String,
    },
    /// A file or folder could not be read or written.
    #[error("{}: {source}", path.display())]
    File {
        /// Path of the file or folder.
        path: PathBuf,
        /// Reason that the system gave.
        #[serde(with = "reason")]
        source: std::io::Error,
    },
}

impl Error {
    /// Adds the name of a file to a system error.
    pub fn file(path: impl Into<PathBuf>) -> impl FnOnce(std::io::Error) -> Self {
        let path = path.into();
        move |source| Self::File { path, source }
    }
}

/// Returns an error and its causes as one line.
pub(crate) fn with_causes(error: &dyn std::error::Error) -> String {
    let causes = std::iter::successors(Some(error), |error| error.source());
    causes.map(ToString::to_string).collect::<Vec<_>>().join(": ")
}

/// A reason that the system gave, which a closed process sends as a text.
pub mod reason {
    use serde::{Deserialize, Deserializer, Serialize, Serializer};
    use std::io::Error;

    /// Writes the text.
    ///
    /// # Errors
    /// The errors are those of the serializer.
    pub fn serialize<S: Serializer>(reason: &Error, serializer: S) -> Result<S::Ok, S::Error> {
        reason.to_string().serialize(serializer)
    }

    /// Reads the text.
    ///
    /// # Errors
    /// The errors are those of the deserializer.
    pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Error, D::Error> {
        String::deserialize(deserializer).map(Error::other)
    }
}
