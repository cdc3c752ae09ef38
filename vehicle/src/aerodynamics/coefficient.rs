//! A coefficient over the angle of attack and the Mach number.

use serde::de::Error;
use serde::{Deserialize, Deserializer, Serialize};

/// A coefficient: a polynomial of the angle of attack in degrees, or a table over the angle of
/// attack and the Mach number, linear between its points and constant beyond them.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(try_from = "Given", into = "Given")]
pub struct Coefficient {
    source: String,
    curve: Curve,
    /// Whether the numbers are per degree; those of derivatives are otherwise per radian.
    per_degree: bool,
}

#[derive(Clone, Debug, PartialEq)]
enum Curve {
    Polynomial(Vec<f64>),
    Table(Table),
}

impl Default for Curve {
    fn default() -> Self {
        Self::Polynomial(Vec::new())
    }
}

/// A table: one row of values per Mach number, one value per angle of attack.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(super) struct Table {
    /// Angles of attack in degrees, increasing.
    pub alpha_deg: Vec<f64>,
    /// Mach numbers, increasing.
    pub mach: Vec<f64>,
    /// One row for each Mach number, with one value for each angle of attack.
    pub values: Vec<Vec<f64>>,
}

/// A coefficient as a file gives it: either a polynomial or a table.
#[derive(Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[cfg_attr(test, schemars(rename = "Coefficient"))]
#[serde(deny_unknown_fields)]
pub(super) struct Given {
    /// Publication or derivation from which the numbers come.
    source: String,
    /// Factors of 1, α, α², … with the angle of attack α in degrees.
    #[serde(default)]
    polynomial: Option<Vec<f64>>,
    /// Table over angle of attack and Mach number.
    #[serde(default, deserialize_with = "checked")]
    table: Option<Table>,
    /// Whether the numbers are per degree. Those of derivatives are otherwise per radian.
    #[serde(default)]
    per_degree: bool,
}

/// Reads a table and checks it, so that the error points at the table.
fn checked<'de, D: Deserializer<'de>>(file: D) -> Result<Option<Table>, D::Error> {
    let table = Option::<Table>::deserialize(file)?;
    let fault = table.as_ref().and_then(|table| table.check().err());
    fault.map_or(Ok(table), |fault| Err(D::Error::custom(fault)))
}

impl TryFrom<Given> for Coefficient {
    type Error = String;

    fn try_from(given: Given) -> Result<Self, String> {
        let Given { source, polynomial, table, per_degree } = given;
        // A coefficient that is left out has no source.
        if source.trim().is_empty() && polynomial.as_ref().is_none_or(|factors| !factors.is_empty())
        {
            return Err("source is empty; say where the numbers come from".into());
        }
        let curve = match (polynomial, table) {
            (Some(polynomial), None) if polynomial.iter().all(|factor| factor.is_finite()) => {
                Curve::Polynomial(polynomial)
            }
            (Some(_), None) => return Err("polynomial holds a value that is not finite".into()),
            (None, Some(table)) => Curve::Table(table),
            _ => return Err("a coefficient has either polynomial or table".into()),
        };
        Ok(Self { source, curve, per_degree })
    }
}

impl From<Coefficient> for Given {
    fn from(Coefficient { source, curve, per_degree }: Coefficient) -> Self {
        let (polynomial, table) = match curve {
            Curve::Polynomial(polynomial) => (Some(polynomial), None),
            Curve::Table(table) => (None, Some(table)),
        };
        Self { source, polynomial, table, per_degree }
    }
}

impl Table {
    /// Refuses a table that is not full, that holds a value which is not finite, or whose axes do
    /// not increase. The message begins with the key at fault.
    pub(super) fn check(&self) -> Result<(), String> {
        increasing("alpha_deg", &self.alpha_deg, TURN)?;
        increasing("mach", &self.mach, [0.0, f64::MAX])?;
        let (rows, columns) = (self.mach.len(), self.alpha_deg.len());
        if self.values.len() != rows {
            let found = self.values.len();
            return Err(format!(
                "values has {found} rows; it needs one for each of the {rows} Mach numbers"
            ));
        }
        for (number, row) in self.values.iter().enumerate() {
            let (number, found) = (number + 1, row.len());
            if found != columns {
                return Err(format!(
                    "values: row {number} has {found} values; it needs one for each of the {columns} angles of attack"
                ));
            }
            if !row.iter().all(|value| value.is_finite()) {
                return Err(format!("values: row {number} holds a value that is not finite"));
            }
        }
        Ok(())
    }

