//! An experiment file: which FMUs, their parameters, their wiring, how they are stepped, what is recorded.
//!
//! All keys stand in docs/experiments.md, and in `orchestrator/schema/experiment.json` for editors.

use crate::document::Source;
use crate::error::Error;
use crate::watch::OnInvalid;
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
    /// Where the figures of merit find their variables.
    #[serde(default)]
    pub metrics: Roles,
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
    #[schemars(with = "BTreeMap<String, crate::schema::Scalar>")]
    pub parameters: BTreeMap<String, Spanned<Value>>,
    /// Whether the command line exchanged the unit; no key of an experiment file.
    #[serde(skip)]
    pub is_exchanged: bool,
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

/// Prefixes below which the figures of merit find their variables. `None` takes the default, if it exists.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Roles {
    /// Attitude angles.
    pub attitude: Option<String>,
    /// Reference of the attitude angles.
    pub reference: Option<String>,
    /// Angular rate.
    pub rate: Option<String>,
    /// Control moment.
    pub moment: Option<String>,
    /// Limits of rate and moment.
    pub limit: Option<String>,
    /// Statistics of the controller's solver.
    pub solver: Option<String>,
    /// What the controller says of its guarantee to keep the limits.
    pub guarantee: Option<String>,
    /// The means are of every so many communication points, from the first on.
    #[serde(default = "one")]
    pub every: u32,
    /// The attitude is lost, and a run ends, where the angles' error is larger than this as a vector, deg.
    pub lost_deg: Option<f64>,
}

impl Default for Roles {
    fn default() -> Self {
        Self {
            attitude: None,
            reference: None,
            rate: None,
            moment: None,
            limit: None,
            solver: None,
            guarantee: None,
            every: 1,
            lost_deg: None,
        }
    }
}

fn one() -> u32 {
    1
}

/// Settings that the command line may change.
#[derive(Clone, Debug, Default, clap::Args)]
pub struct Overrides {
    /// Set a parameter: `plant.disturbance.seed=7`, `controller.constraints=paper`, `plant.disturbance.bound="1 deg/s2"`.
    #[arg(long = "set", value_name = "COMPONENT.PARAMETER=VALUE")]
    pub set: Vec<String>,
    /// Exchange a component's unit: `controller=MyLaw.fmu`, a file or one that is found by its name. What the experiment sets,
    /// records or leaves open of the former unit and the new one does not have is left out.
    #[arg(long = "fmu", value_name = "COMPONENT=FMU")]
    pub fmu: Vec<String>,
    /// Stop time, s.
    #[arg(long, value_name = "SECONDS", allow_negative_numbers = true)]
    pub stop: Option<f64>,
    /// Communication step, s.
    #[arg(long, value_name = "SECONDS", allow_negative_numbers = true)]
    pub step: Option<f64>,
    /// Coupling at communication points.
    #[arg(long, value_enum)]
    pub coupling: Option<Coupling>,
    /// What is done about a value that is no number or outside its type.
    #[arg(long, value_enum)]
    pub on_invalid: Option<OnInvalid>,
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

