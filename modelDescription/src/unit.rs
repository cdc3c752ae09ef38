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

#[inline(never)]
fn unit(name: &str, [kg, m, s, rad]: [i32; 4], display: Option<&str>) -> Unit {
    let display =
        display.map(|name| DisplayUnit { name: name.into(), factor: 180.0 / std::f64::consts::PI });
    Unit { name: name.into(), kg, m, s, ampere: 0, kelvin: 0, rad, display }
}

/// Unit of an angle, rad, displayed in degrees.
pub fn angle() -> Unit {
    unit("rad", [0, 0, 0, 1], Some("deg"))
}
/// Unit of an angular rate, rad/s, displayed in degrees per second.
pub fn angular_rate() -> Unit {
    unit("rad/s", [0, 0, -1, 1], Some("deg/s"))
}
/// Unit of an angular acceleration, rad/s², displayed in degrees per second squared.
pub fn angular_acceleration() -> Unit {
    unit("rad/s2", [0, 0, -2, 1], Some("deg/s2"))
}
/// Unit of a moment of force, N m.
pub fn moment() -> Unit {
    unit("N.m", [1, 2, -2, 0], None)
}
/// Unit of a moment of inertia, kg m².
pub fn inertia() -> Unit {
    unit("kg.m2", [1, 2, 0, 0], None)
}
/// Unit of a length, m.
pub fn length() -> Unit {
    unit("m", [0, 1, 0, 0], None)
}
/// Unit of an acceleration or specific force, m/s².
pub fn acceleration() -> Unit {
    unit("m/s2", [0, 1, -2, 0], None)
}
/// Unit of the rate of an acceleration, m/s³.
pub fn acceleration_rate() -> Unit {
    unit("m/s3", [0, 1, -3, 0], None)
}
/// Unit of a magnetic flux density, T.
pub fn flux_density() -> Unit {
    Unit { ampere: -1, ..unit("T", [1, 0, -2, 0], None) }
}
/// Unit of the rate of a magnetic flux density, T/s.
pub fn flux_density_rate() -> Unit {
    Unit { ampere: -1, ..unit("T/s", [1, 0, -3, 0], None) }
}
/// Unit of a time, s.
pub fn time() -> Unit {
    unit("s", [0, 0, 1, 0], None)
}
/// Unit of a frequency in cycles per second, Hz.
pub fn frequency() -> Unit {
    unit("Hz", [0, 0, -1, 0], None)
}
/// Unit of a gain from an angle to its second derivative, 1/s².
pub fn gain_angle() -> Unit {
    unit("1/s2", [0, 0, -2, 0], None)
}
/// Unit of a gain from a rate to its derivative, 1/s.
pub fn gain_rate() -> Unit {
    unit("1/s", [0, 0, -1, 0], None)
}
/// Unit of a pressure, Pa.
pub fn pressure() -> Unit {
    unit("Pa", [1, -1, -2, 0], None)
}
/// Unit of a moment of force per angle, N m/rad.
pub fn moment_by_angle() -> Unit {
    unit("N.m/rad", [1, 2, -2, -1], None)
}
