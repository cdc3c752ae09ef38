//! Structure of an optimisation problem, which does not change between samples.

use super::problem::{Chain, Cost, End, ErrorTrajectory, Problem, Start, State, zero_state};
use std::ops::Range;

/// Structure of a controller's optimisation problem.
#[derive(Clone, Debug)]
pub struct Layout<const O: usize> {
    /// Chain of integrators with its matrices A and B.
    pub chain: Chain<O>,
    /// Weights of the quadratic cost.
    pub cost: Cost<O>,
    /// Number of intervals of the horizon.
    pub horizon: usize,
    /// Whether the states have norm constraints.
    pub constrains_states: bool,
    /// Whether there is a terminal constraint.
    pub terminal: bool,
    /// Intervals that a window adds before and after the violated ones, as a share of these, beside
    /// the fixed number. A wider window is more expensive, and grows less often.
    pub margin: f64,
    /// Typical sizes of the errors and their derivatives.
    pub scale: [f64; O],
    /// Largest change of any error between passes at which the first optimisation has converged.
    pub standstill: f64,
}

/// Smallest number of intervals that a window adds before and after the violated ones.
pub(super) const MARGIN: usize = 3;
/// Relative tolerance in the check of the terminal constraint, for rounding.
const CHECK_SLACK: f64 = 1e-9;

impl<const O: usize> Layout<O> {
    /// Returns the problem of the whole horizon from a measured start, with this radius of the
    /// terminal constraint.
    pub(super) fn problem<'a, C>(
        &'a self,
        measured: &State<O>,
        affine: &'a [State<O>],
        constraints: &'a C,
        radius: Option<f64>,
    ) -> Problem<'a, O, C> {
        let Self { chain, cost, .. } = self;
        let start = Start::Fixed(*measured);
        let end = End { weight: &cost.end, slope: zero_state(), radius };
        Problem { chain, cost, start, affine, constraints, end }
    }

    /// Returns `radius` if the trajectory violates the terminal constraint.
    pub(super) fn ends_outside(
        &self,
        trajectory: &ErrorTrajectory<O>,
        radius: Option<f64>,
    ) -> Option<f64> {
        let square = self.cost.end_square(&trajectory.states[self.horizon]);
        radius.filter(|radius| square > radius * radius * (1.0 + CHECK_SLACK))
    }

    /// Returns the violated intervals with a margin; with `terminal`, the range extends to the last
    /// interval.
    pub(super) fn window(
        &self,
        violated: Option<Range<usize>>,
        terminal: bool,
    ) -> Option<Range<usize>> {
        let n = self.horizon;
        let violated = match (violated, terminal) {
            (Some(violated), true) => violated.start..n,
            (None, true) => n..n,
            (violated, false) => violated?,
        };
        let margin = MARGIN + (violated.len() as f64 * self.margin) as usize;
        let start = violated.start.saturating_sub(margin);
        // Fewer steps than the order cannot reach every state.
        let start = if start < O { 0 } else { start };
        Some(start..(violated.end + margin).min(n))
    }

    /// Returns whether it pays to solve for these intervals alone, which may be at most three
    /// quarters of the horizon.
    pub(super) fn is_worth_a_window(&self, range: &Range<usize>) -> bool {
        4 * range.len() <= 3 * self.horizon
    }
}
