//! Inputs, outputs and memory of the estimator.

use super::ellipsoid::{Correction, Scatter};
use super::fusion::Fusion;
use super::lowpass;
use nalgebra::{SVector, Vector3};
use serde::{Deserialize, Serialize};
use settings::Choice;

/// The newest sample on the line from the sensors.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Line {
    /// Number of the sample, from 1; 0 before the first. A line without numbers shows 0 throughout.
    pub sample: i32,
    /// Time at which the sample was taken, s.
    pub time: f64,
    /// Readings of gyroscope (rad/s), accelerometer (specific force, m/s²) and magnetometer (T).
    pub readings: [Vector3<f64>; 3],
}

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
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Calibration {
    /// Origin and state of the calibration.
    pub status: CalibrationStatus,
    /// Correction that is in force.
    pub correction: Correction,
    /// Residual of the fit, see [`super::ellipsoid::Fit`].
    pub residual: f64,
    /// Condition number of the fit, see [`super::ellipsoid::Fit`].
    pub condition: f64,
}

/// The estimate at a tick.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Estimate {
    /// Estimated angles Θ, rad.
    pub angles: Vector3<f64>,
    /// Estimated body rates ω with the kinematics of the settings, rad/s.
    pub rates: Vector3<f64>,
    /// Health of the estimate: how far it can be trusted.
    pub health: Health,
    /// Time since the newest sample was taken, s.
    pub age: f64,
    /// Number of samples so far that never arrived.
    pub dropped: i32,
    /// Number of samples so far that were left out as a whole or in part.
    pub rejected: i32,
    /// Bias of the gyroscope, rad/s: the sum of the given one, the one found at rest and the
    /// learned one.
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
