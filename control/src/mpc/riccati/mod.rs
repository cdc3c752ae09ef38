//! Primal-dual interior point method on the Riccati recursion. The numbers of equations are those
//! of docs/solver.md.
//!
//! Balls are written c = ½(‖y‖² − 1) ≤ 0 with one slack s and one multiplier λ each. Every iterate
//! satisfies the chain of integrators exactly, so that Newton's method is left with three
//! residuals: stationarity of the inputs, c + s, and sλ. The Hessian contains the curvature of
//! ½‖y‖² exactly; the curvature of y itself is left out (Gauss-Newton). Balls are left out while
//! the motion stays well inside them. Every iterate is checked, and a ball enters the problem as
//! soon as an iterate comes near it.

mod direction;
mod pair;
mod progress;
mod residuals;
mod scaling;
mod stage;
mod start;
mod step;
mod sweep;

use super::balls::Constraints;
use super::budget::Budget;
use super::lq::Unconstrained;
use super::problem::{Outcome, Problem, Solution, Start, State, zero_state};
use direction::Direction;
use nalgebra::Matrix3;
use pair::Pair;
use progress::{Progress, give_up};
use stage::{Face, Stage};
use sweep::Blocks;

/// The optimum without balls that continues the motion after the last stage.
pub struct Rest<'a, const O: usize> {
    /// Solved optimum without balls over the whole horizon.
    pub unconstrained: &'a Unconstrained<O>,
    /// Affine terms d of the whole horizon.
    pub affine: &'a [State<O>],
}

/// The solver with its iterate and scratch memory. Nothing is carried from one problem to the next.
pub struct Riccati<const O: usize> {
    stages: Vec<Stage<O>>,
    terminal: Pair,
    faces: Vec<Face<O>>,
    /// Weight P and slope p of the first stage.
    first: (Blocks<O>, State<O>),
    /// Number of intervals of the present problem.
    horizon: usize,
    max_iterations: u32,
}

impl<const O: usize> Riccati<O> {
    /// Allocates a solver for `horizon` intervals and at most `faces` normals of the initial set.
    pub fn new(horizon: usize, faces: usize, max_iterations: u32) -> Self {
        Self {
            stages: vec![Stage::new(); horizon + 1],
            terminal: Pair::default(),
            faces: Vec::with_capacity(2 * faces),
            first: ([[Matrix3::zeros(); O]; O], zero_state()),
            horizon,
            max_iterations,
        }
    }

    /// Solves `problem`, which covers the stages of `solution` from `first` on. Their motion is the
    /// first guess, which must satisfy the chain; it is replaced if the optimum is found. With a
    /// `rest`, stages beyond the end that an iterate nearly violates are included in the problem.
    pub fn solve<C: Constraints<O>>(
        &mut self,
        problem: &Problem<O, C>,
        solution: &mut Solution<O>,
        first: usize,
        warm: bool,
        budget: &mut Budget,
        rest: Option<&Rest<O>>,
    ) -> Outcome {
        let problem = &mut Problem { ..*problem };
        self.begin(problem, solution, first, warm);
        let mut progress = Progress::new(problem.constraints.follows(), warm);
        for iteration in 0..=self.max_iterations {
            let residuals = self.residuals(problem);
            if residuals.converged(progress.feasibility) {
                self.write(problem, solution, first);
                return Outcome::Solved(iteration);
            }
            if iteration == self.max_iterations || !budget.take() {
                return Outcome::Failed(iteration);
            }
            if self.factor(problem).is_none() {
                return give_up(iteration, &residuals);
            }
            let Direction { length, centre } = self.direction(problem, &residuals);
            let length = match progress.damp(iteration, &residuals, length) {
                Ok(length) => length,
                Err(outcome) => return outcome,
            };
            self.step(problem, length);
            if let Some(rest) = rest {
                self.extend(problem, rest, first);
            }
            self.include_near(problem, centre, &residuals);
        }
        Outcome::Failed(self.max_iterations)
    }

    /// Returns the number of intervals of the last problem.
    pub fn horizon(&self) -> usize {
        self.horizon
    }

    /// Writes the optimum into `solution`.
    fn write<C: Constraints<O>>(&self, problem: &Problem<O, C>, solution: &mut Solution<O>, first: usize) {
        let Solution { motion, multipliers } = solution;
        let state_balls = problem.constraints.has_state_balls();
        for (k, stage) in self.stages[..=self.horizon].iter().enumerate() {
            let multiplier = |pair: &Pair| if pair.watched { pair.multiplier } else { 0.0 };
            motion.states[first + k] = stage.state;
            if k > 0 && state_balls {
                multipliers.state[first + k - 1] = multiplier(&stage.state_pair);
            }
            if k < self.horizon {
                motion.inputs[first + k] = stage.input;
                multipliers.input[first + k] = multiplier(&stage.input_pair);
            }
        }
        if problem.end.radius.is_some() {
            multipliers.terminal = self.terminal.multiplier;
        }
        if let Start::Within(..) = problem.start {
            multipliers.start = self.start_slope(problem, &|pair| pair.multiplier);
            multipliers.start_gap =
                self.faces.iter().map(|face| face.pair.multiplier * face.pair.c.abs()).sum();
        }
    }
}
