//! First iterate, and the norm constraints that the iterates come near.

use super::iterate::Riccati;
use super::pair::Pair;
use super::residuals::Residuals;
use super::stage::Stage;
use crate::mpc::constraints::Constraints;
use crate::mpc::problem::{Multipliers, Problem, Solution, dot};
use nalgebra::Vector3;

/// A norm constraint is near when ‖y‖² exceeds this value.
const NEAR: f64 = 0.5;
/// Cold start: smallest slack, and Σ sλ relative to half the cost.
const COLD: (f64, f64) = (0.03, 0.03);
/// Smallest initial slack of a norm constraint that an iterate comes near.
const NEWLY: f64 = 0.3;
/// Warm start, with the multipliers of a similar problem: smallest slack, and Σ sλ relative to half
/// the cost.
const WARM: (f64, f64) = (3e-4, 1e-6);
/// First guess that violates a norm constraint by far: smallest slack, and Σ sλ relative to half
/// the cost.
const FAR: (f64, f64) = (3.0, 10.0);
/// A first guess violates a norm constraint by far when c exceeds this value.
const FAR_OUTSIDE: f64 = 1.5;

impl<const O: usize> Riccati<O> {
    /// Sets the first iterate from the guess in `solution`.
    pub(super) fn begin<C: Constraints<O>>(
        &mut self,
        problem: &Problem<O, C>,
        solution: &Solution<O>,
        first: usize,
        warm: bool,
    ) {
        (self.before, self.horizon) = (first, problem.affine.len());
        let Solution { trajectory, multipliers } = solution;
        for (stage, state) in
            self.stages[..=self.horizon].iter_mut().zip(&trajectory.states[first..])
        {
            stage.state = *state;
            (stage.state_pair.watched, stage.input_pair.watched) = (false, false);
        }
        for (stage, input) in
            self.stages[..self.horizon].iter_mut().zip(&trajectory.inputs[first..])
        {
            stage.input = *input;
        }
        // The bounds on the last state may depend on the input that follows it.
        let last = &mut self.stages[self.horizon];
        last.input = trajectory.inputs.get(first + self.horizon).copied().unwrap_or_default();
        last.d_input = Vector3::zeros();
        self.evaluate(problem);
        let cost = self.cost(problem);
        let (smallest, gap) = if warm { WARM } else { COLD };
        let per_stage = if problem.constraints.constrains_states() { 2 } else { 1 };
        let share = cost / (per_stage * self.horizon + 1) as f64;
        let mean = gap * share;
        let Multipliers { intervals, terminal, .. } = multipliers;
        self.terminal.begin(smallest, mean, if warm { *terminal } else { 0.0 });
        self.watch(problem, smallest, mean, |k| {
            let given = |k: usize| intervals.get(k).copied().filter(|_| warm).unwrap_or_default();
            let [state, _] = (first + k).checked_sub(1).map_or([0.0; 2], given);
            [state, given(first + k)[1]]
        });
        let pairs = self.stages[..=self.horizon]
            .iter()
            .flat_map(|stage| [&stage.state_pair, &stage.input_pair]);
        if pairs.filter(|pair| pair.watched).any(|pair| pair.c > FAR_OUTSIDE) {
            self.each_pair(problem, |pair| pair.begin(FAR.0, FAR.1 * share, 0.0));
        }
    }

    /// Includes the norm constraints that a step to sλ = `centre` has come near.
    pub(super) fn include_near<C: Constraints<O>>(
        &mut self,
        problem: &Problem<O, C>,
        centre: f64,
        residuals: &Residuals,
    ) {
        let mean = centre.max(WARM.1 * residuals.cost / residuals.count);
        self.watch(problem, NEWLY, mean, |_| [0.0; 2]);
    }

    /// Includes the norm constraints that the iterate has come near. `guess` gives the multipliers
    /// with which a stage begins, state constraint first.
    fn watch<C: Constraints<O>>(
        &mut self,
        problem: &Problem<O, C>,
        smallest: f64,
        mean: f64,
        guess: impl Fn(usize) -> [f64; 2],
    ) {
        let end = self.horizon;
        let constrains_states = problem.constraints.constrains_states();
        // A value that is not a number must not go unnoticed.
        let near = |square: f64| square.is_nan() || square > NEAR;
        for (k, stage) in self.stages[..=end].iter_mut().enumerate() {
            let (has_state, has_input) = (k > 0 && constrains_states, k < end);
            if !stage.watched() {
                let (state, input) = problem.constraints.squares(k, &stage.state, &stage.input);
                if !(has_state && near(state) || has_input && near(input)) {
                    continue;
                }
                stage.evaluate(problem.constraints, k);
            }
            let guess = guess(k);
            let Stage { state_pair, input_pair, .. } = stage;
            for (pair, exists, multiplier) in
                [(state_pair, has_state, guess[0]), (input_pair, has_input, guess[1])]
            {
                if exists && !pair.watched && near(2.0 * pair.c + 1.0) {
                    pair.begin(smallest, mean, multiplier);
                }
            }
        }
    }

    /// Evaluates c and its slopes at the iterate.
    pub(super) fn evaluate<C: Constraints<O>>(&mut self, problem: &Problem<O, C>) {
        let end = self.horizon;
        for (k, stage) in self.stages[..=end].iter_mut().enumerate() {
            if stage.watched() {
                stage.evaluate(problem.constraints, k);
            }
        }
        if let Some(radius) = problem.end.radius {
            let end = &self.stages[end].state;
            self.terminal.c =
                0.5 * (dot(end, &problem.end.weighted(end)) / (radius * radius) - 1.0);
        }
    }

    /// Visits the pairs of all included inequalities.
    pub(super) fn each_pair<C: Constraints<O>>(
        &mut self,
        problem: &Problem<O, C>,
        mut visit: impl FnMut(&mut Pair),
    ) {
        let pairs = self.stages[..=self.horizon]
            .iter_mut()
            .flat_map(|Stage { state_pair, input_pair, .. }| [state_pair, input_pair]);
        pairs.filter(|pair| pair.watched).for_each(&mut visit);
        if problem.end.radius.is_some() {
            visit(&mut self.terminal);
        }
    }
}
