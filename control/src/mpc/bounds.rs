//! The bounds of the norm constraints. A pure function computes them from a trajectory. The
//! optimiser holds them, or they follow the iterates of the solver.

use super::constraints::{Constraints, StageConstraints, StagePoint};
use super::problem::{ErrorTrajectory, State};
use nalgebra::Vector3;
use std::cell::Cell;
use std::ops::Range;

/// Bounds of the norm constraints at each stage.
#[derive(Clone, Debug, PartialEq)]
pub struct Bounds {
    /// Bounds on the states of stages 0..=N; the first one has no effect.
    pub state: Vec<f64>,
    /// Bounds on the inputs of intervals 0..N.
    pub input: Vec<f64>,
}

impl Bounds {
    /// Returns no bounds for `horizon` intervals.
    pub fn unlimited(horizon: usize) -> Self {
        Self { state: vec![f64::INFINITY; horizon + 1], input: vec![f64::INFINITY; horizon] }
    }

    /// Sets the bounds of interval `k`: on the state at its end, and on its input.
    pub fn set(&mut self, k: usize, (state, input): (f64, f64)) {
        (self.state[k + 1], self.input[k]) = (state, input);
    }

    /// Returns the bounds as cells, which a search may renew.
    pub(super) fn cells(&mut self) -> Cells<'_> {
        let Self { state, input } = self;
        Cells {
            state: Cell::from_mut(state.as_mut_slice()).as_slice_of_cells(),
            input: Cell::from_mut(input.as_mut_slice()).as_slice_of_cells(),
        }
    }
}

/// Bounds that a search may renew.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cells<'a> {
    state: &'a [Cell<f64>],
    input: &'a [Cell<f64>],
}

impl Cells<'_> {
    /// Returns the bounds of stage `k`; the last stage has no input.
    fn at(&self, k: usize) -> (f64, f64) {
        (self.state[k].get(), self.input.get(k).map_or(f64::INFINITY, Cell::get))
    }

    /// Sets the bounds of interval `k`: on the state at its end, and on its input.
    fn set(&self, k: usize, (state, input): (f64, f64)) {
        self.state[k + 1].set(state);
        self.input[k].set(input);
    }
}

/// The constraints of a controller: norm constraints whose bounds are a function of the trajectory.
pub trait Bounded<const O: usize> {
    /// Returns whether the states have norm constraints.
    fn constrains_states(&self) -> bool {
        true
    }

    /// Returns the norm constraints of stage `k` at (E_k, v_k) with these bounds on state and
    /// input, and with their derivatives.
    fn norm_constraints(
        &self,
        k: usize,
        state: &State<O>,
        input: &Vector3<f64>,
        bounds: (f64, f64),
    ) -> StageConstraints<O>;

    /// Returns only the values ‖y‖² of the state constraint and of the input constraint.
    fn squares(
        &self,
        k: usize,
        state: &State<O>,
        input: &Vector3<f64>,
        bounds: (f64, f64),
    ) -> (f64, f64);

    /// Returns the range from the first to the last of `intervals` in which `trajectory` violates
    /// the bounds computed about it: by its input, or by its state at the interval's end.
    ///
    /// If the bounds depend on the trajectory, those of the satisfied intervals are written to
    /// `bounds`. They may be smaller than those of [`Self::bounds_about`], where a smaller bound is
    /// cheaper and suffices. Intervals between the first and the last violated one may be left out.
    fn violated(
        &self,
        trajectory: &ErrorTrajectory<O>,
        intervals: Range<usize>,
        bounds: &mut Bounds,
    ) -> Option<Range<usize>>;

    /// Computes the bounds of `intervals` with `trajectory` as the linearisation point: for the
    /// input of each interval, and for the state at its end. Bounds that do not depend on the
    /// trajectory need no implementation.
    fn bounds_about(
        &self,
        _motion: &ErrorTrajectory<O>,
        _intervals: Range<usize>,
        _bounds: &mut Bounds,
    ) {
    }

    /// Returns the bounds of interval `k`, computed from the stages at its ends: for the state at
    /// its end, and for its input. `None` if they do not depend on the trajectory.
    fn bounds_between(
        &self,
        _k: usize,
        _stage: StagePoint<O>,
        _next: StagePoint<O>,
    ) -> Option<(f64, f64)> {
        None
    }

    /// Returns whether the bounds depend on the trajectory.
    fn depends_on_trajectory(&self) -> bool {
        false
    }

    /// Returns whether the bounds of a first optimisation follow its iterates to the end. The
    /// solver then satisfies the norm constraints less accurately, because it leaves out the
    /// derivatives of the bounds.
    fn follows_at_first(&self) -> bool {
        self.depends_on_trajectory()
    }

    /// Returns whether no trajectory from this start can satisfy the constraints. `false` leaves
    /// the question open.
    fn out_of_reach(&self, _start: &State<O>) -> bool {
        false
    }

    /// Returns whether another optimisation follows if this one finds no optimum. A search that
    /// makes no progress is then ended early, and not begun anew from another guess.
    fn has_another_start(&self) -> bool {
        false
    }

    /// Returns the radius ε of the terminal constraint, if there is one.
    fn terminal_radius(&self) -> Option<f64> {
        None
    }
}

/// The constraints with their bounds, from stage `first` on, as a solver receives them.
#[derive(Clone, Copy)]
pub(super) struct Within<'a, const O: usize> {
    pub bounded: &'a dyn Bounded<O>,
    pub bounds: Cells<'a>,
    pub follows: bool,
    pub first: usize,
}

impl<const O: usize> Constraints<O> for Within<'_, O> {
    fn follows(&self) -> bool {
        self.follows
    }

    fn has_another_start(&self) -> bool {
        self.bounded.has_another_start()
    }

    fn renew(&self, k: usize, stage: StagePoint<O>, next: StagePoint<O>) {
        let k = self.first + k;
        if let Some(bounds) = self.bounded.bounds_between(k, stage, next) {
            self.bounds.set(k, bounds);
        }
    }

    fn constrains_states(&self) -> bool {
        self.bounded.constrains_states()
    }

    fn norm_constraints(
        &self,
        k: usize,
        state: &State<O>,
        input: &Vector3<f64>,
    ) -> StageConstraints<O> {
        let k = self.first + k;
        self.bounded.norm_constraints(k, state, input, self.bounds.at(k))
    }

    fn squares(&self, k: usize, state: &State<O>, input: &Vector3<f64>) -> (f64, f64) {
        let k = self.first + k;
        self.bounded.squares(k, state, input, self.bounds.at(k))
    }
}