    /// Returns the value at an angle of attack (deg) and a Mach number.
    pub(super) fn at(&self, alpha: f64, mach: f64) -> f64 {
        let (column, right) = place(&self.alpha_deg, alpha);
        let (row, above) = place(&self.mach, mach);
        let along = |row: &[f64]| {
            let next = (column + 1).min(row.len() - 1);
            row[column] + right * (row[next] - row[column])
        };
        let next = (row + 1).min(self.values.len() - 1);
        let (low, high) = (along(&self.values[row]), along(&self.values[next]));
        low + above * (high - low)
    }
}

/// Range of angles of attack and deflections, deg.
pub(super) const TURN: [f64; 2] = [-180.0, 180.0];

/// Refuses an axis of a table whose values are not finite, are out of their range, or do not
/// increase.
pub(super) fn increasing(name: &str, axis: &[f64], [low, high]: [f64; 2]) -> Result<(), String> {
    if axis.is_empty() || !axis.iter().all(|value| value.is_finite()) {
        return Err(format!("{name} must hold finite values, one at least"));
    }
    if let Some(value) = axis.iter().find(|value| !(low..=high).contains(*value)) {
        let bound = if *value < low { "at least" } else { "at most" };
        let end = if *value < low { low } else { high };
        return Err(format!("{name} holds {value}, which must be {bound} {end}"));
    }
    match axis.windows(2).find(|pair| pair[0] >= pair[1]) {
        Some([before, after, ..]) => {
            Err(format!("{name} must increase, but {after} follows {before}"))
        }
        _ => Ok(()),
    }
}

/// Position of a value between the points of an axis: the point before it, and the share of the way
/// to the next.
pub(super) fn place(axis: &[f64], value: f64) -> (usize, f64) {
    let last = axis.len() - 1;
    let before = axis.partition_point(|point| *point <= value).saturating_sub(1).min(last);
    let next = (before + 1).min(last);
    let length = axis[next] - axis[before];
    let share = if length > 0.0 { ((value - axis[before]) / length).clamp(0.0, 1.0) } else { 0.0 };
    (before, share)
}

impl Coefficient {
    /// Returns the value at an angle of attack (rad) and a Mach number; those of derivatives are
    /// per radian.
    pub fn at(&self, alpha: f64, mach: f64) -> f64 {
        let alpha = alpha.to_degrees();
        let value = match &self.curve {
            Curve::Polynomial(factors) => polynomial(factors, alpha),
            Curve::Table(table) => table.at(alpha, mach),
        };
        if self.per_degree { value.to_degrees() } else { value }
    }

    /// Returns the publication or the derivation from which the numbers come.
    pub fn source(&self) -> &str {
        &self.source
    }

    /// Returns whether the numbers are those of a derivative per degree.
    pub(crate) fn is_per_degree(&self) -> bool {
        self.per_degree
    }

    /// Returns a negative value within the table, or of the polynomial between 0 and 50 degrees,
    /// after its key.
    pub(crate) fn negative(&self) -> Option<(&'static str, f64)> {
        let (key, values): (_, Vec<f64>) = match &self.curve {
            Curve::Polynomial(factors) => {
                let at = |alpha: i32| polynomial(factors, f64::from(alpha));
                ("polynomial", (0..=50).map(at).collect())
            }
            Curve::Table(table) => ("table.values", table.values.concat()),
        };
        values.into_iter().find(|value| *value < 0.0).map(|value| (key, value))
    }

    /// Returns whether the coefficient was left out.
    pub(super) fn is_zero(&self) -> bool {
        self.curve == Curve::default()
    }
}

/// Returns the value of a polynomial with these factors of 1, x, x², ….
pub(super) fn polynomial(factors: &[f64], x: f64) -> f64 {
    let horner = |(last, rest): (&f64, &[f64])| {
        rest.iter().rev().fold(*last, |sum, factor| sum * x + factor)
    };
    factors.split_last().map_or(0.0, horner)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn oracle_tables_are_linear_between_their_points_and_constant_beyond() {
        let text = "source = 'a test of tables'\n[table]\nalpha_deg = [0, 10]\nmach = [2, 4]\nvalues = [[1, 3], [5, 11]]";
        let table: Coefficient = toml::from_str(text).unwrap();
        for (alpha, mach, value) in [
            (0.0, 2.0, 1.0),
            (5.0, 2.0, 2.0),
            (5.0, 3.0, 5.0),
            (10.0, 4.0, 11.0),
            (20.0, 9.0, 11.0),
            (-5.0, 0.0, 1.0),
        ] {
            assert!((table.at(f64::to_radians(alpha), mach) - value).abs() < 1e-12);
        }
    }
}
