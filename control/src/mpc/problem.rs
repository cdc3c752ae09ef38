//! The structured problem: chains of integrators, quadratic cost, and the conditions on both ends.
//! Its norm constraints are in [`super::constraints`].

use crate::clone_in_place::clone_in_place;
use nalgebra::{SMatrix, SVector, Vector3};

/// The tracking error of one stage: the errors of the three axes, then those of their derivatives
/// up to order O − 1.
pub type State<const O: usize> = [Vector3<f64>; O];

/// Returns the state without any error.
pub fn zero_state<const O: usize>() -> State<O> {
    [Vector3::zeros(); O]
}

/// Three chains of `O` integrators with a held input, sampled exactly: E⁺ = A E + B v + d.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Chain<const O: usize> {
    /// Matrix A: the j-th derivative contributes to the i-th with h^(j−i)/(j−i)!.
    pub a: SMatrix<f64, O, O>,
    /// Vector B: the input contributes to the i-th derivative with h^(O−i)/(O−i)!.
    pub b: SVector<f64, O>,
    /// Sampling interval h, s.
    pub step: f64,
}

impl<const O: usize> Chain<O> {
    /// Returns the chains sampled every `step` s.
    pub fn new(step: f64) -> Self {
        // Factor h^n / n! of the exact sampling.
        let power = |n: usize| (1..=n).map(|i| step / i as f64).product::<f64>();
        Self {
            a: SMatrix::from_fn(|i, j| if j < i { 0.0 } else { power(j - i) }),
            b: SVector::from_fn(|i, _| power(O - i)),
            step,
        }
    }

    /// Returns the next state A E + B v, without d.
    pub fn advance(&self, state: &State<O>, input: &Vector3<f64>) -> State<O> {
        std::array::from_fn(|i| {
            let sum = input * self.b[i] + state[i];
            (i + 1..O).fold(sum, |sum, j| sum + state[j] * self.a[(i, j)])
        })
    }

    /// Returns the costate Aᵀ p of the stage before.
    pub fn adjoint(&self, costate: &State<O>) -> State<O> {
        std::array::from_fn(|i| (0..i).fold(costate[i], |sum, j| sum + costate[j] * self.a[(j, i)]))
    }

    /// Returns Bᵀ p, the slope of the future cost in the input.
    pub fn input_adjoint(&self, costate: &State<O>) -> Vector3<f64> {
        (0..O).fold(Vector3::zeros(), |sum, i| sum + costate[i] * self.b[i])
    }
}

/// The cost Σ_{k<N} (E_kᵀ W E_k + v_kᵀ V v_k) + E_Nᵀ G E_N. Where it is a sampled integral, W and V
/// include the step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cost<const O: usize> {
    /// Diagonal of the state weight W.
    pub state: State<O>,
    /// Diagonal of the input weight V.
    pub input: Vector3<f64>,
    /// Weight G of the last state.
    pub end: PerAxis<O>,
}

/// A matrix without coupling of the axes: each block (i, j) is diagonal.
pub type PerAxis<const O: usize> = [[Vector3<f64>; O]; O];

/// Returns the product M E of a matrix and a state.
pub(super) fn apply<const O: usize>(m: &PerAxis<O>, state: &State<O>) -> State<O> {
    m.map(|row| {
        row.iter().zip(state).fold(Vector3::zeros(), |sum, (m, e)| sum + m.component_mul(e))
    })
}

/// Combines the matrices of the three axes into blocks.
pub fn per_axis<const O: usize>(axes: &[SMatrix<f64, O, O>; 3]) -> PerAxis<O> {
    std::array::from_fn(|i| std::array::from_fn(|j| Vector3::from_fn(|axis, _| axes[axis][(i, j)])))
}

/// Returns the matrix of one axis.
pub(super) fn of_axis<const O: usize>(m: &PerAxis<O>, axis: usize) -> SMatrix<f64, O, O> {
    SMatrix::from_fn(|i, j| m[i][j][axis])
}

