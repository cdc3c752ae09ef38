//! An experiment file: it names the FMUs, sets their parameters, connects them, and says how they
//! are stepped and what is recorded.
//!
//! docs/experiments.md explains all keys; `orchestrator/schema/experiment.json` describes them for
//! editors.

mod interface;
mod measures;
mod overrides;
mod protection;
mod quantity;
mod trajectory;
mod vehicle;

pub use crate::watch::OnInvalid;
pub use fmi_master::wiring::Coupling;
pub use interface::Interface;
pub use measures::{
    Accepted, Curve, Guarantee, Late, Loss, Margins, Measure, MeasureKind, Observe, Panel, Scaled,
};
pub use overrides::{Overrides, Process, name_of};
pub use protection::Protection;
pub use quantity::{Band, Quantity};
pub use trajectory::{Bound, Equilibrium, Trajectory};
pub use vehicle::Vehicle;

use crate::document::Source;
use crate::error::Error;
use fmi_master::names;
use fmi_master::quantity::Scaling;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use toml::{Spanned, Value};

/// An experiment as its file describes it.
#[derive(Clone, Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Experiment {
    /// Title of the experiment, in one line.
    pub title: String,
    /// Description of the experiment, of any length.
    #[serde(default)]
    pub description: String,
    /// Simulated time span, communication step and coupling.
    pub simulation: Simulation,
    /// Components of the experiment, each an FMU with its settings, by name.
    pub components: BTreeMap<String, Component>,
    /// Vehicle that is flown.
    pub vehicle: Option<Flown>,
    /// Connections from outputs to inputs.
    #[serde(default)]
    pub connections: Vec<Connection>,
    /// Variables that are written to the results.
    pub record: Record,
    /// Signals that are measured, watched and drawn.
    #[serde(default)]
    pub observe: Observe,
    /// The process of the instances and its limits.
    #[serde(default)]
    pub isolation: Protection,
    /// Whether inputs may stay unconnected without being named. This is not a key of an experiment
    /// file.
    #[serde(skip)]
    pub leaves_inputs_open: bool,
    /// Parameters that the command line sets, as `component.parameter`.
    #[serde(skip)]
    pub assigned: BTreeSet<String>,
    /// Law in another program that takes the place of that of the controller: its name, and what
    /// identifies it.
    #[serde(skip)]
    pub law: Option<String>,
    /// Settings of the command line that name no component of the experiment.
    #[serde(skip)]
    pub unplaced: Vec<String>,
    /// Changes that the command line made last.
    #[serde(skip)]
    pub given: Overrides,
    /// The experiment file, together with the files that it extends.
    #[serde(skip)]
    pub source: Source,
}

/// Simulated time span, communication step and coupling.
#[derive(Clone, Debug, Default, Deserialize, JsonSchema, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Simulation {
    /// Start time of the simulation, s.
    #[serde(default)]
    pub start: f64,
    /// Stop time of the simulation, s.
    pub stop: f64,
    /// Length of the communication step, s.
    pub step: f64,
    /// Way in which components are stepped and values are passed on.
    #[serde(default)]
    pub coupling: Coupling,
    /// Names of components, in the order in which they are stepped from each communication point.
    /// Components that are left out come last, by name.
    #[serde(default)]
    pub order: Vec<String>,
    /// Component whose FMU may end the simulation before the stop time, for example a vehicle that
    /// arrives. The run is then complete, and its last values are those of that moment.
    pub ends_with: Option<String>,
    /// Action taken if an instance gives a value that is not finite, or not valid for its type.
    #[serde(default)]
    pub on_invalid: OnInvalid,
}

/// A component of the experiment: an FMU or a lookup table with its settings.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Component {
    /// File name of the FMU, or of a lookup table (`.csv`) whose columns are outputs.
    #[schemars(with = "String")]
    pub fmu: Spanned<String>,
    /// Period of the component: it is stepped at every n-th communication point.
    #[serde(default = "one")]
    pub every: u32,
    /// Inputs that stay at their start values.
    #[serde(default)]
    #[schemars(with = "Vec<String>")]
    pub unconnected: Vec<Spanned<String>>,
    /// Values of parameters, and of inputs without a connection, by name.
    #[serde(default)]
    #[schemars(with = "BTreeMap<String, Scalar>")]
    pub parameters: BTreeMap<String, Spanned<Value>>,
    /// Interface by which the FMU is called. By default this is co-simulation if the FMU offers it,
    /// otherwise model exchange, in which the orchestrator integrates the FMU's states.
    pub interface: Option<Interface>,
    /// Relative tolerance of the integration in model exchange. By default it is the one that the
    /// FMU proposes, or otherwise 1e-6.
    pub tolerance: Option<f64>,
    /// Whether the FMU takes the place of another one, as after `--fmu`: settings, recorded
    /// variables and unconnected inputs that it does not have are left out.
    #[serde(default, rename = "exchanged")]
    pub is_exchanged: bool,
}

