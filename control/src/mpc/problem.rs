//! The structured problem: chains of integrators, quadratic cost, ball constraints.

use nalgebra::{Matrix3, SMatrix, SVector, Vector3};

/// The tracking error of one stage: the three axes' errors, then those of their derivatives up to the order − 1.
pub type State<const O: usize> = [Vector3<f64>; O];

/// The error of nothing.
pub fn zero_state<const O: usize>() -> State<O> {
    [Vector3::zeros(); O]
}

/// Three chains of `O` integrators with a held input, sampled exactly: E⁺ = A E + B v + d.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Chain<const O: usize> {
    /// A: what the j-th derivative adds to the i-th, h^(j−i)/(j−i)!.
    pub a: SMatrix<f64, O, O>,
    /// B: what the input adds to the i-th derivative, h^(O−i)/(O−i)!.
    pub b: SVector<f64, O>,
    /// h, s.
    pub step: f64,
}

impl<const O: usize> Chain<O> {
    /// Sampled every `step` s.
    pub fn new(step: f64) -> Self {
        // h^n / n!
        let power = |n: usize| (1..=n).map(|i| step / i as f64).product::<f64>();
        Self {
            a: SMatrix::from_fn(|i, j| if j < i { 0.0 } else { power(j - i) }),
            b: SVector::from_fn(|i, _| power(O - i)),
            step,
        }
    }

    /// A E + B v.
    pub fn advance(&self, state: &State<O>, input: &Vector3<f64>) -> State<O> {
        std::array::from_fn(|i| {
            let sum = input * self.b[i] + state[i];
            (i + 1..O).fold(sum, |sum, j| sum + state[j] * self.a[(i, j)])
        })
    }

    /// Aᵀ p.
    pub fn adjoint(&self, costate: &State<O>) -> State<O> {
        std::array::from_fn(|i| (0..i).fold(costate[i], |sum, j| sum + costate[j] * self.a[(j, i)]))
    }

    /// Bᵀ p.
    pub fn input_adjoint(&self, costate: &State<O>) -> Vector3<f64> {
        (0..O).fold(Vector3::zeros(), |sum, i| sum + costate[i] * self.b[i])
    }
}

/// Σ_{k<N} (E_kᵀ W E_k + v_kᵀ V v_k) + E_Nᵀ G E_N. W and V hold the step, where the cost is a sampled integral.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cost<const O: usize> {
    /// W, diagonal.
    pub state: State<O>,
    /// V, diagonal.
    pub input: Vector3<f64>,
    /// G.
    pub end: PerAxis<O>,
}

/// A matrix that keeps the axes apart: the block (i, j) is diagonal.
pub type PerAxis<const O: usize> = [[Vector3<f64>; O]; O];

/// M E.
pub(super) fn apply<const O: usize>(m: &PerAxis<O>, state: &State<O>) -> State<O> {
    m.map(|row| row.iter().zip(state).fold(Vector3::zeros(), |sum, (m, e)| sum + m.component_mul(e)))
}

/// The blocks from a matrix for each axis.
pub fn per_axis<const O: usize>(axes: &[SMatrix<f64, O, O>; 3]) -> PerAxis<O> {
    std::array::from_fn(|i| std::array::from_fn(|j| Vector3::from_fn(|axis, _| axes[axis][(i, j)])))
}

/// The matrix of one axis.
pub(super) fn of_axis<const O: usize>(m: &PerAxis<O>, axis: usize) -> SMatrix<f64, O, O> {
    SMatrix::from_fn(|i, j| m[i][j][axis])
}

impl<const O: usize> Cost<O> {
    /// G E.
    pub fn end_slope(&self, state: &State<O>) -> State<O> {
        apply(&self.end, state)
    }

    /// EᵀG E.
    pub fn end_square(&self, state: &State<O>) -> f64 {
        dot(state, &self.end_slope(state))
    }

    /// W E.
    pub fn slope(&self, state: &State<O>) -> State<O> {
        std::array::from_fn(|i| self.state[i].component_mul(&state[i]))
    }

    /// The cost of a motion.
    pub fn of(&self, motion: &Motion<O>) -> f64 {
        let state = |e: &State<O>| dot(e, &self.slope(e));
        let input = |v: &Vector3<f64>| v.component_mul(v).dot(&self.input);
        let n = motion.inputs.len();
        motion.states[..n].iter().map(state).sum::<f64>()
            + motion.inputs.iter().map(input).sum::<f64>()
            + self.end_square(&motion.states[n])
    }
}

/// Sum of the products of the components.
pub(super) fn dot<const O: usize>(a: &State<O>, b: &State<O>) -> f64 {
    a.iter().zip(b).map(|(a, b)| a.dot(b)).sum()
}

