//! A window of the horizon around the violated intervals, with arrival cost and cost-to-go in place
//! of the rest. If the rest then violates its constraints, the window grows.
//!
//! Gain: mean time 0.078 → 0.031 ms, longest 0.476 → 0.232 (CRMPC robust); 0.011 → 0.009, 0.152 →
//! 0.039 (paper); 0.020 → 0.011, 0.102 → 0.033 (DLMPC).

use super::{Optimiser, Sample, SolverStatus};

/// Largest number of windows tried before the whole horizon.
const WINDOWS: usize = 4;

impl<const O: usize> Optimiser<O> {
    /// Finds the optimum by windows of the horizon.
    pub(super) fn by_windows(&mut self, sample: &Sample<O>) -> Option<SolverStatus> {
        self.prepare(sample);
        self.settle(sample, Self::in_windows)
    }

    /// Finds the optimum with the present bounds.
    fn in_windows(&mut self, sample: &Sample<O>) -> Option<SolverStatus> {
        if !self.may_iterate() {
            return None;
        }
        self.arrive(sample);
        for _ in 0..WINDOWS {
            let mut window = self
                .search
                .window
                .clone()
                .filter(|window| self.layout.is_worth_a_window(window))?;
            let is_held = window.end == self.layout.horizon;
            let outcome = self.interior_point(sample, window.clone());
            if !outcome.solved() {
                // If no trajectory satisfies the norm constraints within the window, none does over
                // the horizon, unless the first guess was misleading. Another start is then the
                // better one.
                let is_hopeless = outcome.hopeless()
                    && (!self.search.is_warm() || sample.bounded.has_another_start());
                self.begin_cold(sample);
                if is_hopeless {
                    self.search.give_up();
                }
                return None;
            }
            window.end = window.start + self.riccati.horizon();
            let Self { layout, unconstrained, solution, .. } = self;
            unconstrained.trace_back(window.start, sample.affine, &mut solution.trajectory);
            unconstrained.follow(window.end, sample.affine, &mut solution.trajectory);
            // A window that grew to the end was solved without the terminal constraint.
            let unheld = sample.bounded.terminal_radius().filter(|_| !is_held);
            let outside = layout.ends_outside(&solution.trajectory, unheld).is_some();
            let violated = self.violated(sample, &window);
            let more = self.layout.window(violated, outside);
            self.search.window = Some(window.clone());
            let Some(more) = more else { return Some(SolverStatus::Constrained) };
            self.search.go_on();
            self.search.window = Some(window.start.min(more.start)..window.end.max(more.end));
        }
        None
    }
}
