//! Step (12) along a direction, and the stages that it comes near.

use super::iterate::{Rest, Riccati};
use crate::mpc::constraints::Constraints;
use crate::mpc::problem::{End, Problem};
use nalgebra::Vector3;

/// A stage beyond the end is included when ‖y‖² exceeds this value.
const NEARLY_OUTSIDE: f64 = 0.9;
/// Number of stages beyond the end that are examined.
const AHEAD: usize = 6;

impl<const O: usize> Riccati<O> {
    /// Returns the longest step that keeps every s and λ positive, (12).
    pub(super) fn longest<C: Constraints<O>>(&mut self, problem: &Problem<O, C>) -> f64 {
        let mut longest = f64::INFINITY;
        self.each_pair(problem, |pair| longest = longest.min(pair.longest()));
        longest
    }

    /// Returns the mean of sλ after a step `alpha`.
    pub(super) fn mean_after<C: Constraints<O>>(
        &mut self,
        problem: &Problem<O, C>,
        alpha: f64,
        count: f64,
    ) -> f64 {
        let mut gap = 0.0;
        self.each_pair(problem, |pair| {
            gap +=
                (pair.slack + alpha * pair.d_slack) * (pair.multiplier + alpha * pair.d_multiplier);
        });
        gap / count
    }

    /// Takes the step (12), the same for trajectory and multipliers.
    pub(super) fn step<C: Constraints<O>>(&mut self, problem: &Problem<O, C>, alpha: f64) {
        for stage in &mut self.stages[..=self.horizon] {
            stage.state = std::array::from_fn(|i| stage.state[i] + stage.d_state[i] * alpha);
            stage.input += stage.d_input * alpha;
        }
        self.each_pair(problem, |pair| {
            pair.slack += alpha * pair.d_slack;
            pair.multiplier += alpha * pair.d_multiplier;
        });
        if problem.constraints.follows() {
            for (k, pair) in self.stages[..=self.horizon].windows(2).enumerate() {
                let [stage, next] = pair else { continue };
                if stage.input_pair.watched || next.state_pair.watched {
                    let (stage, next) = ((&stage.state, &stage.input), (&next.state, &next.input));
                    problem.constraints.renew(k, stage, next);
                }
            }
        }
        self.evaluate(problem);
    }

    /// Extends the problem by the next stages if one of them is close to violating a norm
    /// constraint.
    #[inline(never)]
    pub(super) fn extend<'a, C: Constraints<O>>(
        &mut self,
        problem: &mut Problem<'a, O, C>,
        rest: &Rest<'a, O>,
        first: usize,
    ) {
        let last = rest.affine.len() - first;
        loop {
            let end = self.horizon;
            let until = (end + AHEAD).min(last);
            let constrains_states = problem.constraints.constrains_states();
            let mut is_near = false;
            for k in end..until {
                let state = self.stages[k].state;
                let (input, next) = rest.unconstrained.go_on(first + k, &state, rest.affine);
                let (of_state, of_input) = problem.constraints.squares(k, &state, &input);
                is_near |= of_input > NEARLY_OUTSIDE
                    || constrains_states && k > end && of_state > NEARLY_OUTSIDE;
                self.stages[k].input = input;
                let stage = &mut self.stages[k + 1];
                stage.state = next;
                (stage.state_pair.watched, stage.input_pair.watched) = (false, false);
            }
            if !is_near || end == until {
                return;
            }
            self.horizon = until;
            // The input after the last state must not keep values of an earlier problem.
            let after = &mut self.stages[until];
            (after.input, after.d_input) = (Vector3::zeros(), Vector3::zeros());
            let (weight, slope) = rest.unconstrained.to_go(first + until);
            problem.end = End { weight, slope, radius: None };
        }
    }
}
