//! Changes that the command line makes to an experiment.

use super::{Coupling, Experiment};
use crate::error::Error;
use clap::Args;
use fmi_master::names;
use serde::Deserialize;
use serde::de::IntoDeserializer;
use serde::de::value::Error as Wrong;
use std::collections::BTreeMap;
use std::path::Path;
use toml::{Spanned, Value};

/// Component whose law another program may replace.
const CONTROLLER: &str = "controller";
/// FMU that stands in for such a law: it gives reference, sampling period and limits.
const STAND_IN: &str = "LQR";

/// Returns the name of a law in another program: the first word of what identifies it.
pub fn name_of(law: &str) -> &str {
    law.split_whitespace().next().unwrap_or_default()
}

/// Groups of the parameters that act on a law in another program, or on what it is judged by.
const GROUPS_OF_LAW: [&str; 6] =
    ["reference", "limit", "knownMoment", "trajectory", "achievedMoment", "scheduled"];
/// The other parameter that does.
const PERIOD_OF_LAW: &str = "period.feedback";

/// Changes that the command line makes to an experiment.
#[derive(Clone, Debug, Default, PartialEq, Args)]
#[command(next_help_heading = "Changes of the experiment")]
pub struct Overrides {
    /// Set a parameter: `plant.disturbance.seed=7`, `controller.constraints=paper`,
    /// `plant.disturbance.bound="1 deg/s2"`.
    #[arg(long, value_name = "COMPONENT.PARAMETER=VALUE")]
    pub set: Vec<String>,
    /// Replace the FMU of a component: `controller=MyLaw.fmu`, or by its name `controller=LQR`.
    /// Settings, recorded variables and unconnected inputs of the experiment that the new FMU does
    /// not have are left out.
    #[arg(long, value_name = "COMPONENT=FMU")]
    pub fmu: Vec<String>,
    /// Stop time of the simulation, s.
    #[arg(long, value_name = "SECONDS")]
    pub stop: Option<f64>,
    /// Length of the communication step, s.
    #[arg(long, value_name = "SECONDS")]
    pub step: Option<f64>,
    /// Step components one after the other, each with the outputs of those before it (sequential),
    /// or all at once with the last outputs of the others (jacobi).
    #[arg(long, value_parser = coupling)]
    pub coupling: Option<Coupling>,
    /// Let the program at the other end of standard input and output give the moment in place of
    /// the controller: the law's name, and what identifies it. The Python package does so.
    #[arg(long, value_name = "NAME HASH", hide = true)]
    pub law: Option<String>,
    /// Process in which the instances run.
    #[command(flatten)]
    pub process: Process,
}

/// Reads a coupling as files name it.
fn coupling(text: &str) -> Result<Coupling, Wrong> {
    Coupling::deserialize(text.into_deserializer())
}

/// Process in which the instances run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Args)]
pub struct Process {
    /// Run the FMUs in a closed process, which reaches nothing outside of itself (true), or in this
    /// one (false), whatever `[isolation]` of the experiment says. By default only FMUs of this
    /// project that lie beside the program, or in a folder that `--fmu-dir` names, run in this one.
    #[arg(long, value_name = "BOOL", num_args = 0..=1, default_missing_value = "true", require_equals = true)]
    pub isolate: Option<bool>,
}

impl Experiment {
    /// Returns the error for a fault of start, stop and step. It blames the option that gives the
    /// value, or the file if none does.
    pub(crate) fn time_error(&self, problem: &str) -> Error {
        let Overrides { stop, step, .. } = self.given;
        // A step that is no step at all is the fault, whatever the stop time is.
        let is_step = step.is_some_and(|step| stop.is_none() || !(step > 0.0 && step.is_finite()));
        match (stop, step) {
            (_, Some(step)) if is_step => Error::experiment(format!("--step {step}: {problem}")),
            (Some(stop), _) => Error::experiment(format!("--stop {stop}: {problem}")),
            _ => self.source.error(&(0..0), format!("[simulation] {problem}")),
        }
    }

    /// Returns the error for an FMU that cannot be found. It blames the option that names it, or
    /// the file if none does.
    pub(crate) fn fmu_error(&self, component: &str, problem: &str) -> Error {
        let written = &self.components[component].fmu;
        let is_it =
            |given: &String| given.split_once('=').is_some_and(|(name, _)| name == component);
        if self.given.fmu.iter().any(is_it) || self.is_flown_by_law(component) {
            return Error::experiment(format!(
                "--fmu {component}={}: {problem}",
                written.get_ref()
            ));
        }
        self.source.error(&written.span(), format!("[components.{component}] {problem}"))
    }

    /// Returns whether a law in another program gives the moment of a component.
    pub(crate) fn is_flown_by_law(&self, component: &str) -> bool {
        self.law.is_some() && component == CONTROLLER
    }

