//! Parts of the limits on ‖ω‖ and ‖m‖ that a deviation uses.

use super::derivatives::{SPIN_BY_ANGLES_TWICE, SPIN_MIXED};
use super::deviation::Deviation;
use super::dynamics::Dynamics;
use super::geometry::{CURVATURE, DRIFT_BY_ANGLES_TWICE, DRIFT_MIXED, TURN};
use crate::crmpc::settings::Settings;
use crate::linearise::TURN_BY_ANGLES as TURN_OF_RATES;
use std::f64::consts::SQRT_2;
use vehicle::math::{powi, sin};

/// Returns the largest ‖I W s‖ over the corners s of the unit box at any α and |β| ≤ `sideslip`,
/// kg m².
/// With the larger eigenvalue λ of I² in the plane of symmetry, ‖I y‖² ≤ λ (y_x² + y_z²) + I_yy²
/// y_y² for y = W s. α turns y in that plane, and y_x² + y_z² = cos²β (s₁ sin β + s₃)² + s₂².
pub(super) fn induced_norm(s: &Settings, sideslip: f64) -> f64 {
    let square = s.body.inertia * s.body.inertia;
    let any = s.body.inertia.symmetric_eigenvalues().max() * 3.0_f64.sqrt();
    if square[(0, 1)] != 0.0 || square[(1, 2)] != 0.0 {
        return any;
    }
    let (xx, zz, xz, yy) = (square[(0, 0)], square[(2, 2)], square[(0, 2)], square[(1, 1)]);
    let plane = 0.5 * (xx + zz) + (0.25 * powi(xx - zz, 2) + xz * xz).sqrt();
    // The maximum of (1 − x²) (1 + x)² is at one half.
    let sine = sin(sideslip).min(0.5);
    let across = 1.0 + (1.0 - sine * sine) * powi(1.0 + sine, 2);
    (3.0 * yy + (plane - yy).max(0.0) * across).sqrt().min(any)
}

/// Loss of the rate limit by a deviation, rad/s: ‖W (x̃_ω + o_ω)‖ ≤ ‖W̃ x̃_ω‖ + ‖(W − W̃) x̃_ω‖ +
/// ‖o_ω‖.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::crmpc) struct RateLoss {
    pub(super) constant: f64,
    pub(super) by_angles: f64,
    pub(super) by_size: f64,
    /// Coefficients of ‖a‖, ‖x_ω‖ ‖a‖, ‖x_ω‖² and ‖x_ω‖³ in [`Self::within`].
    pub(super) within: [f64; 4],
}

impl RateLoss {
    /// Computes the loss of a deviation of the angles and rates (rad, rad/s). The deviation of the
    /// angles changes by up to `change` (rad) over an optimisation period `h` (s).
    pub(super) fn new(angle: f64, rate: f64, change: f64, h: f64) -> Self {
        // ∂ω/∂(α, β) is ∂W[·] x, which changes by ∂²W[x, ·] x + ∂W[·] a; its second derivative is
        // ∂³W[x, x, ·] x + ∂²W[a, ·] x + 2 ∂²W[x, ·] a, and that of ω is 2 Ẇ a + ∂²W[x, x] x +
        // ∂W[a] x.
        let quarter = 0.25 * change * h;
        let curved = 0.125 * h * h;
        let two = curved * SQRT_2 * angle;
        // |o₁² − o₂²| = |o₁ − o₂| (o₁ + o₂).
        let squares = 0.125 * CURVATURE * change * (2.0 * angle + change) * h;
        Self {
            constant: rate,
            by_angles: angle,
            by_size: 0.5 * CURVATURE * angle * angle,
            within: [
                quarter * TURN_OF_RATES + squares,
                3.0 * (curved * TURN + two * CURVATURE),
                quarter * CURVATURE,
                curved * CURVATURE + two * DRIFT_BY_ANGLES_TWICE,
            ],
        }
    }

    /// Returns the loss at a stage with ‖∂ω/∂(α, β)‖ = `by_angles` and ‖x̃_ω‖ = `size`, rad/s.
    #[inline]
    pub(in crate::crmpc) fn at(&self, by_angles: f64, size: f64) -> f64 {
        self.constant + by_angles * self.by_angles + size * self.by_size
    }

