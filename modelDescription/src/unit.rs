//! Units of measure as exponents of SI base units, and the display units that engineers read.

use serde::{Deserialize, Serialize};

/// Unit in which another one can be displayed: `display = factor · base + offset` with `offset = 0`
/// throughout.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct DisplayUnit {
    /// Name of the display unit, for example `deg`.
    pub name: String,
    /// Factor from the unit to the display unit, for example 180/π.
    pub factor: f64,
}

/// Unit of measure with a name that importers expect and the exponents of the SI base units.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Unit {
    /// Name of the unit, for example `rad/s`.
    pub name: String,
    /// Exponent of the kilogram in the unit.
    pub kg: i32,
    /// Exponent of the metre in the unit.
    pub m: i32,
    /// Exponent of the second in the unit.
    pub s: i32,
    /// Exponent of the ampere in the unit.
    pub ampere: i32,
    /// Exponent of the kelvin in the unit.
    pub kelvin: i32,
    /// Exponent of the radian in the unit.
    pub rad: i32,
    /// Unit in which the value is displayed, if it is another one.
    pub display: Option<DisplayUnit>,
}

/// Dimension of a named unit: its symbol, and the exponents of kg, m, s, A, K and rad.
const SYMBOLS: [(&str, [i32; 6]); 13] = [
    ("kg", [1, 0, 0, 0, 0, 0]),
    ("m", [0, 1, 0, 0, 0, 0]),
    ("s", [0, 0, 1, 0, 0, 0]),
    ("A", [0, 0, 0, 1, 0, 0]),
    ("K", [0, 0, 0, 0, 1, 0]),
    ("rad", [0, 0, 0, 0, 0, 1]),
    ("Hz", [0, 0, -1, 0, 0, 0]),
    ("N", [1, 1, -2, 0, 0, 0]),
    ("Pa", [1, -1, -2, 0, 0, 0]),
    ("W", [1, 2, -3, 0, 0, 0]),
    ("J", [1, 2, -2, 0, 0, 0]),
    ("T", [1, 0, -2, -1, 0, 0]),
    ("1", [0; 6]),
];

impl Unit {
    /// Returns the unit with this name, a product of symbols with exponents, such as `kg.m2` or
    /// `rad/s2`. A slash stands before a divisor. Angles are displayed in degrees. A unit with an
    /// unknown symbol has no dimension; the check of descriptions refuses it.
    pub fn new(name: &str) -> Self {
        let [kg, m, s, ampere, kelvin, rad] = dimension(name).unwrap_or_default();
        let display = name.strip_prefix("rad").map(|rest| DisplayUnit {
            name: format!("deg{rest}"),
            factor: 180.0 / std::f64::consts::PI,
        });
        Self { name: name.into(), kg, m, s, ampere, kelvin, rad, display }
    }

    /// Returns whether all symbols in the name are known.
    pub fn is_known(&self) -> bool {
        dimension(&self.name).is_some()
    }
}

/// Returns the exponents of kg, m, s, A, K and rad in a unit, if all its symbols are known.
fn dimension(name: &str) -> Option<[i32; 6]> {
    let mut sum = [0; 6];
    let mut rest = name;
    let mut sign = 1;
    loop {
        let end = rest.find(['.', '/']).unwrap_or(rest.len());
        let factor = &rest[..end];
        let digits = factor.find(|letter: char| letter.is_ascii_digit()).filter(|i| *i > 0);
        let (symbol, exponent) = factor.split_at(digits.unwrap_or(factor.len()));
        let exponent = if exponent.is_empty() { 1 } else { exponent.parse::<i32>().ok()? };
        let (_, exponents) = SYMBOLS.iter().find(|(known, _)| *known == symbol)?;
        for (total, each) in sum.iter_mut().zip(exponents) {
            *total += sign * exponent * each;
        }
        if end == rest.len() {
            return Some(sum);
        }
        sign = if rest.as_bytes()[end] == b'/' { -1 } else { 1 };
        rest = &rest[end + 1..];
    }
}
