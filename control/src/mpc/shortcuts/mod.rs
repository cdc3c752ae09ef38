//! Shortcuts: cheaper exact ways to the optimum, cheapest first. Each leaves constraints out,
//! solves the rest, and checks the omitted ones. If the result satisfies those too, it is the
//! optimum of the whole problem, so no shortcut loses accuracy.
//!
//! The gains in the files' heads are the times of `cargo bench -p reentry-control --bench
//! optimisation` (250 samples of 50 s) without and with the shortcut, in the same run. The check of
//! the constraints has a shortcut, too: `Robust::examine` of CRMPC.

mod terminal_constraint;
mod unconstrained;
mod windows;

use super::optimiser::{Optimiser, Sample};
use super::search::Search;
use crate::report::SolverStatus;

/// A cheaper exact way to the optimum.
pub(super) trait Shortcut<const O: usize> {
    /// Leaves the optimum in the optimiser's solution and returns its status, or returns `None` and
    /// leaves in `search` the problem of the next shortcut.
    fn optimum(
        &self,
        optimiser: &mut Optimiser<O>,
        sample: &Sample<O>,
        search: &mut Search,
    ) -> Option<SolverStatus>;
}

/// Returns the shortcuts in the order in which they are tried.
pub(super) fn in_order<const O: usize>() -> [&'static dyn Shortcut<O>; 3] {
    [
        &unconstrained::Unconstrained,
        &terminal_constraint::TerminalConstraintAlone,
        &windows::Windows,
    ]
}
