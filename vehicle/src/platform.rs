//! Readings of ideal sensors about the body axes: angular rate, specific force and the Earth's
//! magnetic field. They stand on a platform whose orientation is given by the attitude angles.
//!
//! The level axes are north, east and down. Heading and flight path angle lead from them to the
//! trajectory's axes; sideslip, angle of attack and bank angle lead on to the body axes. The bank
//! angle grows *against* the right-hand rule about the velocity, as the signs of R require.

use crate::axes::LEVEL;
use crate::error::{Error, finite, not_negative};
use crate::kinematics::{Kinematics, Sines, sines};
use crate::math::sin_cos;
use crate::trajectory::{TRAJECTORY, Trajectory};
use nalgebra::{Matrix3, SMatrix, Vector3};
use serde::{Deserialize, Serialize};
use settings::Declared;

/// Readings of the three sensors: angular rate (rad/s), specific force (m/s²), magnetic field (T).
pub type Readings = [Vector3<f64>; 3];

/// Gravity and magnetic field around the platform.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Declared)]
pub struct Surroundings {
    /// Gravitational acceleration at the accelerometer, directed down.
    #[setting(unit = "m/s2", min = 0.0, nominal = 10.0)]
    #[setting(file)]
    pub gravity: f64,
    /// Earth's magnetic field at the magnetometer.
    #[setting(each = LEVEL, unit = "T", nominal = 5e-5)]
    #[setting(file)]
    pub field: Vector3<f64>,
}

impl Surroundings {
    /// Refuses values that are not finite, and gravity that points up.
    ///
    /// # Errors
    /// Names the value at fault by its path in the configuration of the plant.
    pub fn check(&self) -> Result<(), Error> {
        not_negative("sensor.gravity", self.gravity, " m/s2")?;
        finite("sensor.field", &self.field)
    }
}

/// Rotation from the trajectory's axes to the body axes. Its rate of change corresponds to ω of
/// [`Kinematics::Exact`].
pub fn body_from_velocity(angles: &Vector3<f64>) -> Matrix3<f64> {
    body_from_velocity_at(&sines(angles))
}

/// Rotation of [`body_from_velocity`], given the sines and cosines of the angles.
pub(crate) fn body_from_velocity_at(sines: &Sines) -> Matrix3<f64> {
    let [(sa, ca), (sb, cb), (ss, cs)] = *sines;
    let bank = Matrix3::new(1.0, 0.0, 0.0, 0.0, cs, -ss, 0.0, ss, cs);
    let sideslip = Matrix3::new(cb, -sb, 0.0, sb, cb, 0.0, 0.0, 0.0, 1.0);
    let attack = Matrix3::new(ca, 0.0, -sa, 0.0, 1.0, 0.0, sa, 0.0, ca);
    attack * sideslip * bank
}

/// Rotation from the level axes to the trajectory's axes.
pub fn velocity_from_level(trajectory: &Trajectory) -> Matrix3<f64> {
    let (sg, cg) = sin_cos(trajectory.flight_path_angle);
    let (sp, cp) = sin_cos(trajectory.heading);
    let climb = Matrix3::new(cg, 0.0, -sg, 0.0, 1.0, 0.0, sg, 0.0, cg);
    let turn = Matrix3::new(cp, sp, 0.0, -sp, cp, 0.0, 0.0, 0.0, 1.0);
    climb * turn
}

/// Orientation of the platform and its rates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// Attitude kinematics in use.
    pub kinematics: Kinematics,
    /// Attitude angles Θ of the platform, rad.
    pub angles: Vector3<f64>,
    /// Body rates ω of the model, rad/s.
    pub rates: Vector3<f64>,
    /// Rate α̇ of the angle of attack, rad/s.
    pub alpha_rate: f64,
    /// Trajectory that gives the platform's direction of flight.
    pub trajectory: Trajectory,
    /// Specific force along the trajectory's axes, m/s²; without it gravity alone gives one.
    pub specific_force: Option<Vector3<f64>>,
}

