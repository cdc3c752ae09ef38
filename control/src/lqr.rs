//! The linear-quadratic regulator of the comparison in Chai 2022, section 5: "an unconstrained
//! version of MPC" with the same P and Q.

use crate::controller::{Controller, Measurement, ReferenceAt};
use crate::error::{DesignError, positive};
use crate::error_dynamics::{Gain, SampledError};
use crate::linearise;
use crate::sliding::tracking_error;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use settings::Declared;
use vehicle::axes::{NUMBERED_ANGLES, NUMBERED_STATE};
use vehicle::dynamics::RigidBody;

/// Settings of the regulator. Units SI, angles rad.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Declared)]
pub struct LqrSettings {
    /// Model of the vehicle that the controller uses.
    #[setting(skip)]
    pub body: RigidBody,
    /// Sampling period of the control law.
    #[setting(name = "period.feedback", unit = "s", min = 1e-4, max = 10.0, nominal = 0.04)]
    pub period: f64,
    /// Weight P on the tracking error and on its derivative, diagonal.
    #[setting(name = "weight.P", each = NUMBERED_STATE, min = 0.0, nominal = 50.0)]
    pub p: [f64; 6],
    /// Weight Q on the second derivative of the tracking error, diagonal.
    #[setting(name = "weight.Q", each = NUMBERED_ANGLES, above = 0.0, nominal = 10.0)]
    pub q: [f64; 3],
}

/// Linear feedback on E = x − x_r with cancellation of the drift f: u = −f + Θ̈_r + K E.
///
/// ```
/// use control::closed_loop::fly;
/// use control::crmpc::{Constraints, Settings};
/// use control::lqr::{Lqr, LqrSettings};
/// use vehicle::Scenario;
///
/// // P and Q of the comparison are those of CRMPC.
/// let Settings { body, p, q, period_feedback: period, .. } = Settings::new(Constraints::Robust);
/// let mut law = Lqr::new(LqrSettings { body, period, p, q })?;
/// let summary = fly(&mut law, &mut (), period, &Scenario::crmpc2022(), |_| ())?;
/// assert!(summary.error_rms.to_degrees() < 3.0);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Lqr {
    settings: LqrSettings,
    /// Gain K per axis, with the papers' signs (negative).
    gains: [Gain; 3],
}

/// Returns the gain of one axis from the Riccati equation AᵀS + S A − S B Q⁻¹ Bᵀ S + P = 0 of the
/// double integrator. Its closed form is k1 = −√(P₁/Q), k2 = −√((P₂ + 2 √(P₁ Q))/Q).
pub fn riccati_gain(p1: f64, p2: f64, q: f64) -> Gain {
    Gain { k1: -(p1 / q).sqrt(), k2: -((p2 + 2.0 * (p1 * q).sqrt()) / q).sqrt() }
}

impl Lqr {
    /// Computes the gains from the settings.
    ///
    /// # Errors
    /// Returns an error that names the weight or period at fault, or the spectral radius of gains
    /// that the sampling makes unstable.
    pub fn new(settings: LqrSettings) -> Result<Self, DesignError> {
        settings::check(&settings)?;
        // Without a weight on an angle there is no gain on it.
        for (i, weight) in settings.p[..3].iter().enumerate() {
            positive(&format!("weight.P[{}]", i + 1), *weight)?;
        }
        let gains =
            std::array::from_fn(|i| riccati_gain(settings.p[i], settings.p[i + 3], settings.q[i]));
        for Gain { k1, k2 } in gains {
            let radius = SampledError::new(Gain { k1, k2 }, settings.period).spectral_radius();
            if radius >= 1.0 {
                return Err(DesignError::Unstable { k1, k2, period: settings.period, radius });
            }
        }
        Ok(Self { settings, gains })
    }

    /// Returns the gain K per axis.
    pub fn gains(&self) -> [Gain; 3] {
        self.gains
    }
}

impl Controller for Lqr {
    type Memory = ();

    fn command(
        &mut self,
        _memory: &mut (),
        _tick: u64,
        time: f64,
        measured: &Measurement,
        reference: ReferenceAt,
    ) -> Vector3<f64> {
        let reference = reference(time);
        let (error, angle_rates) = tracking_error(measured, &reference);
        let mut acceleration = reference.accelerations;
        for (i, gain) in self.gains.iter().enumerate() {
            acceleration[i] += gain.k1 * error.angles[i] + gain.k2 * error.rates[i];
        }
        linearise::moment(&self.settings.body, &measured.angles, &angle_rates, &acceleration)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::crmpc::{Constraints, Settings};
    use nalgebra::{Matrix2, Vector2};
    use vehicle::kinematics;
    use vehicle::reference::Reference;

    #[test]
    fn oracle_the_error_obeys_the_gains() {
        // Under the commanded moment Θ̈ = Θ̈_r + k₁ e + k₂ ė, also where the reference moves.
        let Settings { body, p, q, period_feedback: period, .. } =
            Settings::new(Constraints::Paper);
        let settings = LqrSettings { body, period, p, q };
        let mut law = Lqr::new(settings).unwrap();
        let reference = Reference {
            angles: Vector3::new(0.2, 0.01, -0.5),
            rates: Vector3::new(0.03, -0.02, 0.04),
            accelerations: Vector3::new(-0.01, 0.02, 0.005),
        };
        let measured = Measurement {
            angles: Vector3::new(0.15, 0.05, -0.6),
            rates: Vector3::new(0.02, 0.01, -0.03),
            ..Measurement::default()
        };
        let moment = law.command(&mut (), 0, 0.0, &measured, &|_| reference);
        let rates = kinematics::r(&measured.angles) * measured.rates;
        let acceleration = body.angular_acceleration(&measured.rates, &moment);
        let acceleration: Vector3<f64> = kinematics::r_dot(&measured.angles, &rates)
            * measured.rates
            + kinematics::r(&measured.angles) * acceleration;
        for (i, Gain { k1, k2 }) in law.gains().into_iter().enumerate() {
            let required = reference.accelerations[i]
                + k1 * (measured.angles[i] - reference.angles[i])
                + k2 * (rates[i] - reference.rates[i]);
            assert!(
                (acceleration[i] - required).abs() < 1e-14,
                "{i}: {} {required}",
                acceleration[i]
            );
        }
    }

    #[test]
    fn oracle_gain_satisfies_the_riccati_equation() {
        for (p1, p2, q) in [(50.0, 50.0, 10.0), (3.0, 0.0, 0.7), (1.0, 200.0, 5.0)] {
            let Gain { k1, k2 } = riccati_gain(p1, p2, q);
            // S follows from K = −Q⁻¹BᵀS and the (1,2) entry of the equation.
            let s = Matrix2::new(k1 * k2 * q, -k1 * q, -k1 * q, -k2 * q);
            let (a, b) = (Matrix2::new(0.0, 1.0, 0.0, 0.0), Vector2::new(0.0, 1.0));
            let residual = a.transpose() * s + s * a - s * b * b.transpose() * s / q
                + Matrix2::from_diagonal(&Vector2::new(p1, p2));
            assert!(residual.norm() < 1e-12 * s.norm(), "{residual}");
            assert!(s.cholesky().is_some());
        }
    }
}
