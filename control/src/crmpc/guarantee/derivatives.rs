//! Bounds on the derivatives of the acceleration F and of the moment m by the product rule, with
//! the bounds on the derivatives of W from [`super::geometry`] (docs/proof.md, steps 1 and 4).
//!
//! B is the symmetric bilinear form with B(ω, ω) = 2 ω × I ω, and ‖B(u, v)‖ ≤ (I_max − I_min) ‖u‖
//! ‖v‖. With ω = W x its derivatives are
//!
//! - by rates and angles B(∂W[o] x, W v) + B(W x, ∂W[o] v), at most 2 √2 ‖x‖, see [`SPIN_MIXED`];
//! - twice by angles B(∂²W[o, o] x, W x) + B(∂W[o] x, ∂W[o] x), at most (√10 + 2) ‖x‖², see
//!   [`SPIN_BY_ANGLES_TWICE`].

use super::geometry::{CURVATURE, DRIFT_BY_ANGLES_TWICE, DRIFT_MIXED, FOURTH, Geometry, TURN};
use std::f64::consts::SQRT_2;

/// Bound on the mixed second derivative of ω × I ω by angles and rates, relative to (I_max − I_min)
/// ‖x‖: 2 √2, rounded up.
pub(super) const SPIN_MIXED: f64 = 4.0;
/// Bound on the second derivative of ω × I ω by the angles, relative to (I_max − I_min) ‖x‖²: √10 +
/// 2, rounded up.
pub(super) const SPIN_BY_ANGLES_TWICE: f64 = 12.0;

/// Bounds on F = R G with G = I⁻¹ (m − ω × I ω) − Ẇ x, and on its derivatives (step 1). The
/// derivative of R is ∂R = −R ∂W R.
#[derive(Clone, Copy)]
pub(super) struct Acceleration {
    pub(super) geometry: Geometry,
    /// Bound on ‖ω‖, rad/s.
    pub(super) omega: f64,
    /// Bound on ‖x‖ = ‖R ω‖, rad/s.
    pub(super) rate: f64,
    /// Bound on ‖I⁻¹ (m − ω × I ω)‖, rad/s².
    pub(super) driven: f64,
    /// Bound on ‖I⁻¹ B(u, v)‖ relative to ‖u‖ ‖v‖.
    pub(super) spread: f64,
    /// Bound on ‖∂(I⁻¹ (ω × I ω))/∂ω‖ relative to ‖ω‖ (Frobenius).
    pub(super) spinning: f64,
}

impl Acceleration {
    /// Bound on ‖G‖, rad/s².
    fn inner(&self) -> f64 {
        self.driven + self.geometry.drift * self.rate * self.rate
    }

    /// Bound on ‖F‖, rad/s².
    pub(super) fn size(&self) -> f64 {
        self.geometry.r * self.inner()
    }

    /// Bound on ‖∂F/∂x‖, 1/s: those of Ẇ x and of I⁻¹ (ω × I ω).
    pub(super) fn by_rates(&self) -> f64 {
        let Geometry { drift_by_rates, r, .. } = self.geometry;
        r * (drift_by_rates * self.rate + self.spinning * self.omega)
    }

    /// Bound on ‖∂R‖ along a unit vector.
    fn of_r(&self) -> f64 {
        TURN * self.geometry.r * self.geometry.r
    }

    /// Bound on ‖∂F/∂(α, β)‖, 1/s²: ∂R G + R ∂G, where Ẇ x takes a second derivative of W and the
    /// gyroscopic term ∂ω = ∂W x.
    pub(super) fn by_angles(&self) -> f64 {
        let Self { omega, rate, spinning, .. } = *self;
        self.of_r() * self.inner()
            + self.geometry.r * (CURVATURE * rate * rate + spinning * omega * TURN * rate)
    }

    /// Bound on ‖d²F/dt²‖ with m held, rad/s⁴: F_xx [a, a] + 2 F_xθ [a, x] + F_θθ [x, x] + F_θ a +
    /// F_x ȧ with a = F and ȧ = F_x a + F_θ x.
    pub(super) fn jerk(&self) -> f64 {
        let Self { rate, spread, .. } = *self;
        let (a, by_rates, by_angles) = (self.size(), self.by_rates(), self.by_angles());
        let (r, of_r) = (self.geometry.r, self.of_r());
        // F is of second degree in x.
        let by_rates_twice = 2.0 * (by_rates / rate);
        let mixed = of_r * by_rates + r * (DRIFT_MIXED + SPIN_MIXED * spread) * rate;
        // ∂²R = 2 R ∂W R ∂W R − R ∂²W R.
        let by_angles_twice = 2.0 * of_r * by_angles
            + (CURVATURE * r * r + 2.0 * of_r * of_r) * self.inner()
            + r * (DRIFT_BY_ANGLES_TWICE + SPIN_BY_ANGLES_TWICE * spread) * rate * rate;
        by_rates_twice * a * a
            + 2.0 * mixed * a * rate
            + by_angles_twice * rate * rate
            + by_angles * a
            + by_rates * (by_rates * a + by_angles * rate)
    }
}

