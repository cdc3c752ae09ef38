//! Flow of the air past the vehicle, and the wind that the side force shows.

use super::filter::{ACCELEROMETER, ATTITUDE, Error, Measured, SIDE, VELOCITY, WIND};
use nalgebra::{Matrix3, Vector3};
use vehicle::aerodynamics::{Aerodynamics, Flow};
use vehicle::frames::flow_angles;
use vehicle::math::hypot;
use vehicle::platform::body_from_velocity;

/// Least specific force in the plane of symmetry at which the side force is used, m/s².
const LEAST_FORCE: f64 = 0.5;
/// Difference of an angle from which a slope follows, rad.
const PROBE: f64 = 0.01;
/// Standard deviation of what the model of the side force does not explain, relative to the force
/// in the plane of symmetry.
const UNEXPLAINED: f64 = 3e-4;

/// A velocity of the vehicle, relative to the ground or to the air.
#[derive(Clone, Copy, Debug)]
pub(super) struct Relative {
    /// Velocity along the inertial axes, m/s.
    pub(super) velocity: Vector3<f64>,
    /// Rotation from the inertial axes to those of the body.
    pub(super) to_body: Matrix3<f64>,
    /// Directions to the north and to the east in inertial axes, if the velocity is relative to
    /// the air.
    pub(super) level: Option<[Vector3<f64>; 2]>,
}

impl Relative {
    /// Returns angle of attack and sideslip, rad.
    pub(super) fn angles(&self) -> [f64; 2] {
        flow_angles(&(self.to_body * self.velocity))
    }

    /// Returns the forms of the error that are the errors of these angles: with u the velocity, its
    /// components along the body axes have the error C (δv + [u]× φ − wind).
    pub(super) fn rows(&self) -> [Error; 2] {
        let along = self.to_body * self.velocity;
        let speed = along.norm();
        let flat = hypot(along.x, along.z);
        let alpha = Vector3::new(-along.z, 0.0, along.x) / (flat * flat);
        let beta = (Vector3::y() - along * (along.y / (speed * speed))) / flat;
        [alpha, beta].map(|gradient| {
            let by_velocity = self.to_body.transpose() * gradient;
            let by_attitude = self.velocity.cross_matrix().transpose() * by_velocity;
            let mut row = Error::zeros();
            row.fixed_rows_mut::<3>(VELOCITY).copy_from(&by_velocity);
            row.fixed_rows_mut::<3>(ATTITUDE).copy_from(&by_attitude);
            for (i, direction) in self.level.iter().flatten().enumerate() {
                row[WIND + i] = -by_velocity.dot(direction);
            }
            row
        })
    }

    /// Returns the form of the error that is the error of the bank angle: it grows against the
    /// right-hand rule about the velocity.
    pub(super) fn bank_row(&self) -> Error {
        let mut row = Error::zeros();
        row.fixed_rows_mut::<3>(ATTITUDE).copy_from(&-self.velocity.normalize());
        row
    }
}

/// Returns the ratio of the force along the body's y axis to that in its plane of symmetry, which
/// depends neither on the density nor on the speed.
fn side_ratio(aerodynamics: &Aerodynamics, [alpha, beta]: [f64; 2], mach: f64) -> f64 {
    let flow = Flow { dynamic_pressure: 1.0, mach, speed: 1.0, alpha, beta };
    let [drag, side, lift] = aerodynamics.forces(&flow);
    let along =
        body_from_velocity(&Vector3::new(alpha, beta, 0.0)) * Vector3::new(-drag, side, -lift);
    along.y / hypot(along.x, along.z)
}

/// Returns what a specific force (m/s², body axes) with a noise (m/s²) shows of the sideslip, and
/// with it of the wind. The angle of attack cannot be had in this way: the ratio of lift to drag
/// has a maximum over it. The model times `scale` predicts the side force.
pub(super) fn side_force(
    aerodynamics: &Aerodynamics,
    relative: &Relative,
    mach: f64,
    (force, noise): (&Vector3<f64>, f64),
    scale: f64,
) -> Option<Measured> {
    let flat = hypot(force.x, force.z);
    if flat < LEAST_FORCE {
        return None;
    }
    let [alpha, beta] = relative.angles();
    let at = |alpha: f64, beta: f64| side_ratio(aerodynamics, [alpha, beta], mach);
    let slopes = [
        (at(alpha + PROBE, beta) - at(alpha - PROBE, beta)) / (2.0 * PROBE),
        (at(alpha, beta + PROBE) - at(alpha, beta - PROBE)) / (2.0 * PROBE),
    ];
    let ratio = force.y / flat;
    let [by_alpha, by_beta] = relative.rows();
    let mut row = by_alpha * slopes[0] + by_beta * slopes[1];
    let in_plane = Vector3::new(force.x, 0.0, force.z) * (ratio / flat);
    let by_force = (Vector3::y() - in_plane) / flat;
    let model = at(alpha, beta);
    row *= scale;
    row.fixed_rows_mut::<3>(ACCELEROMETER).copy_from(&by_force);
    row[SIDE] = model;
    let variance = (noise / flat) * (noise / flat) + UNEXPLAINED * UNEXPLAINED;
    Some(Measured { row, residual: ratio - scale * model, variance })
}
