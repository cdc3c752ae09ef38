//! The unconstrained optimum.
//!
//! Gain: mean time 0.036 → 0.031 ms (CRMPC robust), 0.013 → 0.009 (paper), 0.013 → 0.011 (DLMPC).

use super::{Optimiser, Sample, Search, Shortcut, SolverStatus};

pub(super) struct Unconstrained;

impl<const O: usize> Shortcut<O> for Unconstrained {
    fn optimum(
        &self,
        optimiser: &mut Optimiser<O>,
        sample: &Sample<O>,
        search: &mut Search,
    ) -> Option<SolverStatus> {
        if search.outside.is_some() {
            return None;
        }
        // The optimiser has begun with this trajectory.
        let violated = optimiser.violated(sample, &(0..0));
        search.settled = violated.is_none();
        search.violated.clone_from(&violated);
        search.window = optimiser.layout.window(violated, false);
        search.settled.then_some(SolverStatus::Unconstrained)
    }
}
