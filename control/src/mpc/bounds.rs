//! The bounds of the balls. They are a value that a pure function computes from a motion and that
//! the optimiser holds, or they follow the iterates of the solver.

use super::balls::{At, Balls, Constraints};
use super::problem::{Motion, State};
use nalgebra::Vector3;
use std::cell::Cell;
use std::ops::Range;

/// Largest norms that the balls allow at each stage.
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

/// The constraints of a controller: balls whose bounds are a function of the motion.
pub trait Bounded<const O: usize> {
    /// Returns whether the states have balls of their own.
    fn has_state_balls(&self) -> bool;

    /// Returns the balls of stage `k` at (E_k, v_k) with these bounds on state and input, and with
    /// their derivatives.
    fn balls(
        &self,
        k: usize,
        state: &State<O>,
        input: &Vector3<f64>,
        bounds: (f64, f64),
    ) -> Balls<O>;

    /// Returns only the two values ‖y‖², of the state ball and of the input ball.
    fn squares(
        &self,
        k: usize,
        state: &State<O>,
        input: &Vector3<f64>,
        bounds: (f64, f64),
    ) -> (f64, f64);

    /// Returns the range from the first to the last of the intervals `of` that `motion` violates
    /// with the bounds about itself: by its input, or by its state at the interval's end.
    ///
    /// If the bounds depend on the motion, those of the satisfied intervals are written to
    /// `bounds`. They may be smaller than those of [`Self::bounds_about`], where a smaller bound is
    /// cheaper and suffices. Intervals between the first and the last violated one may be left out.
    fn violated(
        &self,
        motion: &Motion<O>,
        of: Range<usize>,
        bounds: &mut Bounds,
    ) -> Option<Range<usize>>;

    /// Computes the bounds of the intervals `of` about `motion`: for the input of each, and for the
    /// state at its end. Bounds that do not depend on the motion need no implementation.
    fn bounds_about(&self, _motion: &Motion<O>, _of: Range<usize>, _bounds: &mut Bounds) {}

    /// Returns the bounds of interval `k` about the stages at its ends: for the state at its end,
    /// and for its input. `None` if they do not depend on the motion.
    fn bounds_between(&self, _k: usize, _here: At<O>, _next: At<O>) -> Option<(f64, f64)> {
        None
    }

    /// Returns whether the bounds depend on the motion.
    fn depends_on_motion(&self) -> bool {
        false
    }

    /// Returns whether the bounds of a first optimisation follow its iterates to the end. The
    /// solver then satisfies the balls only as closely as the derivatives that are left out permit.
    fn follows_at_first(&self) -> bool {
        self.depends_on_motion()
    }

    /// Returns whether no motion from this start can satisfy the constraints. `false` leaves the
    /// question open.
    fn out_of_reach(&self, _start: &State<O>) -> bool {
        false
    }

    /// Returns the radius ε of the terminal ball, if there is one.
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

    fn renew(&self, k: usize, here: At<O>, next: At<O>) {
        let k = self.first + k;
        if let Some(bounds) = self.bounded.bounds_between(k, here, next) {
            self.bounds.set(k, bounds);
        }
    }

    fn has_state_balls(&self) -> bool {
        self.bounded.has_state_balls()
    }

    fn balls(&self, k: usize, state: &State<O>, input: &Vector3<f64>) -> Balls<O> {
        let k = self.first + k;
        self.bounded.balls(k, state, input, self.bounds.at(k))
    }

    fn squares(&self, k: usize, state: &State<O>, input: &Vector3<f64>) -> (f64, f64) {
        let k = self.first + k;
        self.bounded.squares(k, state, input, self.bounds.at(k))
    }
}
