//! Settings of the estimator, with ours from `data/estimator.toml`.

use super::ellipsoid::Correction;
use super::fusion::Gains;
use ::settings::{Choice, Declared};
use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};
use std::sync::LazyLock;
use vehicle::axes::ANGLES;
use vehicle::data::{self, Tables};
use vehicle::kinematics::Kinematics;
use vehicle::math::atan2;
use vehicle::scenario::Scenario;
use vehicle::sensor_data::SensorData;
use vehicle::sensors::PerSensor;

/// Source of the magnetometer's calibration.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Choice)]
pub enum CalibrationMode {
    /// Parameters magnetometer.matrix and magnetometer.bias.
    #[default]
    Given,
    /// Ellipsoid fitted to the readings of the first calibration.duration.
    Fit,
}

/// Source of the initial attitude.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Choice)]
pub enum Alignment {
    /// First samples.
    #[default]
    Measured,
    /// initial.alpha, initial.beta and initial.sigma, the attitude in which the platform was
    /// placed.
    Given,
}

/// All settings of the estimator. Units are SI, angles in rad.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Declared)]
pub struct Settings {
    #[allow(missing_docs)] // Its type says what it is.
    pub alignment: Alignment,
    /// Angle before the first sample; with alignment = given also at the first sample.
    #[setting(each = ANGLES, unit = "rad", nominal = 0.1)]
    pub initial: Vector3<f64>,
    #[allow(missing_docs)]
    pub kinematics: Kinematics,
    /// Direction of the horizontal magnetic field relative to the velocity, positive to the east.
    #[setting(name = "field.declination", unit = "rad", nominal = 0.1, file)]
    pub declination: f64,
    /// Time from the first sample during which the platform rests and the gyroscope's bias is
    /// measured; 0 for none.
    #[setting(name = "rest.duration", unit = "s", min = 0.0, nominal = 1.0, file)]
    pub rest_duration: f64,
    /// Sampling period of the estimator and of the sensors.
    #[setting(unit = "s", min = 1e-4, max = 10.0, nominal = 0.01)]
    pub period: f64,
    /// Cut-off frequency of the low-pass filter on all readings; 0 for no filter.
    #[setting(name = "filter.cutoff", unit = "Hz", min = 0.0, nominal = 10.0, file)]
    pub cutoff: f64,
    /// Whether the estimate is predicted forward over the delays of sensors, transmission and
    /// filter.
    pub prediction: bool,
    /// Delay of the sensors' filters at low frequencies.
    #[setting(name = "sensor.delay", unit = "s", min = 0.0, nominal = 0.01)]
    #[setting(used_with = "sensor.set = 2")]
    pub sensor_delay: f64,
    /// Gains of the nine-axis fusion.
    #[setting(name = "fusion", file)]
    pub gains: Gains,
    /// Time without a usable sample after which the attitude counts as lost.
    #[setting(name = "lost.after", unit = "s", above = 0.0, nominal = 0.5, file)]
    pub lost_after: f64,
    /// Number of equal readings in a row from which a sensor counts as frozen; 0 for never, as
    /// needed for sensors without noise.
    #[setting(name = "frozen.samples", min = 0, file)]
    pub frozen_samples: u32,
    /// Gates for the readings.
    #[setting(name = "", file)]
    pub gates: PerSensor<Gate>,
    /// Sensor set, the same as in the plant: 0 and 1 are sensors without errors; 2 uses
    /// sensor.delay and the correction matrices and biases, by default those of the MEMS set.
    #[setting(name = "sensor.set", min = 0, max = MEMS_SENSORS)]
    pub sensor_set: i32,
    #[allow(missing_docs)]
    #[setting(name = "calibration.mode", file)]
    pub calibration: CalibrationMode,
    /// Time during which readings are collected for the fit.
    #[setting(name = "calibration.duration", unit = "s", above = 0.0, nominal = 10.0)]
    #[setting(used_with = "calibration.mode = fit")]
    #[setting(file)]
    pub calibration_duration: f64,
    /// Corrections of the readings.
    #[setting(name = "", used_with = "sensor.set = 2", file)]
    pub corrections: PerSensor<Correction>,
}

/// Value of `sensor_set` for sensors with errors.
pub const MEMS_SENSORS: i32 = 2;

/// Condition for accepting the readings of a sensor. Readings outside the sensor's range, and
/// changes that no rotation of the vehicle can cause, are left out.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Declared)]
pub struct Gate {
    /// Largest plausible reading along an axis; a larger one is ignored.
    #[setting(part, above = 0.0, max = LARGEST_RANGE)]
    pub range: f64,
    /// Largest plausible change of the reading between two samples; a reading beyond it is ignored
    /// until the next one confirms it.
    #[setting(part, above = 0.0, max = LARGEST_RANGE)]
    pub jump: f64,
}

/// Largest range that can be set; squares and products of readings within it are far from overflow.
pub const LARGEST_RANGE: f64 = 1e9;

impl Gate {
    /// Relative excess over the range that is tolerated, as the rounding of a converter may exceed
    /// it by part of a step.
    const ROUNDING: f64 = 1e-3;

    pub(super) fn shows(&self, reading: &Vector3<f64>) -> bool {
        reading.iter().all(|value| value.abs() <= self.range * (1.0 + Self::ROUNDING))
    }

    pub(super) fn holds(&self, reading: &Vector3<f64>, before: &Vector3<f64>) -> bool {
        (reading - before).norm() <= self.jump
    }
}

static FILE: LazyLock<Tables> =
    LazyLock::new(|| Tables::new("estimator.toml", include_str!("../../data/estimator.toml")));

impl Settings {
    /// Returns the settings of `data/estimator.toml`, for the start of Chai 2022 and sensors
    /// without errors in the field of the vehicle's data.
    pub fn ours() -> Self {
        let SensorData { surroundings, mems, .. } = SensorData::embedded();
        let field = surroundings.field;
        let mut settings = Self {
            declination: atan2(field.y, field.x),
            initial: Scenario::crmpc2022().initial_angles,
            gates: PerSensor(mems.map(|triad| Gate { range: triad.range, jump: 0.0 })),
            ..Self::default()
        };
        FILE.set("settings", &mut settings);
        settings
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct CalibrationFile {
    gyroscope: CorrectionFile,
    accelerometer: CorrectionFile,
    magnetometer: CorrectionFile,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct CorrectionFile {
    matrix: [[f64; 3]; 3],
    bias: Vector3<f64>,
}

/// Returns the corrections of gyroscope, accelerometer and magnetometer of the MEMS set, from
/// `data/sensor-calibration.toml`.
pub fn mems_corrections() -> PerSensor<Correction> {
    static READ: LazyLock<CalibrationFile> = LazyLock::new(|| {
        data::embedded(
            "sensor-calibration.toml",
            include_str!("../../data/sensor-calibration.toml"),
        )
    });
    PerSensor(
        [&READ.gyroscope, &READ.accelerometer, &READ.magnetometer].map(|each| Correction {
            matrix: Matrix3::from(each.matrix).transpose(),
            bias: each.bias,
        }),
    )
}