/// A ball ‖y(E, v)‖ ≤ 1 at a point: y and its derivatives, all divided by the bound.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ball<const O: usize> {
    /// y.
    pub value: Vector3<f64>,
    /// ∂y/∂E.
    pub by_state: [Matrix3<f64>; O],
    /// ∂y/∂v.
    pub by_input: Matrix3<f64>,
}

impl<const O: usize> Default for Ball<O> {
    fn default() -> Self {
        Self { value: Vector3::zeros(), by_state: [Matrix3::zeros(); O], by_input: Matrix3::zeros() }
    }
}

impl<const O: usize> Ball<O> {
    /// y once state and input have changed, if it is linear.
    fn at(&self, state: &State<O>, input: &Vector3<f64>) -> Vector3<f64> {
        self.value + self.change(state, input)
    }

    /// ∂y of a change of state and input.
    pub fn change(&self, state: &State<O>, input: &Vector3<f64>) -> Vector3<f64> {
        self.by_state.iter().zip(state).fold(self.by_input * input, |sum, (by, e)| sum + by * e)
    }
}

/// The balls that the state and the input of one stage are in.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Balls<const O: usize> {
    /// On the state alone, for k = 1..=N. Without one: zero.
    pub state: Ball<O>,
    /// On state and input, for k = 0..N.
    pub input: Ball<O>,
}

/// The constraints of a problem.
pub trait Constraints<const O: usize> {
    /// Whether the balls' sizes are those about the motion that is evaluated, with their own derivatives left out.
    fn follows(&self) -> bool {
        false
    }

    /// Whether states have a ball of their own.
    fn has_state_balls(&self) -> bool;

    /// The balls of stage `k` at (E_k, v_k), with derivatives. That on E_0 and that on v_N are not looked at.
    fn balls(&self, k: usize, state: &State<O>, input: &Vector3<f64>) -> Balls<O>;

    /// ‖y‖² of both alone.
    fn squares(&self, k: usize, state: &State<O>, input: &Vector3<f64>) -> (f64, f64) {
        let Balls { state, input } = self.balls(k, state, input);
        (state.value.norm_squared(), input.value.norm_squared())
    }
}

/// The constraints from stage `first` on.
#[derive(Clone, Copy, Debug)]
pub(super) struct From<'a, C> {
    pub constraints: &'a C,
    pub first: usize,
}

impl<const O: usize, C: Constraints<O>> Constraints<O> for From<'_, C> {
    fn has_state_balls(&self) -> bool {
        self.constraints.has_state_balls()
    }

    fn follows(&self) -> bool {
        self.constraints.follows()
    }

    fn balls(&self, k: usize, state: &State<O>, input: &Vector3<f64>) -> Balls<O> {
        self.constraints.balls(self.first + k, state, input)
    }

    fn squares(&self, k: usize, state: &State<O>, input: &Vector3<f64>) -> (f64, f64) {
        self.constraints.squares(self.first + k, state, input)
    }
}

/// Constraints linearised about a motion: ‖c + J_E E_k + J_v v_k‖ ≤ 1.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Frozen<const O: usize> {
    /// Value at E = 0 and v = 0 and derivatives, for k = 0..=N.
    balls: Vec<Balls<O>>,
    state_balls: bool,
}

impl<const O: usize> Frozen<O> {
    /// With room for `horizon` intervals.
    pub fn new(horizon: usize) -> Self {
        Self { balls: vec![Balls::default(); horizon + 1], state_balls: true }
    }

    /// Linearises `constraints` about `motion`.
    pub fn set(&mut self, constraints: &impl Constraints<O>, motion: &Motion<O>) {
        self.state_balls = constraints.has_state_balls();
        for (k, balls) in self.balls.iter_mut().enumerate() {
            let state = &motion.states[k];
            let input = motion.inputs.get(k).copied().unwrap_or_default();
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
        (of_state.at(state, &Vector3::zeros()).norm_squared(), of_input.at(state, input).norm_squared())
    }
}

/// Where the motion starts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Start<'a, const O: usize> {
    /// E_0 is given.
    Fixed(State<O>),
    /// E_0 may be chosen with |nᵀ(E_given − E_0)| ≤ 1 for each of an axis's normals n.
    Within(State<O>, &'a [Vec<SVector<f64, O>>; 3]),
    /// E_0 is free at the cost (E_0 − Ē)ᵀ Π⁻¹ (E_0 − Ē) of arriving there: Π⁻¹ and Ē.
    Arrival(&'a PerAxis<O>, State<O>),
}

/// What the last state costs: EᵀP E + 2 pᵀE, and the ball it has to be in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct End<'a, const O: usize> {
    /// P.
    pub weight: &'a PerAxis<O>,
    /// p.
    pub slope: State<O>,
    /// ε of the terminal ball ‖E_N‖_G ≤ ε, if there is one; then P is G.
    pub radius: Option<f64>,
}

impl<const O: usize> End<'_, O> {
    /// P E.
    pub(super) fn weighted(&self, state: &State<O>) -> State<O> {
        apply(self.weight, state)
    }
}