/// Bounds on second derivatives along a nominal trajectory with a held, of m = I W a + I Ẇ x + ω ×
/// I ω and of its derivatives (step 4): coefficients of powers of ‖x‖ and ‖a‖. Here ẋ = a and Θ̈ =
/// a.
#[derive(Clone, Copy)]
pub(super) struct Curvatures {
    /// Largest moment of inertia, kg m².
    pub(super) largest: f64,
    /// Bound on ‖B(u, v)‖ relative to ‖u‖ ‖v‖, I_max − I_min, kg m².
    pub(super) spread: f64,
}

impl Curvatures {
    /// Of ‖a‖², ‖x‖² ‖a‖ and ‖x‖⁴ in ‖d²m/dt²‖. I Ẅ a gives ∂²W [x, x] a + ∂W [a] a. With G = I Ẇ x
    /// + ω × I ω the rest is G_xx [a, a] + 2 G_xθ [a, x] + G_θθ [x, x] + G_θ [a].
    pub(super) fn of_moment(&self, drift: f64) -> [f64; 3] {
        let Self { largest, spread } = *self;
        [
            largest * TURN + 2.0 * (largest * drift + 0.5 * spread),
            2.0 * largest * CURVATURE
                + 2.0 * (largest * DRIFT_MIXED + SPIN_MIXED * spread)
                + TURN * SQRT_2 * spread,
            largest * DRIFT_BY_ANGLES_TWICE + SPIN_BY_ANGLES_TWICE * spread,
        ]
    }

    /// Of the same powers in ‖d²/dt² ∂m/∂(α, β)‖ (Frobenius, of two columns).
    ///
    /// ∂m/∂(α, β) [o] is I (∂W[o] a + ∂²W[x, o] x) + B(ω, P) with P = ∂W[o] x. With the bounds t,
    /// c, d and f on the first four derivatives of W, ‖ω̇‖ ≤ t x² + a, ‖ω̈‖ ≤ 3 t x a + c x³, ‖P‖ ≤ t
    /// x, ‖Ṗ‖ ≤ c x² + t a and ‖P̈‖ ≤ d x³ + 3 c x a. The first term gives d x² a + c a², the second
    /// f x⁴ + 5 d x² a + 2 c a², and B(ω̈, P) + 2 B(ω̇, Ṗ) + B(ω, P̈) the others.
    pub(super) fn by_angles(&self) -> [f64; 3] {
        let Self { largest, spread } = *self;
        [
            SQRT_2 * (3.0 * largest * CURVATURE + 2.0 * spread * TURN),
            SQRT_2
                * (6.0 * largest * DRIFT_BY_ANGLES_TWICE
                    + 5.0 * spread * (TURN * TURN + CURVATURE)),
            SQRT_2 * (largest * FOURTH + spread * (3.0 * TURN * CURVATURE + DRIFT_BY_ANGLES_TWICE)),
        ]
    }

    /// Of ‖x‖ ‖a‖ and ‖x‖³ in ‖d²/dt² ∂m/∂x‖ (Frobenius, of three columns).
    ///
    /// ∂m/∂x [v] is I (∂W[v] x + ∂W[x] v) + B(ω, W v). Each of the first two terms gives d x³ + 3 c
    /// x a. With ‖Ẇ v‖ ≤ t x and ‖Ẅ v‖ ≤ c x² + t a, the last one gives (3 + 2 + 1) t x a and 2 (c +
    /// t²) x³.
    pub(super) fn by_rates(&self) -> [f64; 2] {
        let (Self { largest, spread }, root3) = (*self, 3.0_f64.sqrt());
        [
            root3 * (6.0 * largest * CURVATURE + 6.0 * spread * TURN),
            root3
                * (2.0 * largest * DRIFT_BY_ANGLES_TWICE
                    + 2.0 * spread * (CURVATURE + TURN * TURN)),
        ]
    }

    /// Of ‖a‖ and ‖x‖² in the second derivative of the largest ‖I W s‖ over the corners s of the
    /// unit box, ‖s‖ = √3.
    pub(super) fn of_box(&self) -> [f64; 2] {
        let root3 = 3.0_f64.sqrt();
        [root3 * self.largest * TURN, root3 * self.largest * CURVATURE]
    }
}
