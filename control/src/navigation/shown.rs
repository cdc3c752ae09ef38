//! What the navigation shows: the motion, the attitude and the flow as controllers and guidance
//! take them.

use super::air::Relative;
use super::device::Navigation;
use super::filter::{self, Covariance, Error, along};
use super::line::Health;
use super::strapdown::{Felt, State};
use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};
use settings::Declared;
use std::f64::consts::PI;
use vehicle::axes::{ANGLES, Entry, FLOW, HORIZONTAL, LETTERS, RATES, nearest};
use vehicle::entry::{MOTION, Motion, NOMINALS, RATE_UNITS, UNITS, motion_rate};
use vehicle::frames::{attitude_angles, fixed_from_inertial, level_from_fixed};
use vehicle::math::sin_cos;
use vehicle::platform::{body_from_velocity, velocity_from_level};
use vehicle::trajectory::Trajectory;

/// Number of standard deviations within which errors are protected.
const PROTECTED: f64 = 3.0;

/// Predicted standard deviations of what is shown.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Declared)]
pub struct Deviations {
    /// Predicted standard deviation of the {} relative to the ground velocity.
    #[setting(name = "attitude", each = ANGLES, unit = "rad", nominal = 0.01)]
    pub angles: Vector3<f64>,
    /// Predicted standard deviation of the {} relative to the air.
    #[setting(each = FLOW, unit = "rad", nominal = 0.01)]
    pub flow: [f64; 2],
    /// Predicted standard deviation of the wind {}.
    #[setting(each = HORIZONTAL, unit = "m/s", nominal = 10.0)]
    pub wind: [f64; 2],
    /// Predicted standard deviation of the position, root mean square over the axes.
    #[setting(unit = "m", nominal = 10.0)]
    pub position: f64,
    /// Predicted standard deviation of the velocity, root mean square over the axes.
    #[setting(unit = "m/s", nominal = 0.1)]
    pub velocity: f64,
    /// Predicted standard deviation of the altitude.
    #[setting(unit = "m", nominal = 10.0)]
    pub altitude: f64,
    /// Predicted standard deviation of drag.ratio, relative to it.
    #[setting(nominal = 0.1)]
    pub drag: f64,
}

/// Bounds on the errors that are shown (protection levels), which hold while nothing is suspect.
///
/// They are three of the predicted standard deviations, and at least one beyond the largest offset of
/// the receiver, or misalignment of the star tracker, that its first fix could hide; that of the
/// receiver is a first one also after half a minute without fixes. While a contradiction stands, they bound nothing: half a turn, and the radius of the planet. docs/entry.md says how
/// often errors exceed them, without and with faults.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Declared)]
pub struct Protection {
    /// Bound on the errors of the angles that controllers take: angle of attack and sideslip relative
    /// to the air, and bank angle.
    #[setting(unit = "rad", nominal = 0.01)]
    pub attitude: f64,
    /// Bound on the error of the position.
    #[setting(unit = "m", nominal = 10.0)]
    pub position: f64,
}

/// The navigated state.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Declared)]
pub struct Shown {
    /// {}.
    #[setting(each = MOTION, units = UNITS, nominals = NOMINALS)]
    pub motion: Motion,
    /// Rate of motion{.}.
    #[setting(each = MOTION, units = RATE_UNITS, nominals = NOMINALS)]
    pub motion_rate: Motion,
    /// Navigated {} relative to the ground velocity.
    #[setting(name = "attitude", each = ANGLES, unit = "rad", nominal = 0.1)]
    pub angles: Vector3<f64>,
    /// Navigated body {}.
    #[setting(name = "rate", each = RATES, unit = "rad/s", nominal = 0.05)]
    pub rates: Vector3<f64>,
    /// Measured lift per mass.
    #[setting(name = "load.lift", unit = "m/s2", nominal = 10.0)]
    pub lift: f64,
    /// Measured drag per mass.
    #[setting(name = "load.drag", unit = "m/s2", nominal = 10.0)]
    pub drag: f64,
    /// Navigated {} relative to the air.
    #[setting(each = FLOW, unit = "rad", nominal = 0.1)]
    pub flow: [f64; 2],
    /// Estimated wind {}.
    #[setting(each = HORIZONTAL, unit = "m/s", nominal = 10.0)]
    pub wind: [f64; 2],
    /// Estimated ratio of lift and drag to those of the model in the standard atmosphere.
    #[setting(name = "drag.ratio", nominal = 1.0)]
    pub drag_ratio: f64,
    /// Standard deviations that the filter predicts.
    #[setting(name = "deviation")]
    pub deviations: Deviations,
    /// Bounds on the errors.
    pub protection: Protection,
    /// Square of the normalised innovation per component of the latest {}; that of fixes is 1 on
    /// average.
    #[setting(name = "innovation", each = SOURCES)]
    pub innovations: [f64; 4],
    /// Estimated bias of the {} about or along {}.
    #[setting(name = "bias", each = INERTIAL, columns = LETTERS)]
    #[setting(units = ["rad/s", "m/s2"], nominals = [1e-5, 1e-2])]
    pub biases: [Vector3<f64>; 2],
    /// Number of fixes so far that were rejected.
    #[setting(name = "rejectedFixes", min = 0)]
    pub rejected: u32,
}

impl Shown {
    /// Returns whether all of it are finite numbers.
    pub(super) fn is_finite(&self) -> bool {
        let Self { motion, motion_rate, angles, rates, flow, wind, .. } = self;
        let Self { lift, drag, drag_ratio, deviations, innovations, biases, .. } = self;
        let Deviations { position, velocity, altitude, .. } = deviations;
        let vectors = [angles, rates, &biases[0], &biases[1], &deviations.angles];
        let numbers = [motion, motion_rate].into_iter().flatten();
        let numbers = numbers.chain(vectors.into_iter().flatten()).chain(innovations);
        let numbers =
            numbers.chain([flow, wind, &deviations.flow, &deviations.wind].into_iter().flatten());
        let single = [lift, drag, drag_ratio, position, velocity, altitude, &deviations.drag];
        numbers.chain(single).all(|value| value.is_finite())
    }
}

const SOURCES: [Entry; 4] = [
    (".gnss", "fix of satellite navigation"),
    (".star", "fix of the star tracker"),
    (".side", "side force"),
    (".drag", "drag"),
];
const INERTIAL: [Entry; 2] = [(".gyroscope", "gyroscope"), (".accelerometer", "accelerometer")];

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

    /// Returns the bounds on the errors that are shown.
    pub(super) fn protection(
        &self,
        Deviations { angles, flow, position, .. }: &Deviations,
        hidden: [f64; 2],
        health: Health,
    ) -> Protection {
        let knows = matches!(health, Health::Aided | Health::Bridging | Health::Degraded);
        if !knows {
            return self.unprotected();
        }
        let deviation = angles.z.max(flow[0]).max(flow[1]);
        let bound = |predicted: f64, hidden: f64, deviation: f64| {
            predicted.max(if hidden > 0.0 { hidden + deviation } else { 0.0 })
        };
        let of_position = 3_f64.sqrt() * position;
        Protection {
            attitude: bound(PROTECTED * deviation, hidden[1], deviation).min(PI),
            position: bound(PROTECTED * of_position, hidden[0], of_position),
        }
    }

    /// Returns the bounds where nothing is known.
    pub(super) fn unprotected(&self) -> Protection {
        Protection { attitude: PI, position: self.settings.planet.radius }
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
