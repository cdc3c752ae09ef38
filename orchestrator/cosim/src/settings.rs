//! Looks up the parameters that an experiment sets.

use crate::error::Error;
use crate::experiment::Experiment;
use fmi_master::description::ModelDescription;
use fmi_master::settings::Setting;
use fmi_master::wiring::{Part, Wire};
use fmu_import::folder::from_start;
use std::path::Path;
use toml::Value;

/// Resolves the settings of a component.
///
/// # Errors
/// Returns an error if a name does not exist or cannot be set, or if a value is of the wrong type,
/// outside its limits, or in a unit that does not fit.
pub(crate) fn resolve(
    experiment: &Experiment,
    parts: &[Part],
    index: usize,
    wires: &[Wire],
) -> Result<Vec<Setting>, Error> {
    let part = parts[index];
    let component = &experiment.components[part.name];
    let (mut settings, mut left_out) = (Vec::new(), Vec::new());
    for (name, written) in &component.parameters {
        let span = written.span();
        let path = format!("{}.{name}", part.name);
        let is_assigned = experiment.assigned.contains(&path);
        let refuse = |message: String| {
            if is_assigned {
                Error::experiment(format!("--set {path}: {message}"))
            } else {
                experiment.source.error(&span, format!("\"{path}\": {message}"))
            }
        };
        let entries = entries(name, part.description);
        let is_there = part.description.find(name).is_some() || !entries.is_empty();
        if component.is_exchanged && !is_assigned && !is_there {
            left_out.push(name.as_str());
            continue;
        }
        let beside = (!is_assigned).then(|| file_beside(experiment, name, written.get_ref()));
        let value = beside.flatten().unwrap_or_else(|| written.get_ref().clone());
        for (place, entry) in entries.iter().enumerate() {
            let value = match &value {
                Value::Array(values) if values.len() == entries.len() => &values[place],
                Value::Array(values) => {
                    let (given, needed) = (values.len(), entries.join(", "));
                    return Err(refuse(format!(
                        "has {given} values, but the entries are {needed}"
                    )));
                }
                one => one,
            };
            // What is said of an entry alone holds.
            if !component.parameters.contains_key(*entry) {
                let setting = Setting::new(entry, value, index, part, wires, is_assigned);
                settings.push(setting.map_err(refuse)?);
            }
        }
        if entries.is_empty() {
            let setting = Setting::new(name, &value, index, part, wires, is_assigned);
            settings.push(setting.map_err(refuse)?);
        }
    }
    if let Some(flown) = &experiment.vehicle
        && part.description.find(VEHICLE).is_some()
        && !component.parameters.contains_key(VEHICLE)
    {
        let written = Value::from(flown.file.get_ref().as_str());
        let value = file_beside(experiment, VEHICLE, &written).unwrap_or(written);
        let setting = Setting::new(VEHICLE, &value, index, part, wires, false);
        let refuse = |message| experiment.source.error(&flown.file.span(), message);
        settings.push(setting.map_err(refuse)?);
    }
    // A law in another program has none of the parameters of its controller.
    if !left_out.is_empty() && !experiment.is_flown_by_law(part.name) {
        tracing::warn!(
            "{} as \"{}\" does not have these parameters, which are left out: {}",
            part.description.model_name,
            part.name,
            left_out.join(", ")
        );
    }
    Ok(settings)
}

/// Returns the names of the entries of a vector of parameters, such as `weight.P[1]` of `weight.P`;
/// none if there is no such vector.
fn entries<'a>(name: &str, description: &'a ModelDescription) -> Vec<&'a str> {
    let is_entry = |other: &&str| {
        other.strip_prefix(name).is_some_and(|rest| rest.starts_with('[') && rest.ends_with(']'))
    };
    let is_one = description.find(name).is_some();
    description.names("parameter").filter(|other| !is_one && is_entry(other)).collect()
}

/// Parameter of every component that knows a vehicle.
pub(crate) const VEHICLE: &str = "vehicle.file";

/// Returns whether a parameter, such as `vehicle.file`, names a file.
pub(crate) fn is_file(name: &str) -> bool {
    name.rsplit_once('.').is_some_and(|(_, last)| last == "file")
}

/// Returns the path of a file beside the experiment, or beside one that it extends, if a parameter
/// such as `vehicle.file` names it. FMUs themselves look for files in the working directory.
fn file_beside(experiment: &Experiment, name: &str, written: &Value) -> Option<Value> {
    let file = written.as_str().filter(|_| is_file(name))?;
    let path = from_start(&experiment.source.beside(Path::new(file)));
    Some(Value::from(path.is_file().then_some(path)?.to_str()?))
}
