//! Description of an FMU as data, the XML of FMI 2.0 and 3.0 made from it, and the packing of the
//! archives (feature `pack`). The crate knows no physics.

pub mod check;
pub mod condition;
#[cfg(feature = "pack")]
pub mod html;
#[cfg(feature = "pack")]
pub mod library;
#[cfg(feature = "pack")]
pub mod library_file;
#[cfg(feature = "pack")]
pub mod pack;
pub mod structure;
pub mod unit;
pub mod variable;
#[cfg(feature = "pack")]
pub mod xml;

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use std::fmt::Write;
use std::path::PathBuf;
use variable::Variable;

/// Version of FMI of an archive, or for which an instance was made.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Version {
    /// FMI 2.0.
    Fmi2,
    /// FMI 3.0. The time is its variable 0, then come those of the variable table, then the event
    /// indicators.
    Fmi3,
}

impl Version {
    /// Returns the value reference of the first variable of the variable table.
    pub fn first_reference(self) -> usize {
        match self {
            Self::Fmi2 => 0,
            Self::Fmi3 => 1,
        }
    }
}

/// Author of the FMUs, as `modelDescription.xml` names them.
pub const AUTHOR: &str = "Re-entry Attitude Control contributors";
/// SPDX expression of the licence of every FMU.
pub const LICENSE: &str = env!("CARGO_PKG_LICENSE");

/// Log categories that every FMU declares, each with its name and the messages reported under it.
pub const LOG_CATEGORIES: [(&str, &str); 6] = [
    ("logAll", "Messages of all other categories"),
    (
        "logEvents",
        "Changes of the state of the instance: initialized, reset, state restored, terminated",
    ),
    ("logStatusWarning", "Warnings about conditions that do not invalidate the results"),
    ("logStatusDiscard", "A call was refused, but the simulation can continue"),
    (
        "logStatusError",
        "A call failed: reset the instance or restore a saved state. These messages appear even if logging is off",
    ),
    (
        "logStatusFatal",
        "The FMU has a defect: free the instance. These messages appear even if logging is off",
    ),
];

/// Reason why an FMU could not be described or packed.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The variable table contradicts itself or FMI 2.0.
    #[error("FMU '{fmu}': {problem}")]
    Description {
        /// Name of the FMU at fault.
        fmu: String,
        /// Description of the fault, with the variable's name.
        problem: String,
    },
    /// The file is not a library that can be opened.
    #[cfg(feature = "pack")]
    #[error("cannot open library '{}': {source}", path.display())]
    Open {
        /// Path of the library file.
        path: PathBuf,
        /// Reason that the loader gave.
        source: libloading::Error,
    },
    /// The library provides no model descriptions.
    #[error("library '{}' provides no model descriptions ({problem}): build it with export_fmus! of fmi-export", path.display())]
    NoDescriptions {
        /// Path of the library file.
        path: PathBuf,
        /// Description of the part that the library lacks.
        problem: String,
    },
    /// The file is not a library that can be packed.
    #[error("library '{}': {problem}", path.display())]
    Library {
        /// Path of the library file.
        path: PathBuf,
        /// Description of its fault.
        problem: String,
    },
    /// Two FMUs of the given libraries have the same name.
    #[error("two FMUs are named '{0}', so their archives would overwrite each other")]
    SameName(String),
    /// A file could not be read or written.
    #[error("'{}': {source}", path.display())]
    File {
        /// Path of the file.
        path: PathBuf,
        /// Reason that the system gave.
        source: std::io::Error,
    },
    /// The archive could not be written.
    #[cfg(feature = "pack")]
    #[error("archive '{}': {source}", path.display())]
    Archive {
        /// Path of the archive.
        path: PathBuf,
        /// Reason that the archiver gave.
        source: zip::result::ZipError,
    },
}

/// Content of an FMU's `modelDescription.xml`. A built library provides it as JSON through its
/// exported function `fmu_model_descriptions`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ModelDescription {
    /// Model name, which is also the model identifier and the archive's name, for example `CRMPC`.
    pub name: String,
    /// Purpose of the FMU, in one line.
    pub description: String,
    /// HTML fragment for `documentation/index.html` that describes the computation of the FMU, with
    /// equations and their sources.
    pub documentation: String,
    /// Version of the crate that made the FMU.
    pub version: String,
    /// Whether the FMU can be used for co-simulation.
    pub co_simulation: bool,
    /// Whether the FMU can be used for model exchange.
    pub model_exchange: bool,
    /// Number of event indicators in model exchange.
    pub event_indicators: usize,
    /// Experiment that importers propose to their users.
    pub default_experiment: DefaultExperiment,
    /// All variables of the FMU; the value reference of each is its index here.
    pub variables: Vec<Variable>,
}

/// Simulation settings that importers propose.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct DefaultExperiment {
    /// Start time of the experiment, s.
    pub start: f64,
    /// Stop time of the experiment, s.
    pub stop: f64,
    /// Relative tolerance for the integrators of model exchange.
    pub tolerance: f64,
    /// Communication step of the experiment, s.
    pub step: f64,
}

impl Default for DefaultExperiment {
    /// Returns an experiment of one second in steps of 10 ms.
    fn default() -> Self {
        Self { start: 0.0, stop: 1.0, tolerance: 1e-6, step: 0.01 }
    }
}

impl ModelDescription {
    /// Returns the GUID: SHA-256 over the description as JSON, cut to 128 bits and written as a
    /// UUID (version 8). Two FMUs have the same GUID exactly if their variable tables, texts
    /// and versions agree.
    ///
    /// # Panics
    /// This never panics, because JSON can express every part of the description.
    pub fn guid(&self) -> String {
        let json = serde_json::to_vec(self).expect("plain data");
        let mut bytes: [u8; 16] = std::array::from_fn({
            let digest = Sha256::digest(&json);
            move |i| digest[i]
        });
        bytes[6] = bytes[6] & 0x0f | 0x80;
        bytes[8] = bytes[8] & 0x3f | 0x80;
        let mut guid = String::with_capacity(36);
        for (i, byte) in bytes.iter().enumerate() {
            if matches!(i, 4 | 6 | 8 | 10) {
                guid.push('-');
            }
            write!(guid, "{byte:02x}").expect("writing to a string");
        }
        guid
    }
}