    /// Returns the largest amount by which ‖ω̃‖ and the loss together exceed, within an
    /// optimisation period with ‖x̃_ω‖ ≤ x and a held acceleration ‖a‖ ≤ a, the straight line
    /// between their values at both ends, rad/s.
    ///
    /// Each factor exceeds its own line by up to h²/8 times its second derivative. Where one factor
    /// of a product grows and the other falls, the product of two lines exceeds the line between
    /// its ends by up to a quarter of the product of both changes.
    #[inline]
    pub(in crate::crmpc) fn within(&self, x: f64, a: f64) -> f64 {
        let [of_a, xa, xx, xxx] = self.within;
        a * (of_a + xa * x) + x * x * (xx + xxx * x)
    }
}

/// Loss of the moment limit by a deviation, N m: m(x̃ + ô, a + K ô) = m(x̃, a) + I W K ô +
/// ∂m ô + terms of second order in ô. All of it belongs to the middle of a feedback period.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::crmpc) struct MomentLoss {
    /// Deviation of the angles, rad.
    pub(super) angle: f64,
    /// Deviation of the rates, rad/s.
    pub(super) rate: f64,
    /// Half width of the box part of K ô, rad/s².
    pub(super) feedback: f64,
    pub(super) induced_norm: f64,
    pub(super) constant: f64,
    pub(super) by_acceleration: f64,
    pub(super) by_size: f64,
    pub(super) by_size_squared: f64,
    /// h²/8 times the coefficients of ‖a‖², ‖a‖, ‖x_ω‖ ‖a‖, ‖x_ω‖² ‖a‖, and of ‖x_ω‖ to the powers
    /// 2, 3 and 4 in the second derivative of the moment and its loss.
    pub(super) curved: [f64; 7],
}

impl MomentLoss {
    /// Computes the loss of a deviation; `induced_norm` is [`Tightening::induced_norm`].
    /// The optimisation period is `h` (s).
    pub(in crate::crmpc) fn new(
        dynamics: &Dynamics,
        deviation: &Deviation,
        induced_norm: f64,
        h: f64,
    ) -> Self {
        let Deviation { feedback, feedback_norm, feedback_moment, .. } = *deviation;
        let (angle, rate) = (deviation.middle_angle, deviation.middle_rate);
        let largest = dynamics.largest;
        let spread = largest - dynamics.smallest;
        // The second derivatives are those of I W a, and of I Ẇ x + ω × I ω by rates, by both, and
        // by angles.
        let by_rates_twice = (largest * dynamics.geometry.drift + 0.5 * spread) * rate * rate;
        let [aa, xxa, xxxx] = std::array::from_fn(|i| {
            dynamics.curvature[i] + angle * dynamics.curvature_by_angles[i]
        });
        let [xa, xxx] = dynamics.curvature_by_rates.map(|c| rate * c);
        let [of_a, xx] = dynamics.curvature_of_induced_norm.map(|c| feedback * c);
        Self {
            curved: [aa, of_a, xa, xxa, xx, xxx, xxxx].map(|c| 0.125 * h * h * c),
            angle,
            rate,
            feedback,
            induced_norm,
            constant: feedback_norm * largest + feedback_moment + by_rates_twice,
            by_acceleration: 0.5 * largest * CURVATURE * angle * angle,
            by_size: (largest * DRIFT_MIXED + SPIN_MIXED * spread) * angle * rate,
            by_size_squared: 0.5
                * (largest * DRIFT_BY_ANGLES_TWICE + SPIN_BY_ANGLES_TWICE * spread)
                * angle
                * angle,
        }
    }

    /// Returns the loss at a point of the plan, N m. `induced_norm` is the largest ‖I W s‖ over the
    /// corners s of the unit box, at the vehicle's angles (kg m²), `slopes` holds ‖∂m/∂(α, β)‖ and
    /// ‖∂m/∂x_ω‖, and `sizes` holds ‖x̃_ω‖ and ‖a‖.
    #[inline]
    pub(in crate::crmpc) fn at(
        &self,
        induced_norm: f64,
        slopes: (f64, f64),
        sizes: (f64, f64),
    ) -> f64 {
        let (x, a) = (sizes.0 + self.rate, sizes.1);
        self.feedback * induced_norm
            + self.constant
            + slopes.0 * self.angle
            + slopes.1 * self.rate
            + self.by_acceleration * a
            + (self.by_size + self.by_size_squared * x) * x
    }
}

