//! Nine-axis fusion by Mahony's complementary filter of the crate `ahrs`. State and bias are kept
//! here.
//!
//! The crate interprets the specific force as the upward direction, in an Earth frame with x to
//! magnetic north and z up.

use ahrs::{Ahrs, Mahony};
use nalgebra::{Matrix3, Quaternion, Rotation3, UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};
use settings::Declared;

/// Gains of the filter.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Declared)]
pub struct Gains {
    /// Proportional gain of the sensor fusion, the rate at which attitude errors decay.
    #[setting(unit = "1/s", min = 0.0, nominal = 1.0)]
    pub proportional: f64,
    /// Integral gain of the sensor fusion, which learns the gyroscope's bias; 0 for no learning.
    #[setting(unit = "1/s2", min = 0.0, nominal = 0.1)]
    pub integral: f64,
}

/// The state that the filter keeps between samples.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Fusion {
    /// Rotation from body axes to north, west, up.
    attitude: UnitQuaternion<f64>,
    /// Bias of the gyroscope, rad/s.
    bias: Vector3<f64>,
    /// Number of samples of which the attitude is a mean, as long as they are few.
    count: f64,
}

/// Returns the matrix that converts north, west, up into north, east, down, and vice versa.
fn flip() -> Matrix3<f64> {
    Matrix3::from_diagonal(&Vector3::new(1.0, -1.0, -1.0))
}

/// Returns the part of the magnetic field that is perpendicular to the specific force; `None`
/// without a force. With this part alone the heading is corrected as fast as the tilt, and the
/// magnetometer cannot tilt the attitude.
fn horizontal(force: &Vector3<f64>, field: &Vector3<f64>) -> Option<Vector3<f64>> {
    let up = force.try_normalize(0.0)?;
    Some(field - up * up.dot(field))
}

/// Returns the rotation to body axes from north, east, down, computed from specific force and
/// magnetic field; `None` if these are zero or parallel. This is the triad of Black, *A passive
/// system for determining the attitude of a satellite*, AIAA Journal 2 (1964).
pub fn triad(force: &Vector3<f64>, field: &Vector3<f64>) -> Option<Rotation3<f64>> {
    let north = horizontal(force, field)?.try_normalize(1e-9 * field.norm())?;
    let down = -force.normalize();
    Some(Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[
        north,
        down.cross(&north),
        down,
    ])))
}

impl Fusion {
    /// Returns the filter at an attitude (body axes from magnetic north, east, down) that counts as
    /// the mean of `count` samples.
    pub fn new(attitude: &Rotation3<f64>, count: f64) -> Self {
        let to_up = Rotation3::from_matrix_unchecked(flip() * attitude.matrix().transpose());
        Self {
            attitude: UnitQuaternion::from_rotation_matrix(&to_up),
            bias: Vector3::zeros(),
            count,
        }
    }

    /// Returns the rotation to body axes from magnetic north, east, down.
    pub fn attitude(&self) -> Rotation3<f64> {
        let from_up = self.attitude.to_rotation_matrix().transpose();
        Rotation3::from_matrix_unchecked(from_up.matrix() * flip())
    }

    /// Returns the learned bias of the gyroscope, rad/s.
    pub fn bias(&self) -> Vector3<f64> {
        self.bias
    }

    /// Returns the filter with another bias (rad/s).
    #[must_use]
    pub fn with_bias(self, bias: Vector3<f64>) -> Self {
        Self { bias, ..self }
    }

    /// Processes one sample of angular rate (rad/s), held over `elapsed` (s). Specific force and
    /// magnetic field, in any unit, are included if they are usable. The first samples have equal
    /// weights, so that the attitude is their mean.
    pub fn step(
        &mut self,
        gains: &Gains,
        elapsed: f64,
        rate: &Vector3<f64>,
        seen: Option<(&Vector3<f64>, &Vector3<f64>)>,
    ) {
        let mean = 1.0 / ((self.count + 1.0) * elapsed);
        let mut filter = Mahony::new(elapsed, mean.max(gains.proportional), 0.0);
        *filter.quat.as_mut_unchecked() = <[f64; 4]>::from(self.attitude.coords).into();
        // The crate compares with the attitude before the turn, so the turn comes first and the
        // correction second.
        filter.update_gyro(&<[f64; 3]>::from(rate - self.bias).into());
        let corrected = seen.is_some_and(|(force, field)| {
            let Some(field) = horizontal(force, field) else { return false };
            let (force, field) = (<[f64; 3]>::from(*force).into(), <[f64; 3]>::from(field).into());
            filter.update(&[0.0; 3].into(), &force, &field).is_ok()
        });
        if corrected {
            self.count += 1.0;
            if mean < gains.proportional {
                self.bias -= Vector3::from(<[f64; 3]>::from(filter.e_int())) * gains.integral;
            }
        }
        let [i, j, k, w] = filter.quat.as_ref().coords.into();
        self.attitude = UnitQuaternion::new_unchecked(Quaternion::new(w, i, j, k));
    }
}