impl<const O: usize> Cost<O> {
    /// Returns the product G E at the end.
    pub fn end_slope(&self, state: &State<O>) -> State<O> {
        apply(&self.end, state)
    }

    /// Returns the square EᵀG E of the terminal norm.
    pub fn end_square(&self, state: &State<O>) -> f64 {
        dot(state, &self.end_slope(state))
    }

    /// Returns the product W E at a stage.
    pub fn slope(&self, state: &State<O>) -> State<O> {
        std::array::from_fn(|i| self.state[i].component_mul(&state[i]))
    }

    /// Returns the total cost of a trajectory.
    pub fn total(&self, trajectory: &ErrorTrajectory<O>) -> f64 {
        let state = |e: &State<O>| dot(e, &self.slope(e));
        let input = |v: &Vector3<f64>| v.component_mul(v).dot(&self.input);
        let n = trajectory.inputs.len();
        trajectory.states[..n].iter().map(state).sum::<f64>()
            + trajectory.inputs.iter().map(input).sum::<f64>()
            + self.end_square(&trajectory.states[n])
    }
}

/// Returns the sum of two states.
pub(super) fn add<const O: usize>(a: &State<O>, b: &State<O>) -> State<O> {
    std::array::from_fn(|i| a[i] + b[i])
}

/// Returns the scalar product of two states over all components.
pub(super) fn dot<const O: usize>(a: &State<O>, b: &State<O>) -> f64 {
    a.iter().zip(b).map(|(a, b)| a.dot(b)).sum()
}

/// Condition on the first state of the trajectory.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Start<'a, const O: usize> {
    /// The first state E_0 is given.
    Fixed(State<O>),
    /// The first state E_0 is free at the arrival cost (E_0 − Ē)ᵀ Π⁻¹ (E_0 − Ē), given by Π⁻¹ and
    /// Ē.
    Arrival(&'a PerAxis<O>, State<O>),
}

/// Cost EᵀP E + 2 pᵀE of the last state, and the terminal constraint.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct End<'a, const O: usize> {
    /// Weight P of the last state.
    pub weight: &'a PerAxis<O>,
    /// Linear part p of the cost.
    pub slope: State<O>,
    /// Radius ε of the terminal constraint ‖E_N‖_G ≤ ε, if there is one; P is then G.
    pub radius: Option<f64>,
}

impl<const O: usize> End<'_, O> {
    /// Returns the product P E.
    pub(super) fn weighted(&self, state: &State<O>) -> State<O> {
        apply(self.weight, state)
    }
}

/// The problem: minimise the cost of a trajectory E_{k+1} = A E_k + B v_k + d_k under the norm
/// constraints.
#[derive(Clone, Copy, Debug)]
pub struct Problem<'a, const O: usize, C> {
    /// Chain of integrators with its matrices A and B.
    pub chain: &'a Chain<O>,
    /// Weights of the quadratic cost.
    pub cost: &'a Cost<O>,
    /// Condition on the first state E_0.
    pub start: Start<'a, O>,
    /// Affine terms d_0 … d_{N−1}: the part of the reference that the chain cannot reproduce,
    /// including its jumps.
    pub affine: &'a [State<O>],
    /// Norm constraints on states and inputs.
    pub constraints: &'a C,
    /// Cost of the last state E_N, with its terminal constraint.
    pub end: End<'a, O>,
}

/// A trajectory of the tracking error over the horizon.
#[derive(Debug, Default, PartialEq)]
pub struct ErrorTrajectory<const O: usize> {
    /// States E_0 … E_N at the stages.
    pub states: Vec<State<O>>,
    /// Inputs v_0 … v_{N−1}, each held over one interval.
    pub inputs: Vec<Vector3<f64>>,
}

clone_in_place!([const O: usize] ErrorTrajectory<O> { states, inputs });

