//! Data from which the page is built: the controllers, the parameters of all FMUs as their variable
//! tables declare them, and the scenario's values.

use crate::error::Error;
use crate::scenario::{self, Choice};
use crate::signals::COLUMNS;
use fmi2_export::linked::Linked;
use model_description::variable::{Causality, Variable};
use serde::Serialize;
use std::collections::BTreeMap;
use toml::{Table, Value};

/// Description of everything that can be chosen.
#[derive(Debug, Serialize)]
pub struct Description {
    columns: [&'static str; COLUMNS.len()],
    controllers: Vec<Choice>,
    /// FMUs by their names.
    fmus: BTreeMap<String, Fmu>,
    /// Name of the vehicle's FMU.
    plant: &'static str,
    /// Values of the scenario by component and parameter.
    scenario: BTreeMap<String, Table>,
    /// Length of a flight, s.
    stop: f64,
    /// Version of the FMUs.
    version: &'static str,
}

#[derive(Debug, Serialize)]
struct Fmu {
    description: String,
    parameters: Vec<Variable>,
}

impl Fmu {
    fn new(name: &str) -> Result<Self, Error> {
        let instance = Linked::new(&scenario::fmu(name)?.export);
        let described = instance.description();
        let is_parameter = |variable: &&Variable| variable.causality == Causality::Parameter;
        let parameters = described.variables.iter().filter(is_parameter).cloned().collect();
        Ok(Self { description: described.description.clone(), parameters })
    }
}

/// Describes what can be chosen.
///
/// # Errors
/// Says which of the experiments that are built in contradicts itself.
pub fn describe() -> Result<Description, Error> {
    let mut fmus = BTreeMap::from([(scenario::PLANT.into(), Fmu::new(scenario::PLANT)?)]);
    let controllers = scenario::choices()?;
    for Choice { fmu, .. } in &controllers {
        fmus.insert(fmu.clone(), Fmu::new(fmu)?);
    }
    let experiment = scenario::experiment()?;
    let parts: BTreeMap<String, Table> = scenario::read(&experiment, "components")?;
    let parameters = |part: &Table| part.get("parameters").and_then(Value::as_table).cloned();
    let scenario = parts.iter().filter_map(|(name, part)| Some((name.clone(), parameters(part)?)));
    let scenario = scenario.collect();
    let stop = scenario::read(&experiment, "simulation.stop")?;
    let version = env!("CARGO_PKG_VERSION");
    let (columns, plant) = (COLUMNS, scenario::PLANT);
    Ok(Description { columns, controllers, fmus, plant, scenario, stop, version })
}
