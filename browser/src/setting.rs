//! Values of parameters as experiment files write them, converted as the orchestrator does.

use fmi2_export::linked::Value;
use model_description::unit::Unit;
use model_description::variable::{Variable, VariableKind};

/// Converts a written value to the type and the unit of a variable. Its limits are checked when it
/// is set.
///
/// # Errors
/// Says which values the variable accepts.
pub fn value(written: &toml::Value, variable: &Variable) -> Result<Value, String> {
    let mismatch = |expected: &str| Err(format!("must be {expected}, not {written}"));
    match (&variable.kind, written) {
        (VariableKind::Real { unit, .. }, toml::Value::String(text)) => {
            converted(text, unit.as_ref()).map(Value::Real)
        }
        (VariableKind::Real { .. }, toml::Value::Float(value)) => Ok(Value::Real(*value)),
        (VariableKind::Real { .. }, toml::Value::Integer(value)) => Ok(Value::Real(*value as f64)),
        (VariableKind::Real { .. }, _) => mismatch("a number, or a text with a number and a unit"),
        (VariableKind::Integer { .. }, toml::Value::Integer(value)) => {
            i32::try_from(*value).map(Value::Integer).or_else(|_| mismatch("of 32 bits"))
        }
        (VariableKind::Integer { .. }, _) => mismatch("an integer"),
        (VariableKind::Boolean { .. }, toml::Value::Boolean(value)) => Ok(Value::Boolean(*value)),
        (VariableKind::Boolean { .. }, _) => mismatch("true or false"),
        (VariableKind::Enumeration { enumeration_type, .. }, toml::Value::String(text)) => {
            let items = enumeration_type.items.iter().map(|(name, _)| name.as_str());
            match (1..).zip(items.clone()).find(|(_, name)| name == text) {
                Some((number, _)) => Ok(Value::Integer(number)),
                None => mismatch(&format!("one of {}", items.collect::<Vec<_>>().join(", "))),
            }
        }
        (VariableKind::Enumeration { .. }, _) => mismatch("the name of an item"),
        (VariableKind::String { .. }, toml::Value::String(text)) => Ok(Value::Text(text.clone())),
        (VariableKind::String { .. }, _) => mismatch("a text"),
    }
}

/// Converts a text such as `2 deg/s2` to a value in the unit. A bare `2` is already in it.
fn converted(text: &str, unit: Option<&Unit>) -> Result<f64, String> {
    let (number, name) = text.trim().split_once(char::is_whitespace).unwrap_or((text.trim(), ""));
    let value: f64 = number.parse().map_err(|_| format!("'{number}' is not a number"))?;
    let name = name.trim();
    let display = unit.and_then(|unit| unit.display.as_ref());
    match (unit, display) {
        _ if name.is_empty() => Ok(value),
        (Some(unit), _) if unit.name == name => Ok(value),
        (_, Some(display)) if display.name == name => Ok(value / display.factor),
        (Some(unit), _) => Err(format!("'{text}' is not in {}", unit.name)),
        (None, _) => Err(format!("'{text}' has a unit, but the variable has none")),
    }
}