impl<const O: usize> ErrorTrajectory<O> {
    /// Returns a trajectory without error over `horizon` intervals.
    pub fn new(horizon: usize) -> Self {
        Self { states: vec![zero_state(); horizon + 1], inputs: vec![Vector3::zeros(); horizon] }
    }

    /// Moves this trajectory half of the way to `other`.
    pub fn halve_the_way_to(&mut self, other: &Self) {
        let values = self.states.iter_mut().flatten().chain(&mut self.inputs);
        let others = other.states.iter().flatten().chain(&other.inputs);
        for (value, other) in values.zip(others) {
            *value = (*value + other) * 0.5;
        }
    }

    /// Returns the largest difference of any component of any state.
    pub fn distance(&self, other: &Self) -> f64 {
        let states = self.states.iter().flatten().zip(other.states.iter().flatten());
        states.map(|(a, b)| (a - b).amax()).fold(0.0, f64::max)
    }

    /// Replaces the first `count` inputs by those that lead the last derivative through the states.
    pub(super) fn set_inputs(&mut self, count: usize, chain: &Chain<O>, affine: &[State<O>]) {
        for k in 0..count {
            let moved = self.states[k + 1][O - 1] - self.states[k][O - 1] - affine[k][O - 1];
            self.inputs[k] = moved / chain.step;
        }
    }

    /// Replaces the states by those that the inputs produce from the first state.
    pub fn roll_out(&mut self, chain: &Chain<O>, affine: &[State<O>]) {
        for (k, (v, d)) in self.inputs.iter().zip(affine).enumerate() {
            self.states[k + 1] = add(&chain.advance(&self.states[k], v), d);
        }
    }
}

/// Multipliers for half the cost, of the norm constraints written as ½(‖y‖² − 1) ≤ 0.
#[derive(Clone, Debug, PartialEq)]
pub struct Multipliers {
    /// Multipliers of each interval: of the state constraint at its end, and of the norm constraint
    /// on its input.
    pub intervals: Vec<[f64; 2]>,
    /// Multiplier of the terminal constraint.
    pub terminal: f64,
}

impl Multipliers {
    /// Returns multipliers that are all zero.
    pub fn new(horizon: usize) -> Self {
        Self { intervals: vec![[0.0; 2]; horizon], terminal: 0.0 }
    }

    /// Sets all multipliers to zero.
    pub fn clear(&mut self) {
        self.intervals.fill([0.0; 2]);
        self.terminal = 0.0;
    }
}

/// A trajectory with the multipliers that prove it to be the optimum.
#[derive(Clone, Debug, PartialEq)]
pub struct Solution<const O: usize> {
    /// Trajectory of the tracking error.
    pub trajectory: ErrorTrajectory<O>,
    /// Multipliers of the constraints for this trajectory.
    pub multipliers: Multipliers,
}

impl<const O: usize> Solution<O> {
    /// Allocates a solution for `horizon` intervals.
    pub fn new(horizon: usize) -> Self {
        Self { trajectory: ErrorTrajectory::new(horizon), multipliers: Multipliers::new(horizon) }
    }
}

/// How a solver ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// The optimum was found after this number of iterations.
    Solved(u32),
    /// No optimum was found after this number of iterations.
    Failed(u32),
    /// No optimum was found, and the last iterate violated the norm constraints by far: probably no
    /// trajectory satisfies them.
    Hopeless(u32),
}

impl Outcome {
    /// Returns the number of iterations done.
    pub fn iterations(self) -> u32 {
        match self {
            Self::Solved(iterations) | Self::Failed(iterations) | Self::Hopeless(iterations) => {
                iterations
            }
        }
    }

    /// Returns whether probably no trajectory satisfies the norm constraints.
    pub fn hopeless(self) -> bool {
        matches!(self, Self::Hopeless(_))
    }

    /// Returns whether the optimum was found.
    pub fn solved(self) -> bool {
        matches!(self, Self::Solved(_))
    }
}
