//! The description of an FMI 2.0 unit as data, the XML made from it, and the packing of `.fmu` archives.
//! Knows no physics.

pub mod unit;
pub mod variable;

use serde::{Deserialize, Serialize};
use variable::Variable;

/// Everything `modelDescription.xml` says of a unit. Handed out by a built library as JSON, through its exported function
/// `fmu_model_descriptions`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ModelDescription {
    /// Model name, also the model identifier and the archive's name: `CRMPC`.
    pub name: String,
    /// One line: what the unit is.
    pub description: String,
    /// HTML fragment for `documentation/index.html`: what the unit computes, with equations and their source.
    pub documentation: String,
    /// Version of the crate that made it.
    pub version: String,
    /// Whether it can be used for co-simulation.
    pub co_simulation: bool,
    /// Whether it can be used for model exchange.
    pub model_exchange: bool,
    /// Number of event indicators (model exchange).
    pub event_indicators: usize,
    /// The experiment a tool proposes.
    pub default_experiment: DefaultExperiment,
    /// All variables; a variable's value reference is its index here.
    pub variables: Vec<Variable>,
}

/// What a tool offers as simulation settings.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct DefaultExperiment {
    /// Start time, s.
    pub start: f64,
    /// Stop time, s.
    pub stop: f64,
    /// Relative tolerance for model exchange integrators.
    pub tolerance: f64,
    /// Communication step, s.
    pub step: f64,
}
