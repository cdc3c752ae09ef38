//! What the navigation shows: the motion, the attitude and the flow as controllers and guidance
//! take them.

use super::air::Relative;
use super::device::Navigation;
use super::filter::{self, Covariance, Error, along};
use super::strapdown::{Felt, State};
use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};
use vehicle::axes::nearest;
use vehicle::entry::{Motion, motion_rate};
use vehicle::frames::{attitude_angles, fixed_from_inertial, level_from_fixed};
use vehicle::math::sin_cos;
use vehicle::platform::{body_from_velocity, velocity_from_level};
use vehicle::trajectory::Trajectory;

/// Standard deviations that the filter predicts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Deviations {
    /// Of the attitude angles relative to the ground velocity, rad.
    pub angles: Vector3<f64>,
    /// Of angle of attack and sideslip relative to the air, rad.
    pub flow: [f64; 2],
    /// Of the position, root mean square over the axes, m.
    pub position: f64,
    /// Of the velocity, root mean square over the axes, m/s.
    pub velocity: f64,
    /// Of the wind to the north and to the east, m/s.
    pub wind: [f64; 2],
    /// Of the altitude, m.
    pub altitude: f64,
    /// Of the ratio of the drag to that of the model, relative to it.
    pub drag: f64,
}

/// The navigated state.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Shown {
    /// Motion relative to the rotating planet.
    pub motion: Motion,
    /// Its time derivative.
    pub motion_rate: Motion,
    /// Attitude angles Θ relative to the ground velocity, rad.
    pub angles: Vector3<f64>,
    /// Angle of attack and sideslip relative to the air, rad.
    pub flow: [f64; 2],
    /// Body rates ω, rad/s.
    pub rates: Vector3<f64>,
    /// Lift per mass, m/s².
    pub lift: f64,
    /// Drag per mass, m/s².
    pub drag: f64,
    /// Wind to the north and to the east, m/s.
    pub wind: [f64; 2],
    /// Standard deviations that the filter predicts.
    pub deviations: Deviations,
    /// Squares of the normalised innovations per component, of the latest fix of satellite
    /// navigation and star tracker and of the latest side force and drag; they are 1 on average.
    pub innovations: [f64; 4],
    /// Estimated biases of gyroscope (rad/s) and accelerometer (m/s²).
    pub biases: [Vector3<f64>; 2],
    /// Estimated ratio of lift and drag to those of the model in the standard atmosphere.
    pub drag_ratio: f64,
    /// Number of fixes that were rejected.
    pub rejected: u32,
}

impl Navigation {
    /// Returns the motion of a state at a time (s), and the rotation from inertial to level axes.
    pub(super) fn level(&self, (time, state): (f64, &State)) -> (Motion, Matrix3<f64>) {
        let planet = &self.settings.planet;
        let motion = state.place(planet, time).motion(planet);
        let to_level = level_from_fixed(motion[1], motion[2]) * fixed_from_inertial(planet, time);
        (motion, to_level)
    }

    /// Returns the velocities relative to the ground and to the air.
    pub(super) fn relative(
        &self,
        state: &State,
        to_level: &Matrix3<f64>,
        wind: [f64; 2],
    ) -> [Relative; 2] {
        let to_body = state.attitude.inverse().to_rotation_matrix().into_inner();
        let velocity = state.over_ground(&self.settings.planet);
        let [north, east] = [0, 1].map(|i| to_level.row(i).transpose());
        let through_air = velocity - north * wind[0] - east * wind[1];
        [
            Relative { velocity, to_body, level: None },
            Relative { velocity: through_air, to_body, level: Some([north, east]) },
        ]
    }

    /// Returns the standard deviations that follow from a covariance.
    pub(super) fn deviations(
        &self,
        at: (f64, &State),
        wind: [f64; 2],
        covariance: &Covariance,
    ) -> Deviations {
        let of = |row: &Error| filter::deviation(covariance, row);
        // Independent of the directions of the axes.
        let per_axis = |from: usize| {
            let sum: f64 = (from..from + 3).map(|i| covariance[(i, i)]).sum();
            (sum / 3.0).max(0.0).sqrt()
        };
        let [ground, air] = self.relative(at.1, &self.level(at).1, wind);
        let [alpha, beta] = ground.rows();
        let altitude = along(filter::POSITION, &at.1.position.normalize());
        Deviations {
            angles: Vector3::new(of(&alpha), of(&beta), of(&ground.bank_row())),
            flow: air.rows().map(|row| of(&row)),
            position: per_axis(filter::POSITION),
            velocity: per_axis(filter::VELOCITY),
            wind: [0, 1].map(|i| covariance[(filter::WIND + i, filter::WIND + i)].max(0.0).sqrt()),
            altitude: of(&altitude),
            drag: covariance[(filter::DRAG, filter::DRAG)].max(0.0).sqrt(),
        }
    }

    /// Shows a state at a time (s). Angles are shown as the turns nearest to those before.
    pub(super) fn show(
        &self,
        shown: &mut Shown,
        (time, state): (f64, &State),
        felt: &Felt,
        wind: [f64; 2],
    ) {
        let planet = &self.settings.planet;
        let (motion, to_level) = self.level((time, state));
        let [_, _, latitude, _, path, heading] = motion.into();
        let course = Trajectory { flight_path_angle: path, heading, ..Trajectory::default() };
        let to_inertial = state.attitude.to_rotation_matrix().into_inner();
        let to_velocity = velocity_from_level(&course) * to_level * to_inertial;
        let mut angles = attitude_angles(&to_velocity.transpose());
        for (angle, before) in angles.iter_mut().zip(&shown.angles) {
            *angle = nearest(*angle, *before);
        }
        let [_, air] = self.relative(state, &to_level, wind);
        let [alpha, beta] = air.angles();
        let flow = [nearest(alpha, shown.flow[0]), beta];
        let from_flow = body_from_velocity(&Vector3::new(alpha, beta, 0.0));
        let along_flow = from_flow.transpose() * felt.force;
        let sines = [path, heading, latitude].map(sin_cos);
        let motion_rate = motion_rate(planet, &motion, &sines, &(to_velocity * felt.force));
        let mut continued = motion;
        // Longitude and heading count on beyond a whole turn.
        for i in [1, 5] {
            continued[i] = nearest(motion[i], shown.motion[i]);
        }
        *shown = Shown {
            motion: continued,
            motion_rate,
            angles,
            flow,
            rates: felt.rate,
            lift: -along_flow.z,
            drag: -along_flow.x,
            wind,
            ..*shown
        };
    }
}
