//! Finite-horizon linear-quadratic optimum: the unconstrained problem. Gains and weights depend on
//! the cost alone and are computed once; the affine terms cost one sweep per sample.

use super::problem::{
    Chain, Cost, ErrorTrajectory, PerAxis, State, add, apply, of_axis, per_axis, zero_state,
};
use nalgebra::{SMatrix, Vector3};

/// One stage of the backward recursion, v = K E − M⁻¹Bᵀ(P⁺d + p⁺).
#[derive(Clone, Copy, Debug)]
struct Gain<const O: usize> {
    /// Feedback gain K of the stage.
    feedback: State<O>,
    /// Feedforward matrix M⁻¹Bᵀ of the stage.
    feedforward: State<O>,
    /// Transposed closed-loop matrix (A + B K)ᵀ.
    closed_loop_transposed: PerAxis<O>,
    /// Weight P of the next stage.
    next_weight: PerAxis<O>,
}

/// One stage of the forward recursion. The cost of getting from E_0 to E_k is (E_k − Ē)ᵀ Π⁻¹
/// (E_k − Ē) + const, as for a Kalman filter with v as process noise of variance V⁻¹ and the stage
/// cost as a measurement of E = 0 with information W.
#[derive(Clone, Copy, Debug)]
struct Arrival<const O: usize> {
    /// Factor in Ē⁺ = discount·Ē, which includes the cost of the stage.
    discount: PerAxis<O>,
    /// Gain of the smoother, E_k = Ē_k⁺ + smoother·(E_{k+1} − Ē_{k+1}).
    smoother: PerAxis<O>,
    /// Arrival weight Π⁻¹ of the next stage.
    next_weight: PerAxis<O>,
}

/// The solver for the unconstrained optimum, and for the optimum with the terminal constraint
/// alone. It also solves for a part of the horizon so that the part agrees with the optimum of the
/// whole.
#[derive(Clone, Debug)]
pub struct Unconstrained<const O: usize> {
    pub(super) chain: Chain<O>,
    pub(super) end: PerAxis<O>,
    gains: Vec<Gain<O>>,
    arrivals: Vec<Arrival<O>>,
    /// Slope p of each stage's cost-to-go EᵀP E + 2 pᵀE + const.
    slopes: Vec<State<O>>,
    /// Mean Ē of each stage's arrival cost.
    means: Vec<State<O>>,
}

/// Computes a matrix for each axis with ordinary matrices; used only at construction.
fn each_axis<const O: usize>(mut f: impl FnMut(usize) -> SMatrix<f64, O, O>) -> PerAxis<O> {
    per_axis(&[f(0), f(1), f(2)])
}

impl<const O: usize> Unconstrained<O> {
    /// Computes gains and arrival weights for `horizon` intervals.
    pub fn new(horizon: usize, chain: &Chain<O>, cost: &Cost<O>) -> Self {
        let (a, b) = (chain.a, chain.b);
        let information =
            |axis: usize| SMatrix::from_fn(|i, j| if i == j { cost.state[i][axis] } else { 0.0 });
        let mut weight = cost.end;
        let mut gains = Vec::with_capacity(horizon);
        for _ in 0..horizon {
            let mut gain = Gain {
                feedback: zero_state(),
                feedforward: zero_state(),
                closed_loop_transposed: [[Vector3::zeros(); O]; O],
                next_weight: weight,
            };
            weight = each_axis(|axis| {
                let next: SMatrix<f64, O, O> = of_axis(&gain.next_weight, axis);
                let curvature = cost.input[axis] + b.dot(&(next * b));
                let feedback = -(b.transpose() * next * a) / curvature;
                let closed_loop = a + b * feedback;
                for i in 0..O {
                    gain.feedback[i][axis] = feedback[i];
                    gain.feedforward[i][axis] = b[i] / curvature;
                    for j in 0..O {
                        gain.closed_loop_transposed[i][j][axis] = closed_loop[(j, i)];
                    }
                }
                // P is symmetric up to rounding; the sum with its transpose removes the error.
                let full = information(axis) + a.transpose() * next * closed_loop;
                (full + full.transpose()) * 0.5
            });
            gains.push(gain);
        }
        gains.reverse();

        let zeros = [[Vector3::zeros(); O]; O];
        let mut spread = zeros;
        let mut arrivals = Vec::with_capacity(horizon);
        for _ in 0..horizon {
            // (Π⁻¹ + W)⁻¹ Π⁻¹, in a form that also holds for a singular Π.
            let discount = each_axis(|axis| {
                (SMatrix::identity() + of_axis(&spread, axis) * information(axis))
                    .try_inverse()
                    .unwrap_or_else(SMatrix::identity)
            });
            let counted = |axis| of_axis(&discount, axis) * of_axis(&spread, axis);
            let next = each_axis(|axis| {
                let next = a * counted(axis) * a.transpose() + b * b.transpose() / cost.input[axis];
                (next + next.transpose()) * 0.5
            });
            // The first nonzero Π has rank one, but then the state before it is known anyway.
            let next_weight =
                each_axis(|axis| of_axis(&next, axis).try_inverse().unwrap_or_else(SMatrix::zeros));
            let smoother =
                each_axis(|axis| counted(axis) * a.transpose() * of_axis(&next_weight, axis));
            arrivals.push(Arrival { discount, smoother, next_weight });
            spread = next;
        }
        Self {
            chain: *chain,
            end: cost.end,
            gains,
            arrivals,
            slopes: vec![zero_state(); horizon + 1],
            means: vec![zero_state(); horizon + 1],
        }
    }

