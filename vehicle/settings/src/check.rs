//! Range checks.

use crate::access::Access;
use crate::{Declared, settings};

/// A setting with a value that is not allowed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{name} = {value} {problem}")]
pub struct Invalid {
    /// Name of the setting.
    pub name: String,
    /// Value of the setting.
    pub value: f64,
    /// What the value must satisfy.
    pub problem: String,
}

/// Checks that all numbers are within their declared ranges.
///
/// # Errors
/// Returns the first setting that is not.
pub fn check<S: Declared + Clone>(value: &S) -> Result<(), Invalid> {
    let mut value = value.clone();
    for setting in settings::<S>() {
        let number = match &setting.access {
            Access::Real(path) => *path.field(&mut value),
            Access::Integer(integer, _) => (integer.get)(&mut value) as f64,
            Access::Boolean(_) | Access::Choice(..) | Access::Text(_) => continue,
        };
        if let Some(problem) = setting.place.problem(number) {
            return Err(Invalid { name: setting.place.name, value: number, problem });
        }
    }
    Ok(())
}

/// Returns the names of all settings of a type.
pub fn names<S: Declared>() -> Vec<String> {
    settings::<S>().into_iter().map(|setting| setting.place.name).collect()
}
