//! The balls of a problem as the solvers see them: as functions of the motion, or linearised.

use super::problem::{Motion, State};
use nalgebra::{Matrix3, Vector3};

/// A ball ‖y(E, v)‖ ≤ 1 at a point, with y and its derivatives, all divided by the bound.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ball<const O: usize> {
    /// Value of y at the point.
    pub value: Vector3<f64>,
    /// Derivative of y by the state, ∂y/∂E.
    pub by_state: [Matrix3<f64>; O],
    /// Derivative of y by the input, ∂y/∂v.
    pub by_input: Matrix3<f64>,
}

impl<const O: usize> Default for Ball<O> {
    fn default() -> Self {
        Self {
            value: Vector3::zeros(),
            by_state: [Matrix3::zeros(); O],
            by_input: Matrix3::zeros(),
        }
    }
}

impl<const O: usize> Ball<O> {
    /// Returns y at a changed state and input; exact if y is linear.
    fn at(&self, state: &State<O>, input: &Vector3<f64>) -> Vector3<f64> {
        self.value + self.change(state, input)
    }

    /// Returns the linear change of y for a change of state and input.
    pub fn change(&self, state: &State<O>, input: &Vector3<f64>) -> Vector3<f64> {
        self.by_state.iter().zip(state).fold(self.by_input * input, |sum, (by, e)| sum + by * e)
    }
}

/// The balls that constrain the state and the input of one stage.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Balls<const O: usize> {
    /// Ball on the state alone, for k = 1..=N; zero if there is none.
    pub state: Ball<O>,
    /// Ball on state and input, for k = 0..N.
    pub input: Ball<O>,
}

/// State E_k and input v_k of a stage.
pub type At<'a, const O: usize> = (&'a State<O>, &'a Vector3<f64>);

/// The ball constraints of a problem, one state ball and one input ball for each stage.
pub trait Constraints<const O: usize> {
    /// Returns whether the sizes of the balls follow the iterates of a search; otherwise they are
    /// held. Their derivatives are left out.
    fn follows(&self) -> bool {
        false
    }

    /// Sets the sizes of the input ball of stage `k` and of the state ball of the next stage to
    /// those about these two stages, if they depend on the motion. Until then they are held.
    fn renew(&self, _k: usize, _here: At<O>, _next: At<O>) {}

    /// Returns whether the states have balls of their own.
    fn has_state_balls(&self) -> bool;

    /// Returns the balls of stage `k` at (E_k, v_k) with their derivatives. The balls on E_0 and on
    /// v_N are not used.
    fn balls(&self, k: usize, state: &State<O>, input: &Vector3<f64>) -> Balls<O>;

    /// Returns only the two values ‖y‖², of the state ball and of the input ball.
    fn squares(&self, k: usize, state: &State<O>, input: &Vector3<f64>) -> (f64, f64) {
        let Balls { state, input } = self.balls(k, state, input);
        (state.value.norm_squared(), input.value.norm_squared())
    }
}

/// Constraints that are linearised about a motion: ‖c + J_E E_k + J_v v_k‖ ≤ 1.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Frozen<const O: usize> {
    /// Values at E = 0 and v = 0 with derivatives, for k = 0..=N.
    balls: Vec<Balls<O>>,
    state_balls: bool,
}

impl<const O: usize> Frozen<O> {
    /// Allocates linearised constraints for `horizon` intervals.
    pub fn new(horizon: usize) -> Self {
        Self { balls: vec![Balls::default(); horizon + 1], state_balls: true }
    }

    /// Linearises `constraints`, which begin at stage `first` of `motion`, about it.
    pub fn set(&mut self, constraints: &impl Constraints<O>, motion: &Motion<O>, first: usize) {
        self.state_balls = constraints.has_state_balls();
        for (k, (balls, state)) in self.balls.iter_mut().zip(&motion.states[first..]).enumerate() {
            let input = motion.inputs.get(first + k).copied().unwrap_or_default();
            *balls = constraints.balls(k, state, &input);
            balls.state.value -= balls.state.change(state, &Vector3::zeros());
            balls.input.value -= balls.input.change(state, &input);
        }
    }

    pub(super) fn stages(&self) -> &[Balls<O>] {
        &self.balls
    }
}

impl<const O: usize> Constraints<O> for Frozen<O> {
    fn has_state_balls(&self) -> bool {
        self.state_balls
    }

    fn balls(&self, k: usize, state: &State<O>, input: &Vector3<f64>) -> Balls<O> {
        let mut balls = self.balls[k];
        balls.state.value = balls.state.at(state, &Vector3::zeros());
        balls.input.value = balls.input.at(state, input);
        balls
    }

    fn squares(&self, k: usize, state: &State<O>, input: &Vector3<f64>) -> (f64, f64) {
        let Balls { state: of_state, input: of_input } = &self.balls[k];
        (
            of_state.at(state, &Vector3::zeros()).norm_squared(),
            of_input.at(state, input).norm_squared(),
        )
    }
}
