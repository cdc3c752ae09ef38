//! Sampled error dynamics under the feedback law: the effect of a bounded disturbance.
//!
//! Per axis the deviation o = (angle, rate) of the vehicle from the nominal trajectory obeys ö = K
//! o + Δ (Chai 2022, (22)), with K o computed every `period` and held. The bounds here are exact:
//! they are sums of absolute impulse responses (L1 norms) under zero-order hold. The paper's c̄ is
//! the peak of the step response instead, which holds for a constant Δ only.

mod reach;
mod sums;

pub use reach::{InitialTicks, Reach};

use nalgebra::{Matrix2, RowVector2, Vector2};
use serde::{Deserialize, Serialize};
use settings::Declared;
use vehicle::math::ln;

/// Feedback gain of one axis with the paper's signs: u = k1 · angle + k2 · rate, both negative
/// (1/s², 1/s).
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Declared)]
pub struct Gain {
    /// Factor on the angle; negative.
    #[setting(part, unit = "1/s2", max = 0.0, nominal = 5.0)]
    pub k1: f64,
    /// Factor on the rate; negative.
    #[setting(part, unit = "1/s", max = 0.0, nominal = 5.0)]
    pub k2: f64,
}

impl Gain {
    /// Returns the gain as a row vector.
    pub fn row(&self) -> RowVector2<f64> {
        RowVector2::new(self.k1, self.k2)
    }

    /// Returns the eigenvalues (slower, faster) of the continuous error dynamics if they are real,
    /// distinct and stable, as Lemma 3 of Chai 2022 requires: k1 < 0, k2 < 0, k2² + 4 k1 > 0.
    pub fn eigenvalues(&self) -> Option<(f64, f64)> {
        let discriminant = self.k2 * self.k2 + 4.0 * self.k1;
        (self.k1 < 0.0 && self.k2 < 0.0 && discriminant > 0.0).then(|| {
            let root = discriminant.sqrt();
            (f64::midpoint(self.k2, root), f64::midpoint(self.k2, -root))
        })
    }
}

/// Returns the state transition of the double integrator over `h`.
pub fn transition(h: f64) -> Matrix2<f64> {
    Matrix2::new(1.0, h, 0.0, 1.0)
}

/// Returns the response of the double integrator to a unit acceleration held over `h`.
pub fn response(h: f64) -> Vector2<f64> {
    Vector2::new(0.5 * h * h, h)
}

/// Error dynamics of one axis with the feedback sampled every `period` seconds. The law acts
/// `latency` seconds after its measurement, on the state predicted for that instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SampledError {
    gain: Gain,
    period: f64,
    latency: f64,
    /// Matrices of o⁺ = Φ o + Γ Δ for a held Δ.
    phi: Matrix2<f64>,
    gamma: Vector2<f64>,
    /// Transition under the feedback from the beginning of a period to its middle.
    to_middle: Matrix2<f64>,
}

/// Largest spectral radius of sampled dynamics that count as stable: a decay slower than 10⁴
/// periods cannot be distinguished from none.
const LARGEST_RADIUS: f64 = 1.0 - 1e-4;

impl SampledError {
    /// Returns the error dynamics under `gain` sampled every `period` s, acting at once.
    pub fn new(gain: Gain, period: f64) -> Self {
        let held = |time: f64| transition(time) + response(time) * gain.row();
        Self {
            gain,
            period,
            latency: 0.0,
            phi: held(period),
            gamma: response(period),
            to_middle: held(0.5 * period),
        }
    }

    /// Returns the error dynamics under `gain` sampled every `period` s, acting `latency` s after
    /// the measurement.
    pub fn delayed(gain: Gain, period: f64, latency: f64) -> Self {
        Self { latency, ..Self::new(gain, period) }
    }

    /// Returns the largest magnitude of the closed-loop eigenvalues; the dynamics are stable if it
    /// is below 1.
    pub fn spectral_radius(&self) -> f64 {
        let (trace, det) = (self.phi.trace(), self.phi.determinant());
        let discriminant = 0.25 * trace * trace - det;
        if discriminant < 0.0 { det.sqrt() } else { 0.5 * trace.abs() + discriminant.sqrt() }
    }

    /// Returns the number of periods after which a response has fallen below rounding; `None` if
    /// the dynamics are not stable.
    pub fn settling(&self) -> Option<usize> {
        let radius = self.spectral_radius();
        // The response falls at least as fast as n·radiusⁿ.
        (radius <= LARGEST_RADIUS).then(|| (60.0 / -ln(radius.max(0.5))).ceil() as usize)
    }

    /// Returns the sampling period, s.
    pub fn period(&self) -> f64 {
        self.period
    }

    /// Returns Φ, the transition over one period under the held feedback.
    pub fn transition(&self) -> &Matrix2<f64> {
        &self.phi
    }
}

#[cfg(test)]
mod tests;
