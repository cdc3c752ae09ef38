//! Shortcut of the check of a motion: about every tenth stage is evaluated, and serves its
//! neighbours as long as their sizes alone show that they keep the bounds that they set.
//!
//! Gain: mean time 0.044 → 0.031 ms (robust set), measured as in `mpc::shortcuts`.

use super::{Interval, Robust, largest_over_box};
use crate::crmpc::guarantee::End;
use crate::crmpc::stages::Point;
use crate::linearise::{BodyMotion, MomentSlopeBounds, TURN_BY_ANGLES};
use nalgebra::Vector3;
use std::f64::consts::SQRT_2;

/// A stage with known kinematics, from which neighbouring stages are estimated.
pub(super) struct Anchor {
    angles: Vector3<f64>,
    /// Derivative of the angles, x_ω.
    rates: Vector3<f64>,
    /// Norm of the rates, ‖x_ω‖.
    size: f64,
    pub(super) motion: BodyMotion,
    /// Largest ‖I W s‖ over the corners s of the unit box.
    bearing: f64,
    /// Upper bound on the growth of `bearing` with the angles.
    bearing_by_angles: f64,
}

impl Robust {
    /// Returns bounds of interval `k` and whether the motion keeps it. The bounds are the exact
    /// ones, or smaller ones that suffice. `anchor` is the stage evaluated last, which is replaced
    /// if it does not suffice.
    pub(super) fn examine(
        &self,
        k: usize,
        here: &Point,
        next: &Point,
        anchor: &mut Option<Anchor>,
    ) -> (Interval, bool) {
        if let Some(anchor) = anchor {
            let estimate = self.estimate(k, here, next, anchor);
            if estimate.keeps((0.0, 0.0)) {
                return (estimate, true);
            }
        }
        let estimate = self.estimate(k, here, next, anchor.insert(self.anchor(here)));
        if estimate.keeps((0.0, 0.0)) {
            return (estimate, true);
        }
        let exact = self.interval(k, here, next);
        (exact, exact.keeps(self.reserves()))
    }

    /// Evaluates a stage from which its neighbours are estimated.
    pub(super) fn anchor(&self, here: &Point) -> Anchor {
        let motion = here.motion(&self.settings.body);
        let bearing = largest_over_box(&motion.moment_by_acceleration);
        // ‖∂W/∂α‖² and ‖∂W/∂β‖² are at most 2, and the two are orthogonal.
        let bearing_by_angles = self.design.largest_inertia * SQRT_2 * 3.0_f64.sqrt();
        let Point { angles, rates, size, .. } = *here;
        Anchor { angles, rates, size, motion, bearing, bearing_by_angles }
    }

    /// Returns bounds that are at most those of [`Self::interval`], and norms that are at least
    /// those. Along the way from `anchor` to `here` and on to `next`, every change is bounded by
    /// the largest derivatives there.
    pub(super) fn estimate(
        &self,
        k: usize,
        here: &Point,
        next: &Point,
        anchor: &Anchor,
    ) -> Interval {
        let (largest_inertia, inertia_ratio) =
            (self.design.largest_inertia, self.design.inertia_ratio);
        let a = &here.acceleration;
        let size = next.size.max(here.size).max(anchor.size);
        let slopes = MomentSlopeBounds::new(size, here.pull, inertia_ratio);
        let (by_angles, by_rates) =
            (largest_inertia * slopes.by_angles, largest_inertia * slopes.by_rates);
        let turn = (here.angles - anchor.angles).xy().norm();
        let moment = (anchor.motion.moment(a) - self.terms.known).norm()
            + by_angles * turn
            + by_rates * (here.rates - anchor.rates).norm();
        let turn_within = (next.angles - here.angles).xy().norm();
        let after = moment + by_angles * turn_within + by_rates * (next.rates - here.rates).norm();
        let bearing = anchor.bearing + anchor.bearing_by_angles * turn;
        let end = |moment: f64, bearing: f64| End {
            moment,
            bearing,
            slopes: (by_angles, by_rates),
            size,
        };
        let ends =
            [end(moment, bearing), end(after, bearing + anchor.bearing_by_angles * turn_within)];
        Interval {
            rate: next.size,
            rate_bound: self.rate_bound(k + 1, TURN_BY_ANGLES * next.size, next, here),
            moment,
            moment_bound: self.moment_bound(k, &ends, here.pull),
        }
    }
}
