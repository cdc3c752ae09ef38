//! Prints everything that is known about the variables of an FMU as JSON.

use fmi_master::description::{Interface, ModelDescription, Variable, VariableKind};
use fmu_import::fmu::Fmu;
use serde_json::{Value, json};
use std::io::{self, Write};

/// Prints the description of an archive as JSON.
///
/// # Errors
/// Returns an error if the text cannot be written.
pub(crate) fn print(fmu: &Fmu, out: &mut impl Write) -> io::Result<()> {
    let d = &fmu.description;
    let interface = |interface: &Option<Interface>| {
        interface.as_ref().map(
            |i| json!({ "model_identifier": i.model_identifier, "capabilities": i.capabilities }),
        )
    };
    let experiment = &d.default_experiment;
    let description = json!({
        "model_name": d.model_name,
        "fmi_version": d.fmi_version,
        "description": d.description,
        "version": d.version,
        "generation_tool": d.generation_tool,
        "guid": d.guid,
        "platforms": fmu.platforms(),
        "co_simulation": interface(&d.co_simulation),
        "model_exchange": interface(&d.model_exchange),
        "default_experiment": {
            "start": experiment.start,
            "stop": experiment.stop,
            "step": experiment.step,
            "tolerance": experiment.tolerance,
        },
        "scheduled_execution": interface(&d.scheduled_execution),
        "variables": d.variables.iter().map(|each| variable(d, each)).collect::<Vec<_>>(),
    });
    serde_json::to_writer_pretty(&mut *out, &description)?;
    writeln!(out)
}

fn variable(description: &ModelDescription, variable: &Variable) -> Value {
    let place = description.place(variable);
    let mut printed = json!({
        "name": variable.name,
        "value_reference": place.map_or(variable.reference, |place| place.reference),
        "causality": variable.causality,
        "variability": variable.variability,
        "type": variable.type_name(place),
        "start": variable.start,
        "description": variable.description,
    });
    match &variable.kind {
        VariableKind::Real { unit, min, max, .. } => {
            (printed["unit"], printed["min"], printed["max"]) =
                (json!(unit), json!(min), json!(max));
        }
        VariableKind::Integer { min, max } => {
            (printed["min"], printed["max"]) = (json!(min), json!(max));
        }
        VariableKind::Enumeration { items } => {
            printed["items"] =
                items.iter().map(|(name, item)| (name.clone(), json!(item))).collect();
        }
        VariableKind::Clock { interval } => printed["interval"] = json!(interval),
        VariableKind::Boolean | VariableKind::String | VariableKind::Binary => {}
    }
    printed
}
