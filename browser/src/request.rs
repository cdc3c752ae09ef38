//! What the page asks for: a controller and the parameters that differ, as an experiment.

use crate::error::Error;
use crate::scenario::{self, Choice};
use crate::setting;
use fmi2_export::linked::{Linked, Value};
use model_description::variable::VariableKind;
use serde::Deserialize;
use std::collections::BTreeMap;
use toml::Table;

/// Parameter of every controller by which the loop is stepped, s.
const PERIOD: &str = "period.feedback";
/// Outputs of the controllers that guarantee limits: the status, and what contradicts an
/// assumption.
pub const GUARANTEE: [&str; 2] = ["guarantee.status", "guarantee.contradiction"];

/// A request of the page.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Request {
    /// Short name of the controller.
    controller: String,
    /// Parameters that differ, by `component.name`.
    #[serde(default)]
    set: BTreeMap<String, toml::Value>,
}

/// An experiment with its instances, whose parameters are set.
pub struct Prepared {
    /// Controller of the loop.
    pub controller: Linked,
    /// Vehicle of the loop.
    pub plant: Linked,
    /// Communication step, s.
    pub step: f64,
    /// Number of steps.
    pub steps: usize,
    /// Stop time, s.
    pub stop: f64,
    /// Tracking error beyond which the attitude counts as lost, deg.
    pub lost_beyond: f64,
    /// Experiment as the orchestrator reads it.
    pub experiment: Table,
}

impl Request {
    /// Reads a request.
    ///
    /// # Errors
    /// Says where the text is no request.
    pub fn read(text: &[u8]) -> Result<Self, Error> {
        Ok(serde_json::from_slice(text)?)
    }

    /// Makes the experiment and its instances.
    ///
    /// # Errors
    /// Names the parameter at fault.
    pub fn prepare(self) -> Result<Prepared, Error> {
        let unknown = || Error::Controller(self.controller.clone());
        let choice = scenario::choices()?.into_iter().find(|choice| choice.id == self.controller);
        let choice = choice.ok_or_else(unknown)?;
        let law = scenario::law(&choice.fmu).ok_or_else(unknown)?;
        let mut experiment = scenario::experiment()?;
        describe(&mut experiment, &choice);
        part(&mut experiment, "controller")?.insert("fmu".into(), (choice.fmu + ".fmu").into());
        let own = choice.set.into_iter().map(|(name, value)| (format!("controller.{name}"), value));
        for (name, value) in own.chain(self.set) {
            let (component, parameter) = name.split_once('.').unwrap_or_default();
            parameters(&mut experiment, component)?.insert(parameter.into(), value);
        }
        let mut controller = Linked::new(law);
        let mut plant = Linked::new(&scenario::PLANT);
        apply(&mut experiment, "controller", &mut controller)?;
        apply(&mut experiment, "plant", &mut plant)?;
        record_guarantee(&mut experiment, &controller);
        let (step, steps, stop) = clock(&mut experiment, &controller)?;
        let loss = experiment.get("observe").and_then(|observe| observe.get("loss"));
        let beyond = loss.and_then(|loss| loss.get("beyond")).and_then(toml::Value::as_float);
        let lost_beyond =
            beyond.ok_or_else(|| scenario::problem("observe.loss", "beyond is no number"))?;
        Ok(Prepared { controller, plant, step, steps, stop, lost_beyond, experiment })
    }
}

/// Writes title and description of the experiment.
fn describe(experiment: &mut Table, choice: &Choice) {
    let title = format!("{} in the scenario of Chai 2022, as set in the browser", choice.name);
    experiment.insert("title".into(), title.into());
    let text = "Settings of the page \"Try it in the browser\". `orchestrator run FILE` gives the same bits.";
    experiment.insert("description".into(), text.into());
}

/// Returns the table of a component.
fn part<'a>(experiment: &'a mut Table, component: &str) -> Result<&'a mut Table, Error> {
    let parts = experiment.get_mut("components").and_then(toml::Value::as_table_mut);
    let part = parts.and_then(|parts| parts.get_mut(component));
    part.and_then(toml::Value::as_table_mut).ok_or_else(|| Error::Setting {
        name: component.into(),
        problem: "the experiment has no such component".into(),
    })
}

/// Returns the parameters of a component.
fn parameters<'a>(experiment: &'a mut Table, component: &str) -> Result<&'a mut Table, Error> {
    let part = part(experiment, component)?;
    let parameters = part.entry("parameters").or_insert_with(|| Table::new().into());
    parameters.as_table_mut().ok_or_else(|| scenario::problem(component, "parameters is no table"))
}

/// Sets the parameters of a component.
fn apply(experiment: &mut Table, component: &str, instance: &mut Linked) -> Result<(), Error> {
    for (name, written) in parameters(experiment, component)? {
        let wrong = |problem| Error::Setting { name: format!("{component}.{name}"), problem };
        let Some((_, variable)) = instance.find(name) else {
            return Err(wrong(format!("{} has no such parameter", instance.description().name)));
        };
        let value = setting::value(written, variable).map_err(wrong)?;
        instance.set(name, &value)?;
    }
    Ok(())
}

/// Has what the controller says of its guarantee recorded, if it gives one.
fn record_guarantee(experiment: &mut Table, controller: &Linked) {
    let variables = experiment.get_mut("record").and_then(|record| record.get_mut("variables"));
    if let Some(toml::Value::Array(variables)) = variables {
        let given = GUARANTEE.into_iter().filter(|name| controller.find(name).is_some());
        variables.extend(given.map(|name| toml::Value::from(format!("controller.{name}"))));
    }
}

/// Returns the length of a step (s), which is the period of the controller, the number of steps,
/// and the stop time (s).
fn clock(experiment: &mut Table, controller: &Linked) -> Result<(f64, usize, f64), Error> {
    let wrong = |problem: &str| Error::Setting {
        name: format!("controller.{PERIOD}"),
        problem: problem.into(),
    };
    let (_, variable) = controller.find(PERIOD).ok_or_else(|| wrong("there is no period"))?;
    let step = match parameters(experiment, "controller")?.get(PERIOD) {
        Some(written) => match setting::value(written, variable).map_err(|text| wrong(&text))? {
            Value::Real(value) => value,
            _ => return Err(wrong("must be a number")),
        },
        None => match variable.kind {
            VariableKind::Real { start: Some(start), .. } => start,
            _ => return Err(wrong("there is no start value")),
        },
    };
    let simulation = experiment.get_mut("simulation").and_then(toml::Value::as_table_mut);
    let simulation = simulation.ok_or_else(|| wrong("the experiment has no simulation"))?;
    simulation.insert("step".into(), step.into());
    let stop = simulation.get("stop").and_then(toml::Value::as_float);
    let stop = stop.ok_or_else(|| wrong("the experiment has no stop time"))?;
    let exact = stop / step;
    let steps = exact.round();
    if steps < 1.0 || (exact - steps).abs() > 1e-9 * steps {
        return Err(wrong("the flight must be a whole number of periods long"));
    }
    Ok((step, steps as usize, stop))
}
