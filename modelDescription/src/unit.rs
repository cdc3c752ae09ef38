//! Physical units as SI exponents, and the display units engineers read.

use serde::{Deserialize, Serialize};

/// A unit another one can be shown in: `display = factor · base + offset` with `offset = 0` throughout.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct DisplayUnit {
    /// Name, for example `deg`.
    pub name: String,
    /// Multiplier from the unit to the display unit, for example 180/π.
    pub factor: f64,
}

/// A unit named as FMI tools expect, with exponents of the SI base units.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Unit {
    /// Name, for example `rad/s`.
    pub name: String,
    /// Exponent of the kilogram.
    pub kg: i32,
    /// Exponent of the metre.
    pub m: i32,
    /// Exponent of the second.
    pub s: i32,
    /// Exponent of the ampere.
    pub ampere: i32,
    /// Exponent of the kelvin.
    pub kelvin: i32,
    /// Exponent of the radian.
    pub rad: i32,
    /// What the value is shown in, if not in the unit itself.
    pub display: Option<DisplayUnit>,
}

fn unit(name: &str, [kg, m, s, rad]: [i32; 4], display: Option<&str>) -> Unit {
    let display = display.map(|name| DisplayUnit { name: name.into(), factor: 180.0 / std::f64::consts::PI });
    Unit { name: name.into(), kg, m, s, ampere: 0, kelvin: 0, rad, display }
}

/// Angle, shown in degrees.
pub fn angle() -> Unit {
    unit("rad", [0, 0, 0, 1], Some("deg"))
}
/// Angular rate, shown in degrees per second.
pub fn angular_rate() -> Unit {
    unit("rad/s", [0, 0, -1, 1], Some("deg/s"))
}
/// Angular acceleration, shown in degrees per second squared.
pub fn angular_acceleration() -> Unit {
    unit("rad/s2", [0, 0, -2, 1], Some("deg/s2"))
}
/// Moment of force.
pub fn moment() -> Unit {
    unit("N.m", [1, 2, -2, 0], None)
}
/// Moment of inertia.
pub fn inertia() -> Unit {
    unit("kg.m2", [1, 2, 0, 0], None)
}
/// Length.
pub fn length() -> Unit {
    unit("m", [0, 1, 0, 0], None)
}
/// Acceleration, specific force.
pub fn acceleration() -> Unit {
    unit("m/s2", [0, 1, -2, 0], None)
}
/// Magnetic flux density.
pub fn flux_density() -> Unit {
    Unit { ampere: -1, ..unit("T", [1, 0, -2, 0], None) }
}
/// Time.
pub fn time() -> Unit {
    unit("s", [0, 0, 1, 0], None)
}
/// Frequency in cycles per second.
pub fn frequency() -> Unit {
    unit("Hz", [0, 0, -1, 0], None)
}
/// Gain from an angle to its second derivative.
pub fn gain_angle() -> Unit {
    unit("1/s2", [0, 0, -2, 0], None)
}
/// Gain from a rate to its derivative.
pub fn gain_rate() -> Unit {
    unit("1/s", [0, 0, -1, 0], None)
}
/// Pressure.
pub fn pressure() -> Unit {
    unit("Pa", [1, -1, -2, 0], None)
}
/// Moment of force by angle.
pub fn moment_by_angle() -> Unit {
    unit("N.m/rad", [1, 2, -2, -1], None)
}
