//! Chooses which variables of an FMU are shown, and prints everything that is known about them as
//! JSON.

use cosim::error::Error;
use fmi_master::description::{Interface, ModelDescription, Variable, VariableKind};
use fmi_master::names;
use fmu_import::fmu::Fmu;
use serde_json::{Value, json};
use std::io::{self, Write};

/// Choice of the variables that are shown.
#[derive(Clone, Debug, Default, clap::Args)]
pub(crate) struct Filter {
    /// Show only these variables: a name, a pattern with *, or a part of a name. Without it all
    /// variables are shown.
    pub(crate) pattern: Option<String>,
    /// Show only variables of this causality: parameter, calculatedParameter, input, output, local
    /// or independent.
    #[arg(long)]
    pub(crate) causality: Option<String>,
}

impl Filter {
    fn fits(&self, variable: &Variable) -> bool {
        let by_name = self.pattern.as_ref().is_none_or(|pattern| {
            names::matches(pattern, &variable.name)
                || (!pattern.contains('*')
                    && variable.name.to_lowercase().contains(&pattern.to_lowercase()))
        });
        by_name && self.causality.as_ref().is_none_or(|causality| *causality == variable.causality)
    }

    /// Removes the variables that do not fit from a description.
    ///
    /// # Errors
    /// Returns an error if no variable fits.
    pub(crate) fn apply(&self, description: &mut ModelDescription) -> Result<(), Error> {
        if self.pattern.is_none() && self.causality.is_none() {
            return Ok(());
        }
        let names: Vec<String> = description.variables.iter().map(|v| v.name.clone()).collect();
        description.variables.retain(|variable| self.fits(variable));
        if !description.variables.is_empty() {
            return Ok(());
        }
        let causality =
            self.causality.as_ref().map_or(String::new(), |c| format!(" of causality {c}"));
        let (name, hint) =
            self.pattern.as_ref().map_or((String::new(), String::new()), |pattern| {
                (
                    format!(" that fits \"{pattern}\""),
                    names::hint(pattern, names.iter().map(String::as_str)),
                )
            });
        let model = &description.model_name;
        Err(Error::experiment(format!("{model} has no variable{causality}{name}{hint}")))
    }
}

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
