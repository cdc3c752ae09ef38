//! Passes of an optimisation. For each pass the bounds (and the linearised constraints) are
//! computed about a trajectory: first about the first guess, then about the optimum of the last
//! pass.

use super::layout::MARGIN;
use super::optimiser::{Optimiser, Sample};
use super::problem::Solution;
use super::settings::Method;
use crate::report::SolverStatus;
use std::mem::replace;

/// A multiplier counts as active above this share of the largest one.
const ACTIVE: f64 = 1e-3;
/// The previous plan is no guess if the unconstrained optimum violates intervals this far beyond
/// the last active one. A jump of the reference has then entered the horizon. Bounds that do not
/// depend on the trajectory need no such rule: the search then recovers faster than it begins anew.
const NEWS: usize = 10;
/// Largest number of passes until an optimum satisfies the bounds computed about it.
const SETTLING_PASSES: usize = 8;
/// Largest number of passes until a first optimisation with linearised constraints stands still.
const FIRST_PASSES: usize = 20;

impl<const O: usize> Optimiser<O> {
    /// Chooses the first guess and the trajectory about which the first bounds are computed. This
    /// is done once, by the first solver that iterates.
    pub(super) fn prepare(&mut self, sample: &Sample<O>) {
        if self.search.has_begun() {
            return;
        }
        if sample.bounded.out_of_reach(sample.start) {
            self.search.give_up();
            return;
        }
        self.begin_cold(sample);
        let Some((previous, active)) = sample.previous else {
            self.linearisation_point.clone_from(&self.solution.trajectory);
            return;
        };
        self.linearisation_point.states[0] = *sample.start;
        self.unconstrained.track(previous, sample.affine, &mut self.linearisation_point);
        // Where the terminal constraint is active, each sample has one more stage to reach it, and
        // successive plans differ too much for a warm start.
        if self.settings.method == Method::Riccati && self.search.outside.is_none() {
            self.start_warm(sample, active);
        }
    }

    /// Takes the previous plan, tracked from the new start, and its multipliers as first guess if
    /// some of them are active in the range to be solved. A window is extended by the active stages
    /// just beyond its end, as it would otherwise have to grow.
    fn start_warm(&mut self, sample: &Sample<O>, active: &[[f64; 2]]) {
        let n = self.layout.horizon;
        let mut range = self.search.window.clone().unwrap_or(0..n);
        let more_than = |least: f64| move |&[state, input]: &[f64; 2]| state.max(input) > least;
        if !active[range.clone()].iter().any(more_than(0.0)) {
            return;
        }
        let largest = active.iter().flatten().copied().fold(0.0, f64::max);
        let is_active = more_than(ACTIVE * largest);
        let last = active.iter().rposition(&is_active).unwrap_or(0);
        let is_news = self.search.violated.as_ref().is_some_and(|range| range.end > last + NEWS);
        if is_news && sample.bounded.depends_on_trajectory() {
            return;
        }
        while let Some(last) =
            active[range.end..(range.end + MARGIN).min(n)].iter().rposition(is_active)
        {
            range.end += last + 1;
        }
        if let Some(window) = &mut self.search.window {
            window.end = range.end;
        }
        if !self.layout.is_worth_a_window(&range) {
            self.search.window = None;
            range = 0..n;
        }
        let Solution { trajectory, multipliers } = &mut self.solution;
        trajectory.clone_from(&self.linearisation_point);
        multipliers.intervals[range.clone()].copy_from_slice(&active[range]);
        self.search.begin_warm();
    }

    /// Lets the next search begin without the multipliers of a similar problem. Its guess may be
    /// far away, so that bounds that depend on the trajectory follow the iterates.
    pub(super) fn begin_cold(&mut self, sample: &Sample<O>) {
        let follows = match sample.previous {
            None => sample.bounded.follows_at_first(),
            Some(_) => sample.bounded.depends_on_trajectory(),
        };
        self.search.begin_cold(follows && self.settings.method == Method::Riccati);
    }

    /// Repeats `solve_pass` with the bounds (and linearised constraints) computed about its last
    /// optimum until one is final. Returns `None` as soon as a pass finds none.
    pub(super) fn settle(
        &mut self,
        sample: &Sample<O>,
        solve_pass: impl Fn(&mut Self, &Sample<O>) -> Option<SolverStatus>,
    ) -> Option<SolverStatus> {
        loop {
            let status = solve_pass(self, sample)?;
            self.search.pass += 1;
            if self.is_final(sample) {
                return Some(status);
            }
            self.search.go_on();
        }
    }

    /// Returns whether the optimum of a pass is final; otherwise the linearisation point is set for
    /// the next pass.
    fn is_final(&mut self, sample: &Sample<O>) -> bool {
        let Self {
            layout, settings, linearisation_point, bounds, checked_bounds, solution, ..
        } = self;
        let trajectory = &solution.trajectory;
        if sample.previous.is_none() && settings.method == Method::Cone {
            let moved = linearisation_point.distance(trajectory);
            linearisation_point.clone_from(trajectory);
            return moved < layout.standstill || self.search.pass == FIRST_PASSES;
        }
        if replace(&mut self.search.follows, false) {
            sample.bounded.bounds_about(trajectory, 0..layout.horizon, bounds);
        }
        // The intervals outside a window have already been checked.
        let solved = self.search.window.clone().unwrap_or(0..layout.horizon);
        self.search.settled = !sample.bounded.depends_on_trajectory()
            || sample.bounded.violated(trajectory, solved, checked_bounds).is_none();
        if self.search.settled || self.search.pass == SETTLING_PASSES {
            return true;
        }
        if self.search.pass == 1 {
            linearisation_point.clone_from(trajectory);
        } else {
            // Where the bounds change more than the trajectory, whole steps would alternate between
            // two of them.
            linearisation_point.halve_the_way_to(trajectory);
        }
        false
    }
}
