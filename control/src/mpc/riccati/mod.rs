//! Primal-dual interior point method on the Riccati recursion. The numbers of equations are those
//! of docs/solver.md.
//!
//! Norm constraints are written c = ½(‖y‖² − 1) ≤ 0 with one slack s and one multiplier λ each.
//! Every iterate satisfies the chain of integrators exactly, so that Newton's method is left with
//! three residuals: stationarity of the inputs, c + s, and sλ. The Hessian contains the curvature
//! of ½‖y‖² exactly; the curvature of y itself is left out (Gauss-Newton). Norm constraints are
//! left out while the trajectory satisfies them with a wide margin. Every iterate is checked, and a
//! norm constraint enters the problem as soon as an iterate comes near it.

mod direction;
mod iterate;
mod pair;
mod progress;
mod residuals;
mod scaling;
mod stage;
mod start;
mod step;
mod sweep;

pub use iterate::{Rest, Riccati};

use super::budget::Budget;
use super::constraints::Constraints;
use super::problem::{Outcome, Problem, Solution};
use direction::Direction;
use pair::Pair;
use progress::{Progress, give_up};

impl<const O: usize> Riccati<O> {
    /// Solves `problem`, which covers the stages of `solution` from `first` on. Their trajectory is
    /// the first guess, which must satisfy the chain; it is replaced if the optimum is found. With
    /// a `rest`, stages beyond the end that an iterate nearly violates are included in the problem.
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
        let constraints = problem.constraints;
        let mut progress =
            Progress::new(constraints.follows(), warm, constraints.has_another_start());
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

    /// Writes the optimum into `solution`.
    fn write<C: Constraints<O>>(
        &self,
        problem: &Problem<O, C>,
        solution: &mut Solution<O>,
        first: usize,
    ) {
        let Solution { trajectory, multipliers } = solution;
        let constrains_states = problem.constraints.constrains_states();
        for (k, stage) in self.stages[..=self.horizon].iter().enumerate() {
            let multiplier = |pair: &Pair| if pair.watched { pair.multiplier } else { 0.0 };
            trajectory.states[first + k] = stage.state;
            if k > 0 && constrains_states {
                multipliers.intervals[first + k - 1][0] = multiplier(&stage.state_pair);
            }
            if k < self.horizon {
                trajectory.inputs[first + k] = stage.input;
                multipliers.intervals[first + k][1] = multiplier(&stage.input_pair);
            }
        }
        if problem.end.radius.is_some() {
            multipliers.terminal = self.terminal.multiplier;
        }
    }
}
