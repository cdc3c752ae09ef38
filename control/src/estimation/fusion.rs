//! Nine-axis fusion: Mahony's complementary filter, of the crate `ahrs`; state and bias are kept here.
//!
//! The crate takes the specific force for the direction up and an Earth frame with x to magnetic north and z up.

use ahrs::{Ahrs, Mahony};
use nalgebra::{Matrix3, Quaternion, Rotation3, UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};

/// Gains of the filter.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Gains {
    /// Proportional, 1/s: the error of attitude falls with this rate.
    pub proportional: f64,
    /// Integral, 1/s²: the gyroscope's bias is learned with it.
    pub integral: f64,
}

/// What the filter keeps between samples.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Fusion {
    /// Body to north-west-up.
    attitude: UnitQuaternion<f64>,
    /// Of the gyroscope, rad/s.
    bias: Vector3<f64>,
    /// Samples that the attitude is a mean of, as long as they are few.
    count: f64,
}

/// North-west-up and north-east-down, either from the other.
fn flip() -> Matrix3<f64> {
    Matrix3::from_diagonal(&Vector3::new(1.0, -1.0, -1.0))
}

/// The part of the magnetic field that is perpendicular to the specific force. With it the heading is corrected as fast as the
/// tilt, and the magnetometer cannot tilt the attitude. `None` without a force.
fn horizontal(force: &Vector3<f64>, field: &Vector3<f64>) -> Option<Vector3<f64>> {
    let up = force.try_normalize(0.0)?;
    Some(field - up * up.dot(field))
}

/// Body axes from north, east, down, out of specific force and magnetic field; `None` if they are zero or parallel. The triad of
/// Black, *A passive system for determining the attitude of a satellite*, AIAA Journal 2 (1964).
pub fn triad(force: &Vector3<f64>, field: &Vector3<f64>) -> Option<Rotation3<f64>> {
    let north = horizontal(force, field)?.try_normalize(1e-9 * field.norm())?;
    let down = -force.normalize();
    Some(Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[north, down.cross(&north), down])))
}

impl Fusion {
    /// At an attitude (body axes from magnetic north, east, down) that stands for `count` samples.
    pub fn new(attitude: &Rotation3<f64>, count: f64) -> Self {
        let to_up = Rotation3::from_matrix_unchecked(flip() * attitude.matrix().transpose());
        Self { attitude: UnitQuaternion::from_rotation_matrix(&to_up), bias: Vector3::zeros(), count }
    }

    /// Body axes from magnetic north, east, down.
    pub fn attitude(&self) -> Rotation3<f64> {
        let from_up = self.attitude.to_rotation_matrix().transpose();
        Rotation3::from_matrix_unchecked(from_up.matrix() * flip())
    }

    /// The gyroscope's bias that was learned, rad/s.
    pub fn bias(&self) -> Vector3<f64> {
        self.bias
    }

    /// The same attitude with another bias (rad/s).
    #[must_use]
    pub fn with_bias(self, bias: Vector3<f64>) -> Self {
        Self { bias, ..self }
    }

    /// One sample of angular rate (rad/s), held over `elapsed` (s), with specific force and magnetic field of any unit if they can
    /// be used. The first samples count alike, so that the attitude is their mean.
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
        // The crate compares with the attitude before the turn: turn first, then correct.
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
