//! Settings of the guidance, with ours from `data/guidance.toml`.

use ::settings::{Declared, Invalid};
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;
use std::sync::LazyLock;
use vehicle::data::Tables;
use vehicle::translation::Planet;

/// All settings of the guidance.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Declared)]
pub struct Settings {
    #[allow(missing_docs)] // Its type says what it is.
    pub target: Target,
    #[allow(missing_docs)]
    pub initial: Initial,
    #[allow(missing_docs)]
    #[setting(file)]
    pub bank: Bank,
    #[allow(missing_docs)]
    #[setting(file)]
    pub alpha: Alpha,
    #[allow(missing_docs)]
    #[setting(file)]
    pub reversal: Reversal,
    #[allow(missing_docs)]
    #[setting(file)]
    pub shaping: Shaping,
    #[allow(missing_docs)]
    #[setting(file)]
    pub damping: Damping,
    #[allow(missing_docs)]
    pub limit: Limit,
    #[allow(missing_docs)]
    #[setting(file)]
    pub filter: Filter,
    #[allow(missing_docs)]
    pub planet: Ellipsoid,
}

/// Where the flight is to end.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Declared)]
pub struct Target {
    /// Latitude of the runway point.
    #[setting(unit = "rad", min = -1.5, max = 1.5, nominal = 1.0)]
    pub latitude: f64,
    /// Longitude of the runway point.
    #[setting(unit = "rad", min = -7.0, max = 7.0, nominal = 1.0)]
    pub longitude: f64,
    /// Distance to the runway point at which the flight is to end.
    #[setting(unit = "m", min = 0.0, nominal = 1e5)]
    pub range: f64,
    /// Largest difference from target.range with which the flight still ends at the target.
    #[setting(unit = "m", above = 0.0, nominal = 1e3)]
    pub tolerance: f64,
    /// Altitude at which the flight is to end.
    #[setting(unit = "m", min = 0.0, nominal = 1e4, file)]
    pub altitude: f64,
    /// Speed at which the flight is to end.
    #[setting(unit = "m/s", above = 0.0, nominal = 1e3, file)]
    pub speed: f64,
}

/// Where the reference begins.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Declared)]
pub struct Initial {
    /// Angle of attack at which the reference begins, to be that of the vehicle.
    #[setting(unit = "rad", min = -7.0, max = 7.0, nominal = 0.1)]
    pub alpha: f64,
    /// Bank angle at which the reference begins, to be that of the vehicle.
    #[setting(unit = "rad", min = -7.0, max = 7.0, nominal = 1.0)]
    pub sigma: f64,
}

/// Magnitude of the bank angle.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Declared)]
pub struct Bank {
    /// Bank angle planned for the end of the flight.
    #[setting(name = "final", unit = "rad", min = 0.0, max = 1.5, nominal = 0.1)]
    pub last: f64,
    /// Largest bank angle.
    #[setting(unit = "rad", above = 0.0, max = 3.0, nominal = 1.0)]
    pub largest: f64,
}

/// Most points of the schedule of the angle of attack.
const POINTS: usize = 6;

/// Angle of attack over speed: linear between points, and constant beyond the first and the last.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Declared)]
pub struct Alpha {
    /// Number of points of the schedule of the angle of attack that are used.
    #[setting(min = 1, max = POINTS)]
    pub points: usize,
    /// Points of the schedule, in the order of their speeds.
    #[setting(name = "", by_column, used_with = "alpha.points >= {#}")]
    pub schedule: [Point; POINTS],
    /// Largest change of the first angle by which the flight ends at the target's altitude although
    /// its lift differs from the predicted one.
    #[setting(unit = "rad", min = 0.0, max = 0.5, nominal = 0.1)]
    pub adjustment: f64,
}

/// One point of the schedule of the angle of attack.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Declared)]
pub struct Point {
    /// Speed at a point of the schedule (point {#}).
    #[setting(unit = "m/s", min = 0.0, nominal = 1e3)]
    pub speed: f64,
    /// Angle of attack at this speed (point {#}).
    #[setting(unit = "rad", min = -PI, max = PI, nominal = 0.1)]
    pub angle: f64,
}

