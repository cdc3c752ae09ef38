//! What ideal sensors on a platform feel whose orientation the attitude angles give: angular rate, specific force and the
//! Earth's magnetic field, about the body axes.
//!
//! Level axes are north, east, down. The trajectory's axes come from them by heading and flight path angle, the body axes by
//! sideslip, angle of attack and a bank angle that grows *against* the right-hand rule about the velocity, as the signs of R
//! say.

use crate::error::Error;
use crate::kinematics::{Kinematics, TRAJECTORY, Trajectory};
use nalgebra::{Matrix3, SMatrix, Vector3};
use serde::{Deserialize, Serialize};

/// What the three sensors feel or show: angular rate (rad/s), specific force (m/s²), magnetic field (T).
pub type Readings = [Vector3<f64>; 3];

/// The fields around the platform.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Surroundings {
    /// Gravity, m/s², down.
    pub gravity: f64,
    /// Magnetic field north, east and down, T.
    pub field: Vector3<f64>,
}

impl Surroundings {
    /// Refuses what is not finite, and gravity upwards.
    ///
    /// # Errors
    /// Names the value at fault as the units do.
    pub fn check(&self) -> Result<(), Error> {
        let refuse = |name, problem: String| Err(Error::Parameter { name, problem });
        if !(self.gravity >= 0.0 && self.gravity.is_finite()) {
            return refuse("sensor.gravity", format!("= {} m/s2 must not be negative", self.gravity));
        }
        if !self.field.iter().all(|value| value.is_finite()) {
            return refuse("sensor.field", "holds a value that is not finite".into());
        }
        Ok(())
    }
}

/// Rotation from the trajectory's to the body axes. Its change is ω of [`Kinematics::Exact`].
pub fn body_from_velocity(angles: &Vector3<f64>) -> Matrix3<f64> {
    let (sa, ca) = angles.x.sin_cos();
    let (sb, cb) = angles.y.sin_cos();
    let (ss, cs) = angles.z.sin_cos();
    let bank = Matrix3::new(1.0, 0.0, 0.0, 0.0, cs, -ss, 0.0, ss, cs);
    let sideslip = Matrix3::new(cb, -sb, 0.0, sb, cb, 0.0, 0.0, 0.0, 1.0);
    let attack = Matrix3::new(ca, 0.0, -sa, 0.0, 1.0, 0.0, sa, 0.0, ca);
    attack * sideslip * bank
}

/// Rotation from the level to the trajectory's axes.
pub fn velocity_from_level(trajectory: &Trajectory) -> Matrix3<f64> {
    let (sg, cg) = trajectory.flight_path_angle.sin_cos();
    let (sp, cp) = trajectory.heading.sin_cos();
    let climb = Matrix3::new(cg, 0.0, -sg, 0.0, 1.0, 0.0, sg, 0.0, cg);
    let turn = Matrix3::new(cp, sp, 0.0, -sp, cp, 0.0, 0.0, 0.0, 1.0);
    climb * turn
}

/// Unit vector against the velocity: the axis of a growing bank angle, in body axes.
fn bank_axis(angles: &Vector3<f64>) -> Vector3<f64> {
    let (sa, ca) = angles.x.sin_cos();
    let (sb, cb) = angles.y.sin_cos();
    Vector3::new(-ca * cb, -sb, -sa * cb)
}

/// Where the platform is and how it moves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// The kinematics that the motion obeys.
    pub kinematics: Kinematics,
    /// Θ, rad.
    pub angles: Vector3<f64>,
    /// ω of the model, rad/s.
    pub rates: Vector3<f64>,
    /// α̇, rad/s.
    pub alpha_rate: f64,
    /// The trajectory.
    pub trajectory: Trajectory,
}

impl Pose {
    /// What ideal sensors feel. The gyroscope's is the platform's rate, which belongs to the change of its orientation: where
    /// the bank row of R lacks α̇ sin β, it is ω less that much about the bank axis. The platform's centre moves steadily, so
    /// the specific force is that of gravity.
    pub fn felt(&self, surroundings: &Surroundings) -> Readings {
        let mut rate = self.rates;
        if self.kinematics == Kinematics::Printed {
            rate -= bank_axis(&self.angles) * (self.alpha_rate * self.angles.y.sin());
        }
        let [force, field] = self.fields(surroundings);
        [rate, force, field]
    }

    /// Specific force and magnetic field in body axes.
    fn fields(&self, surroundings: &Surroundings) -> [Vector3<f64>; 2] {
        let body_from_level = body_from_velocity(&self.angles) * velocity_from_level(&self.trajectory);
        let lift = Vector3::new(0.0, 0.0, -surroundings.gravity);
        [body_from_level * lift, body_from_level * surroundings.field]
    }

    /// Partial derivatives of [`Pose::felt`] by state (9 × 6) and trajectory (9 × 7), given those of α̇.
    pub fn felt_by_state_and_trajectory(
        &self,
        surroundings: &Surroundings,
        alpha_rate_by_state: &SMatrix<f64, 1, 6>,
        alpha_rate_by_trajectory: &SMatrix<f64, 1, TRAJECTORY>,
    ) -> (SMatrix<f64, 9, 6>, SMatrix<f64, 9, TRAJECTORY>) {
        let mut by_state = SMatrix::<f64, 9, 6>::zeros();
        let mut by_trajectory = SMatrix::<f64, 9, TRAJECTORY>::zeros();
        by_state.fixed_view_mut::<3, 3>(0, 3).fill_with_identity();
        if self.kinematics == Kinematics::Printed {
            let axis = bank_axis(&self.angles);
            let (sa, ca) = self.angles.x.sin_cos();
            let (sb, cb) = self.angles.y.sin_cos();
            let mut rate = by_state.fixed_rows_mut::<3>(0);
            rate -= axis * alpha_rate_by_state * sb;
            let mut alpha = rate.column_mut(0);
            alpha -= Vector3::new(sa * cb, 0.0, -ca * cb) * (self.alpha_rate * sb);
            let mut beta = rate.column_mut(1);
            beta -= (Vector3::new(ca * sb, -cb, sa * sb) * sb + axis * cb) * self.alpha_rate;
            by_trajectory.fixed_rows_mut::<3>(0).copy_from(&(axis * alpha_rate_by_trajectory * -sb));
        }
        // A field at rest turns against the body: v̇ = −ω × v.
        let by_angles = Kinematics::Exact.r_inverse(&self.angles);
        let body_from_velocity = body_from_velocity(&self.angles);
        let (sg, cg) = self.trajectory.flight_path_angle.sin_cos();
        let by_course = [Vector3::y(), Vector3::new(-sg, 0.0, cg)].map(|axis| body_from_velocity * axis);
        for (row, field) in [3, 6].into_iter().zip(self.fields(surroundings)) {
            for i in 0..3 {
                by_state.fixed_view_mut::<3, 1>(row, i).copy_from(&field.cross(&by_angles.column(i)));
            }
            for (i, axis) in by_course.iter().enumerate() {
                by_trajectory.fixed_view_mut::<3, 1>(row, i).copy_from(&field.cross(axis));
            }
        }
        (by_state, by_trajectory)
    }
}
