//! A window of the horizon around the violated intervals, with arrival cost and cost-to-go in place
//! of the rest. If the rest then violates its constraints, the window grows.
//!
//! Gain: mean time 0.078 → 0.031 ms, longest 0.476 → 0.232 (CRMPC robust); 0.011 → 0.009, 0.152 →
//! 0.039 (paper); 0.020 → 0.011, 0.102 → 0.033 (DLMPC).

use super::{Optimiser, Sample, Search, Shortcut, SolverStatus};

pub(super) struct Windows;

/// Largest number of windows tried before the whole horizon.
const WINDOWS: usize = 4;

impl<const O: usize> Shortcut<O> for Windows {
    fn optimum(
        &self,
        optimiser: &mut Optimiser<O>,
        sample: &Sample<O>,
        search: &mut Search,
    ) -> Option<SolverStatus> {
        optimiser.prepare(sample, search);
        optimiser.settle(sample, search, in_windows)
    }
}

/// Finds the optimum with the present bounds.
fn in_windows<const O: usize>(
    optimiser: &mut Optimiser<O>,
    sample: &Sample<O>,
    search: &mut Search,
) -> Option<SolverStatus> {
    if !optimiser.may_iterate(search) {
        return None;
    }
    optimiser.arrive(sample, search);
    for _ in 0..WINDOWS {
        let mut window =
            search.window.clone().filter(|window| optimiser.layout.is_worth_a_window(window))?;
        let is_held = window.end == optimiser.layout.horizon;
        let outcome = optimiser.interior_point(sample, search, window.clone());
        if !outcome.solved() {
            // If no trajectory satisfies the norm constraints within the window, none does over the
            // horizon, unless the first guess was misleading. Another start is then the better one.
            let is_hopeless =
                outcome.hopeless() && (!search.is_warm() || sample.bounded.has_another_start());
            optimiser.begin_cold(sample, search);
            if is_hopeless {
                search.give_up();
            }
            return None;
        }
        window.end = window.start + optimiser.riccati.horizon();
        let Optimiser { layout, unconstrained, solution, .. } = optimiser;
        unconstrained.trace_back(window.start, sample.affine, &mut solution.trajectory);
        unconstrained.follow(window.end, sample.affine, &mut solution.trajectory);
        // A window that grew to the end was solved without the terminal constraint.
        let unheld = sample.bounded.terminal_radius().filter(|_| !is_held);
        let outside = layout.ends_outside(&solution.trajectory, unheld).is_some();
        let violated = optimiser.violated(sample, &window);
        let more = optimiser.layout.window(violated, outside);
        search.window = Some(window.clone());
        let Some(more) = more else { return Some(SolverStatus::Constrained) };
        search.go_on();
        search.window = Some(window.start.min(more.start)..window.end.max(more.end));
    }
    None
}