    /// Returns K of the first stage, negative: v = K E without affine terms.
    pub fn feedback(&self) -> State<O> {
        self.gains.first().map_or_else(zero_state, |gain| gain.feedback)
    }

    /// Writes the optimum from `start` into `trajectory`.
    pub fn solve(
        &mut self,
        start: &State<O>,
        affine: &[State<O>],
        trajectory: &mut ErrorTrajectory<O>,
    ) {
        for (k, gain) in self.gains.iter().enumerate().rev() {
            let costate = costate(gain, &self.slopes[k + 1], &affine[k]);
            self.slopes[k] = apply(&gain.closed_loop_transposed, &costate);
        }
        trajectory.states[0] = *start;
        self.follow(0, affine, trajectory);
    }

    /// Continues `trajectory` with the optimum from stage `first` on, for the affine terms of the
    /// last [`Self::solve`].
    pub fn follow(&self, first: usize, affine: &[State<O>], trajectory: &mut ErrorTrajectory<O>) {
        for k in first..self.gains.len() {
            (trajectory.inputs[k], trajectory.states[k + 1]) =
                self.go_on(k, &trajectory.states[k], affine);
        }
    }

    /// Returns the optimal input at `state` of stage `k` and the next state, for the affine terms
    /// of the last [`Self::solve`].
    #[allow(clippy::inline_always)] // Otherwise an optimisation without constraints takes a tenth longer.
    #[inline(always)]
    pub fn go_on(
        &self,
        k: usize,
        state: &State<O>,
        affine: &[State<O>],
    ) -> (Vector3<f64>, State<O>) {
        let gain = &self.gains[k];
        let costate = costate(gain, &self.slopes[k + 1], &affine[k]);
        let v = (0..O).fold(Vector3::zeros(), |sum, i| {
            sum + gain.feedback[i].component_mul(&state[i])
                - gain.feedforward[i].component_mul(&costate[i])
        });
        (v, add(&self.chain.advance(state, &v), &affine[k]))
    }

    /// Lets `trajectory` follow `plan` with the gains of the optimum, from its first state on.
    pub fn track(
        &self,
        plan: &ErrorTrajectory<O>,
        affine: &[State<O>],
        trajectory: &mut ErrorTrajectory<O>,
    ) {
        for (k, gain) in self.gains.iter().enumerate() {
            let (state, planned) = (trajectory.states[k], plan.states[k]);
            let v = (0..O).fold(plan.inputs[k], |sum, i| {
                sum + gain.feedback[i].component_mul(&(state[i] - planned[i]))
            });
            trajectory.inputs[k] = v;
            trajectory.states[k + 1] = add(&self.chain.advance(&state, &v), &affine[k]);
        }
    }

    /// Returns P and p of the cost-to-go from stage `k`, for the affine terms of the last
    /// [`Self::solve`].
    pub fn to_go(&self, k: usize) -> (&PerAxis<O>, State<O>) {
        let weight = if k == self.gains.len() { &self.end } else { &self.gains[k - 1].next_weight };
        (weight, self.slopes[k])
    }

    /// Computes the arrival cost of each stage from `start`.
    pub fn arrive(&mut self, start: &State<O>, affine: &[State<O>]) {
        self.means[0] = *start;
        for (k, Arrival { discount, .. }) in self.arrivals.iter().enumerate() {
            let next = self.chain.advance(&apply(discount, &self.means[k]), &Vector3::zeros());
            self.means[k + 1] = add(&next, &affine[k]);
        }
    }

    /// Returns Π⁻¹ and Ē at stage `k`, after [`Self::arrive`]. `k` must be at least `O`, as fewer
    /// steps do not reach every E.
    pub fn arrival(&self, k: usize) -> (&PerAxis<O>, State<O>) {
        (&self.arrivals[k - 1].next_weight, self.means[k])
    }

    /// Computes the optimum from the start of [`Self::arrive`] to the state of `trajectory` at
    /// stage `k`. The inputs are those that lead the last derivative exactly through the states.
    pub fn trace_back(&self, k: usize, affine: &[State<O>], trajectory: &mut ErrorTrajectory<O>) {
        for (j, Arrival { discount, smoother, .. }) in self.arrivals[..k].iter().enumerate().rev() {
            let (counted, after) = (apply(discount, &self.means[j]), trajectory.states[j + 1]);
            let deviation =
                apply(smoother, &std::array::from_fn(|i| after[i] - self.means[j + 1][i]));
            trajectory.states[j] = add(&counted, &deviation);
        }
        trajectory.states[0] = self.means[0];
        trajectory.set_inputs(k, &self.chain, affine);
    }
}

/// Returns the costate P⁺d + p⁺ behind a stage.
fn costate<const O: usize>(gain: &Gain<O>, next_slope: &State<O>, d: &State<O>) -> State<O> {
    add(next_slope, &apply(&gain.next_weight, d))
}

#[cfg(test)]
pub(super) mod tests;
