//! Units of measure, as the FMU defines them: conversion of texts such as `"2 deg/s2"`, and the
//! check whether two variables may be connected.

use crate::names;

/// A unit, defined by `base = factor · value + offset` in SI base units, with its display units.
#[derive(Clone, Debug, PartialEq)]
pub struct UnitDefinition {
    /// Name of the unit, for example `rad/s`.
    pub name: String,
    /// Exponents of kg, m, s, A, K, mol, cd and rad; `None` if the FMU does not state them.
    pub exponents: Option<[i32; 8]>,
    /// Factor of the conversion to SI base units.
    pub factor: f64,
    /// Offset of the conversion to SI base units.
    pub offset: f64,
    /// Display units as name, factor, offset: `display = factor · value + offset`.
    pub displays: Vec<(String, f64, f64)>,
}

impl UnitDefinition {
    /// Returns the unit as differences of two values have it, which have no offset.
    #[must_use]
    pub fn of_differences(&self) -> Self {
        let displays = self.displays.iter().map(|(name, factor, _)| (name.clone(), *factor, 0.0));
        Self { offset: 0.0, displays: displays.collect(), ..self.clone() }
    }
}

/// Converts a text such as `"2 deg/s2"` to a value in the unit `target`. A bare `"2"` is already in
/// that unit.
///
/// # Errors
/// Returns an error if the text is not a number with a unit that the FMU defines and that measures
/// the same quantity as `target`.
pub fn convert(text: &str, target: Option<&str>, units: &[UnitDefinition]) -> Result<f64, String> {
    let text = text.trim();
    if let Ok(value) = text.parse::<f64>() {
        return Ok(value);
    }
    let (number, name) = text
        .split_once(char::is_whitespace)
        .map(|(number, name)| (number, name.trim()))
        .ok_or_else(|| {
            format!(
                "\"{text}\" is neither a plain number nor a number followed by a space and a unit"
            )
        })?;
    let value: f64 = number.parse().map_err(|_| format!("\"{number}\" is not a number"))?;
    let target =
        target.ok_or_else(|| format!("\"{text}\" has a unit, but the variable has none"))?;
    if name == target {
        return Ok(value);
    }

    let definition = units.iter().find(|unit| unit.name == target).ok_or_else(|| {
        format!("the FMU does not define its unit \"{target}\": give a plain number")
    })?;
    // A display unit of the variable's own unit takes precedence, because another unit may have a
    // display unit of the same name.
    let display = definition.displays.iter().find(|(display, ..)| display == name);
    if let Some((_, factor, offset)) = display {
        return Ok((value - offset) / factor);
    }
    let (unit, in_unit) = units
        .iter()
        .find_map(|unit| {
            if unit.name == name {
                return Some((unit, value));
            }
            let (_, factor, offset) = unit.displays.iter().find(|(display, ..)| display == name)?;
            Some((unit, (value - offset) / factor))
        })
        .ok_or_else(|| {
            let names: Vec<&str> = units
                .iter()
                .flat_map(|unit| {
                    std::iter::once(unit.name.as_str())
                        .chain(unit.displays.iter().map(|d| d.0.as_str()))
                })
                .collect();
            format!(
                "the FMU defines no unit \"{name}\"{}",
                names::hint(name, names.iter().copied())
            )
        })?;
    if unit.exponents.is_none() || unit.exponents != definition.exponents {
        return Err(format!(
            "\"{text}\" cannot be converted to {target}: they measure different quantities"
        ));
    }
    Ok((unit.factor * in_unit + unit.offset - definition.offset) / definition.factor)
}

