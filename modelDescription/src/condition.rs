//! Condition on the settings of an FMU under which one of its variables has an effect.
//!
//! It is a text, such as `reference.profile = constant or sine`, or `translation = entry and
//! air.rows >= 3`, which descriptions and warnings show as it is. Parts joined by `and` must all
//! hold, and one of the alternatives joined by `or`, which stand in brackets beside another part.
//! An alternative without a comparison repeats name and operator of the one before. A name with `*`
//! at its end denotes all variables that begin with it, of which one must satisfy the comparison.
//! [`CO_SIMULATION`] holds for instances of co-simulation, and [`NEVER`] for none.

use crate::variable::{Causality, Variable, VariableKind};
use std::cmp::Ordering;

/// Part that holds for instances of co-simulation.
pub const CO_SIMULATION: &str = "co-simulation";
/// Condition of a variable that an FMU has only because others have it.
pub const NEVER: &str = "no setting of this FMU";

/// Value of a variable as a condition compares it.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    /// A number.
    Number(f64),
    /// A text, the item of an enumeration, `true` or `false`.
    Text(String),
}

/// A comparison of one variable, or of those whose names begin with the text before `*`.
struct Comparison<'a> {
    name: &'a str,
    operator: &'a str,
    value: &'a str,
}

impl Comparison<'_> {
    fn names(&self, variable: &Variable) -> bool {
        match self.name.strip_suffix('*') {
            Some(beginning) => variable.name.starts_with(beginning),
            None => variable.name == self.name,
        }
    }

    fn holds(&self, value: &Value) -> bool {
        let order = match value {
            Value::Number(number) => {
                self.value.parse().ok().and_then(|value: f64| number.partial_cmp(&value))
            }
            Value::Text(text) => Some(text.as_str().cmp(self.value)),
        };
        order.is_some_and(|order| match self.operator {
            "=" => order == Ordering::Equal,
            "!=" => order != Ordering::Equal,
            ">" => order == Ordering::Greater,
            _ => order != Ordering::Less,
        })
    }
}

/// Returns the alternatives of each part, or the part itself if it is no comparison.
fn parts(condition: &str) -> impl Iterator<Item = Result<Vec<Comparison<'_>>, &str>> {
    condition.split(" and ").map(|part| {
        let mut before = None;
        let alternatives = part.trim_matches(['(', ')']).split(" or ").map(|text| {
            let mut words = text.splitn(3, ' ');
            if let (Some(name), Some(operator), Some(value)) =
                (words.next(), words.next(), words.next())
                && matches!(operator, "=" | "!=" | ">" | ">=")
            {
                before = Some((name, operator));
                return Some(Comparison { name, operator, value });
            }
            before.map(|(name, operator)| Comparison { name, operator, value: text })
        });
        alternatives.collect::<Option<Vec<_>>>().ok_or(part)
    })
}

/// Whether a condition holds for an instance with these variables, whose values `value` returns by
/// their positions.
pub fn holds(
    condition: &str,
    co_simulation: bool,
    variables: &[Variable],
    mut value: impl FnMut(usize) -> Value,
) -> bool {
    parts(condition).all(|part| match part {
        Err(part) => part.is_empty() || part == CO_SIMULATION && co_simulation,
        Ok(alternatives) => alternatives.iter().any(|alternative| {
            let named = |(_, variable): &(usize, &Variable)| alternative.names(variable);
            let mut named = variables.iter().enumerate().filter(named);
            named.any(|(position, _)| alternative.holds(&value(position)))
        }),
    })
}

