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
use crate::trajectory::Trajectory;
use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};
use settings::Declared;

/// Readings of the three sensors: angular rate (rad/s), specific force (m/s²), magnetic field (T).
pub type Readings = [Vector3<f64>; 3];

/// Gravity and magnetic field around the platform.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Declared)]
pub struct Surroundings {
    /// Gravitational acceleration at the accelerometer, directed down.
    #[setting(unit = "m/s2", min = 0.0, nominal = 10.0, file)]
    pub gravity: f64,
    /// Earth's magnetic field at the magnetometer.
    #[setting(each = LEVEL, unit = "T", nominal = 5e-5, file)]
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
        let body_from_level = body_from_velocity * velocity_from_level(&self.trajectory);
        let force = match &self.specific_force {
            Some(force) => body_from_velocity * force,
            None => body_from_level * Vector3::new(0.0, 0.0, -surroundings.gravity),
        };
        [rate, force, body_from_level * surroundings.field]
    }
}
