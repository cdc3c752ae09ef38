//! The iterate, stage by stage, with its norm constraints and the direction of the present step.

use super::pair::Pair;
use super::sweep::Gain;
use crate::mpc::constraints::{Constraints, StageConstraints};
use crate::mpc::problem::{Problem, State, zero_state};
use nalgebra::Vector3;

/// One stage of the horizon: the iterate, its norm constraints and the direction.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stage<const O: usize> {
    pub state: State<O>,
    pub input: Vector3<f64>,
    pub constraints: StageConstraints<O>,
    pub slopes: Slopes<O>,
    pub state_pair: Pair,
    pub input_pair: Pair,
    pub gain: Gain<O>,
    pub feedforward: Vector3<f64>,
    pub d_state: State<O>,
    pub d_input: Vector3<f64>,
}

/// Gradients ∇c of a stage's norm constraints: first of the state constraint, then of the input
/// constraint.
#[derive(Clone, Copy, Debug)]
pub(super) struct Slopes<const O: usize> {
    pub state: State<O>,
    pub input: (State<O>, Vector3<f64>),
}

impl<const O: usize> Stage<O> {
    /// Returns a stage at rest.
    pub(super) fn new() -> Self {
        Self {
            state: zero_state(),
            input: Vector3::zeros(),
            constraints: StageConstraints::default(),
            slopes: Slopes { state: zero_state(), input: (zero_state(), Vector3::zeros()) },
            state_pair: Pair::default(),
            input_pair: Pair::default(),
            gain: Gain::default(),
            feedforward: Vector3::zeros(),
            d_state: zero_state(),
            d_input: Vector3::zeros(),
        }
    }

    /// Returns whether any norm constraint of the stage is included in the problem.
    pub(super) fn watched(&self) -> bool {
        self.state_pair.watched || self.input_pair.watched
    }

    /// Evaluates the norm constraints, c and its slopes at the iterate.
    pub(super) fn evaluate(&mut self, constraints: &impl Constraints<O>, k: usize) {
        self.constraints = constraints.norm_constraints(k, &self.state, &self.input);
        let StageConstraints { state, input } = &self.constraints;
        self.slopes = Slopes {
            state: state.by_state.map(|by| by.tr_mul(&state.value)),
            input: (
                input.by_state.map(|by| by.tr_mul(&input.value)),
                input.by_input.tr_mul(&input.value),
            ),
        };
        self.state_pair.evaluate(&state.value);
        self.input_pair.evaluate(&input.value);
    }

    /// Returns ∂/∂E and ∂/∂v of the stage's cost and of its norm constraints, weighted by their
    /// multipliers: the stage's part of (2) and (3), or of (6).
    pub(super) fn slope<C: Constraints<O>>(
        &self,
        problem: &Problem<O, C>,
        multiplier: &impl Fn(&Pair) -> f64,
    ) -> (State<O>, Vector3<f64>) {
        let mut by_state = problem.cost.slope(&self.state);
        let mut by_input = problem.cost.input.component_mul(&self.input);
        if self.input_pair.watched {
            let multiplier = multiplier(&self.input_pair);
            by_state = std::array::from_fn(|i| by_state[i] + self.slopes.input.0[i] * multiplier);
            by_input += self.slopes.input.1 * multiplier;
        }
        if self.state_pair.watched {
            let multiplier = multiplier(&self.state_pair);
            by_state = std::array::from_fn(|i| by_state[i] + self.slopes.state[i] * multiplier);
        }
        (by_state, by_input)
    }
}
