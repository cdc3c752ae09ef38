//! Bounds on the kinematics that hold at any attitude.

use std::f64::consts::SQRT_2;
use vehicle::math::{powi, sin_cos};

/// Part of the state space in which the dynamics are bounded.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Domain {
    /// Bound on ‖ω‖, rad/s.
    pub rate: f64,
    /// Bound on |β|, rad.
    pub sideslip: f64,
}

/// Bounds that depend on |sin β| ≤ s alone.
///
/// With e₁, e₂, e₃ turned by α, Ẇ x_ω = [s x₂ (2 s x₁ + x₃), −c x₂ (2 s x₁ + x₃),
/// c x₁ (s x₁ + x₃)], where s = sin β, c = cos β, x = x_ω.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Geometry {
    /// Factor in the bound ‖Ẇ x‖ ≤ `drift` ‖x‖².
    pub drift: f64,
    /// Factor in the bound ‖∂(Ẇ x)/∂x‖ ≤ `drift_by_rates` ‖x‖.
    pub drift_by_rates: f64,
    /// Norm ‖R‖ = sec β (Lemma 1).
    pub r: f64,
}

/// Bound on ‖∂²(W y)/∂(α, β)²‖ relative to ‖y‖.
pub const CURVATURE: f64 = 3.162_277_660_168_379_5;
/// Bound on ‖W(Θ + o) − W(Θ)‖ relative to ‖o‖: ∂W/∂α and ∂W/∂β are orthogonal and no longer than √2
/// (Frobenius).
pub const TURN: f64 = SQRT_2;
/// Bound on the mixed second derivative of Ẇ x by angles and rates, relative to ‖x‖.
/// Ẇ x = ∂W x α̇ + ∂W x β̇ takes one more derivative of W.
pub const DRIFT_MIXED: f64 = 2.0 * CURVATURE;
/// Bound on the second derivative of Ẇ x by the angles, relative to ‖x‖², from the third
/// derivatives of W.
pub const DRIFT_BY_ANGLES_TWICE: f64 = 8.0;
/// Bound on ‖∂⁴(W y)/∂(α, β)⁴‖ relative to ‖y‖. Along a line of unit speed in (α, β), W y is a sum
/// of sines whose frequencies are at most |α̇| + 2 |β̇| ≤ √5. As ‖W y‖ ≤ ‖y‖ everywhere, Bernstein's
/// inequality bounds the fourth derivative by √5⁴.
pub const FOURTH: f64 = 25.0;
/// Largest z for which 1/(1 − z) ≤ exp(2 z) is used; it is true up to 0.79.
pub(super) const LARGEST_IN_TURN: f64 = 0.75;
/// Number of domains that are tried until one contains its predictions.
pub(super) const DOMAINS: usize = 50;
/// Widest sideslip angle of a domain, rad.
pub(super) const WIDEST: f64 = 0.95;
/// Rate at which the nominal trajectory brakes beyond the horizon, a = −κ x̃_ω, 1/s; for the
/// sideslip it is the smallest rate, see the module `braking`.
pub const BRAKING: f64 = 0.01;

impl Geometry {
    /// Computes the bounds for |β| ≤ `sideslip` (rad, below π/2).
    pub fn new(sideslip: f64) -> Self {
        let (s, c) = sin_cos(sideslip);
        let (s2, c2) = (s * s, c * c);
        // ‖Ẇ x‖² = x₂² (2 s x₁ + x₃)² + c² x₁² (s x₁ + x₃)² ≤ A u (1 − u) + E u² with u = x₁² + x₃²
        // for ‖x‖ = 1.
        let a = 1.0 + 4.0 * s2;
        let e = c2 * powi(0.5 * (s + (1.0 + s2).sqrt()), 2);
        let square = if 2.0 * e < a { a * a / (4.0 * (a - e)) } else { e };
        // The rows of its derivative, [2 s x₂, 2 s x₁ + x₃, x₂] and c [2 s x₁ + x₃, 0, x₁], are
        // squared and added up.
        let trace = (1.0 + c2) * a + c2;
        let determinant = c2 * (1.0 + c2);
        let by_rates = (0.5 * (trace + (trace * trace - 4.0 * determinant).sqrt())).max(a);
        Self { drift: square.sqrt(), drift_by_rates: by_rates.sqrt(), r: 1.0 / c }
    }
}
