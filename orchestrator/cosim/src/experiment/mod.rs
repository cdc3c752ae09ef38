//! An experiment file: which FMUs, their parameters, their wiring, how they are stepped, what is recorded.
//!
//! All keys stand in docs/experiments.md, and in `orchestrator/schema/experiment.json` for editors.

mod measures;
mod overrides;

pub use crate::watch::OnInvalid;
pub use measures::{Curve, Guarantee, Kind, Loss, Measure, Observe, Panel, Scaled};
pub use overrides::Overrides;

use crate::document::Source;
use crate::error::Error;
use fmu_import::names;
use fmu_import::quantity::Scaling;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use toml::{Spanned, Value};

/// An experiment as it is written.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Experiment {
    /// One line.
    pub title: String,
    /// Whatever there is to say.
    #[serde(default)]
    pub description: String,
    /// Time and coupling.
    pub simulation: Simulation,
    /// The units, by name.
    pub components: BTreeMap<String, Component>,
    /// The wiring.
    #[serde(default)]
    pub connections: Vec<Connection>,
    /// What goes into the results.
    pub record: Record,
    /// What is measured, watched and drawn.
    #[serde(default)]
    pub observe: Observe,
    /// Whether inputs may stay unconnected without being named; no key of an experiment file.
    #[serde(skip)]
    pub leaves_inputs_open: bool,
    /// Parameters `component.parameter` that the command line sets.
    #[serde(skip)]
    pub assigned: BTreeSet<String>,
    /// What the command line sets of no component.
    #[serde(skip)]
    pub unplaced: Vec<String>,
    /// The file, with those that it extends.
    #[serde(skip)]
    pub source: Source,
}

/// Time and coupling.
#[derive(Clone, Debug, Deserialize, JsonSchema, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Simulation {
    /// Start time, s.
    #[serde(default)]
    pub start: f64,
    /// Stop time, s.
    pub stop: f64,
    /// Communication step, s.
    pub step: f64,
    /// How values are passed on at a communication point.
    #[serde(default)]
    pub coupling: Coupling,
    /// Order of the components.
    #[serde(default)]
    pub order: Vec<String>,
    /// What is done about values of a unit that are no numbers, or outside their type.
    #[serde(default)]
    pub on_invalid: OnInvalid,
}

/// How values are passed on at a communication point.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, JsonSchema, Serialize, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum Coupling {
    /// One component after the other: each gets what those before it make of their new inputs.
    #[default]
    GaussSeidel,
    /// All at once: each gets what the others had before this point's inputs were set.
    Jacobi,
}

/// A unit and its settings.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Component {
    /// File name of the archive.
    #[schemars(with = "String")]
    pub fmu: Spanned<String>,
    /// Steps at every n-th communication point.
    #[serde(default = "one")]
    pub every: u32,
    /// Inputs that stay at their start value.
    #[serde(default)]
    #[schemars(with = "Vec<String>")]
    pub unconnected: Vec<Spanned<String>>,
    /// Values for parameters and for inputs without connection.
    #[serde(default)]
    #[schemars(with = "BTreeMap<String, Scalar>")]
    pub parameters: BTreeMap<String, Spanned<Value>>,
    /// Whether the command line exchanged the unit; no key of an experiment file.
    #[serde(skip)]
    pub is_exchanged: bool,
}

/// A number, a text or a truth value: what a parameter is set to, for the JSON Schema.
#[derive(JsonSchema)]
#[serde(untagged)]
pub enum Scalar {
    /// A number.
    Number(f64),
    /// A text.
    Text(String),
    /// A truth value.
    Truth(bool),
}

/// One line of wiring.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Connection {
    /// `component.output`, or `component.prefix.*`.
    #[schemars(with = "String")]
    pub from: Spanned<String>,
    /// `component.input`, or `component.prefix.*`.
    #[schemars(with = "String")]
    pub to: Spanned<String>,
    /// Whether values are converted if the units differ in scale only; else that is refused.
    #[serde(default)]
    pub convert_units: bool,
    /// Applied to the values after that; no key of an experiment file.
    #[serde(skip)]
    pub scaling: Scaling,
}

/// What goes into the results.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Record {
    /// `component.variable`, or `component.prefix.*`.
    #[schemars(with = "Vec<String>")]
    pub variables: Vec<Spanned<String>>,
    /// A row at every n-th communication point.
    #[serde(default = "one")]
    pub every: u32,
}

/// The period of what is done at every communication point.
pub(crate) fn one() -> u32 {
    1
}

impl Experiment {
    /// Reads an experiment file with all that it extends.
    ///
    /// # Errors
    /// If one cannot be read, is no TOML, or holds an unknown key.
    pub fn load(path: &Path) -> Result<Self, Error> {
        Self::of(Source::load(path)?)
    }

    /// Reads the text of an experiment file; `path` is for messages, and for finding FMUs and what it extends beside it.
    ///
    /// # Errors
    /// If it is no TOML, or holds an unknown key.
    pub fn parse(path: &Path, text: String) -> Result<Self, Error> {
        Self::of(Source::new(path, text)?)
    }

    fn of(source: Source) -> Result<Self, Error> {
        let mut experiment: Self = source.read()?;
        experiment.source = source;
        Ok(experiment)
    }

    /// Sets `component.parameter`.
    ///
    /// # Errors
    /// If there is no such component.
    pub fn set(&mut self, target: &str, value: Value) -> Result<(), String> {
        let (component, parameter) = self.target(target)?;
        component.parameters.insert(parameter.to_string(), Spanned::new(0..0, value));
        Ok(())
    }

    /// Leaves `component.parameter` at the FMU's own value.
    ///
    /// # Errors
    /// If there is no such component, or the experiment does not set it.
    pub fn unset(&mut self, target: &str) -> Result<(), String> {
        let (component, parameter) = self.target(target)?;
        let hint = names::hint(parameter, component.parameters.keys().map(String::as_str));
        match component.parameters.remove(parameter) {
            Some(_) => Ok(()),
            None => Err(format!("the experiment does not set \"{target}\"{hint}")),
        }
    }

    /// Whether it sets the parameter `component.parameter`.
    pub fn sets(&self, target: &str) -> bool {
        names::split(target).is_some_and(|(name, parameter)| {
            self.components.get(name).is_some_and(|component| component.parameters.contains_key(parameter))
        })
    }

    fn target<'a>(&mut self, target: &'a str) -> Result<(&mut Component, &'a str), String> {
        let (name, parameter) =
            names::split(target).ok_or_else(|| format!("\"{target}\" is no component.parameter"))?;
        let hint = names::hint(name, self.components.keys().map(String::as_str));
        let component =
            self.components.get_mut(name).ok_or_else(|| format!("there is no component \"{name}\"{hint}"))?;
        Ok((component, parameter))
    }
}

#[cfg(test)]
mod tests;
