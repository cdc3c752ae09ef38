//! Data from which the page is built: the controllers, the parameters of all FMUs as their variable
//! tables declare them, and the scenario's values.

use crate::error::Error;
use crate::scenario::{self, Choice, SCENARIOS, Scenario};
use fmi_export::linked::Linked;
use model_description::variable::{Causality, Variable};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use toml::Table;

/// Description of everything that can be chosen.
#[derive(Debug, Serialize)]
pub struct Description {
    controllers: Vec<Choice>,
    /// FMUs by their names.
    fmus: BTreeMap<String, Fmu>,
    /// Flights by their short names.
    scenarios: BTreeMap<&'static str, Flight>,
    /// Version of the FMUs.
    version: &'static str,
}

#[derive(Debug, Serialize)]
struct Flight {
    columns: &'static [&'static str],
    /// FMU and parameters of each component; those of the controller go for any.
    components: BTreeMap<String, Component>,
    /// Length of the flight, s; an entry ends before.
    stop: f64,
}

#[derive(Debug, Serialize, Deserialize)]
struct Component {
    fmu: String,
    #[serde(default)]
    parameters: Table,
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

impl Flight {
    fn new(scenario: &Scenario) -> Result<Self, Error> {
        let experiment = scenario.experiment()?;
        let mut components: BTreeMap<String, Component> =
            scenario::read(&experiment, "components")?;
        for component in components.values_mut() {
            component.fmu = component.fmu.trim_end_matches(".fmu").into();
        }
        let stop = scenario::read(&experiment, "simulation.stop")?;
        Ok(Self { columns: scenario.columns, components, stop })
    }
}

/// Describes what can be chosen.
///
/// # Errors
/// Says which of the experiments that are built in contradicts itself.
pub fn describe() -> Result<Description, Error> {
    let flights = SCENARIOS.iter().map(|scenario| Ok((scenario.id, Flight::new(scenario)?)));
    let scenarios: BTreeMap<_, _> = flights.collect::<Result<_, Error>>()?;
    let controllers = scenario::choices()?;
    let components = scenarios.values().flat_map(|flight: &Flight| flight.components.values());
    let names = components.map(|component| &component.fmu);
    let mut fmus = BTreeMap::new();
    for name in names.chain(controllers.iter().map(|Choice { fmu, .. }| fmu)) {
        if !fmus.contains_key(name) {
            fmus.insert(name.clone(), Fmu::new(name)?);
        }
    }
    Ok(Description { controllers, fmus, scenarios, version: env!("CARGO_PKG_VERSION") })
}
