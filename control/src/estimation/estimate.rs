//! Inputs, outputs and memory of the estimator.

use super::ellipsoid::{Correction, Scatter};
use super::fusion::Fusion;
use super::lowpass;
use nalgebra::{SVector, Vector3};
use serde::{Deserialize, Serialize};
use settings::{Choice, Declared};
use vehicle::axes::{ANGLES, LETTERS, RATES};

/// The newest sample on the line from the sensors.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Declared)]
pub struct Line {
    /// Readings of gyroscope, accelerometer and magnetometer.
    #[setting(name = "measured", text = "{}", each = READINGS, columns = LETTERS)]
    #[setting(units = ["rad/s", "m/s2", "T"], nominals = [0.05, 10.0, 5e-5])]
    pub readings: [Vector3<f64>; 3],
    /// Time at which the newest sample was taken.
    #[setting(name = "measured.time", unit = "s", nominal = 1.0)]
    pub time: f64,
    /// Number of the newest sample, counted from 1; 0 before the first sample, or always if samples
    /// are not counted.
    #[setting(name = "measured.sample", min = 0)]
    pub sample: i32,
}

const READINGS: [(&str, &str); 3] = [
    (".gyroscope", "Angular rate about {}, measured by the gyroscope"),
    (".accelerometer", "Specific force along {}, measured by the accelerometer"),
    (".magnetometer", "Magnetic field along {}, measured by the magnetometer"),
];

/// Health of the estimate: how far it can be trusted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Choice)]
#[setting(name = "EstimatorHealth")]
pub enum Health {
    /// No sample has arrived yet.
    #[default]
    Waiting,
    /// The estimate uses a current sample of all sensors.
    Ok,
    /// a sample is missing, and the last rate is held.
    Bridging,
    /// a sensor repeats its value and is ignored.
    Frozen,
    /// No usable sample has arrived for longer than lost.after.
    Lost,
    /// Readings for the calibration are collected.
    Calibrating,
    /// The fit of the calibration was rejected.
    Uncalibrated,
    /// a reading of the newest sample is implausible and is ignored.
    #[setting(name = "sampleRejected")]
    Rejected,
}

/// Source of the magnetometer's calibration in force.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Choice)]
pub enum CalibrationStatus {
    /// Parameters magnetometer.matrix and magnetometer.bias.
    #[default]
    Given,
    /// Parameters, while readings for a fit are collected.
    Collecting,
    /// Fitted ellipsoid.
    Fitted,
    /// Parameters, because the readings do not determine an ellipsoid.
    Refused,
}

/// The calibration of the magnetometer with its origin.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Declared)]
pub struct Calibration {
    #[allow(missing_docs)] // Its type says what it is.
    pub status: CalibrationStatus,
    /// Correction that is in force.
    #[setting(skip)]
    pub correction: Correction,
    /// Root mean square distance of the readings from the fitted ellipsoid, relative to its size.
    pub residual: f64,
    /// Condition number of the ellipsoid fit; 16 for uniform coverage, above 1000 rejected.
    pub condition: f64,
}

/// The estimate at a tick.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Declared)]
pub struct Estimate {
    /// Estimated {}.
    #[setting(name = "attitude", each = ANGLES, unit = "rad", nominal = 0.1)]
    pub angles: Vector3<f64>,
    /// Estimated body {}.
    ///
    /// The kinematics are those of the settings.
    #[setting(name = "rate", each = RATES, unit = "rad/s", nominal = 0.05)]
    pub rates: Vector3<f64>,
    /// Health of the estimate: how far it can be trusted.
    pub health: Health,
    /// Time since the newest sample was taken.
    #[setting(unit = "s", nominal = 0.01)]
    pub age: f64,
    /// Number of samples so far that never arrived.
    #[setting(name = "droppedSamples")]
    pub dropped: i32,
    /// Number of samples so far that were ignored in whole or in part because a reading or the time
    /// was implausible.
    #[setting(name = "rejectedSamples")]
    pub rejected: i32,
    /// Estimated gyroscope bias about {}: sum of the given bias, the one measured at rest and the
    /// learned one.
    #[setting(name = "estimatedBias", each = LETTERS, unit = "rad/s", nominal = 0.01)]
    pub gyroscope_bias: Vector3<f64>,
}

pub(super) type Nine = SVector<f64, 9>;

/// The state that the estimator carries from tick to tick.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Memory {
    /// Estimate at the last tick.
    pub estimate: Estimate,
    /// Calibration of the magnetometer.
    pub calibration: Calibration,
    pub(super) scatter: Scatter,
    pub(super) running: Option<Running>,
    /// Number of the last sample that was left out as a whole; 0 for none.
    pub(super) refused: i32,
}

/// State from the first sample on.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Running {
    /// Time at which the first sample was taken, s.
    pub(super) start: f64,
    /// The last sample, with the readings that were last accepted.
    pub(super) last: Line,
    /// Readings of the last sample as they arrived.
    pub(super) raw: [Vector3<f64>; 3],
    /// Whether a reading of the last sample was left out.
    pub(super) rejected: bool,
    /// Whether a second sample has confirmed the first.
    pub(super) confirmed: bool,
    /// Time at which the last sample arrived, s.
    pub(super) arrived: f64,
    pub(super) filter: lowpass::State<9>,
    /// Readings after the low-pass filter.
    pub(super) filtered: Nine,
    pub(super) fusion: Fusion,
    /// Sum and number of the rates at rest.
    pub(super) rest: (Vector3<f64>, f64),
    /// Number of equal readings in a row, for each sensor.
    pub(super) equal: [u32; 3],
    /// Time at which the last sample with all sensors alive was taken, s.
    pub(super) alive: f64,
}

impl Running {
    /// Returns the bias found at rest, rad/s.
    pub(super) fn rest_bias(&self) -> Vector3<f64> {
        self.rest.0 / self.rest.1.max(1.0)
    }
}
