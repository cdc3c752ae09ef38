//! Request of the page: a controller and the parameters that differ, as an experiment.

use crate::closed_loop::ClosedLoop;
use crate::error::Error;
use crate::scenario::{self, Choice, SCENARIOS, Scenario};
use crate::signals::GUARANTEE;
use serde::Deserialize;
use std::collections::BTreeMap;
use toml::{Table, Value};

/// A request of the page.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Request {
    /// Short name of the flight; the first one unless given.
    #[serde(default)]
    scenario: Option<String>,
    /// Short name of the controller.
    controller: String,
    /// Parameters that differ, by `component.name`.
    #[serde(default)]
    set: BTreeMap<String, Value>,
}

impl Request {
    /// Reads a request.
    ///
    /// # Errors
    /// Says where the text is no request.
    pub fn read(text: &[u8]) -> Result<Self, Error> {
        Ok(serde_json::from_slice(text)?)
    }

    /// Makes the experiment, as the orchestrator reads it, and its loop.
    ///
    /// # Errors
    /// Names the parameter at fault.
    pub fn prepare(self) -> Result<(Table, ClosedLoop), Error> {
        let choice = scenario::choices()?.into_iter().find(|choice| choice.id == self.controller);
        let choice = choice.ok_or(Error::Controller(self.controller))?;
        let scenario = self.scenario.map_or(Ok(&SCENARIOS[0]), |id| Scenario::find(&id))?;
        let mut experiment = scenario.experiment()?;
        describe(&mut experiment, &choice);
        part(&mut experiment, "controller")?.insert("fmu".into(), (choice.fmu + ".fmu").into());
        let own = choice.set.into_iter().map(|(name, value)| (format!("controller.{name}"), value));
        for (name, value) in own.chain(self.set) {
            let (component, parameter) = name.split_once('.').unwrap_or_default();
            parameters(&mut experiment, component)?.insert(parameter.into(), value);
        }
        let closed_loop = ClosedLoop::new(&experiment, scenario)?;
        record(&mut experiment, &closed_loop);
        Ok((experiment, closed_loop))
    }
}

/// Writes title and description of the experiment.
fn describe(experiment: &mut Table, choice: &Choice) {
    let title = experiment.get("title").and_then(Value::as_str).unwrap_or_default();
    let title = format!("{title}: {}, as set in the browser", choice.name);
    experiment.insert("title".into(), title.into());
    let text = "Settings of the page \"Try it in the browser\". `orchestrator run FILE` gives the same bits.";
    experiment.insert("description".into(), text.into());
}

/// Returns the table of a component.
fn part<'a>(experiment: &'a mut Table, component: &str) -> Result<&'a mut Table, Error> {
    let parts = experiment.get_mut("components").and_then(Value::as_table_mut);
    let part = parts.and_then(|parts| parts.get_mut(component));
    let part = part.and_then(Value::as_table_mut);
    part.ok_or_else(|| scenario::problem(component, "the experiment has no such component"))
}

/// Returns the parameters of a component.
fn parameters<'a>(experiment: &'a mut Table, component: &str) -> Result<&'a mut Table, Error> {
    let part = part(experiment, component)?;
    let parameters = part.entry("parameters").or_insert_with(|| Table::new().into());
    parameters.as_table_mut().ok_or_else(|| scenario::problem(component, "parameters is no table"))
}

/// Writes the step of the loop and which rows are recorded, and records the guarantee that its
/// controller reports.
fn record(experiment: &mut Table, closed_loop: &ClosedLoop) {
    if let Some(Value::Table(simulation)) = experiment.get_mut("simulation") {
        simulation.insert("step".into(), closed_loop.master.clock().step().into());
    }
    if let Some(Value::Table(record)) = experiment.get_mut("record") {
        record.insert("every".into(), i64::from(closed_loop.scenario.every).into());
    }
    let variables = experiment.get_mut("record").and_then(|record| record.get_mut("variables"));
    if let Some(Value::Array(variables)) = variables {
        let said = GUARANTEE.into_iter().zip(&closed_loop.guarantee);
        variables.extend(said.filter(|(_, items)| !items.is_empty()).map(|(name, _)| name.into()));
    }
}
