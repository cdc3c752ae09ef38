//! Rotation sequence for the calibration of sensors. The platform turns so that every direction
//! fixed in space points along every direction of the body at some time.

use crate::kinematics::Kinematics;
use crate::math::sin_cos;
use crate::state::{State, state};
use nalgebra::Vector3;

/// Calibration sequence: α and σ turn at constant rates, and β swings as β₀ + amplitude ·
/// sin(frequency · t).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sequence {
    /// Rate of the angle of attack, rad/s.
    pub alpha_rate: f64,
    /// Rate of the bank angle, rad/s.
    pub sigma_rate: f64,
    /// Amplitude of the sideslip angle, rad.
    pub beta_amplitude: f64,
    /// Angular frequency of the sideslip angle, rad/s.
    pub beta_frequency: f64,
}

impl Sequence {
    /// Attitude angles Θ and their derivatives Θ̇ and Θ̈ (rad, s) at `time` (s) after the start at
    /// the angles `initial` (rad).
    pub fn angles_and_derivatives(&self, initial: &Vector3<f64>, time: f64) -> [Vector3<f64>; 3] {
        let (sine, cosine) = sin_cos(self.beta_frequency * time);
        let (amplitude, frequency) = (self.beta_amplitude, self.beta_frequency);
        let swing = Vector3::new(self.alpha_rate * time, amplitude * sine, self.sigma_rate * time);
        [
            initial + swing,
            Vector3::new(self.alpha_rate, amplitude * frequency * cosine, self.sigma_rate),
            Vector3::new(0.0, -amplitude * frequency * frequency * sine, 0.0),
        ]
    }

    /// State and its derivative at `time` (s) after the start. The rates ω follow from Θ̇ with the
    /// matrix R in use and a trajectory that does not turn.
    pub fn state_at(
        &self,
        kinematics: Kinematics,
        initial: &Vector3<f64>,
        time: f64,
    ) -> (State, State) {
        let [angles, angle_rates, angle_accelerations] = self.angles_and_derivatives(initial, time);
        let r_inverse = kinematics.r_inverse(&angles);
        let rates = r_inverse * angle_rates;
        let r_dot = kinematics.r_alpha(&angles) * angle_rates.x
            + kinematics.r_beta(&angles) * angle_rates.y;
        // Θ̈ = Ṙ ω + R ω̇
        let accelerations = r_inverse * (angle_accelerations - r_dot * rates);
        (state(&angles, &rates), state(&angle_rates, &accelerations))
    }
}
