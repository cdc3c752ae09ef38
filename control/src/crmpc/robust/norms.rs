//! The robust set as norm constraints of the optimisation: their linearisation and their bounds
//! about a trajectory.

use super::{Interval, Robust};
use crate::crmpc::set::{ROUNDING, norm_constraint};
use crate::crmpc::settings::Settings;
use crate::crmpc::stages::Point;
use crate::linearise::InverseKinematics;
use crate::mpc::constraints::StagePoint;
use crate::mpc::{self, Bounded, ErrorTrajectory, StageConstraints, State};
use nalgebra::Vector3;
use std::ops::Range;
use vehicle::math::cos;

impl Robust {
    /// Returns the range from the first to the last of these intervals that the trajectory
    /// violates with the bounds about itself or smaller ones. `keep` receives the bounds.
    pub(super) fn first_and_last(
        &self,
        motion: &ErrorTrajectory<2>,
        intervals: Range<usize>,
        mut keep: impl FnMut(usize, (f64, f64)),
    ) -> Option<Range<usize>> {
        self.carry(motion);
        self.stages.first_and_last(motion, intervals, |k, here, next, anchor| {
            let (Interval { rate_bound, moment_bound, .. }, kept) =
                self.examine(k, here, next, anchor);
            keep(k, (rate_bound, moment_bound));
            !kept
        })
    }
}

impl Bounded<2> for Robust {
    fn constrains_states(&self) -> bool {
        true
    }

    fn norm_constraints(
        &self,
        k: usize,
        state: &State<2>,
        input: &Vector3<f64>,
        bounds: (f64, f64),
    ) -> StageConstraints<2> {
        let [angles, rates, a] = self.stages.nominal(k, state, input);
        let at = InverseKinematics::at(&angles).linearise(&self.stages.body, &rates, &a);
        let (rate, moment) = self.nonempty(bounds);
        StageConstraints {
            state: norm_constraint(&at.rates, rate),
            input: norm_constraint(&self.asked(at.moment), moment),
        }
    }

    fn squares(
        &self,
        k: usize,
        state: &State<2>,
        input: &Vector3<f64>,
        bounds: (f64, f64),
    ) -> (f64, f64) {
        let [angles, rates, a] = self.stages.nominal(k, state, input);
        let kinematics = InverseKinematics::at(&angles);
        let (rate, moment) = self.nonempty(bounds);
        let state = kinematics.body_rates(&rates).0 / rate;
        let input = (kinematics.moment(&self.stages.body, &rates, &a) - self.terms.known) / moment;
        (state.norm_squared(), input.norm_squared())
    }

    fn violated(
        &self,
        motion: &ErrorTrajectory<2>,
        intervals: Range<usize>,
        bounds: &mut mpc::Bounds,
    ) -> Option<Range<usize>> {
        self.first_and_last(motion, intervals, |k, about| bounds.set(k, about))
    }

    fn bounds_about(
        &self,
        motion: &ErrorTrajectory<2>,
        intervals: Range<usize>,
        bounds: &mut mpc::Bounds,
    ) {
        self.carry(motion);
        let mut here = self.stages.point(motion, intervals.start);
        for k in intervals {
            let next = self.stages.point(motion, k + 1);
            let interval = self.interval(k, &here, &next);
            bounds.set(k, (interval.rate_bound, interval.moment_bound));
            here = next;
        }
    }

    fn bounds_between(
        &self,
        k: usize,
        here: StagePoint<2>,
        next: StagePoint<2>,
    ) -> Option<(f64, f64)> {
        let point = |k: usize, (state, input): StagePoint<2>| {
            let [angles, rates, a] = self.stages.nominal(k, state, input);
            let last = k == self.settings.horizon;
            Point::new(angles, rates, if last { Vector3::zeros() } else { a })
        };
        let interval = self.interval(k, &point(k, here), &point(k + 1, next));
        Some((interval.rate_bound, interval.moment_bound))
    }

    fn depends_on_trajectory(&self) -> bool {
        true
    }

    fn has_another_start(&self) -> bool {
        self.another
    }

    /// Returns whether the full moment over one interval cannot bring the rates down to the bound
    /// at its end.
    fn out_of_reach(&self, start: &State<2>) -> bool {
        let [angles, rates, _] = self.stages.nominal(0, start, &Vector3::zeros());
        let (body, h) = (&self.stages.body, self.stages.step);
        let Settings { limit_rate, .. } = self.settings;
        let at_rest = InverseKinematics::at(&angles).motion(body, &rates).moment_at_rest;
        let secant = 1.0 / cos(angles.y);
        let most = secant * self.settings.limit_total() / self.design.smallest_inertia;
        let drift = vehicle::kinematics::r(&angles) * (body.inverse * -at_rest);
        // The sideslip will have changed by then.
        let beta = angles.y.abs() + h * (rates.norm() + h * (drift.norm() + most));
        if beta >= std::f64::consts::FRAC_PI_3 {
            return false;
        }
        // x_ω after an interval without input, less the largest change by the input.
        let least = (rates + drift * h).norm() - h * most;
        least > limit_rate / cos(beta) * (1.0 + ROUNDING)
    }
}