/// Dead band of the heading, beyond which the bank is reversed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Declared)]
pub struct Reversal {
    /// Heading error at high speed beyond which the bank is reversed.
    #[setting(unit = "rad", above = 0.0, max = 1.5, nominal = 0.1)]
    pub high: f64,
    /// Heading error at low speed beyond which the bank is reversed.
    #[setting(unit = "rad", above = 0.0, max = 1.5, nominal = 0.1)]
    pub low: f64,
    /// Speed above which the heading error may be reversal.high.
    #[setting(unit = "m/s", min = 0.0, nominal = 1e3)]
    pub upper_speed: f64,
    /// Speed below which the heading error may be reversal.low.
    #[setting(unit = "m/s", min = 0.0, nominal = 1e3)]
    pub lower_speed: f64,
    /// Least time between two reversals.
    #[setting(unit = "s", min = 0.0, nominal = 10.0)]
    pub interval: f64,
}

/// Limits within which the reference follows the commands.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Declared)]
pub struct Shaping {
    /// Largest rate of the reference of the bank angle.
    #[setting(unit = "rad/s", above = 0.0, nominal = 0.1)]
    pub bank_rate: f64,
    /// Largest acceleration of the reference of the bank angle.
    #[setting(unit = "rad/s2", above = 0.0, nominal = 0.01)]
    pub bank_acceleration: f64,
    /// Largest rate of the reference of the angle of attack.
    #[setting(unit = "rad/s", above = 0.0, nominal = 0.1)]
    pub alpha_rate: f64,
    /// Largest acceleration of the reference of the angle of attack.
    #[setting(unit = "rad/s2", above = 0.0, nominal = 0.01)]
    pub alpha_acceleration: f64,
}

/// Damping of the oscillation about the equilibrium glide.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Declared)]
pub struct Damping {
    /// Change of the cosine of the bank angle with the altitude rate; 0 leaves it out.
    #[setting(unit = "s/m", min = 0.0, nominal = 1e-3)]
    pub gain: f64,
    /// Drag per mass below which the bank angle is changed neither for damping nor for a limit.
    #[setting(unit = "m/s2", min = 0.0, nominal = 1.0)]
    pub drag: f64,
}

/// Limits that the bank angle keeps.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Declared)]
pub struct Limit {
    /// Largest heat flux into the leading edge.
    #[setting(unit = "W/m2", above = 0.0, nominal = 1e5)]
    pub heat_flux: f64,
    /// Largest load, in 9.80665 m/s2.
    #[setting(above = 0.0, nominal = 1.0)]
    pub load: f64,
    /// Largest dynamic pressure.
    #[setting(unit = "Pa", above = 0.0, nominal = 1e4)]
    pub pressure: f64,
    /// Share of each limit that is kept in reserve.
    #[setting(min = 0.0, max = 0.5, nominal = 0.1, file)]
    pub margin: f64,
    /// Time constant with which a limit is approached.
    #[setting(unit = "s", above = 0.0, nominal = 10.0, file)]
    pub time: f64,
    /// Change of the cosine of the bank angle with the altitude rate at a limit.
    #[setting(unit = "s/m", min = 0.0, nominal = 1e-2, file)]
    pub gain: f64,
}

impl Limit {
    /// Returns the limits of heat flux, load and dynamic pressure.
    pub(super) fn all(&self) -> [f64; 3] {
        [self.heat_flux, self.load, self.pressure]
    }
}

/// Filters of the measured lift and drag.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Declared)]
pub struct Filter {
    /// Time constant of the ratios of measured to predicted lift and drag.
    #[setting(unit = "s", above = 0.0, nominal = 10.0)]
    pub time: f64,
    /// Drag per mass below which these ratios are not updated.
    #[setting(unit = "m/s2", min = 0.0, nominal = 1.0)]
    pub drag: f64,
}