/// Returns the fault of a condition, if it has one.
pub(crate) fn problem(condition: &str, variables: &[Variable]) -> Option<String> {
    for part in parts(condition) {
        let alternatives = match part {
            Ok(alternatives) => alternatives,
            Err("" | CO_SIMULATION | NEVER) => continue,
            Err(part) => return Some(format!("is used with '{part}', which is no comparison")),
        };
        for comparison in alternatives {
            let Comparison { name, operator, value } = comparison;
            let mut named = variables.iter().filter(|variable| comparison.names(variable));
            let fits = |variable: &Variable| {
                let allowed = match &variable.kind {
                    VariableKind::Enumeration { enumeration_type, .. } => {
                        enumeration_type.items.iter().any(|(item, _)| item == value)
                    }
                    VariableKind::Boolean { .. } => matches!(value, "true" | "false"),
                    VariableKind::Real { .. } | VariableKind::Integer { .. } => {
                        value.parse::<f64>().is_ok()
                    }
                    VariableKind::String { .. } => true,
                };
                allowed && variable.causality == Causality::Parameter
            };
            if !named.next().is_some_and(fits) {
                return Some(format!(
                    "is used with '{name} {operator} {value}', but no parameter can have this value"
                ));
            }
        }
    }
    None
}

impl VariableKind {
    /// Returns the value of an integer or enumeration as a condition compares it.
    pub fn value_of(&self, number: i32) -> Value {
        let item = match self {
            Self::Enumeration { enumeration_type, .. } => usize::try_from(number - 1)
                .ok()
                .and_then(|position| enumeration_type.items.get(position)),
            _ => None,
        };
        item.map_or(Value::Number(number.into()), |(name, _)| Value::Text(name.clone()))
    }

    /// Returns the start value, if there is one.
    pub fn start_value(&self) -> Option<Value> {
        match self {
            Self::Real { start, .. } => start.map(Value::Number),
            Self::Integer { start, .. } | Self::Enumeration { start, .. } => {
                start.map(|start| self.value_of(start))
            }
            Self::Boolean { start } => start.map(|start| Value::Text(start.to_string())),
            Self::String { start } => start.clone().map(Value::Text),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::variable::Variability;

    fn variable(name: &str) -> Variable {
        Variable {
            name: name.into(),
            description: String::new(),
            causality: Causality::Parameter,
            variability: Variability::Fixed,
            kind: VariableKind::Real {
                unit: None,
                min: None,
                max: None,
                nominal: None,
                start: Some(0.0),
                derivative_of: None,
            },
            dependencies: vec![],
            used_with: String::new(),
            is_optional: false,
        }
    }

    fn holds_with(condition: &str, values: [f64; 3]) -> bool {
        let variables = ["rows", "gust.north", "gust.east"].map(variable);
        holds(condition, true, &variables, |position| Value::Number(values[position]))
    }

    #[test]
    fn all_parts_must_hold_and_one_alternative() {
        for (condition, values, expected) in [
            ("rows >= 2", [2.0, 0.0, 0.0], true),
            ("rows > 2", [2.0, 0.0, 0.0], false),
            ("rows = 1 or 2", [2.0, 0.0, 0.0], true),
            ("rows = 1 or 2", [3.0, 0.0, 0.0], false),
            ("gust.* != 0", [1.0, 0.0, 0.0], false),
            ("gust.* != 0", [1.0, 0.0, -3.0], true),
            ("rows > 0 and (gust.north > 1 or gust.east > 1)", [1.0, 0.0, 2.0], true),
            ("rows > 0 and (gust.north > 1 or gust.east > 1)", [0.0, 0.0, 2.0], false),
            ("co-simulation and rows > 0", [1.0, 0.0, 0.0], true),
            (NEVER, [1.0, 1.0, 1.0], false),
        ] {
            assert_eq!(holds_with(condition, values), expected, "{condition} {values:?}");
        }
    }

    #[test]
    fn conditions_on_what_does_not_exist_are_refused() {
        let variables = ["rows", "gust.north"].map(variable);
        for condition in ["rows = 1 or 2", "gust.* != 0", "co-simulation and rows > 0", NEVER, ""] {
            assert_eq!(problem(condition, &variables), None, "{condition}");
        }
        for condition in ["row = 1", "rows = many", "wind.* != 0", "rows = 1 and always"] {
            assert!(problem(condition, &variables).is_some(), "{condition}");
        }
    }
}
