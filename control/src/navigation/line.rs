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

impl Line {
    /// Returns the name of the inputs that hold a value that is not finite.
    pub fn fault(&self) -> Option<&'static str> {
        let Fixes { gnss, star } = &self.fixes;
        let broken = |values: &[f64]| values.iter().any(|value| !value.is_finite());
        let vectors = |vectors: [&Vector3<f64>; 2], time: f64| {
            vectors.iter().any(|vector| broken(vector.as_slice())) || broken(&[time])
        };
        if vectors([&self.rate, &self.force], self.time) {
            Some("measured.*")
        } else if vectors([&gnss.position, &gnss.velocity], gnss.time) {
            Some("gnss.*")
        } else {
            (broken(&star.attitude) || broken(&[star.time])).then_some("star.*")
        }
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
}