/// One end of an interval of the plan, with the acceleration that is held in it.
#[derive(Clone, Copy, Debug)]
pub(in crate::crmpc) struct End {
    /// Norm of the moment, ‖m̃‖, N m.
    pub moment: f64,
    /// Largest ‖I W s‖ over the corners s of the unit box, kg m².
    pub induced_norm: f64,
    /// Norms of ∂m/∂(α, β) and of ∂m/∂x_ω.
    pub slopes: (f64, f64),
    /// Norm of the rates, ‖x̃_ω‖, rad/s.
    pub size: f64,
}

/// Acceleration in an interval of the plan, and its feedback periods.
#[derive(Clone, Copy, Debug)]
pub(in crate::crmpc) struct Held {
    /// Norm of the held acceleration, ‖a‖, rad/s².
    pub acceleration: f64,
    /// Number of feedback periods in it.
    pub ratio: usize,
    /// Share of the loss that counts.
    pub share: f64,
}

impl MomentLoss {
    /// Returns a bound on ‖m‖ at the middles of all feedback periods of an interval, for any
    /// deviation, N m.
    ///
    /// ‖m̃‖ and every factor of the loss lie below the straight line between their values at both
    /// ends, or exceed it by at most h²/8 times their second derivative; so does their sum. The
    /// first middle is half a feedback period after the beginning, the last one as much before the
    /// end.
    #[inline]
    pub(in crate::crmpc) fn largest_moment(
        &self,
        dynamics: &Dynamics,
        ends: &[End; 2],
        held: Held,
    ) -> f64 {
        let Held { acceleration: a, ratio, share } = held;
        let [from, to] = ends;
        let shift = 0.5 / ratio as f64;
        let on_the_line = |from: f64, to: f64| {
            let (low, high) = if from < to { (from, to) } else { (to, from) };
            high - shift * (high - low)
        };
        let [apart, to_apart] =
            [from, to].map(|end| end.moment + share * self.at(0.0, end.slopes, (end.size, a)));
        let feedback = share * self.feedback;
        // The deviation turns the vehicle, but no attitude needs more than `induced_norm`.
        let turned = feedback * dynamics.largest * TURN * 3.0_f64.sqrt() * self.angle;
        let along = on_the_line(
            apart + feedback * from.induced_norm,
            to_apart + feedback * to.induced_norm,
        ) + turned;
        let anywhere = on_the_line(apart, to_apart) + feedback * self.induced_norm;
        let x = from.size.max(to.size);
        let [aa, of_a, xa, xxa, xx, xxx, xxxx] = self.curved;
        let curved = a * (aa * a + of_a + x * (xa + x * xxa)) + x * x * (xx + x * (xxx + x * xxxx));
        along.min(anywhere) + curved
    }
}

impl Dynamics {
    /// Returns bounds on ‖∂m/∂(α, β)‖ and ‖∂m/∂x_ω‖ for ‖x_ω‖ ≤ x and ‖a‖ ≤ a at any attitude of
    /// the domain.
    pub(super) fn slopes(&self, x: f64, a: f64) -> (f64, f64) {
        let Self { largest, gyroscopic, geometry, .. } = self;
        (
            largest * (TURN_OF_RATES * a + CURVATURE * x * x) + TURN_OF_RATES * gyroscopic * x * x,
            (largest * geometry.drift_by_rates + gyroscopic) * x,
        )
    }

    /// Returns a bound on ‖m‖ for ‖x_ω‖ ≤ x and ‖a‖ ≤ a, N m.
    pub(super) fn nominal_moment(&self, x: f64, a: f64) -> f64 {
        let Self { largest, smallest, geometry, .. } = self;
        largest * (a + geometry.drift * x * x) + 0.5 * (largest - smallest) * x * x
    }
}
