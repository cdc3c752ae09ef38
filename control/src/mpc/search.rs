//! Progress of the search for the optimum.

use std::ops::Range;

/// The state of a search: the point from which the next solver begins.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Guess {
    /// No solver has begun.
    #[default]
    None,
    /// The next solver begins from the unconstrained optimum, without multipliers.
    Cold,
    /// It begins from the solution of a similar problem: the previous plan, a smaller window, or
    /// the last pass.
    Warm,
    /// No trajectory satisfies the norm constraints, so that no solver would find one.
    Hopeless,
}

/// Progress of the search for the optimum.
#[derive(Default)]
pub(super) struct Search {
    /// State of the search. Its transitions are the methods below.
    guess: Guess,
    /// Radius of the terminal constraint, if the unconstrained optimum violates it.
    pub outside: Option<f64>,
    /// Range from the first to the last interval in which the unconstrained optimum violates a
    /// constraint.
    pub violated: Option<Range<usize>>,
    /// Window of the horizon to solve for, if it is not the whole horizon.
    pub window: Option<Range<usize>>,
    /// Whether the arrival cost has been computed.
    pub arrived: bool,
    /// Whether the bounds of the present pass follow the iterates.
    pub follows: bool,
    /// Number of passes so far; the bounds are computed anew for each.
    pub pass: usize,
    /// Number of iterations over all passes and solvers.
    pub iterations: u32,
    /// Whether the optimum satisfies the bounds computed about it.
    pub settled: bool,
}

impl Search {
    /// Returns the search that begins after the unconstrained optimum, which violates a terminal
    /// constraint of this radius if there is one.
    pub(super) fn new(outside: Option<f64>) -> Self {
        Self { outside, ..Self::default() }
    }

    pub(super) fn has_begun(&self) -> bool {
        self.guess != Guess::None
    }

    pub(super) fn is_warm(&self) -> bool {
        self.guess == Guess::Warm
    }

    pub(super) fn is_hopeless(&self) -> bool {
        self.guess == Guess::Hopeless
    }

    /// Any state → Cold. The guess may be far away, so that bounds that depend on the trajectory
    /// may follow the iterates.
    pub(super) fn begin_cold(&mut self, follows: bool) {
        (self.guess, self.follows) = (Guess::Cold, follows);
    }

    /// Cold → Warm, with the previous plan.
    pub(super) fn begin_warm(&mut self) {
        (self.guess, self.follows) = (Guess::Warm, false);
    }

    /// Cold or Warm → Warm: the last solution is the guess for a larger window or another pass.
    pub(super) fn go_on(&mut self) {
        self.guess = Guess::Warm;
    }

    /// Any state → Hopeless.
    pub(super) fn give_up(&mut self) {
        self.guess = Guess::Hopeless;
    }

    /// The passes begin anew, with the bounds about the trajectory that the last ones have left.
    pub(super) fn restart_passes(&mut self) {
        (self.follows, self.pass) = (false, 0);
    }
}
