//! Check that a value holds no NaN, however deep.

use ciborium::Value;
use serde::Serialize;

/// Whether no Real in `value` is NaN. Infinite ones are allowed, as they may denote an interval
/// without end.
pub(crate) fn are_numbers<T: Serialize>(value: &T) -> bool {
    Value::serialized(value).is_ok_and(|value| holds_numbers(&value))
}

fn holds_numbers(value: &Value) -> bool {
    match value {
        Value::Float(number) => !number.is_nan(),
        Value::Array(items) => items.iter().all(holds_numbers),
        Value::Map(entries) => entries.iter().all(|(_, value)| holds_numbers(value)),
        _ => true,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(serde::Serialize)]
    enum Deep {
        Named { list: Vec<Option<f64>> },
        Pair((i32, String), f64),
        Nothing,
    }

    #[test]
    fn every_nan_is_found_however_deep() {
        let named = |value| Deep::Named { list: vec![None, Some(f64::INFINITY), Some(value)] };
        let pair = |value| Deep::Pair((1, "text".into()), value);
        assert!(are_numbers(&[named(1.0), pair(-1e308), Deep::Nothing]));
        assert!(!are_numbers(&[named(f64::NAN)]) && !are_numbers(&(true, pair(-f64::NAN))));
    }
}