/// The planet as the guidance knows it: an ellipsoid that rotates, with the gravity of a sphere.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Declared)]
pub struct Ellipsoid {
    /// Radius of the planet at its equator.
    #[setting(unit = "m", min = 1e3, nominal = 1e6)]
    pub radius: f64,
    /// Flattening of the ellipsoid from which altitudes are counted; 0 for a sphere.
    #[setting(min = 0.0, max = 0.1, nominal = 1e-3)]
    pub flattening: f64,
    /// Gravitational parameter of the planet.
    #[setting(unit = "m3/s2", min = 0.0, nominal = 1e14)]
    pub gravitation: f64,
    /// Angular rate of the planet's rotation.
    #[setting(unit = "rad/s", min = 0.0, max = 1.0, nominal = 1e-4)]
    pub rate: f64,
}

impl Ellipsoid {
    /// Returns the planet.
    pub(super) fn planet(&self) -> Planet {
        let Self { radius, flattening, gravitation, rate } = *self;
        Planet { radius, flattening, gravitation, oblateness: 0.0, rate }
    }
}

static FILE: LazyLock<Tables> =
    LazyLock::new(|| Tables::new("guidance.toml", include_str!("../../data/guidance.toml")));

impl Default for Settings {
    /// Returns the settings of `data/guidance.toml`.
    fn default() -> Self {
        static READ: LazyLock<Settings> = LazyLock::new(|| {
            let Planet { radius, flattening, gravitation, rate, .. } = Planet::EARTH;
            let mut settings = Settings {
                target: Target::default(),
                initial: Initial::default(),
                bank: Bank::default(),
                alpha: Alpha::default(),
                reversal: Reversal::default(),
                shaping: Shaping::default(),
                damping: Damping::default(),
                limit: Limit::default(),
                filter: Filter::default(),
                planet: Ellipsoid { radius, flattening, gravitation, rate },
            };
            FILE.set("settings", &mut settings);
            settings
        });
        *READ
    }
}

/// Returns a value that is `low` up to the lower speed, `high` from the upper speed on, and linear
/// in between.
pub(super) fn over_speed(speed: f64, [lower, upper]: [f64; 2], [low, high]: [f64; 2]) -> f64 {
    let share = if upper > lower { (speed - lower) / (upper - lower) } else { 1.0 };
    low + share.clamp(0.0, 1.0) * (high - low)
}

impl Alpha {
    /// Returns the angle of attack of the schedule (rad) at a speed (m/s).
    pub fn at(&self, speed: f64) -> f64 {
        let [lower, upper] = self.about(speed);
        over_speed(speed, [lower.speed, upper.speed], [lower.angle, upper.angle])
    }

    /// Returns the derivative of the schedule over speed, rad per m/s.
    pub(super) fn slope(&self, speed: f64) -> f64 {
        let [lower, upper] = self.about(speed);
        let is_between = speed > lower.speed && speed < upper.speed;
        let slope = (upper.angle - lower.angle) / (upper.speed - lower.speed);
        if is_between { slope } else { 0.0 }
    }

    /// Returns the points about a speed (m/s), or the two that are nearest.
    fn about(&self, speed: f64) -> [Point; 2] {
        let used = &self.schedule[..self.points.clamp(1, POINTS)];
        let upper =
            used.partition_point(|point| point.speed < speed).clamp(1, used.len().max(2) - 1);
        [used[upper - 1], used[upper.min(used.len() - 1)]]
    }

    /// Refuses points whose speeds do not increase.
    pub(super) fn check(&self) -> Result<(), Invalid> {
        let used = &self.schedule[..self.points];
        let fault = (1..used.len()).find(|&i| used[i].speed <= used[i - 1].speed);
        fault.map_or(Ok(()), |i| {
            Err(Invalid {
                name: format!("alpha.speed[{}]", i + 1),
                value: used[i].speed,
                problem: format!("must exceed alpha.speed[{i}]"),
            })
        })
    }
}

impl Reversal {
    /// Returns the largest heading error (rad) at a speed (m/s).
    pub fn at(&self, speed: f64) -> f64 {
        over_speed(speed, [self.lower_speed, self.upper_speed], [self.low, self.high])
    }
}