    /// Warns of parameters that are given for a flight by a law in another program, and do nothing
    /// to it. `given` holds names such as "controller.weight.alpha".
    pub fn warn_of_idle<'a>(&self, given: impl IntoIterator<Item = &'a str>) {
        let Some(law) = self.law.as_deref().map(name_of) else { return };
        let owned = given.into_iter().filter_map(names::split);
        let acts = |name: &str| {
            let group = name.split('.').next().unwrap_or_default();
            name == PERIOD_OF_LAW || GROUPS_OF_LAW.contains(&group)
        };
        for (owner, name) in owned.filter(|(owner, name)| *owner == CONTROLLER && !acts(name)) {
            tracing::warn!(
                "{owner}.{name} has no effect on the law {law}: of its controller, a law has \
                 reference, limits, inputs and period"
            );
        }
    }

    /// Applies the settings of the command line.
    ///
    /// # Errors
    /// Returns an error if an assignment is malformed.
    pub fn apply(&mut self, overrides: &Overrides) -> Result<(), Error> {
        self.simulation.stop = overrides.stop.unwrap_or(self.simulation.stop);
        self.simulation.step = overrides.step.unwrap_or(self.simulation.step);
        self.simulation.coupling = overrides.coupling.unwrap_or(self.simulation.coupling);
        self.isolation.isolate = overrides.process.isolate.or(self.isolation.isolate);
        self.given = overrides.clone();
        let is_given = |assignment: &String| assignment.starts_with(&format!("{CONTROLLER}="));
        let is_needed = overrides.law.is_some() && !overrides.fmu.iter().any(is_given);
        let stand_in = is_needed.then(|| format!("{CONTROLLER}={STAND_IN}"));
        for assignment in overrides.fmu.iter().chain(&stand_in) {
            self.replace_fmu(assignment, overrides.law.as_deref())
                .map_err(|fault| Error::experiment(format!("--fmu {assignment}: {fault}")))?;
        }
        self.law = overrides.law.clone().or(self.law.take());
        for assignment in &overrides.set {
            self.assign(assignment).ok_or_else(|| {
                Error::experiment(format!(
                    "--set {assignment}: expected component.parameter=value, for example plant.disturbance.seed=7"
                ))
            })?;
        }
        Ok(())
    }

    /// Replaces the FMU of a component, or the law of the controller, as `component=file` says.
    fn replace_fmu(&mut self, assignment: &str, law: Option<&str>) -> Result<(), String> {
        let (name, fmu) = assignment
            .split_once('=')
            .ok_or("expected component=file, for example controller=MyLaw.fmu")?;
        let hint = names::hint(name, self.components.keys().map(String::as_str));
        let component = self
            .components
            .get_mut(name)
            .ok_or_else(|| format!("there is no component \"{name}\"{hint}"))?;
        // A path is relative to the current folder, not to the experiment. A name is that of a file
        // without the extension.
        let path = Path::new(fmu);
        let file = path.is_file().then(|| std::path::absolute(path).ok()).flatten();
        let file = match file {
            Some(file) => file.to_string_lossy().into_owned(),
            None if path.extension().is_none() => format!("{fmu}.fmu"),
            None => fmu.to_string(),
        };
        // The title of the file is about another FMU.
        let (new, old) = (stem(&file), stem(component.fmu.get_ref()));
        if let Some(law) = law.filter(|_| name == CONTROLLER) {
            self.title = format!("law {} in place of {old}: {}", name_of(law), self.title);
        } else if new != old {
            self.title = format!("{new} in place of {old}: {}", self.title);
        }
        (component.fmu, component.is_exchanged) = (Spanned::new(0..0, file), true);
        Ok(())
    }

    /// Sets a parameter, as `component.parameter=value` says. Returns `None` if the text is
    /// malformed.
    fn assign(&mut self, assignment: &str) -> Option<()> {
        let (target, value) = assignment.split_once('=')?;
        let (target, value) = (target.trim(), value.trim());
        if target.is_empty() {
            return None;
        }
        // A value that is not TOML is taken as text, so that an enumeration's item needs no quotes
        // within quotes.
        let value = toml::from_str::<BTreeMap<String, Value>>(&format!("x = {value}"))
            .ok()
            .filter(|table| table.len() == 1)
            .and_then(|mut table| table.remove("x"))
            .unwrap_or_else(|| Value::String(value.to_string()));
        if self.set(target, value).is_ok() {
            self.assigned.insert(target.to_string());
        } else {
            // The target is resolved later, when the FMUs are known.
            self.unplaced.push(target.to_string());
        }
        Some(())
    }
}

/// Returns the name of an FMU's file without folder and extension.
fn stem(path: &str) -> String {
    Path::new(path).file_stem().unwrap_or_default().to_string_lossy().into_owned()
}
