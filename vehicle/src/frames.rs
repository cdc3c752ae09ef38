//! Axes of navigation: planet-fixed, inertial and level ones, and the motion as vectors in them.
//!
//! The planet-fixed axes are x through longitude 0 at the equator, y through 90° east, and z north.
//! The inertial axes are those of the planet at time 0. The level axes are north, east and down.

use crate::entry::Motion;
use crate::math::{asin, atan2, hypot, sin, sin_cos};
use crate::platform::{body_from_velocity, velocity_from_level};
use crate::trajectory::Trajectory;
use crate::translation::Planet;
use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};

/// Position, velocity and attitude of the vehicle as vectors.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Place {
    /// Position along the planet-fixed axes, m.
    pub position: Vector3<f64>,
    /// Velocity relative to the planet, along the planet-fixed axes, m/s.
    pub velocity: Vector3<f64>,
    /// Rotation from the inertial axes to those of the body.
    pub attitude: UnitQuaternion<f64>,
}

/// Returns the rotation from planet-fixed to level axes at a longitude and a latitude (rad).
pub fn level_from_fixed(longitude: f64, latitude: f64) -> Matrix3<f64> {
    let (so, co) = sin_cos(longitude);
    let (sa, ca) = sin_cos(latitude);
    Matrix3::new(-sa * co, -sa * so, ca, -so, co, 0.0, -ca * co, -ca * so, -sa)
}

/// Returns the rotation from inertial to planet-fixed axes at `time` (s).
pub fn fixed_from_inertial(planet: &Planet, time: f64) -> Matrix3<f64> {
    let (sine, cosine) = sin_cos(planet.rate * time);
    Matrix3::new(cosine, sine, 0.0, -sine, cosine, 0.0, 0.0, 0.0, 1.0)
}

impl Place {
    /// Returns the vectors of a motion with attitude angles Θ (rad) at `time` (s).
    pub fn of(planet: &Planet, motion: &Motion, angles: &Vector3<f64>, time: f64) -> Self {
        let [altitude, longitude, latitude, speed, path, heading] = (*motion).into();
        let level = level_from_fixed(longitude, latitude);
        let course = Trajectory { flight_path_angle: path, heading, ..Trajectory::default() };
        let velocity_axes = velocity_from_level(&course) * level;
        let body = body_from_velocity(angles) * velocity_axes * fixed_from_inertial(planet, time);
        Self {
            position: level.row(2).transpose() * -(planet.surface(sin(latitude))[0] + altitude),
            velocity: velocity_axes.row(0).transpose() * speed,
            attitude: UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(body)),
        }
    }

    /// Returns longitude and latitude, rad.
    fn coordinates(&self) -> [f64; 2] {
        let [x, y, z] = self.position.into();
        [atan2(y, x), atan2(z, hypot(x, y))]
    }

    /// Returns the rotation from planet-fixed to level axes.
    pub fn level(&self) -> Matrix3<f64> {
        let [longitude, latitude] = self.coordinates();
        level_from_fixed(longitude, latitude)
    }

    /// Returns the motion.
    pub fn motion(&self, planet: &Planet) -> Motion {
        let distance = self.position.norm();
        let [longitude, latitude] = self.coordinates();
        let [north, east, down] = (level_from_fixed(longitude, latitude) * self.velocity).into();
        Motion::new(
            distance - planet.surface(self.position.z / distance)[0],
            longitude,
            latitude,
            self.velocity.norm(),
            atan2(-down, hypot(north, east)),
            atan2(east, north),
        )
    }
}

/// Returns angle of attack and sideslip (rad) of a velocity along the body axes.
pub fn flow_angles(velocity: &Vector3<f64>) -> [f64; 2] {
    let [x, y, z] = (*velocity).into();
    [atan2(z, x), asin((y / velocity.norm()).clamp(-1.0, 1.0))]
}

/// Returns the attitude angles Θ (rad) that lead from the trajectory's axes to those of the body,
/// given the rotation between them.
pub fn attitude_angles(body_from_velocity: &Matrix3<f64>) -> Vector3<f64> {
    let [alpha, beta] = flow_angles(&body_from_velocity.column(0).into());
    let unbanked = self::body_from_velocity(&Vector3::new(alpha, beta, 0.0));
    let bank = unbanked.transpose() * body_from_velocity;
    Vector3::new(alpha, beta, atan2(bank[(2, 1)], bank[(1, 1)]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::entry::motion_rate;

    #[test]
    fn oracle_a_motion_comes_back_from_its_vectors() {
        let planet = Planet::EARTH;
        for (k, time) in [(0.3_f64, 0.0), (-1.1, 77.0), (2.0, 1800.0)] {
            let motion = Motion::new(7e4 * k.abs(), k, 0.4 * k, 3e3, -0.02 * k, 1.4 * k);
            let angles = Vector3::new(0.5, -0.1 * k, k);
            let place = Place::of(&planet, &motion, &angles, time);
            let back = place.motion(&planet);
            assert!((back - motion).amax() < 1e-7, "{back} {motion}");
            let [_, longitude, latitude, _, path, heading] = motion.into();
            let course = Trajectory { flight_path_angle: path, heading, ..Trajectory::default() };
            let inertial_from_velocity = (velocity_from_level(&course)
                * level_from_fixed(longitude, latitude)
                * fixed_from_inertial(&planet, time))
            .transpose();
            let body = place.attitude.to_rotation_matrix().into_inner() * inertial_from_velocity;
            assert!((attitude_angles(&body) - angles).amax() < 1e-12);
        }
    }

    /// The radius at the poles is that of WGS 84, and the altitude changes as it does along the
    /// velocity in planet-fixed axes.
    #[test]
    fn oracle_altitudes_are_counted_from_the_ellipsoid() {
        let planet = Planet::EARTH;
        assert!((planet.surface(1.0)[0] - 6_356_752.314_2).abs() < 1e-3);
        assert!((planet.surface(0.0)[0] - 6_378_137.0).abs() < 1e-6);
        for (latitude, heading) in [(0.1, 0.3), (0.8, -0.4), (-1.2, 2.8)] {
            let motion = Motion::new(6e4, 0.5, latitude, 6e3, -0.03, heading);
            let place = Place::of(&planet, &motion, &Vector3::zeros(), 0.0);
            let sines = [-0.03, heading, latitude].map(sin_cos);
            let rate = motion_rate(&planet, &motion, &sines, &Vector3::zeros());
            let step = 1e-3;
            let altitude = |time: f64| {
                let position = place.position + place.velocity * time;
                Place { position, ..place }.motion(&planet)[0]
            };
            let difference = (altitude(step) - altitude(-step)) / (2.0 * step);
            assert!((rate[0] - difference).abs() < 1e-4, "{} {difference}", rate[0]);
        }
    }

    #[test]
    fn oracle_gravity_as_a_vector_is_that_of_the_equations_of_motion() {
        let planet = Planet::EARTH;
        for (longitude, latitude) in [(0.0, 0.0), (1.0, 0.7), (-2.0, -1.3)] {
            let motion = Motion::new(5e4, longitude, latitude, 1e3, 0.0, 0.0);
            let place = Place::of(&planet, &motion, &Vector3::zeros(), 0.0);
            let level =
                level_from_fixed(longitude, latitude) * planet.gravity_vector(&place.position);
            let [down, north] = planet.gravity(place.position.norm(), latitude);
            assert!((level - Vector3::new(north, 0.0, down)).amax() < 1e-14 * down * 100.0);
        }
    }
}
