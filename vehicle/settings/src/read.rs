//! Values from files.

use crate::access::{Access, Setting};
use crate::{Declared, settings};
use toml::{Table, Value};

/// A value of a file that cannot be that of a setting.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{name}: {problem}")]
pub struct Misread {
    /// Name in the file.
    pub name: String,
    /// What is wrong.
    pub problem: String,
}

/// Sets the settings that a table of values names, by their names: tables and quoted dots are the
/// same, and an array has the values of `name[1]`, `name[2]`, and so on. A number is in the unit of
/// its setting; a text such as `"20 deg"` says its unit.
///
/// # Errors
/// Returns the first name or value that no setting can take.
pub fn read<S: Declared>(value: &mut S, table: &Table) -> Result<(), Misread> {
    let list = settings::<S>();
    let mut entries = Vec::new();
    flatten("", table, &mut entries);
    for (name, entry) in entries {
        set(value, &list, &name, &entry).map_err(|problem| Misread { name, problem })?;
    }
    Ok(())
}

/// Sets one setting by its name, as [`read`] does.
///
/// # Errors
/// Says that there is no such setting, or that it cannot have this value.
pub fn change<S: Declared>(value: &mut S, name: &str, entry: &Value) -> Result<(), Misread> {
    let fault = |problem| Misread { name: name.to_owned(), problem };
    set(value, &settings::<S>(), name, entry).map_err(fault)
}

/// Adds the values of a table and of those in it, with their full names.
fn flatten(structure: &str, table: &Table, entries: &mut Vec<(String, Value)>) {
    for (key, value) in table {
        let name = if structure.is_empty() { key.clone() } else { format!("{structure}.{key}") };
        match value {
            Value::Table(table) => flatten(&name, table, entries),
            Value::Array(values) => {
                let numbered = values.iter().enumerate();
                entries.extend(
                    numbered.map(|(i, value)| (format!("{name}[{}]", i + 1), value.clone())),
                );
            }
            _ => entries.push((name, value.clone())),
        }
    }
}

fn set<S>(settings: &mut S, list: &[Setting<S>], name: &str, entry: &Value) -> Result<(), String>
where
    S: 'static,
{
    let setting = list.iter().find(|setting| setting.place.name == name);
    let Some(Setting { place, access }) = setting else {
        return Err("there is no such setting".into());
    };
    let not = |kind: &str| format!("{entry} is not {kind}");
    match (access, entry) {
        (Access::Real(path), Value::String(text)) => {
            *path.field(settings) = quantity(text, &place.unit)?
        }
        (Access::Real(path), Value::Integer(number)) => *path.field(settings) = *number as f64,
        (Access::Real(path), Value::Float(number)) => *path.field(settings) = *number,
        (Access::Real(_), _) => return Err(not("a number")),
        (Access::Integer(integer, _), Value::Integer(number)) => {
            if !(integer.set)(settings, *number) {
                return Err(not("a number that it can hold"));
            }
        }
        (Access::Integer(..), _) => return Err(not("an integer")),
        (Access::Boolean(path), Value::Boolean(value)) => *path.field(settings) = *value,
        (Access::Boolean(_), _) => return Err(not("true or false")),
        (Access::Choice(integer, items), Value::String(text)) => {
            let number = items.items.iter().position(|item| item.0 == text);
            let number = number.and_then(|number| i64::try_from(number).ok());
            if !number.is_some_and(|number| (integer.set)(settings, number)) {
                let names: Vec<&str> = items.items.iter().map(|item| item.0).collect();
                return Err(not(&format!("one of {}", names.join(", "))));
            }
        }
        (Access::Choice(..) | Access::Text(_), entry) if !entry.is_str() => {
            return Err(not("a text"));
        }
        (Access::Text(path), Value::String(text)) => path.field(settings).clone_from(text),
        (Access::Choice(..) | Access::Text(_), _) => {}
    }
    Ok(())
}

/// Converts a text such as `20 deg` to the unit of a setting.
fn quantity(text: &str, unit: &str) -> Result<f64, String> {
    let fault = || format!("\"{text}\" is not a number in {unit}");
    let (number, written) = text.split_once(' ').ok_or_else(fault)?;
    let number: f64 = number.parse().map_err(|_| fault())?;
    if written == unit {
        Ok(number)
    } else if written.replace("deg", "rad") == unit {
        Ok(number.to_radians())
    } else {
        Err(fault())
    }
}
