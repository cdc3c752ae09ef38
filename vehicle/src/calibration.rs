//! Rotation sequence for the calibration of sensors. The platform turns so that every direction
//! fixed in space points along every direction of the body at some time.

use crate::error::{Error, finite};
use crate::kinematics::Kinematics;
use crate::math::sin_cos;
use crate::state::{BETA_LIMIT, State, state};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use settings::Declared;

/// Calibration sequence: α and σ turn at constant rates, and β swings as β₀ + amplitude ·
/// sin(frequency · t).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Declared)]
#[serde(deny_unknown_fields)]
pub struct Sequence {
    /// Rate of the angle of attack in the calibration sequence.
    #[setting(name = "rate.alpha", unit = "rad/s", nominal = 0.1)]
    pub alpha_rate: f64,
    /// Rate of the bank angle in the calibration sequence.
    #[setting(name = "rate.sigma", unit = "rad/s", nominal = 0.1)]
    pub sigma_rate: f64,
    /// Amplitude of the sideslip angle in the calibration sequence.
    #[setting(name = "beta.amplitude", unit = "rad", min = 0.0, nominal = 0.5)]
    pub beta_amplitude: f64,
    /// Angular frequency of the sideslip angle in the calibration sequence.
    #[setting(name = "beta.frequency", unit = "rad/s", nominal = 0.1)]
    pub beta_frequency: f64,
}

impl Sequence {
    /// Refuses a sequence that reaches the singular sideslip angle from the `initial` angles (rad).
    ///
    /// # Errors
    /// Names the value at fault by its path in the configuration of the plant.
    pub fn check(&self, initial: &Vector3<f64>) -> Result<(), Error> {
        let values = [self.alpha_rate, self.sigma_rate, self.beta_amplitude, self.beta_frequency];
        finite("calibration", &values)?;
        let reach = initial.y.abs() + self.beta_amplitude.abs();
        if reach >= BETA_LIMIT {
            let problem = format!(
                "= {} deg: with initial.beta, beta reaches {} deg, but it must stay within 90 deg",
                self.beta_amplitude.to_degrees(),
                reach.to_degrees()
            );
            return Err(Error::parameter("calibration.beta.amplitude", problem));
        }
        Ok(())
    }

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
