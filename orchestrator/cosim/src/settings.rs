//! Parameter values of an experiment, converted to the types and units of the FMU's variables.

use crate::error::Error;
use crate::experiment::Experiment;
use crate::wiring::{Part, Wire};
use fmu_import::description::{Variable, VariableKind};
use fmu_import::instance::{Instance, Outcome};
use fmu_import::names;
use fmu_import::quantity;
use fmu_import::warnings::warn_once;
use toml::Value;

/// A variable that is set before initialization.
#[derive(Clone, Debug, PartialEq)]
pub struct Setting {
    /// Name of the variable.
    pub name: String,
    /// Value reference of the variable.
    pub reference: u32,
    /// Value in the variable's own unit.
    pub value: SettingValue,
}

/// A value together with its type.
#[derive(Clone, Debug, PartialEq)]
pub enum SettingValue {
    /// A value of type Real.
    Real(f64),
    /// A value of type Integer.
    Integer(i32),
    /// An item of an enumeration, as its name and value.
    Item(String, i32),
    /// A value of type Boolean.
    Boolean(bool),
    /// A value of type String.
    Text(String),
}

impl SettingValue {
    /// Returns the plain value as JSON; for an enumeration this is the name of the item.
    pub fn to_json(&self) -> serde_json::Value {
        match self {
            Self::Real(value) => (*value).into(),
            Self::Integer(value) => (*value).into(),
            Self::Boolean(value) => (*value).into(),
            Self::Item(text, _) | Self::Text(text) => text.as_str().into(),
        }
    }
}

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
        if component.is_exchanged && !is_assigned && part.description.find(name).is_none() {
            left_out.push(name.as_str());
            continue;
        }
        let position = position(name, index, part, wires, is_assigned).map_err(&refuse)?;
        let variable = &part.description.variables[position];
        let value = value(written.get_ref(), variable, part).map_err(refuse)?;
        settings.push(Setting { name: name.clone(), reference: variable.reference, value });
    }
    if !left_out.is_empty() {
        warn_once(format!(
            "{} as \"{}\" does not have these parameters, which are left out: {}",
            part.description.model_name,
            part.name,
            left_out.join(", ")
        ));
    }
    Ok(settings)
}

/// Returns the position of a variable that may be set, among the variables of its component. With
/// `is_whole` a hint names the component as well.
pub(crate) fn position(
    name: &str,
    component: usize,
    part: Part,
    wires: &[Wire],
    is_whole: bool,
) -> Result<usize, String> {
    let (position, variable) = part.description.find(name).ok_or_else(|| {
        let names = part.description.names("parameter").chain(part.description.names("input"));
        let names: Vec<&str> = names.collect();
        let hint = match names::nearest(name, names.iter().copied()) {
            Some(near) if is_whole => format!("; did you mean \"{}.{near}\"?", part.name),
            _ => names::hint(name, names.iter().copied()),
        };
        format!("there is no such parameter{hint}")
    })?;
    let is_connected = |wire: &Wire| (wire.to.component, wire.to.variable) == (component, position);
    match &*variable.causality {
        "input" if wires.iter().any(is_connected) => {
            Err("is an input with a connection, so it cannot have a value of its own".into())
        }
        "parameter" | "input" => Ok(position),
        other => Err(format!("is of causality {other}, only parameters and inputs can be set")),
    }
}

/// Converts a value to the type and the unit of a variable.
pub(crate) fn value(
    written: &Value,
    variable: &Variable,
    part: Part,
) -> Result<SettingValue, String> {
    let mismatch = |expected: &str| Err(format!("must be {expected}, not {written}"));
    match (&variable.kind, written) {
        (VariableKind::Real { unit, min, max, .. }, _) => {
            let value = match written {
                Value::Float(value) => *value,
                Value::Integer(value) => *value as f64,
                Value::String(text) => {
                    quantity::convert(text, unit.as_deref(), &part.description.units)?
                }
                _ => return mismatch("a number, or a text with a number and a unit"),
            };
            let unit = unit.as_ref().map(|unit| format!(" {unit}")).unwrap_or_default();
            if let Some(min) = min.filter(|min| value < *min) {
                return Err(format!("{value}{unit} is below its minimum {min}{unit}"));
            }
            if let Some(max) = max.filter(|max| value > *max) {
                return Err(format!("{value}{unit} is above its maximum {max}{unit}"));
            }
            Ok(SettingValue::Real(value))
        }
        (VariableKind::Integer { min, max }, Value::Integer(written)) => {
            let (low, high) = (min.unwrap_or(i32::MIN), max.unwrap_or(i32::MAX));
            match i32::try_from(*written) {
                Ok(value) if (low..=high).contains(&value) => Ok(SettingValue::Integer(value)),
                _ => Err(format!("{written} is not between {low} and {high}")),
            }
        }
        (VariableKind::Integer { .. }, _) => mismatch("an integer"),
        (VariableKind::Boolean, Value::Boolean(value)) => Ok(SettingValue::Boolean(*value)),
        (VariableKind::Boolean, _) => mismatch("true or false"),
        (VariableKind::Enumeration { items }, Value::String(text)) => items
            .iter()
            .find(|(name, _)| name == text)
            .map(|(name, value)| SettingValue::Item(name.clone(), *value))
            .ok_or_else(|| {
                let names: Vec<&str> = items.iter().map(|(name, _)| name.as_str()).collect();
                format!("has no item \"{text}\"{}", names::hint(text, names.iter().copied()))
            }),
        (VariableKind::Enumeration { items }, _) => {
            let names: Vec<&str> = items.iter().map(|(name, _)| name.as_str()).collect();
            mismatch(&format!("the name of an item ({})", names.join(", ")))
        }
        (VariableKind::String, Value::String(text)) => Ok(SettingValue::Text(text.clone())),
        (VariableKind::String, _) => mismatch("a text"),
    }
}

/// Sets the values, with one call for all values of a type. Texts take one call each.
///
/// # Errors
/// Returns an error if the instance reports a failure.
pub(crate) fn apply(settings: &[Setting], instance: &mut dyn Instance) -> Outcome {
    let mut reals = (Vec::new(), Vec::new());
    let mut integers = (Vec::new(), Vec::new());
    let mut booleans = (Vec::new(), Vec::new());
    for Setting { reference, value, .. } in settings {
        match value {
            SettingValue::Real(value) => {
                reals.0.push(*reference);
                reals.1.push(*value);
            }
            SettingValue::Integer(value) | SettingValue::Item(_, value) => {
                integers.0.push(*reference);
                integers.1.push(*value);
            }
            SettingValue::Boolean(value) => {
                booleans.0.push(*reference);
                booleans.1.push(i32::from(*value));
            }
            SettingValue::Text(text) => instance.set_string(*reference, text)?,
        }
    }
    if !reals.0.is_empty() {
        instance.set_real(&reals.0, &reals.1)?;
    }
    if !integers.0.is_empty() {
        instance.set_integer(&integers.0, &integers.1)?;
    }
    if !booleans.0.is_empty() {
        instance.set_boolean(&booleans.0, &booleans.1)?;
    }
    Ok(())
}
