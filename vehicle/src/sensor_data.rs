//! Data of the embedded file of sensors: sensor sets and the surrounding fields.

use crate::aerodynamics::FOOT;
use crate::data;
use crate::platform::Surroundings;
use crate::sensors::{Line, PerSensor};
use crate::triad::{Triad, Window};
use nalgebra::{Matrix3, Vector3};
use serde::Deserialize;
use std::sync::LazyLock;

const TEXT: &str = include_str!("../data/sensors.toml");

/// Content of the file of sensors, in SI units and radians.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SensorData {
    /// Gravity and the magnetic field of the Earth.
    pub surroundings: Surroundings,
    /// Sample period and transport delay of a line that drops no samples.
    pub line: Line,
    /// Typical MEMS set of gyroscope, accelerometer and magnetometer.
    pub mems: PerSensor<Triad>,
    /// Sensor set without any errors.
    pub ideal: PerSensor<Triad>,
    /// Grades of inertial sensors.
    grades: [Grade; 3],
}

/// Grade of inertial sensors, whose known errors are corrected.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
struct Grade {
    gyroscope: Inertial,
    accelerometer: Inertial,
}

/// Errors of an inertial sensor, in SI units after its unit.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
struct Inertial {
    unit: Unit,
    instability: f64,
    correlation: f64,
    /// Noise density: random walk of angle or velocity over the square root of time.
    random_walk: RandomWalk,
}

/// Random walk as data sheets give it.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
enum RandomWalk {
    #[serde(rename = "deg_sqrt_h")]
    Angle(f64),
    #[serde(rename = "ft_s_sqrt_h")]
    Velocity(f64),
}

impl Inertial {
    /// Returns the sensor's errors when it is sampled with a period (s).
    fn triad(&self, period: f64) -> Triad {
        let per_root_second = match self.random_walk {
            RandomWalk::Angle(degrees) => degrees.to_radians(),
            RandomWalk::Velocity(feet) => feet * FOOT,
        } / 60.0;
        Triad {
            instability: self.instability * self.unit.factor(),
            correlation: self.correlation,
            noise: per_root_second / period.sqrt(),
            ..Triad::default()
        }
    }
}

impl SensorData {
    /// Returns the errors of gyroscope and accelerometer of a sensor set from
    /// [`NAVIGATION_SENSORS`] on, sampled with a period (s); its magnetometer is without errors.
    pub fn inertial(&self, set: i32, period: f64) -> PerSensor<Triad> {
        let last = self.grades.len() - 1;
        let index = usize::try_from(set - NAVIGATION_SENSORS).unwrap_or(0).min(last);
        let Grade { gyroscope, accelerometer } = &self.grades[index];
        PerSensor([gyroscope.triad(period), accelerometer.triad(period), Triad::default()])
    }
}

/// Number of the first set of inertial sensors: navigation grade. Tactical grade and calibrated
/// MEMS sensors follow.
pub const NAVIGATION_SENSORS: i32 = 3;
/// Number of the last set.
pub const LAST_SENSORS: i32 = 5;

impl SensorData {
    /// Returns the data of the embedded file.
    pub fn embedded() -> Self {
        let file = file();
        Self {
            surroundings: Surroundings {
                gravity: file.surroundings.gravity,
                field: file.surroundings.field_ut * Unit::Microtesla.factor(),
            },
            line: Line {
                period: file.line.period,
                delay: file.line.delay,
                drop_probability: 0.0,
                drop_window: Window { start: 0.0, end: f64::INFINITY },
            },
            mems: file.mems.triads(),
            ideal: file.ideal.triads(),
            grades: [file.navigation, file.tactical, file.calibrated],
        }
    }
}

fn file() -> &'static File {
    static READ: LazyLock<File> = LazyLock::new(|| data::embedded("sensors.toml", TEXT));
    &READ
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    surroundings: Fields,
    line: Times,
    mems: Set,
    ideal: Set,
    navigation: Grade,
    tactical: Grade,
    calibrated: Grade,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Fields {
    gravity: f64,
    #[serde(rename = "field_uT")]
    field_ut: Vector3<f64>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Times {
    period: f64,
    delay: f64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Set {
    gyroscope: Sensor,
    accelerometer: Sensor,
    magnetometer: Sensor,
}

impl Set {
    fn triads(&self) -> PerSensor<Triad> {
        PerSensor([&self.gyroscope, &self.accelerometer, &self.magnetometer].map(Sensor::triad))
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
enum Unit {
    #[serde(rename = "deg/s")]
    DegreePerSecond,
    #[serde(rename = "deg/h")]
    DegreePerHour,
    #[serde(rename = "g")]
    StandardGravity,
    #[serde(rename = "uT")]
    Microtesla,
}

impl Unit {
    /// Factor from this unit to the SI unit.
    fn factor(self) -> f64 {
        match self {
            Self::DegreePerSecond => 1f64.to_radians(),
            Self::DegreePerHour => 1f64.to_radians() / 3600.0,
            Self::StandardGravity => 9.80665,
            Self::Microtesla => 1e-6,
        }
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Sensor {
    unit: Unit,
    /// Matrix of scale and misalignment, by rows.
    matrix: Option<[[f64; 3]; 3]>,
    #[serde(default)]
    bias: Vector3<f64>,
    #[serde(default)]
    noise: f64,
    #[serde(default)]
    bandwidth: f64,
    #[serde(default)]
    range: f64,
    #[serde(default)]
    resolution: f64,
}

impl Sensor {
    fn triad(&self) -> Triad {
        let unit = self.unit.factor();
        Triad {
            matrix: self
                .matrix
                .map_or_else(Matrix3::identity, |rows| Matrix3::from(rows).transpose()),
            bias: self.bias * unit,
            // Data sheets give none over the length of a flight.
            drift: Vector3::zeros(),
            instability: 0.0,
            correlation: 0.0,
            noise: self.noise * unit,
            bandwidth: self.bandwidth,
            range: self.range * unit,
            resolution: self.resolution * unit,
            freeze: Window::default(),
        }
    }
}