impl Pose {
    /// Returns the readings of ideal sensors. The gyroscope measures the rate at which the
    /// orientation changes. Where the bank row of R lacks α̇ sin β, that rate is ω less α̇ sin β
    /// about the bank axis. Unless a specific force is given, the platform's centre moves
    /// steadily, so gravity alone gives one.
    pub fn felt(&self, surroundings: &Surroundings) -> Readings {
        let body_from_velocity = body_from_velocity(&self.angles);
        let mut rate = self.rates;
        if self.kinematics == Kinematics::Printed {
            // The bank axis points against the velocity, whose second component is sin β.
            let velocity = body_from_velocity.column(0);
            rate += velocity * (self.alpha_rate * velocity.y);
        }
        let [force, field] = self.fields(&body_from_velocity, surroundings);
        [rate, force, field]
    }

    /// Specific force (m/s²) and magnetic field (T) in body axes.
    fn fields(
        &self,
        body_from_velocity: &Matrix3<f64>,
        surroundings: &Surroundings,
    ) -> [Vector3<f64>; 2] {
        let body_from_level = body_from_velocity * velocity_from_level(&self.trajectory);
        let force = match &self.specific_force {
            Some(force) => body_from_velocity * force,
            None => body_from_level * Vector3::new(0.0, 0.0, -surroundings.gravity),
        };
        [force, body_from_level * surroundings.field]
    }

    /// Partial derivatives of [`Pose::felt`] with respect to the state (9 × 6) and the trajectory
    /// (9 × 7), given those of α̇.
    pub fn felt_by_state_and_trajectory(
        &self,
        surroundings: &Surroundings,
        alpha_rate_by_state: &SMatrix<f64, 1, 6>,
        alpha_rate_by_trajectory: &SMatrix<f64, 1, TRAJECTORY>,
    ) -> (SMatrix<f64, 9, 6>, SMatrix<f64, 9, TRAJECTORY>) {
        let mut by_state = SMatrix::<f64, 9, 6>::zeros();
        let mut by_trajectory = SMatrix::<f64, 9, TRAJECTORY>::zeros();
        by_state.fixed_view_mut::<3, 3>(0, 3).fill_with_identity();
        let body_from_velocity = body_from_velocity(&self.angles);
        if self.kinematics == Kinematics::Printed {
            let axis = -body_from_velocity.column(0);
            let (sa, ca) = sin_cos(self.angles.x);
            let (sb, cb) = sin_cos(self.angles.y);
            let mut rate = by_state.fixed_rows_mut::<3>(0);
            rate -= axis * alpha_rate_by_state * sb;
            let mut alpha = rate.column_mut(0);
            alpha -= Vector3::new(sa * cb, 0.0, -ca * cb) * (self.alpha_rate * sb);
            let mut beta = rate.column_mut(1);
            beta -= (Vector3::new(ca * sb, -cb, sa * sb) * sb + axis * cb) * self.alpha_rate;
            by_trajectory
                .fixed_rows_mut::<3>(0)
                .copy_from(&(axis * alpha_rate_by_trajectory * -sb));
        }
        // A field that is fixed in space turns against the body: v̇ = −ω × v.
        let by_angles = Kinematics::Exact.r_inverse(&self.angles);
        let (sg, cg) = sin_cos(self.trajectory.flight_path_angle);
        let by_course =
            [Vector3::y(), Vector3::new(-sg, 0.0, cg)].map(|axis| body_from_velocity * axis);
        let fields = self.fields(&body_from_velocity, surroundings);
        for (row, field) in [3, 6].into_iter().zip(fields) {
            for i in 0..3 {
                by_state
                    .fixed_view_mut::<3, 1>(row, i)
                    .copy_from(&field.cross(&by_angles.column(i)));
            }
            for (i, axis) in by_course.iter().enumerate() {
                by_trajectory.fixed_view_mut::<3, 1>(row, i).copy_from(&field.cross(axis));
            }
        }
        (by_state, by_trajectory)
    }
}
