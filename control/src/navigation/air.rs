//! Flow of the air past the vehicle, the wind that the side force shows, and the altitude that the
//! drag shows.

use super::filter::{
    ACCELEROMETER, ATTITUDE, DRAG, Error, Measured, POSITION, SIDE, VELOCITY, WIND, along,
};
use nalgebra::{Matrix3, Vector3};
use vehicle::aerodynamics::{Aerodynamics, Flow};
use vehicle::atmosphere::air_anywhere;
use vehicle::frames::flow_angles;
use vehicle::math::{hypot, ln};
use vehicle::platform::body_from_velocity;

/// Least specific force in the plane of symmetry at which the air's forces are used, m/s².
const LEAST_FORCE: f64 = 0.5;
/// Differences of an angle (rad) and of an altitude (m) from which slopes follow.
const PROBE: f64 = 0.01;
const CLIMB: f64 = 100.0;
/// Standard deviation of what the model of the side force does not explain, relative to the force
/// in the plane of symmetry.
const UNEXPLAINED: f64 = 3e-4;
/// Standard deviation of what the model of the drag does not explain, relative to it: waves of the
/// density that the vehicle flies through in less than the time between two measurements.
const WAVES: f64 = 0.02;

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
        let flow = self.to_body * self.velocity;
        let speed = flow.norm();
        let flat = hypot(flow.x, flow.z);
        let alpha = Vector3::new(-flow.z, 0.0, flow.x) / (flat * flat);
        let beta = (Vector3::y() - flow * (flow.y / (speed * speed))) / flat;
        [alpha, beta].map(|gradient| {
            let by_velocity = self.to_body.transpose() * gradient;
            let by_attitude = self.velocity.cross_matrix().transpose() * by_velocity;
            self.velocity_row(&by_velocity) + along(ATTITUDE, &by_attitude)
        })
    }

    /// Returns the form of the error that is the error of the bank angle: it grows against the
    /// right-hand rule about the velocity.
    pub(super) fn bank_row(&self) -> Error {
        along(ATTITUDE, &-self.velocity.normalize())
    }

    /// Returns the form of the error that is the relative error of the speed.
    fn speed_row(&self) -> Error {
        self.velocity_row(&(self.velocity / self.velocity.norm_squared()))
    }

    /// Returns the form of the error that is the part of the velocity's along a direction; wind is
    /// a part of a velocity relative to the air.
    fn velocity_row(&self, direction: &Vector3<f64>) -> Error {
        let mut row = along(VELOCITY, direction);
        for (i, blowing) in self.level.iter().flatten().enumerate() {
            row[WIND + i] = -direction.dot(blowing);
        }
        row
    }
}

/// Returns the force of the air at a dynamic pressure of 1 Pa along the body's y axis and in its
/// plane of symmetry, N.
fn force_parts(aerodynamics: &Aerodynamics, [alpha, beta]: [f64; 2], mach: f64) -> [f64; 2] {
    let flow = Flow { dynamic_pressure: 1.0, mach, speed: 1.0, alpha, beta };
    let [drag, side, lift] = aerodynamics.forces(&flow);
    let along =
        body_from_velocity(&Vector3::new(alpha, beta, 0.0)) * Vector3::new(-drag, side, -lift);
    [along.y, hypot(along.x, along.z)]
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
    // The ratio depends neither on the density nor on the speed.
    let at = |alpha: f64, beta: f64| {
        let [side, in_plane] = force_parts(aerodynamics, [alpha, beta], mach);
        side / in_plane
    };
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

/// Returns what a specific force (m/s², body axes) with a noise (m/s²) shows of the altitude (m),
/// by the density of the standard atmosphere; the altitude grows along `up`. Lift and drag count
/// together, so that an error of the angle of attack does not turn one into the other. The model
/// times the exponential of `excess` predicts them.
pub(super) fn drag(
    aerodynamics: &Aerodynamics,
    relative: &Relative,
    (altitude, up): (f64, &Vector3<f64>),
    (force, noise): (&Vector3<f64>, f64),
    excess: f64,
) -> Option<Measured> {
    let flat = hypot(force.x, force.z);
    if flat < LEAST_FORCE {
        return None;
    }
    let (air, above) = (air_anywhere(altitude), air_anywhere(altitude + CLIMB));
    let thinning = ln(above.density / air.density) / CLIMB;
    let speed = relative.velocity.norm();
    let [alpha, beta] = relative.angles();
    let at = |alpha: f64| force_parts(aerodynamics, [alpha, beta], speed / air.sound_speed)[1];
    let slope = ln(at(alpha + PROBE) / at(alpha - PROBE)) / (2.0 * PROBE);
    let model = 0.5 * air.density * speed * speed * at(alpha) / aerodynamics.mass();
    let [by_alpha, _] = relative.rows();
    let mut row = by_alpha * slope + relative.speed_row() * 2.0 + along(POSITION, up) * thinning;
    row += along(ACCELEROMETER, &(Vector3::new(force.x, 0.0, force.z) / (flat * flat)));
    row[DRAG] = 1.0;
    let variance = (noise / flat) * (noise / flat) + WAVES * WAVES;
    Some(Measured { row, residual: ln(flat / model) - excess, variance })
}
