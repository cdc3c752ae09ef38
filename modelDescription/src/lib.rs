//! Description of an FMI 2.0 unit as data, the XML made from it, and the packing of `.fmu`
//! archives (feature `pack`). The crate knows no physics.

#[cfg(feature = "pack")]
pub mod binary;
pub mod check;
#[cfg(feature = "pack")]
pub mod html;
#[cfg(feature = "pack")]
pub mod library;
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

/// Author of the units, as `modelDescription.xml` names them.
pub const AUTHOR: &str = "Re-entry Attitude Control contributors";
/// SPDX expression of the licence of every unit.
pub const LICENSE: &str = env!("CARGO_PKG_LICENSE");

/// Log categories that every unit declares, each with its name and the messages reported under it.
pub const LOG_CATEGORIES: [(&str, &str); 6] = [
    ("logAll", "Everything below"),
    ("logEvents", "Changes of the call state: initialized, reset, state restored, terminated"),
    ("logStatusWarning", "Something is not as it should be, but the result holds"),
    ("logStatusDiscard", "A call was refused, the unit can go on"),
    (
        "logStatusError",
        "A call failed: reset the unit or restore a saved state; reported even if logging is off",
    ),
    ("logStatusFatal", "A defect in the unit: free it; reported even if logging is off"),
];

/// Reason why a unit could not be described or packed.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The table of variables contradicts itself or FMI 2.0.
    #[error("unit '{unit}': {problem}")]
    Description {
        /// Name of the unit at fault.
        unit: String,
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
    /// The library does not hand out descriptions.
    #[error("'{}' hands out no unit descriptions ({problem}): build it with fmi2-export's export_fmus!", path.display())]
    NoDescriptions {
        /// Path of the library file.
        path: PathBuf,
        /// Description of what the library lacks.
        problem: String,
    },
    /// The file is no library that can be packed.
    #[error("library '{}': {problem}", path.display())]
    Binary {
        /// Path of the library file.
        path: PathBuf,
        /// Description of what is wrong with it.
        problem: String,
    },
    /// Two libraries, or two units of one library, have the same name.
    #[error("two units are named '{0}': their archives would overwrite each other")]
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

/// Content of a unit's `modelDescription.xml`. A built library hands it out as JSON through its
/// exported function `fmu_model_descriptions`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ModelDescription {
    /// Model name, which is also the model identifier and the archive's name, for example `CRMPC`.
    pub name: String,
    /// Purpose of the unit, in one line.
    pub description: String,
    /// HTML fragment for `documentation/index.html` that says what the unit computes, with
    /// equations and their sources.
    pub documentation: String,
    /// Version of the crate that made the unit.
    pub version: String,
    /// Whether the unit can be used for co-simulation.
    pub co_simulation: bool,
    /// Whether the unit can be used for model exchange.
    pub model_exchange: bool,
    /// Number of event indicators in model exchange.
    pub event_indicators: usize,
    /// Experiment that a tool proposes to its user.
    pub default_experiment: DefaultExperiment,
    /// All variables of the unit; the value reference of each is its index here.
    pub variables: Vec<Variable>,
}

/// Simulation settings that a tool proposes.
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

impl ModelDescription {
    /// Returns the GUID: SHA-256 over the description as JSON, cut to 128 bits and written as a
    /// UUID (version 8). Two libraries have the same GUID exactly if their tables, texts and
    /// versions agree.
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
