//! Range checks.

use crate::{Declared, Field, Setting, settings};

/// A setting with a value that is not allowed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{name} = {value} {problem}")]
pub struct Invalid {
    /// Name of the setting.
    pub name: String,
    /// Value of the setting.
    pub value: f64,
    /// Condition that the value must satisfy.
    pub problem: String,
}

/// Checks that all numbers are within their declared ranges.
///
/// # Errors
/// Returns the first setting that is not.
pub fn check<S: Declared + Clone>(value: &S) -> Result<(), Invalid> {
    let mut value = value.clone();
    let settings = settings::<S>();
    for (index, Setting { place, .. }) in settings.iter().enumerate() {
        let number = match settings.field(&mut value, index) {
            Field::Real(field) => *field,
            Field::Integer(field) => field.number() as f64,
            _ => continue,
        };
        if let Some(problem) = place.problem(number) {
            return Err(Invalid { name: place.name.clone(), value: number, problem });
        }
    }
    Ok(())
}

/// Returns the names of all settings of a type.
pub fn names<S: Declared>() -> Vec<String> {
    settings::<S>().iter().map(|setting| setting.place.name.clone()).collect()
}
