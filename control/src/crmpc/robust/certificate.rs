//! The certificate of a plan: the conditions of the theorem (docs/guarantee.md), and the margins
//! that the plan leaves.

use super::{Interval, RESERVE, Robust, norm_of_columns};
use crate::crmpc::guarantee;
use crate::crmpc::horizon::{PlanPoint, points};
use crate::crmpc::memory::{Margins, Memory};
use crate::crmpc::settings::Settings;
use crate::crmpc::stages::Point;
use crate::mpc::ErrorTrajectory;

/// Properties of a plan that satisfies the conditions of the theorem.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Certified {
    pub margins: Margins,
    /// Braking rate beyond the horizon, see [`crate::crmpc::Plan::braking`].
    pub braking: f64,
}

impl Robust {
    /// Returns the certificate of a plan, or `None` if it does not satisfy the conditions of the
    /// theorem (docs/guarantee.md), which require the whole tightening.
    ///
    /// `checked` says that [`crate::mpc::Bounded::violated`] has already found no violation in it.
    pub(super) fn certify(&self, motion: &ErrorTrajectory<2>, checked: bool) -> Option<Certified> {
        let Self { dynamics, design, stages, .. } = self;
        let n = motion.inputs.len();
        if design.accepted_share < 1.0
            || self.share < 1.0
            || !checked && self.first_and_last(motion, 0..n, |_, _| ()).is_some()
        {
            return None;
        }
        // The first state, which no optimisation can change, and the last one, beyond which the
        // motion brakes, are checked separately.
        let [first, second, last] = [0, 1, n].map(|k| stages.point(motion, k));
        let rates = first.motion(&stages.body);
        let bound = self.rate_bound(0, norm_of_columns(&rates.rates_by_angles), &first, &second);
        let sideslip = |k: usize| {
            let input = motion.inputs.get(k).copied().unwrap_or_default();
            stages.nominal(k, &motion.states[k], &input).map(|vector| vector.y)
        };
        let inside = (0..n).all(|k| {
            let [beta, rate, a] = sideslip(k);
            self.keeps_sideslip(k, [beta, rate], a, sideslip(k + 1)[0])
        });
        let (size, bound) = (rates.rates.norm(), bound + self.reserves().0);
        if !inside || size > bound {
            return None;
        }
        let end = self.horizon_end(&last);
        let (settings, tightening) = (self.settings_of_plan(), self.tightening());
        let braking = guarantee::braking(&settings, dynamics, tightening, &end)?;
        Some(Certified { margins: self.margins_of_first(&first, &second), braking })
    }

    /// Returns whether |β| stays within its bound throughout interval `k`, whatever the error
    /// dynamics do.
    ///
    /// Within the interval β̃ is a parabola, and the deviation lies below the straight line between
    /// its values at both ends plus the bulge, so that the largest value of the sum is exact.
    ///
    /// `here` holds β̃ and its derivative at the beginning, `a` is its second derivative, and `end`
    /// is β̃ at the end.
    pub(super) fn keeps_sideslip(&self, k: usize, here: [f64; 2], a: f64, end: f64) -> bool {
        let Settings { period_optimisation: h, sideslip_domain, .. } = self.settings;
        let tightening = self.tightening();
        let [from, to] = [k, k + 1].map(|k| tightening.at(self.tick(k)).angle);
        let slope = (to - from) / h;
        let largest = |sign: f64| {
            let (rate, a) = (sign * here[1] + slope, sign * a);
            let (before, after) = (sign * here[0] + from, sign * end + to);
            let at_top = if a < 0.0 && rate > 0.0 && rate < -a * h {
                before - 0.5 * rate * rate / a
            } else {
                before
            };
            at_top.max(after)
        };
        largest(1.0).max(largest(-1.0)) + tightening.tick(self.tick(k)).bulge <= sideslip_domain
    }

    /// Shows the plan in force, with the bounds that its certificate has checked.
    pub(super) fn show(&self, memory: &mut Memory) {
        let Memory { plan, shown, .. } = memory;
        let n = self.settings.horizon;
        let reserves = self.reserves();
        for (slot, k) in shown.iter_mut().zip(points(n)) {
            let begins = k.min(n - 1);
            let interval = self.interval(begins, &plan.point(begins), &plan.point(begins + 1));
            let (here, beside) = (plan.point(k), plan.point(if k == 0 { 1 } else { k - 1 }));
            let rates = here.motion(&self.stages.body);
            let by_angles = norm_of_columns(&rates.rates_by_angles);
            *slot = PlanPoint {
                rate: rates.rates.norm(),
                rate_bound: self.rate_bound(k, by_angles, &here, &beside) + reserves.0,
                moment: interval.moment,
                moment_bound: interval.moment_bound + reserves.1,
            };
        }
    }

    /// Returns the margins of a trajectory.
    pub(super) fn margins(&self, motion: &ErrorTrajectory<2>) -> Margins {
        self.margins_of_first(&self.stages.point(motion, 0), &self.stages.point(motion, 1))
    }

    /// Returns the margins of the first interval.
    fn margins_of_first(&self, first: &Point, second: &Point) -> Margins {
        let Interval { rate, rate_bound, moment, moment_bound } = self.interval(0, first, second);
        let Settings { limit_rate, limit_moment, .. } = self.settings;
        let left = |bound: f64, value: f64, limit: f64| (bound - value) / limit + RESERVE;
        Margins {
            rate: left(rate_bound, rate, limit_rate),
            moment: left(moment_bound, moment, limit_moment),
        }
    }
}
