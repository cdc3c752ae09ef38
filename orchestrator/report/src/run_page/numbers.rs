//! Numbers of a page, with as many digits as a screen can resolve.

use serde_json::{Value, json};

/// Number of significant digits of a value, which is more than a screen can resolve.
pub(super) const DIGITS: usize = 5;
/// Number of significant digits of a time.
pub(super) const TIME_DIGITS: usize = 7;

/// Rounds numbers; those that are not finite become null.
pub(super) fn numbers(values: impl IntoIterator<Item = f64>, digits: usize) -> Vec<Value> {
    values.into_iter().map(|value| rounded(value, digits)).collect()
}

/// Rounds a number; one that is not finite becomes null.
pub(super) fn rounded(value: f64, digits: usize) -> Value {
    if !value.is_finite() {
        return Value::Null;
    }
    let rounded: f64 = format!("{value:.*e}", digits - 1).parse().unwrap_or(value);
    // A whole number is shorter without its point.
    if rounded.fract() == 0.0 && rounded.abs() < 1e9 {
        json!(rounded as i64)
    } else {
        json!(rounded)
    }
}
