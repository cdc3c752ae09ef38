//! Checks of single values while a file is read, so that the error points at the value's line.

use serde::de::Error;
use serde::{Deserialize, Deserializer};

/// Reads the text that says where numbers come from.
pub(crate) fn source<'de, D: Deserializer<'de>>(file: D) -> Result<String, D::Error> {
    let text = String::deserialize(file)?;
    if text.trim().is_empty() {
        return Err(D::Error::custom("is empty; say where the numbers come from"));
    }
    Ok(text)
}

/// Reads a finite number.
pub(crate) fn finite<'de, D: Deserializer<'de>>(file: D) -> Result<f64, D::Error> {
    let value = f64::deserialize(file)?;
    if value.is_finite() { Ok(value) } else { Err(D::Error::custom("must be finite")) }
}

/// Reads a finite number above zero.
pub(crate) fn positive<'de, D: Deserializer<'de>>(file: D) -> Result<f64, D::Error> {
    let value = finite(file)?;
    if value > 0.0 { Ok(value) } else { Err(D::Error::custom("must be positive")) }
}

/// Reads a list of finite numbers.
pub(crate) fn all_finite<'de, D: Deserializer<'de>>(file: D) -> Result<Vec<f64>, D::Error> {
    let values = Vec::<f64>::deserialize(file)?;
    if values.iter().all(|value| value.is_finite()) {
        return Ok(values);
    }
    Err(D::Error::custom("must hold finite values"))
}

/// Reads a point that may be left out.
pub(crate) fn point<'de, D: Deserializer<'de>>(file: D) -> Result<Option<[f64; 3]>, D::Error> {
    let point = Option::<[f64; 3]>::deserialize(file)?;
    if point.iter().flatten().all(|value| value.is_finite()) {
        return Ok(point);
    }
    Err(D::Error::custom("must hold finite values"))
}
