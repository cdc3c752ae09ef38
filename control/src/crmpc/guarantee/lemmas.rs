//! The numbers on which the guarantee rests, for its machine check.

use super::dynamics::Dynamics;
use super::geometry::{CURVATURE, TURN};
use super::losses::induced_norm;
use super::mismatch::gyroscopic;
use super::parts::Parts;
use crate::crmpc::settings::Settings;
use vehicle::math::powi;

/// The bounds that the proof uses, as this crate computes them. The lines that compute the bounds
/// explain them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lemmas {
    /// Bounds on the dynamics.
    pub dynamics: Dynamics,
    /// Parts of the deviation.
    pub parts: Parts,
    /// Bounds of ∂(ω × I ω)/∂ω, and of I⁻¹ times that derivative.
    pub gyroscopic: (f64, f64),
    /// Largest ‖I W s‖ over the corners s of the unit box in the domain, kg m².
    pub induced_norm: f64,
}

impl Lemmas {
    /// Computes the bounds for the settings `s`.
    pub fn new(s: &Settings) -> Self {
        Self::of(s, Dynamics::new(s))
    }

    /// Computes the bounds for the time before the nominal trajectory began.
    pub fn before(s: &Settings) -> Self {
        Self::of(s, Dynamics::new(s).before(s))
    }

    fn of(s: &Settings, dynamics: Dynamics) -> Self {
        let parts = Parts::new(s, &dynamics);
        let induced_norm = induced_norm(s, dynamics.domain.sideslip);
        Self { dynamics, parts, gyroscopic: gyroscopic(s), induced_norm }
    }

    /// Returns bounds on ‖∂m/∂(α, β)‖, ‖∂m/∂x_ω‖ and ‖m‖ for ‖x_ω‖ ≤ x and ‖a‖ ≤ a.
    pub fn moment(&self, x: f64, a: f64) -> [f64; 3] {
        let (by_angles, by_rates) = self.dynamics.slopes(x, a);
        [by_angles, by_rates, self.dynamics.nominal_moment(x, a)]
    }

    /// Returns bounds on the second time derivatives of m, of ω (2 Ẇ a + ∂²W [x, x] x + ∂W [a] x),
    /// of ∂m/∂(α, β) and ∂m/∂x_ω (Frobenius) and of the largest ‖I W s‖, along a nominal trajectory
    /// with a held, for ‖x_ω‖ ≤ x and ‖a‖ ≤ a.
    pub fn curvatures(&self, x: f64, a: f64) -> [f64; 5] {
        let Dynamics {
            curvature,
            curvature_by_angles,
            curvature_by_rates,
            curvature_of_induced_norm,
            ..
        } = self.dynamics;
        let square = x * x;
        let ([aa, xxa, xxxx], [by_aa, by_xxa, by_xxxx]) = (curvature, curvature_by_angles);
        let ([xa, xxx], [of_a, xx]) = (curvature_by_rates, curvature_of_induced_norm);
        [
            aa * a * a + x * x * (xxa * a + xxxx * x * x),
            3.0 * TURN * x * a + CURVATURE * powi(x, 3),
            by_aa * a * a + square * (by_xxa * a + by_xxxx * square),
            x * (xa * a + xxx * square),
            of_a * a + xx * square,
        ]
    }
}
