//! Error dynamics under the feedback law, sampled: what a bounded disturbance can do to them.
//!
//! Per axis the deviation o = (angle, rate) of the vehicle from the nominal motion obeys ö = K o + Δ (Chai 2022, (22)),
//! with K o computed every `period` and held. The bounds here are exact: sums of absolute impulse responses (L1 norms)
//! under zero-order hold, not the peak of the step response that the paper's c̄ is (that one holds for a constant Δ only).

use nalgebra::{Matrix2, RowVector2, SMatrix, Vector2};
use serde::{Deserialize, Serialize};

/// Feedback gain of one axis with the paper's signs: u = k1 · angle + k2 · rate, both negative (1/s², 1/s).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Gain {
    /// Gain on the angle, 1/s².
    pub k1: f64,
    /// Gain on the rate, 1/s.
    pub k2: f64,
}

impl Gain {
    /// The gain as a row.
    pub fn row(&self) -> RowVector2<f64> {
        RowVector2::new(self.k1, self.k2)
    }

    /// Eigenvalues (slower, faster) of the continuous error dynamics, if they are real, distinct and stable, as
    /// Lemma 3 of Chai 2022 demands: k1 < 0, k2 < 0, k2² + 4 k1 > 0.
    pub fn eigenvalues(&self) -> Option<(f64, f64)> {
        let discriminant = self.k2 * self.k2 + 4.0 * self.k1;
        (self.k1 < 0.0 && self.k2 < 0.0 && discriminant > 0.0).then(|| {
            let root = discriminant.sqrt();
            (f64::midpoint(self.k2, root), f64::midpoint(self.k2, -root))
        })
    }
}

/// State transition of the double integrator over `h`.
pub fn transition(h: f64) -> Matrix2<f64> {
    Matrix2::new(1.0, h, 0.0, 1.0)
}

/// Response of the double integrator to a unit acceleration held over `h`.
pub fn response(h: f64) -> Vector2<f64> {
    Vector2::new(0.5 * h * h, h)
}

/// Bounds per unit of disturbance bound: |o_angle| ≤ `angle`·Δ̄, |o_rate| ≤ `rate`·Δ̄, |K o| ≤ `feedback`·Δ̄.
#[derive(Clone, Copy, Debug, PartialEq, Default, Serialize, Deserialize)]
pub struct Reach {
    /// s².
    pub angle: f64,
    /// s.
    pub rate: f64,
    /// Dimensionless.
    pub feedback: f64,
}

/// Error dynamics of one axis with the feedback sampled every `period` seconds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SampledError {
    gain: Gain,
    period: f64,
    /// o⁺ = Φ o + Γ Δ.
    phi: Matrix2<f64>,
    gamma: Vector2<f64>,
}

impl SampledError {
    /// Error dynamics under `gain` sampled every `period` s.
    pub fn new(gain: Gain, period: f64) -> Self {
        let gamma = response(period);
        Self { gain, period, phi: transition(period) + gamma * gain.row(), gamma }
    }

    /// Largest magnitude of the closed-loop eigenvalues; stable if below 1.
    pub fn spectral_radius(&self) -> f64 {
        let (trace, det) = (self.phi.trace(), self.phi.determinant());
        let discriminant = 0.25 * trace * trace - det;
        if discriminant < 0.0 { det.sqrt() } else { 0.5 * trace.abs() + discriminant.sqrt() }
    }

    /// What disturbances held over each period can do within 0, 1, …, `steps` periods, starting from o = 0.
    pub fn reach(&self, steps: usize) -> Vec<Reach> {
        let mut impulse = self.gamma;
        let mut reach = Reach::default();
        let mut all = Vec::with_capacity(steps + 1);
        all.push(reach);
        for _ in 0..steps {
            reach.angle += impulse.x.abs();
            reach.rate += impulse.y.abs();
            reach.feedback += (self.gain.row() * impulse).x.abs();
            all.push(reach);
            impulse = self.phi * impulse;
        }
        all
    }

    /// The limit of [`Self::reach`] for infinitely many periods; `None` if the dynamics are not stable.
    pub fn reach_forever(&self) -> Option<Reach> {
        let radius = self.spectral_radius();
        if radius >= 1.0 - 1e-9 {
            return None;
        }
        // The impulse response falls at least as fast as n·radiusⁿ: carry on until the rest is below rounding.
        let steps = (60.0 / -radius.max(0.5).ln()).ceil() as usize;
        self.reach(steps).pop()
    }

    /// Shape X of an ellipse {o : oᵀ X⁻¹ o ≤ 1} that |Δ| ≤ `bound` can never drive the deviation out of:
    /// X = Φ X Φᵀ/(1−s) + Γ Γᵀ bound²/s, with the s that makes the product of its angle and rate extents smallest.
    /// `None` if the dynamics are not stable or the bound is not positive.
    pub fn invariant_ellipse(&self, bound: f64) -> Option<Matrix2<f64>> {
        let radius = self.spectral_radius();
        if radius >= 1.0 - 1e-9 || bound <= 0.0 {
            return None;
        }
        let shape = |s: f64| self.ellipse(s, bound);
        let largest = 1.0 - radius * radius;
        let candidates = (1..200).filter_map(|i| shape(largest * f64::from(i) / 200.0));
        candidates.min_by(|a, b| (a.m11 * a.m22).total_cmp(&(b.m11 * b.m22)))
    }

    fn ellipse(&self, s: f64, bound: f64) -> Option<Matrix2<f64>> {
        // The three unknowns of the symmetric X from X − Φ X Φᵀ/(1−s) = Γ Γᵀ bound²/s.
        let phi = self.phi / (1.0 - s).sqrt();
        let (a, b, c, d) = (phi.m11, phi.m12, phi.m21, phi.m22);
        let system = SMatrix::<f64, 3, 3>::identity()
            - SMatrix::<f64, 3, 3>::new(
                a * a,
                2.0 * a * b,
                b * b,
                a * c,
                a * d + b * c,
                b * d,
                c * c,
                2.0 * c * d,
                d * d,
            );
        let w = self.gamma * self.gamma.transpose() * (bound * bound / s);
        let x = system.lu().solve(&nalgebra::Vector3::new(w.m11, w.m12, w.m22))?;
        let x = Matrix2::new(x.x, x.y, x.y, x.z);
        (x.m11 > 0.0 && x.determinant() > 0.0).then_some(x)
    }

    /// Sampling period, s.
    pub fn period(&self) -> f64 {
        self.period
    }

    /// One period: o⁺ = Φ o + Γ Δ.
    pub fn advance(&self, deviation: &Vector2<f64>, disturbance: f64) -> Vector2<f64> {
        self.phi * deviation + self.gamma * disturbance
    }
}
