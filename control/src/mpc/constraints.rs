//! The norm constraints of a problem as the solvers see them: as functions of the trajectory, or
//! linearised.

use super::problem::{ErrorTrajectory, State};
use nalgebra::{Matrix3, Vector3};

/// A norm constraint ‖y(E, v)‖ ≤ 1 at a point, with y and its derivatives, all divided by the
/// bound.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NormConstraint<const O: usize> {
    /// Value of y at the point.
    pub value: Vector3<f64>,
    /// Derivative of y by the state, ∂y/∂E.
    pub by_state: [Matrix3<f64>; O],
    /// Derivative of y by the input, ∂y/∂v.
    pub by_input: Matrix3<f64>,
}

impl<const O: usize> Default for NormConstraint<O> {
    fn default() -> Self {
        Self {
            value: Vector3::zeros(),
            by_state: [Matrix3::zeros(); O],
            by_input: Matrix3::zeros(),
        }
    }
}

impl<const O: usize> NormConstraint<O> {
    /// Returns y at a changed state and input; exact if y is linear.
    fn at(&self, state: &State<O>, input: &Vector3<f64>) -> Vector3<f64> {
        self.value + self.change(state, input)
    }

    /// Returns the linear change of y for a change of state and input.
    pub fn change(&self, state: &State<O>, input: &Vector3<f64>) -> Vector3<f64> {
        self.by_state.iter().zip(state).fold(self.by_input * input, |sum, (by, e)| sum + by * e)
    }
}

/// The norm constraints of one stage.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StageConstraints<const O: usize> {
    /// Norm constraint on the state alone, for k = 1..=N; zero if there is none.
    pub state: NormConstraint<O>,
    /// Norm constraint on state and input, for k = 0..N.
    pub input: NormConstraint<O>,
}

/// State E_k and input v_k of a stage.
pub type StagePoint<'a, const O: usize> = (&'a State<O>, &'a Vector3<f64>);

/// The norm constraints of a problem, one state constraint and one input constraint for each stage.
pub trait Constraints<const O: usize> {
    /// Returns whether the bounds of the norm constraints follow the iterates of a search;
    /// otherwise they are held. Their derivatives are left out.
    fn follows(&self) -> bool {
        false
    }

    /// Returns whether another optimisation follows if this one finds no optimum.
    fn has_another_start(&self) -> bool {
        false
    }

    /// Computes the bounds of the input constraint of stage `k` and of the state constraint of the
    /// next stage anew from these two stages, if they depend on the trajectory. Until then they are
    /// held.
    fn renew(&self, _k: usize, _stage: StagePoint<O>, _next: StagePoint<O>) {}

    /// Returns whether the states have norm constraints.
    fn constrains_states(&self) -> bool;

    /// Returns the norm constraints of stage `k` at (E_k, v_k) with their derivatives. The norm
    /// constraints on E_0 and on v_N are not used.
    fn norm_constraints(
        &self,
        k: usize,
        state: &State<O>,
        input: &Vector3<f64>,
    ) -> StageConstraints<O>;

    /// Returns only the values ‖y‖² of the state constraint and of the input constraint.
    fn squares(&self, k: usize, state: &State<O>, input: &Vector3<f64>) -> (f64, f64) {
        let StageConstraints { state, input } = self.norm_constraints(k, state, input);
        (state.value.norm_squared(), input.value.norm_squared())
    }
}

/// Constraints that are linearised about a trajectory: ‖c + J_E E_k + J_v v_k‖ ≤ 1.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LinearisedConstraints<const O: usize> {
    /// Values at E = 0 and v = 0 with derivatives, for k = 0..=N.
    stages: Vec<StageConstraints<O>>,
    constrains_states: bool,
}

impl<const O: usize> LinearisedConstraints<O> {
    /// Allocates linearised constraints for `horizon` intervals.
    pub fn new(horizon: usize) -> Self {
        Self { stages: vec![StageConstraints::default(); horizon + 1], constrains_states: true }
    }

    /// Linearises `constraints`, which begin at stage `first`, about `trajectory`.
    pub fn set(
        &mut self,
        constraints: &impl Constraints<O>,
        trajectory: &ErrorTrajectory<O>,
        first: usize,
    ) {
        self.constrains_states = constraints.constrains_states();
        for (k, (stage, state)) in
            self.stages.iter_mut().zip(&trajectory.states[first..]).enumerate()
        {
            let input = trajectory.inputs.get(first + k).copied().unwrap_or_default();
            *stage = constraints.norm_constraints(k, state, &input);
            stage.state.value -= stage.state.change(state, &Vector3::zeros());
            stage.input.value -= stage.input.change(state, &input);
        }
    }

    pub(super) fn stages(&self) -> &[StageConstraints<O>] {
        &self.stages
    }
}

impl<const O: usize> Constraints<O> for LinearisedConstraints<O> {
    fn constrains_states(&self) -> bool {
        self.constrains_states
    }

    fn norm_constraints(
        &self,
        k: usize,
        state: &State<O>,
        input: &Vector3<f64>,
    ) -> StageConstraints<O> {
        let mut stage = self.stages[k];
        stage.state.value = stage.state.at(state, &Vector3::zeros());
        stage.input.value = stage.input.at(state, input);
        stage
    }
}
