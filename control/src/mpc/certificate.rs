//! Proof that a trajectory is the optimum. It is evaluated independently of the solvers; only the
//! multipliers come from them.

use super::constraints::{Constraints, StageConstraints};
use super::problem::{ErrorTrajectory, Problem, Solution, State, dot};
use nalgebra::Vector3;

/// Residuals of the conditions of Karush, Kuhn and Tucker, with the constraints as functions of the
/// trajectory rather than as a solver approximates them. All are relative: to the largest ∂(½
/// cost)/∂v, to the bounds and to half the cost.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Certificate {
    /// Largest slope ∂L/∂v in any input.
    pub stationarity: f64,
    /// Largest excess of a norm constraint, or error of the chain.
    pub feasibility: f64,
    /// Complementarity Σ |λ c|, or the largest negative multiplier.
    pub complementarity: f64,
    /// Cost of the whole trajectory.
    pub cost: f64,
}

impl Certificate {
    /// Returns the largest of the three residuals.
    pub fn residual(&self) -> f64 {
        self.stationarity.max(self.feasibility).max(self.complementarity)
    }

    /// Evaluates the certificate of `solution`. If `checked`, intervals without multipliers are
    /// known to satisfy their constraints and are not evaluated again.
    pub fn new<const O: usize, C: Constraints<O>>(
        problem: &Problem<O, C>,
        solution: &Solution<O>,
        checked: bool,
    ) -> Self {
        let Solution { trajectory, multipliers } = solution;
        let (chain, cost) = (problem.chain, problem.cost);
        let n = trajectory.inputs.len();
        let constrains_states = problem.constraints.constrains_states();

        let (mut largest, mut gap, mut least) = (1.0_f64, 0.0, 0.0_f64);
        let mut count = |square: f64, multiplier: f64| {
            largest = largest.max(square);
            gap += 0.5 * (multiplier * (square - 1.0)).abs();
            least = least.min(multiplier);
        };

        // Costate p of the last stage.
        let end = &trajectory.states[n];
        let mut weight = 1.0;
        let weighted = problem.end.weighted(end);
        if let Some(radius) = problem.end.radius {
            let square = radius * radius;
            weight += multipliers.terminal / square;
            count(dot(end, &weighted) / square, multipliers.terminal);
        }
        let mut p: State<O> = std::array::from_fn(|i| weighted[i] * weight + problem.end.slope[i]);
        let (mut slope, mut scale) = (0.0_f64, f64::MIN_POSITIVE);
        for k in (0..=n).rev() {
            let state = &trajectory.states[k];
            let input = trajectory.inputs.get(k).copied().unwrap_or_default();
            // A stage without multipliers contributes only its norms.
            let by_input = multipliers.intervals.get(k).map_or(0.0, |[_, input]| *input);
            let by_state =
                if k > 0 && constrains_states { multipliers.intervals[k - 1][0] } else { 0.0 };
            let idle = by_input == 0.0 && by_state == 0.0;
            let (stage, squares) = if idle && checked {
                (StageConstraints::default(), (0.0, 0.0))
            } else if idle {
                (StageConstraints::default(), problem.constraints.squares(k, state, &input))
            } else {
                let stage = problem.constraints.norm_constraints(k, state, &input);
                (stage, (stage.state.value.norm_squared(), stage.input.value.norm_squared()))
            };
            if k < n {
                let by_cost = cost.input.component_mul(&input);
                let by_future = chain.input_adjoint(&p);
                let (through, weighted) = (chain.adjoint(&p), cost.slope(state));
                p = std::array::from_fn(|i| through[i] + weighted[i]);
                let mut by_constraint = Vector3::zeros();
                if !idle {
                    by_constraint = stage.input.by_input.tr_mul(&stage.input.value) * by_input;
                    add(&mut p, |i| stage.input.by_state[i].tr_mul(&stage.input.value) * by_input);
                }
                slope = slope.max((by_cost + by_constraint + by_future).amax());
                scale = [by_cost, by_constraint, by_future]
                    .iter()
                    .fold(scale, |scale, part| scale.max(part.amax()));
                count(squares.1, by_input);
            }
            if k > 0 && constrains_states {
                if !idle {
                    add(&mut p, |i| stage.state.by_state[i].tr_mul(&stage.state.value) * by_state);
                }
                count(squares.0, by_state);
            }
        }
        let cost = cost.total(trajectory);
        let half_cost = (0.5 * cost).max(f64::MIN_POSITIVE);
        Self {
            stationarity: slope / scale,
            feasibility: (largest.sqrt() - 1.0).max(chain_error(problem, trajectory)),
            complementarity: (gap / half_cost).max(least.abs() / half_cost),
            cost,
        }
    }
}

fn add<const O: usize>(p: &mut State<O>, term: impl Fn(usize) -> Vector3<f64>) {
    for (i, p) in p.iter_mut().enumerate() {
        *p += term(i);
    }
}

/// Returns the largest ‖E_{k+1} − (A E_k + B v_k + d_k)‖, relative to the largest ‖E‖.
fn chain_error<const O: usize, C>(problem: &Problem<O, C>, trajectory: &ErrorTrajectory<O>) -> f64 {
    let square = |state: &State<O>| dot(state, state);
    let error = |k: usize| {
        let next = problem.chain.advance(&trajectory.states[k], &trajectory.inputs[k]);
        square(&std::array::from_fn(|i| {
            trajectory.states[k + 1][i] - next[i] - problem.affine[k][i]
        }))
    };
    let error = (0..trajectory.inputs.len()).map(error).fold(0.0, f64::max);
    let size = trajectory.states.iter().map(square).fold(f64::MIN_POSITIVE, f64::max);
    (error / size).sqrt()
}