/// Returns the scaling that converts values in one unit to values in another.
///
/// # Errors
/// Returns an error that says how the units differ, if they do not measure the same quantity.
pub fn conversion(
    from: Option<&str>,
    from_units: &[UnitDefinition],
    to: Option<&str>,
    to_units: &[UnitDefinition],
) -> Result<Scaling, String> {
    let unchanged = Ok(Scaling::default());
    let (Some(from), Some(to)) = (from, to) else {
        // An FMU that defines no units at all fits every unit.
        let sides = [(from, from_units), (to, to_units)];
        return if from == to || sides.iter().any(|(unit, units)| unit.is_none() && units.is_empty())
        {
            unchanged
        } else {
            Err(format!("{} against {}", from.unwrap_or("no unit"), to.unwrap_or("no unit")))
        };
    };
    let find =
        |name: &str, units: &[UnitDefinition]| units.iter().find(|unit| unit.name == name).cloned();
    match (find(from, from_units), find(to, to_units)) {
        (Some(a), Some(b)) if a.exponents.is_some() && b.exponents.is_some() => {
            if a.exponents != b.exponents {
                Err(format!("{from} against {to}"))
            } else if a.factor == b.factor && a.offset == b.offset {
                unchanged
            } else {
                Ok(Scaling {
                    factor: a.factor / b.factor,
                    offset: (a.offset - b.offset) / b.factor,
                })
            }
        }
        _ if from == to => unchanged,
        _ => Err(format!("{from} against {to}")),
    }
}

/// Returns the scaling that converts values of a lookup table, whose unit is only named, to values
/// in another unit. Values without a unit are in that unit already.
///
/// # Errors
/// Returns an error if the other side defines no unit of this name that measures the same quantity.
pub fn named(
    from: Option<&str>,
    to: Option<&str>,
    to_units: &[UnitDefinition],
) -> Result<Scaling, String> {
    let Some(from) = from else { return Ok(Scaling::default()) };
    let Some(to) = to else { return Err(format!("{from} against no unit")) };
    if from == to {
        return Ok(Scaling::default());
    }
    let converted = |value: f64| convert(&format!("{value} {from}"), Some(to), to_units);
    let is_known = to_units
        .iter()
        .any(|unit| unit.name == from || unit.displays.iter().any(|(name, ..)| name == from));
    match converted(0.0).and_then(|zero| Ok((zero, converted(1.0)?))) {
        Ok((zero, one)) => Ok(Scaling { factor: one - zero, offset: zero }),
        Err(_) if is_known => Err(format!("{from} against {to}")),
        Err(problem) => Err(format!("{from} against {to}: {problem}")),
    }
}

/// A linear conversion, value ↦ factor · value + offset.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scaling {
    /// Factor by which values are multiplied.
    pub factor: f64,
    /// Offset that is added after the multiplication.
    pub offset: f64,
}

impl Default for Scaling {
    /// Returns the scaling that leaves every value as it is.
    fn default() -> Self {
        Self { factor: 1.0, offset: 0.0 }
    }
}

impl Scaling {
    /// Returns the scaled value.
    pub fn apply(self, value: f64) -> f64 {
        self.factor * value + self.offset
    }

    /// Returns the scaling that applies this one first, and `next` afterwards.
    #[must_use]
    pub fn then(self, next: Self) -> Self {
        Self { factor: next.factor * self.factor, offset: next.apply(self.offset) }
    }
}

/// Rounds a number for a text, so that its last digits show no rounding errors.
pub fn rounded(time: f64) -> f64 {
    // A large time has fewer reliable digits after the point.
    let digits = if time.abs() < 1e5 { 1e9 } else { 1e4 };
    (time * digits).round() / digits
}

#[cfg(test)]
mod tests {
    use super::*;

    fn units() -> Vec<UnitDefinition> {
        let unit =
            |name: &str, exponents, factor, offset, displays: &[(&str, f64, f64)]| UnitDefinition {
                name: name.into(),
                exponents: Some(exponents),
                factor,
                offset,
                displays: displays.iter().map(|(n, f, o)| ((*n).to_string(), *f, *o)).collect(),
            };
        let in_degrees = 180.0 / std::f64::consts::PI;
        let (angle, angle_rate) = ([0, 0, 0, 0, 0, 0, 0, 1], [0, 0, -1, 0, 0, 0, 0, 1]);
        vec![
            unit("rad", angle, 1.0, 0.0, &[("deg", in_degrees, 0.0)]),
            unit("rad/s", angle_rate, 1.0, 0.0, &[("deg/s", in_degrees, 0.0)]),
            unit("s", [0, 0, 1, 0, 0, 0, 0, 0], 1.0, 0.0, &[("ms", 1000.0, 0.0)]),
            unit("min", [0, 0, 1, 0, 0, 0, 0, 0], 60.0, 0.0, &[]),
            unit("K", [0, 0, 0, 0, 1, 0, 0, 0], 1.0, 0.0, &[("degC", 1.0, -273.15)]),
        ]
    }

