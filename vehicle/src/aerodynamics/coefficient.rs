//! A coefficient over the angle of attack and the Mach number.

use serde::{Deserialize, Serialize};

/// A coefficient: a polynomial of the angle of attack in degrees, or a table over the angle of
/// attack and the Mach number, linear between its points and constant beyond them.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
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
#[serde(deny_unknown_fields)]
struct Table {
    alpha_deg: Vec<f64>,
    mach: Vec<f64>,
    values: Vec<Vec<f64>>,
}

/// A coefficient as a file gives it.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Given {
    source: String,
    #[serde(default)]
    polynomial: Option<Vec<f64>>,
    #[serde(default)]
    table: Option<Table>,
    #[serde(default)]
    per_degree: bool,
}

impl TryFrom<Given> for Coefficient {
    type Error = String;

    fn try_from(given: Given) -> Result<Self, String> {
        let Given { source, polynomial, table, per_degree } = given;
        let curve = match (polynomial, table) {
            (Some(polynomial), None) => Curve::Polynomial(polynomial),
            (None, Some(table)) => Curve::Table(table.checked()?),
            _ => return Err(format!("{source}: give either 'polynomial' or 'table'")),
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
    fn checked(self) -> Result<Self, String> {
        let increases = |axis: &[f64]| axis.windows(2).all(|pair| pair[0] < pair[1]);
        let is_full = self.values.len() == self.mach.len()
            && self.values.iter().all(|row| row.len() == self.alpha_deg.len());
        if self.alpha_deg.is_empty() || !is_full {
            return Err("a table needs one row per Mach number, one value per angle".into());
        }
        if !(increases(&self.alpha_deg) && increases(&self.mach)) {
            return Err("the angles and Mach numbers of a table must increase".into());
        }
        Ok(self)
    }

    fn at(&self, alpha: f64, mach: f64) -> f64 {
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

/// Position of a value between the points of an axis: the point before it, and the share of the way
/// to the next.
fn place(axis: &[f64], value: f64) -> (usize, f64) {
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

    /// Returns whether the coefficient was left out.
    pub(super) fn is_zero(&self) -> bool {
        self.curve == Curve::default()
    }
}

/// Returns the value of a polynomial with these factors of 1, x, x², ….
pub(super) fn polynomial(factors: &[f64], x: f64) -> f64 {
    factors.iter().rev().fold(0.0, |sum, factor| sum * x + factor)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<Coefficient, toml::de::Error> {
        toml::from_str(text)
    }

    #[test]
    fn oracle_tables_are_linear_between_their_points_and_constant_beyond() {
        let text = "source = 'a test'\n[table]\nalpha_deg = [0, 10]\nmach = [2, 4]\nvalues = [[1, 3], [5, 11]]";
        let table = read(text).unwrap();
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

    #[test]
    fn a_table_that_is_not_full_is_refused() {
        let rows = "source = 'a test'\n[table]\nalpha_deg = [0, 10]\nmach = [2]\nvalues = [[1]]";
        assert!(read(rows).unwrap_err().to_string().contains("one value per angle"));
        let order = "source = 'a test'\n[table]\nalpha_deg = [0, 0]\nmach = [2]\nvalues = [[1, 2]]";
        assert!(read(order).unwrap_err().to_string().contains("must increase"));
        assert!(read("source = 'a test'").unwrap_err().to_string().contains("either"));
    }
}
