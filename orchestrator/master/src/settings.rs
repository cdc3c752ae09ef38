//! Values of parameters as people write them, converted to the types and units of the variables.

use crate::description::{Variable, VariableKind};
use crate::instance::{Instance, Outcome};
use crate::names;
use crate::quantity;
use crate::wiring::{Part, Wire};
use serde::{Deserialize, Serialize};
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
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
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

impl Setting {
    /// Looks up a variable among those of its component, and converts the value that is written
    /// for it. With `is_whole` a hint names the component as well.
    ///
    /// # Errors
    /// Says why there is no variable of this name that may be set, or which values it accepts.
    pub fn new(
        name: &str,
        written: &Value,
        component: usize,
        part: Part,
        wires: &[Wire],
        is_whole: bool,
    ) -> Result<Self, String> {
        let variable =
            &part.description.variables[position(name, component, part, wires, is_whole)?];
        let value = value(written, variable, part)?;
        Ok(Self { name: name.into(), reference: variable.reference, value })
    }
}

/// Returns the position of a variable that may be set, among the variables of its component. With
/// `is_whole` a hint names the component as well.
///
/// # Errors
/// Says why there is no variable of this name that may be set.
pub fn position(
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
        "structuralParameter" => {
            Err("is a structural parameter, which keeps its start value".into())
        }
        // FMI 2.0, section 2.2.7: a start value belongs to a variable whose initial value is exact
        // or approximate, and such variables can be set before initialization.
        _ if variable.variability != "constant" && variable.start.is_some() => Ok(position),
        other => Err(format!("is of causality {other} without a start value that can be changed")),
    }
}

/// Converts a value to the type and the unit of a variable.
///
/// # Errors
/// Says which values the variable accepts.
pub fn value(written: &Value, variable: &Variable, part: Part) -> Result<SettingValue, String> {
    let mismatch = |expected: &str| Err(format!("must be {expected}, not {written}"));
    match (&variable.kind, written) {
        (VariableKind::Real { unit, min, max, .. }, _) => {
            let value = match written {
                Value::Float(value) => *value,
                Value::Integer(value) => *value as f64,
                Value::String(text) => {
                    let units = part.description.units_of(&variable.kind);
                    quantity::convert(text, unit.as_deref(), &units)?
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
        (VariableKind::Binary | VariableKind::Clock { .. }, _) => Err(format!(
            "is {}, which cannot be set",
            variable.kind.untransferred().unwrap_or_default()
        )),
    }
}

/// Sets the values, with one call for all values of a type. Texts take one call each.
///
/// # Errors
/// Returns an error if the instance reports a failure.
pub fn apply(settings: &[Setting], instance: &mut dyn Instance) -> Outcome {
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::description::ModelDescription;

    #[test]
    fn start_values_of_all_variables_that_are_not_constant_can_be_set() {
        let variable = |name: &str, variability: &'static str, start: Option<&str>| Variable {
            name: name.into(),
            causality: "local".into(),
            variability: variability.into(),
            start: start.map(String::from),
            ..Variable::default()
        };
        let variables = vec![
            variable("state", "continuous", Some("true")),
            variable("constant", "constant", Some("true")),
            variable("calculated", "continuous", None),
        ];
        let description = ModelDescription { variables, ..ModelDescription::default() };
        let part = Part { name: "a", description: &description };
        assert_eq!(position("state", 0, part, &[], false), Ok(0));
        for name in ["constant", "calculated"] {
            let fault = position(name, 0, part, &[], false).unwrap_err();
            assert!(fault.contains("is of causality local"), "{fault}");
        }
    }
}