    #[test]
    fn oracle_conversion_by_hand() {
        let units = units();
        assert_eq!(convert("2", Some("rad"), &units), Ok(2.0));
        assert_eq!(convert("2 rad", Some("rad"), &units), Ok(2.0));
        let angle = convert("180 deg", Some("rad"), &units).unwrap();
        assert!((angle - std::f64::consts::PI).abs() < 1e-15);
        assert_eq!(convert("2 min", Some("s"), &units), Ok(120.0));
        assert_eq!(convert("500 ms", Some("min"), &units), Ok(0.5 / 60.0));
        assert!((convert("20 degC", Some("K"), &units).unwrap() - 293.15).abs() < 1e-12);
    }

    #[test]
    fn oracle_differences_ignore_the_zero_of_a_unit() {
        let units: Vec<_> = units().iter().map(UnitDefinition::of_differences).collect();
        assert_eq!(convert("5 degC", Some("K"), &units), Ok(5.0));
        assert_eq!(convert("180 deg", Some("rad"), &units), Ok(std::f64::consts::PI));
    }

    #[test]
    fn wrong_units_are_refused() {
        let units = units();
        assert!(convert("2 deg", None, &units).unwrap_err().contains("has none"));
        assert!(convert("two deg", Some("rad"), &units).unwrap_err().contains("not a number"));
        assert!(convert("2deg", Some("rad"), &units).unwrap_err().contains("a space and a unit"));
    }

    #[test]
    fn oracle_connections_need_equal_dimension_and_tell_the_scale() {
        let units = units();
        let scaling = |a, b| conversion(a, &units, b, &units);
        assert_eq!(scaling(Some("rad"), Some("rad")), Ok(Scaling::default()));
        assert_eq!(scaling(None, None), Ok(Scaling::default()));
        assert!(scaling(Some("rad"), None).is_err());
        assert!(scaling(Some("rad"), Some("rad/s")).is_err());
        assert_eq!(scaling(Some("min"), Some("s")).unwrap().apply(2.0), 120.0);
        assert_eq!(scaling(Some("s"), Some("min")).unwrap().apply(30.0), 0.5);
        // Another name for the same unit is no mismatch, and a description without units fits every
        // unit.
        let mut renamed = units.clone();
        renamed[0].name = "radian".into();
        assert_eq!(
            conversion(Some("rad"), &units, Some("radian"), &renamed),
            Ok(Scaling::default())
        );
        assert_eq!(conversion(None, &[], Some("rad"), &units), Ok(Scaling::default()));
    }

    #[test]
    fn oracle_a_unit_that_is_only_named_is_that_of_the_other_side() {
        let scaling = |from, to| named(from, to, &units());
        assert_eq!(scaling(Some("rad"), Some("rad")), Ok(Scaling::default()));
        assert_eq!(scaling(None, Some("rad")), Ok(Scaling::default()));
        let angle = scaling(Some("deg"), Some("rad")).unwrap();
        assert!((angle.apply(180.0) - std::f64::consts::PI).abs() < 1e-15);
        let temperature = scaling(Some("degC"), Some("K")).unwrap();
        assert!((temperature.apply(20.0) - 293.15).abs() < 1e-9);
        assert_eq!(scaling(Some("min"), Some("s")).unwrap().apply(2.0), 120.0);
        assert_eq!(scaling(Some("deg"), Some("K")), Err("deg against K".into()));
        let unknown = scaling(Some("knots"), Some("K")).unwrap_err();
        assert!(unknown.contains("defines no unit \"knots\""), "{unknown}");
        assert!(scaling(Some("deg"), None).is_err());
    }

    proptest::proptest! {}
}
