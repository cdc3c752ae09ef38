//! Bounds that follow from the sizes of x_ω and a alone.

use std::f64::consts::SQRT_2;

/// Bound on ‖∂(W y)/∂(α, β)‖ relative to ‖y‖ (Frobenius): √(5/2). The largest eigenvalue λ of the
/// quadratic form in y solves λ² − (2 + c²(1 + s²)) λ + c²(1 + c²) = 0 with s = sin β, c = cos β,
/// and is below 5/2 at any β.
pub const TURN_BY_ANGLES: f64 = 1.581_138_830_084_189_8;

/// Bounds on the derivatives of the moment that follow from the sizes of x_ω and a alone, relative
/// to the largest moment of inertia.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MomentSlopeBounds {
    /// Bound on ‖∂m/∂(α, β)‖ (Frobenius).
    pub by_angles: f64,
    /// Bound on ‖∂m/∂x_ω‖ (Frobenius).
    pub by_rates: f64,
}

impl MomentSlopeBounds {
    /// Computes the bounds for any angles, with ‖x_ω‖ ≤ x, ‖a‖ ≤ a and this ratio of the largest to
    /// the smallest moment of inertia.
    ///
    /// The columns above give, in Frobenius' norm, ‖∂W/∂α‖² ≤ 2 and ‖∂W/∂β‖² = 2, orthogonal to
    /// each other, hence ‖Ẇ‖² ≤ 2 ‖x‖². They also give ‖∂W/∂α y‖² + ‖∂W/∂β y‖² ≤ 5/2 ‖y‖², and
    /// ‖∂²W y‖² ≤ (1 + 2 · 2 + 5) ‖y‖² over α², twice αβ, and β². With principal axes,
    /// ‖∂(ω × I ω)/∂ω‖² ≤ 2 (I_max − I_min)² ‖ω‖², and ‖ω‖ ≤ ‖x‖ as ‖W‖ = 1 (Lemma 1).
    pub fn new(x: f64, a: f64, ratio: f64) -> Self {
        let gyroscopic = SQRT_2 * (1.0 - 1.0 / ratio);
        Self {
            by_angles: TURN_BY_ANGLES * (a + gyroscopic * x * x) + 10.0_f64.sqrt() * x * x,
            by_rates: (SQRT_2 + TURN_BY_ANGLES + gyroscopic) * x,
        }
    }
}

/// Returns a bound on ‖u‖ at any α and this β, with ‖x_ω‖ = `x` and ‖a‖ = `a`. `ratio` is that of
/// the largest to the smallest moment of inertia.
///
/// u = a − f with f = −R (Ẇ x_ω + I⁻¹ (ω × I ω)); ‖R‖² ≤ 2 + 1/cos²β in Frobenius' norm, and
/// ‖ω × I ω‖ ≤ ½ (I_max − I_min) ‖ω‖².
pub fn input_bound(beta: f64, x: f64, a: f64, ratio: f64) -> f64 {
    let cosine = (1.0 - 0.5 * beta * beta).max(0.0);
    let r = (2.0 + 1.0 / (cosine * cosine)).sqrt();
    a + r * (3.0_f64.sqrt() + 0.5 * (ratio - 1.0)) * x * x
}
