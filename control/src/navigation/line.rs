//! What the navigation receives, and its health.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use settings::Choice;
use vehicle::fixes::Fixes;

/// What the navigation receives.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Line {
    /// Number of the newest sample, counted from 1; 0 before the first, or always if samples are
    /// not counted.
    pub sample: i32,
    /// Time at which it was taken, s.
    pub time: f64,
    /// Reading of the gyroscope, rad/s.
    pub rate: Vector3<f64>,
    /// Reading of the accelerometer, m/s².
    pub force: Vector3<f64>,
    /// Latest fixes.
    pub fixes: Fixes,
}

/// Largest angular rate (rad/s) and specific force (m/s²) that a sample can have.
const LARGEST: [f64; 2] = [100.0, 1e4];

impl Line {
    /// Returns whether there are readings, and they can be those of a vehicle.
    pub(super) fn is_plausible(&self) -> bool {
        let is_there = self.sample > 0 || self.rate.amax() > 0.0 || self.force.amax() > 0.0;
        let within = |vector: &Vector3<f64>, most: f64| vector.iter().all(|v| v.abs() <= most);
        is_there && within(&self.rate, LARGEST[0]) && within(&self.force, LARGEST[1])
    }
}

/// Health of the navigation: how far it can be trusted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Choice)]
#[setting(name = "NavigationHealth")]
pub enum Health {
    /// No sample has arrived yet.
    #[default]
    Waiting,
    /// Fixes arrive, and the attitude is known as well as health.deviation asks for.
    Aided,
    /// No fix has arrived for health.after, and the inertial sensors bridge the gap.
    Bridging,
    /// The predicted standard deviation of an attitude angle exceeds health.deviation.
    Degraded,
    /// The fixes contradict the filter's own standard deviations.
    Inconsistent,
    /// No sample has arrived for half a second.
    Lost,
    /// A device contradicts itself, or an estimate what is known beforehand.
    Suspect,
}

/// What contradicts what the navigation expects.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Choice)]
#[setting(name = "NavigationContradiction")]
pub enum Contradiction {
    /// Nothing does.
    #[default]
    None,
    /// Satellite navigation: its fixes contradict each other or the filter.
    Gnss,
    /// The star tracker: its fixes contradict each other or the filter.
    Star,
    /// The side force: its innovations or the wind are too large.
    Side,
    /// The drag: its innovations or drag.ratio are too large.
    Drag,
    /// The gyroscope: its bias is too large, or its samples repeat themselves.
    Gyroscope,
    /// The accelerometer: its bias is too large, or its samples repeat themselves.
    Accelerometer,
}
