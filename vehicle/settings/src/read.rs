//! Values from files.

use crate::{Declared, Field, Kind, Place, Role, Settings, settings};
use toml::{Table, Value};

/// A value of a file that cannot be that of a setting.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{name}: {problem}")]
pub struct Misread {
    /// Name in the file.
    pub name: String,
    /// Description of the fault.
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

/// Sets settings as [`read`] does, from the text of a file that may name only settings which are
/// declared with `file`.
///
/// # Errors
/// Says where the text is no TOML, or returns the first name or value that no such setting can take.
pub fn read_file<S: Declared>(value: &mut S, text: &str) -> Result<(), String> {
    let table: Table = toml::from_str(text).map_err(|error| error.to_string())?;
    let list = settings::<S>();
    let mut entries = Vec::new();
    flatten("", &table, &mut entries);
    for (name, entry) in entries {
        let is_other = |place: &Place| place.name == name && place.role != Role::File;
        if list.iter().any(|setting| is_other(&setting.place)) {
            return Err(format!("{name} is a variable: set it as one"));
        }
        set(value, &list, &name, &entry).map_err(|problem| format!("{name}: {problem}"))?;
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

fn set<S: Declared>(
    value: &mut S,
    list: &Settings<S>,
    name: &str,
    entry: &Value,
) -> Result<(), String> {
    let index = list.iter().position(|setting| setting.place.name == name);
    let index = index.ok_or("there is no such setting")?;
    let not = |kind: &str| Err(format!("{entry} is not {kind}"));
    match (list.field(value, index), entry) {
        (Field::Real(field), Value::String(text)) => {
            *field = quantity(text, &list[index].place.unit)?;
        }
        (Field::Real(field), Value::Integer(number)) => *field = *number as f64,
        (Field::Real(field), Value::Float(number)) => *field = *number,
        (Field::Real(_), _) => return not("a number"),
        (Field::Integer(field), Value::Integer(number)) => {
            if !field.set_number(*number) {
                return not("a number that it can hold");
            }
        }
        (Field::Integer(_), _) => return not("an integer"),
        (Field::Boolean(field), Value::Boolean(value)) => *field = *value,
        (Field::Boolean(_), _) => return not("true or false"),
        (Field::Choice(field), Value::String(text)) => {
            let Kind::Choice(items, _) = &list[index].kind else { return not("a choice") };
            let number = items.items.iter().position(|item| item.0 == text);
            let number = number.and_then(|number| i64::try_from(number).ok());
            if !number.is_some_and(|number| field.set_number(number)) {
                let names: Vec<&str> = items.items.iter().map(|item| item.0).collect();
                return not(&format!("one of {}", names.join(", ")));
            }
        }
        (Field::Text(field), Value::String(text)) => field.clone_from(text),
        (Field::Choice(_) | Field::Text(_), _) => return not("a text"),
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
