//! Content of `results.json`: everything that is needed to know, years later, how `results.csv` was
//! made.

use crate::error::Error;
use crate::files::digest;
use crate::pacing::Factor;
use crate::system::{CheckedComponent, Parameters, System};
use fmi_master::description::InterfaceKind;
use serde_json::{Value, json};
use std::collections::BTreeMap;

/// Returns the content of `results.json`. If the run ended early, `failure` is the reason.
pub fn metadata(
    system: &System,
    parameters: &Parameters,
    real_time: Option<Factor>,
    failure: Option<&Error>,
) -> Value {
    let experiment = &system.experiment;
    let simulation = &experiment.simulation;
    let seeds: BTreeMap<String, &Value> = parameters
        .iter()
        .flat_map(|(component, values)| {
            values.iter().map(move |(name, value)| (component, name, value))
        })
        .filter(|(_, name, _)| is_seed(name))
        .map(|(component, name, value)| (format!("{component}.{name}"), value))
        .collect();
    let parts = system.parts();
    let connections = system.connections().into_iter();
    let connections: Vec<Value> =
        connections.map(|(from, to)| json!({ "from": from, "to": to })).collect();
    let columns: Vec<Value> = system
        .columns
        .iter()
        .map(|column| {
            let variable =
                &parts[column.port.component].description.variables[column.port.variable];
            let items = variable.kind.items().iter().map(|(name, item)| (item.to_string(), name));
            let items: BTreeMap<_, _> = items.collect();
            let component = &system.components[column.port.component];
            json!({
                "name": column.name,
                "type": variable.kind.name(),
                "unit": variable.kind.unit(),
                "display_unit": display_unit(component, column.port.variable),
                "items": (!items.is_empty()).then_some(items),
                "description": variable.description,
            })
        })
        .collect();
    let loops: Vec<Value> = system
        .loops
        .iter()
        .map(|l| {
            let components: Vec<&str> = l.components.iter().map(|&index| parts[index].name).collect();
            json!({ "components": components, "delay_steps": l.ticks, "delay_s": l.ticks as f64 * system.clock.step() })
        })
        .collect();
    let mut components = serde_json::Map::new();
    for checked in &system.components {
        components.insert(checked.name.clone(), component(checked, parameters));
    }
    json!({
        "title": experiment.title,
        "status": status(failure),
        "orchestrator": env!("CARGO_PKG_VERSION"),
        "simulation": {
            "start": simulation.start, "stop": simulation.stop, "step": simulation.step,
            "steps": system.clock.ticks(), "coupling": simulation.coupling, "order": system.names(),
        },
        "real_time": real_time.map(|factor| json!({ "factor": factor })),
        "components": components,
        "seeds": seeds,
        "connections": connections,
        "feedback_loops": loops,
        "columns": columns,
        "experiment": {
            "file": experiment.source.path.file_name().map(|name| name.to_string_lossy()),
            "text": experiment.source.whole(),
            // With the surfaces and jets of the vehicle's file, which the text does not hold.
            "vehicle": experiment.observe.vehicle,
        },
    })
}

/// Returns whether a parameter is a seed. Its name decides, because FMI offers no other sign.
pub fn is_seed(name: &str) -> bool {
    name.rsplit('.').next() == Some("seed")
}

fn status(failure: Option<&Error>) -> String {
    match failure {
        None => "completed".into(),
        Some(
            error
            @ (Error::Interrupted { .. } | Error::EndedByInstance { .. } | Error::Lost { .. }),
        ) => error.to_string(),
        Some(error) => format!("failed: {error}"),
    }
}

fn component(component: &CheckedComponent, parameters: &Parameters) -> Value {
    let CheckedComponent { name, fmu, interface, every, settings, .. } = component;
    let tolerance = match interface {
        InterfaceKind::CoSimulation => None,
        InterfaceKind::ModelExchange { tolerance } => Some(tolerance),
    };
    let set: BTreeMap<&str, Value> =
        settings.iter().map(|s| (s.name.as_str(), s.value.to_json())).collect();
    let variables = fmu.description.variables.iter().enumerate();
    let units: BTreeMap<&str, Value> = variables
        .filter(|(_, variable)| variable.causality == "parameter")
        .filter_map(|(place, variable)| {
            Some((variable.name.as_str(), display_unit(component, place)?))
        })
        .collect();
    json!({
        "fmu": fmu.path.file_name().map(|name| name.to_string_lossy()),
        "sha256": std::fs::read(fmu_import::folder::from_start(&fmu.path)).ok().map(digest),
        "guid": fmu.description.guid,
        "model": fmu.description.model_name,
        "version": fmu.description.version,
        "generation_tool": fmu.description.generation_tool,
        "interface": interface.name(),
        "tolerance": tolerance,
        "every": every,
        "set": set,
        "parameters": parameters.get(name),
        "display_units": units,
    })
}

/// Returns the unit in which a variable is displayed, and the number of these units in one unit of
/// its values; `None` if it has no unit.
fn display_unit(component: &CheckedComponent, variable: usize) -> Option<Value> {
    let (factor, name) = component.display(variable);
    (!name.is_empty()).then(|| json!({ "name": name, "factor": factor }))
}
