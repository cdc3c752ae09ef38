//! Changes that the command line makes to an experiment.

use super::{Coupling, Experiment, Protection};
use crate::error::Error;
use crate::watch::OnInvalid;
use fmi_master::names;
use fmu_import::warnings::warn_once;
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

/// Settings of an experiment that the command line may change.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Overrides {
    /// Values of parameters, as `component.parameter=value`.
    pub set: Vec<String>,
    /// FMUs in place of those of components, as `component=file`.
    pub fmu: Vec<String>,
    /// Law in another program that takes the place of that of the controller: its name, and what
    /// identifies it.
    pub law: Option<String>,
    /// Stop time of the simulation, s.
    pub stop: Option<f64>,
    /// Length of the communication step, s.
    pub step: Option<f64>,
    /// Way in which components are stepped and values are passed on.
    pub coupling: Option<Coupling>,
    /// Action taken if an instance gives a value that is not finite, or not valid for its type.
    pub on_invalid: Option<OnInvalid>,
    /// Processes of instances and their limits.
    pub isolation: Protection,
}

/// Settings of the command line that replace those of an experiment's file. A fault in them is
/// attributed to the option.
#[derive(Clone, Debug, Default)]
pub struct Given {
    stop: Option<f64>,
    step: Option<f64>,
    call_timeout: Option<f64>,
    /// Whether the coupling is given.
    pub(crate) coupling: bool,
    /// Components whose FMU is given.
    fmu: Vec<String>,
}

impl Given {
    /// Returns whether the command line gives the stop time.
    pub fn has_stop(&self) -> bool {
        self.stop.is_some()
    }
}

impl Experiment {
    /// Returns the error for a fault of start, stop and step. It blames the option that gives the
    /// value, or the file if none does.
    pub(crate) fn time_error(&self, problem: &str) -> Error {
        let Given { stop, step, .. } = self.given;
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
        if self.given.fmu.iter().any(|name| name == component) {
            return Error::experiment(format!(
                "--fmu {component}={}: {problem}",
                written.get_ref()
            ));
        }
        self.source.error(&written.span(), format!("[components.{component}] {problem}"))
    }

    /// Returns the error for a fault of the limits of isolated instances. It blames the option that
    /// gives the value, or the file if none does.
    pub(crate) fn isolation_error(&self, problem: &str) -> Error {
        match self.given.call_timeout {
            Some(time) => Error::experiment(format!("--call-timeout {time}: {problem}")),
            None => self.source.error(&(0..0), format!("[isolation] {problem}")),
        }
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
            warn_once(format!(
                "{owner}.{name} has no effect on the law {law}: of its controller, a law has \
                 reference, limits, inputs and period"
            ));
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
        self.simulation.on_invalid = overrides.on_invalid.unwrap_or(self.simulation.on_invalid);
        self.isolation.apply(&overrides.isolation);
        self.given.coupling |= overrides.coupling.is_some();
        self.given.stop = overrides.stop.or(self.given.stop);
        self.given.step = overrides.step.or(self.given.step);
        self.given.call_timeout = overrides.isolation.call_timeout.or(self.given.call_timeout);
        if overrides.isolation.isolate.is_some() {
            // The command line decides for components that decide for themselves, too.
            self.components.values_mut().for_each(|component| component.isolate = None);
        }
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
        self.given.fmu.push(name.to_string());
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