/// Minimise the cost of a motion E_{k+1} = A E_k + B v_k + d_k within the balls.
#[derive(Clone, Copy, Debug)]
pub struct Problem<'a, const O: usize, C> {
    /// A and B.
    pub chain: &'a Chain<O>,
    /// Weights.
    pub cost: &'a Cost<O>,
    /// E_0.
    pub start: Start<'a, O>,
    /// d_0 … d_{N−1}: what the reference does beyond the chain, its jumps included.
    pub affine: &'a [State<O>],
    /// Balls on states and inputs.
    pub constraints: &'a C,
    /// What E_N costs.
    pub end: End<'a, O>,
}

/// A motion of the tracking error.
#[derive(Clone, Debug, PartialEq)]
pub struct Motion<const O: usize> {
    /// E_0 … E_N.
    pub states: Vec<State<O>>,
    /// v_0 … v_{N−1}, held between them.
    pub inputs: Vec<Vector3<f64>>,
}

impl<const O: usize> Motion<O> {
    /// No error over `horizon` intervals.
    pub fn new(horizon: usize) -> Self {
        Self { states: vec![zero_state(); horizon + 1], inputs: vec![Vector3::zeros(); horizon] }
    }

    /// Half of the way to `other`.
    pub fn halve_the_way_to(&mut self, other: &Self) {
        let here = self.states.iter_mut().flatten().chain(&mut self.inputs);
        let there = other.states.iter().flatten().chain(&other.inputs);
        for (here, there) in here.zip(there) {
            *here = (*here + there) * 0.5;
        }
    }

    /// Largest difference of any component of any state.
    pub fn distance(&self, other: &Self) -> f64 {
        let states = self.states.iter().flatten().zip(other.states.iter().flatten());
        states.map(|(a, b)| (a - b).amax()).fold(0.0, f64::max)
    }

    /// The motion that the inputs lead to from the first state.
    pub fn roll_out(&mut self, chain: &Chain<O>, affine: &[State<O>]) {
        for (k, (v, d)) in self.inputs.iter().zip(affine).enumerate() {
            let next = chain.advance(&self.states[k], v);
            self.states[k + 1] = std::array::from_fn(|i| next[i] + d[i]);
        }
    }
}

/// Multipliers of the balls, written as ½(‖y‖² − 1) ≤ 0, and of the start's faces, for half the cost.
#[derive(Clone, Debug, PartialEq)]
pub struct Multipliers<const O: usize> {
    /// Of the state balls of stages 1..=N, at position k − 1.
    pub state: Vec<f64>,
    /// Of the input balls.
    pub input: Vec<f64>,
    /// Of the terminal ball.
    pub terminal: f64,
    /// Σ λ n over the faces of the start's set, signed: their slope in E_0.
    pub start: State<O>,
    /// Σ λ |c| of these faces.
    pub start_gap: f64,
}

impl<const O: usize> Multipliers<O> {
    /// Nothing is active.
    pub fn new(horizon: usize) -> Self {
        Self {
            state: vec![0.0; horizon],
            input: vec![0.0; horizon],
            terminal: 0.0,
            start: zero_state(),
            start_gap: 0.0,
        }
    }

    /// Makes nothing active.
    pub fn clear(&mut self) {
        self.state.fill(0.0);
        self.input.fill(0.0);
        self.terminal = 0.0;
        self.start = zero_state();
        self.start_gap = 0.0;
    }
}

/// A motion with the multipliers that show it to be the optimum.
#[derive(Clone, Debug, PartialEq)]
pub struct Solution<const O: usize> {
    /// The motion.
    pub motion: Motion<O>,
    /// The multipliers.
    pub multipliers: Multipliers<O>,
}

impl<const O: usize> Solution<O> {
    /// With room for `horizon` intervals.
    pub fn new(horizon: usize) -> Self {
        Self { motion: Motion::new(horizon), multipliers: Multipliers::new(horizon) }
    }
}

/// How a solver ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// With the optimum, after so many iterations.
    Solved(u32),
    /// Without.
    Failed(u32),
    /// Without, and far outside of the balls: nothing seems to keep them.
    Hopeless(u32),
}

impl Outcome {
    /// Iterations done.
    pub fn iterations(self) -> u32 {
        match self {
            Self::Solved(iterations) | Self::Failed(iterations) | Self::Hopeless(iterations) => iterations,
        }
    }

    /// Whether nothing seems to keep the balls.
    pub fn hopeless(self) -> bool {
        matches!(self, Self::Hopeless(_))
    }

    /// Whether the optimum was found.
    pub fn solved(self) -> bool {
        matches!(self, Self::Solved(_))
    }
}
