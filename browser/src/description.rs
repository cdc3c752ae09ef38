//! What the page is built from: the controllers, the parameters of all FMUs as their variable
//! tables declare them, and the scenario's values.

use crate::error::Error;
use crate::scenario;
use crate::signals::COLUMNS;
use fmi2_export::Export;
use fmi2_export::linked::Linked;
use model_description::variable::{Causality, Variable};
use serde::Serialize;
use std::collections::BTreeMap;
use toml::{Table, Value};

/// Description of everything that can be chosen.
#[derive(Debug, Serialize)]
pub struct Description {
    columns: [&'static str; COLUMNS.len()],
    controllers: Vec<Controller>,
    /// FMUs by their names.
    fmus: BTreeMap<String, Fmu>,
    /// Name of the vehicle's FMU.
    plant: String,
    /// Values of the scenario by component and parameter.
    scenario: BTreeMap<String, Table>,
    /// Length of a flight, s.
    stop: f64,
    /// Version of the FMUs.
    version: &'static str,
}

#[derive(Debug, Serialize)]
struct Controller {
    id: String,
    name: String,
    fmu: String,
    set: Table,
}

#[derive(Debug, Serialize)]
struct Fmu {
    description: String,
    parameters: Vec<Variable>,
}

impl Fmu {
    fn new(export: &Export) -> (String, Self) {
        let instance = Linked::new(export);
        let described = instance.description();
        let is_parameter = |variable: &&Variable| variable.causality == Causality::Parameter;
        let parameters = described.variables.iter().filter(is_parameter).cloned().collect();
        (described.name.clone(), Self { description: described.description.clone(), parameters })
    }
}

/// Describes what can be chosen.
///
/// # Errors
/// Says which of the experiments that are built in contradicts itself.
pub fn describe() -> Result<Description, Error> {
    let (plant, vehicle) = Fmu::new(&scenario::PLANT);
    let mut fmus = BTreeMap::from([(plant.clone(), vehicle)]);
    let mut controllers = vec![];
    for scenario::Choice { id, name, fmu, set } in scenario::choices()? {
        let export = scenario::law(&fmu).ok_or_else(|| Error::Controller(fmu.clone()))?;
        fmus.extend([Fmu::new(export)]);
        controllers.push(Controller { id, name, fmu, set });
    }
    let experiment = scenario::experiment()?;
    let parts = experiment.get("components").and_then(Value::as_table).into_iter().flatten();
    let parameters = |part: &Value| part.get("parameters").and_then(Value::as_table).cloned();
    let scenario =
        parts.filter_map(|(name, part)| Some((name.clone(), parameters(part)?))).collect();
    let stop = experiment.get("simulation").and_then(|simulation| simulation.get("stop"));
    let stop = stop.and_then(Value::as_float).unwrap_or_default();
    let version = env!("CARGO_PKG_VERSION");
    Ok(Description { columns: COLUMNS, controllers, fmus, plant, scenario, stop, version })
}