/// The vehicle of an experiment.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Flown {
    /// File of the vehicle, or name of a shipped one: every component that has the parameter
    /// `vehicle.file`, and does not set it itself, reads it.
    #[schemars(with = "String")]
    pub file: Spanned<String>,
}

/// The value of a parameter as the JSON Schema describes it: a number, a text or a truth value.
#[derive(JsonSchema)]
#[serde(untagged)]
pub enum Scalar {
    /// The value is a number.
    Number(f64),
    /// The value is a text.
    Text(String),
    /// The value is true or false.
    Truth(bool),
}

/// A connection, or several that are written as one with a pattern.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Connection {
    /// Output that the values come from, as `component.output` or `component.prefix.*`.
    #[schemars(with = "String")]
    pub from: Spanned<String>,
    /// Input that the values go to, as `component.input` or `component.prefix.*`.
    #[schemars(with = "String")]
    pub to: Spanned<String>,
    /// Scaling in place of the conversion of units, as an SSP archive gives it. This is not a key of
    /// an experiment file.
    #[serde(skip)]
    pub scaling: Option<Scaling>,
}

/// Variables that are written to the results.
#[derive(Clone, Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Record {
    /// Names of the variables, as `component.variable` or `component.prefix.*`.
    #[schemars(with = "Vec<String>")]
    pub variables: Vec<Spanned<String>>,
    /// Period of the rows: one is written at every n-th communication point.
    #[serde(default = "one")]
    pub every: u32,
}

/// Returns the default period, which means every communication point.
pub(crate) fn one() -> u32 {
    1
}

impl Experiment {
    /// Reads an experiment file and all files that it extends.
    ///
    /// # Errors
    /// Returns an error if a file cannot be read, is not TOML, or holds an unknown key.
    pub fn load(path: &Path) -> Result<Self, Error> {
        Self::from_source(Source::load(path)?)
    }

    /// Reads the text of an experiment file. The `path` appears in messages, and FMUs and extended
    /// files are looked for beside it.
    ///
    /// # Errors
    /// Returns an error if the text is not TOML, or holds an unknown key.
    pub fn parse(path: &Path, text: String) -> Result<Self, Error> {
        Self::from_source(Source::new(path, text)?)
    }

    fn from_source(source: Source) -> Result<Self, Error> {
        let mut experiment: Self = source.read()?;
        if let (Some(flown), Some(shown)) = (&experiment.vehicle, &mut experiment.observe.vehicle) {
            shown.take_effectors(&source.beside(Path::new(flown.file.get_ref())));
        }
        experiment.source = source;
        Ok(experiment)
    }

    /// Sets the parameter `component.parameter` to a value.
    ///
    /// # Errors
    /// Returns an error if the experiment has no such component.
    pub fn set(&mut self, target: &str, value: Value) -> Result<(), String> {
        let (component, parameter) = self.target(target)?;
        component.parameters.insert(parameter.to_string(), Spanned::new(0..0, value));
        Ok(())
    }

    /// Leaves the parameter `component.parameter` at the FMU's own value.
    ///
    /// # Errors
    /// Returns an error if the experiment has no such component, or does not set the parameter.
    pub fn unset(&mut self, target: &str) -> Result<(), String> {
        let (component, parameter) = self.target(target)?;
        let hint = names::hint(parameter, component.parameters.keys().map(String::as_str));
        match component.parameters.remove(parameter) {
            Some(_) => Ok(()),
            None => Err(format!("the experiment does not set \"{target}\"{hint}")),
        }
    }

    /// Returns whether the experiment sets the parameter `component.parameter`.
    pub fn sets(&self, target: &str) -> bool {
        names::split(target).is_some_and(|(name, parameter)| {
            self.components
                .get(name)
                .is_some_and(|component| component.parameters.contains_key(parameter))
        })
    }

    fn target<'a>(&mut self, target: &'a str) -> Result<(&mut Component, &'a str), String> {
        let (name, parameter) = names::split(target)
            .ok_or_else(|| format!("\"{target}\" is not of the form component.parameter"))?;
        let hint = names::hint(name, self.components.keys().map(String::as_str));
        let component = self
            .components
            .get_mut(name)
            .ok_or_else(|| format!("there is no component \"{name}\"{hint}"))?;
        Ok((component, parameter))
    }
}

#[cfg(test)]
mod tests;