    /// Applies what the command line says.
    ///
    /// # Errors
    /// If an assignment is malformed.
    pub fn apply(&mut self, overrides: &Overrides) -> Result<(), Error> {
        self.simulation.stop = overrides.stop.unwrap_or(self.simulation.stop);
        self.simulation.step = overrides.step.unwrap_or(self.simulation.step);
        self.simulation.coupling = overrides.coupling.unwrap_or(self.simulation.coupling);
        self.simulation.on_invalid = overrides.on_invalid.unwrap_or(self.simulation.on_invalid);
        for assignment in &overrides.fmu {
            let refuse = |message: String| Error::experiment(format!("--fmu {assignment}: {message}"));
            let (name, fmu) = assignment
                .split_once('=')
                .ok_or_else(|| refuse("wants component=file, for example controller=MyLaw.fmu".into()))?;
            let hint = names::hint(name, self.components.keys().map(String::as_str));
            let component = self
                .components
                .get_mut(name)
                .ok_or_else(|| refuse(format!("there is no component \"{name}\"{hint}")))?;
            // A file is meant as seen from here, not from the experiment.
            let file = Path::new(fmu).is_file().then(|| std::path::absolute(fmu).ok()).flatten();
            let file = file.map_or_else(|| fmu.to_string(), |file| file.to_string_lossy().into_owned());
            (component.fmu, component.is_exchanged) = (Spanned::new(0..0, file), true);
        }
        for assignment in &overrides.set {
            let malformed = || {
                Error::experiment(format!(
                    "--set {assignment}: wants component.parameter=value, for example plant.disturbance.seed=7"
                ))
            };
            let (target, value) = assignment.split_once('=').ok_or_else(malformed)?;
            let target = target.trim();
            if target.is_empty() {
                return Err(malformed());
            }
            // What is no TOML value is text: an enumeration's item needs no quotes within quotes.
            let value = value.trim();
            let value = toml::from_str::<BTreeMap<String, Value>>(&format!("x = {value}"))
                .ok()
                .filter(|table| table.len() == 1)
                .and_then(|mut table| table.remove("x"))
                .unwrap_or_else(|| Value::String(value.to_string()));
            if self.set(target, value).is_ok() {
                self.assigned.insert(target.to_string());
            } else {
                // The units know what is meant.
                self.unplaced.push(target.to_string());
            }
        }
        Ok(())
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
mod tests {
    use super::*;

    const TEXT: &str = r#"
title = "x"
[simulation]
stop = 1.0
step = 0.1
[components.a]
fmu = "A.fmu"
[components.a.parameters]
"p.q" = 1
[record]
variables = ["a.*"]
"#;

    fn parse(text: &str) -> Result<Experiment, Error> {
        Experiment::parse(Path::new("x.toml"), text.to_string())
    }

    #[test]
    fn defaults_are_filled_in() {
        let experiment = parse(TEXT).unwrap();
        assert_eq!(experiment.simulation.coupling, Coupling::GaussSeidel);
        assert_eq!(
            (experiment.simulation.start, experiment.components["a"].every, experiment.record.every),
            (0.0, 1, 1)
        );
    }

    #[test]
    fn unknown_keys_are_refused_with_their_line() {
        let message = parse(&TEXT.replace("step = 0.1", "stepp = 0.1")).unwrap_err().to_string();
        assert!(
            message.starts_with("x.toml:5: ") && message.contains("`stepp`") && message.contains("`step`"),
            "{message}"
        );
        let message = parse(&TEXT.replace("fmu =", "fum =")).unwrap_err().to_string();
        assert!(message.starts_with("x.toml:7: ") && message.contains("`fum`"), "{message}");
        let message = parse("title = ").unwrap_err().to_string();
        assert!(message.starts_with("x.toml:1: "), "{message}");
        assert_eq!(message.lines().count(), 1);
    }

    #[test]
    fn the_command_line_wins() {
        let mut experiment = parse(TEXT).unwrap();
        let set = ["a.p.q=2.5", "a.kind=white", "a.bound=2 deg/s2", "a.text=\"1\"", "a.flag=true"];
        let set = set.map(String::from).to_vec();
        experiment.apply(&Overrides { set, stop: Some(3.0), ..Overrides::default() }).unwrap();
        let value = |name: &str| experiment.components["a"].parameters[name].get_ref().clone();
        assert_eq!(experiment.simulation.stop, 3.0);
        assert_eq!(value("p.q"), Value::Float(2.5));
        assert_eq!(value("kind"), Value::String("white".into()));
        assert_eq!(value("bound"), Value::String("2 deg/s2".into()));
        assert_eq!(value("text"), Value::String("1".into()));
        assert_eq!(value("flag"), Value::Boolean(true));
    }

    #[test]
    fn bad_assignments_are_refused() {
        let refusal = |text: &str| {
            let overrides = Overrides { set: vec![text.into()], ..Overrides::default() };
            parse(TEXT).unwrap().apply(&overrides).unwrap_err().to_string()
        };
        assert!(refusal("a.p").contains("wants component.parameter=value"));
        assert!(refusal("=1").contains("wants component.parameter=value"));
    }
}
