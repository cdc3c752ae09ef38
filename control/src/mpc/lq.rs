//! Finite-horizon linear-quadratic optimum: the unconstrained problem. Gains and weights depend on
//! the cost alone and are computed once; the affine terms cost one sweep per sample.

use super::problem::{
    Chain, Cost, ErrorTrajectory, PerAxis, State, apply, of_axis, per_axis, zero_state,
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
    chain: Chain<O>,
    end: PerAxis<O>,
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
        for (k, gain) in self.gains.iter().enumerate().skip(first) {
            let state = trajectory.states[k];
            (trajectory.inputs[k], trajectory.states[k + 1]) =
                self.advance(gain, &self.slopes[k + 1], &state, &affine[k]);
        }
    }

    /// Returns the optimal input at `state` of stage `k` and the next state, for the affine terms
    /// of the last [`Self::solve`].
    pub fn go_on(
        &self,
        k: usize,
        state: &State<O>,
        affine: &[State<O>],
    ) -> (Vector3<f64>, State<O>) {
        self.advance(&self.gains[k], &self.slopes[k + 1], state, &affine[k])
    }

    #[allow(clippy::inline_always)] // Otherwise an optimisation without constraints takes a tenth longer.
    #[inline(always)]
    fn advance(
        &self,
        gain: &Gain<O>,
        slope: &State<O>,
        state: &State<O>,
        affine: &State<O>,
    ) -> (Vector3<f64>, State<O>) {
        let costate = costate(gain, slope, affine);
        let v = (0..O).fold(Vector3::zeros(), |sum, i| {
            sum + gain.feedback[i].component_mul(&state[i])
                - gain.feedforward[i].component_mul(&costate[i])
        });
        let next = self.chain.advance(state, &v);
        (v, std::array::from_fn(|i| next[i] + affine[i]))
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
            let next = self.chain.advance(&state, &v);
            trajectory.states[k + 1] = std::array::from_fn(|i| next[i] + affine[k][i]);
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
            self.means[k + 1] = std::array::from_fn(|i| next[i] + affine[k][i]);
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
            trajectory.states[j] = std::array::from_fn(|i| counted[i] + deviation[i]);
        }
        trajectory.states[0] = self.means[0];
        for j in 0..k {
            let moved =
                trajectory.states[j + 1][O - 1] - trajectory.states[j][O - 1] - affine[j][O - 1];
            trajectory.inputs[j] = moved / self.chain.step;
        }
    }
}

/// Returns the costate P⁺d + p⁺ behind a stage.
fn costate<const O: usize>(gain: &Gain<O>, next_slope: &State<O>, d: &State<O>) -> State<O> {
    let moved = apply(&gain.next_weight, d);
    std::array::from_fn(|i| next_slope[i] + moved[i])
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use nalgebra::SVector;

    pub(in crate::mpc) const N: usize = 20;
    /// Number of all inputs together.
    const INPUTS: usize = 3 * N;

    pub(in crate::mpc) fn chain<const O: usize>() -> Chain<O> {
        Chain::new(0.2)
    }

    pub(in crate::mpc) fn cost<const O: usize>() -> Cost<O> {
        let end = SMatrix::<f64, O, O>::from_fn(
            |i, j| if i == j { 80.0 - 40.0 * i as f64 } else { 30.0 },
        );
        Cost {
            state: std::array::from_fn(|i| Vector3::new(10.0, 7.0, 3.0) / (1.0 + i as f64)),
            input: Vector3::new(2.0, 1.0, 0.5),
            end: per_axis(&[end, end * 0.5, end * 2.0]),
        }
    }

    pub(in crate::mpc) fn start<const O: usize>() -> State<O> {
        std::array::from_fn(|i| Vector3::new(0.1, -0.2, 0.05) / (1.0 + i as f64))
    }

    /// Affine terms with a jump at stage 13.
    pub(in crate::mpc) fn affine<const O: usize>() -> Vec<State<O>> {
        let d = |k: usize| if k == 13 { 0.08 } else { 1e-3 * k as f64 };
        (0..N)
            .map(|k| {
                std::array::from_fn(|i| Vector3::new(d(k), -d(k), 0.5 * d(k)) / (1.0 + i as f64))
            })
            .collect()
    }

    pub(in crate::mpc) fn optimum<const O: usize>() -> (Unconstrained<O>, ErrorTrajectory<O>) {
        let mut lq = Unconstrained::new(N, &chain(), &cost());
        let mut trajectory = ErrorTrajectory::new(N);
        lq.solve(&start(), &affine(), &mut trajectory);
        (lq, trajectory)
    }

    /// Slope of the cost in every input, by differences of the cost of the resulting trajectory.
    /// They are exact for a quadratic.
    pub(in crate::mpc) fn slopes<const O: usize>(
        trajectory: &ErrorTrajectory<O>,
        terminal: f64,
    ) -> SVector<f64, INPUTS> {
        let (chain, affine) = (chain(), affine());
        let mut cost = cost::<O>();
        let value = |cost: &Cost<O>, trajectory: &ErrorTrajectory<O>, i: usize, change: f64| {
            let mut changed = trajectory.clone();
            changed.inputs[i / 3][i % 3] += change;
            changed.roll_out(&chain, &affine);
            cost.total(&changed)
        };
        cost.end = cost.end.map(|row| row.map(|block| block * (1.0 + terminal)));
        SVector::from_fn(|i, _| {
            (value(&cost, trajectory, i, 0.5) - value(&cost, trajectory, i, -0.5)) / 1.0
        })
    }

    fn assert_stationary<const O: usize>() {
        let (_, trajectory) = optimum::<O>();
        let mut still = trajectory.clone();
        still.inputs.fill(Vector3::zeros());
        let largest = slopes(&still, 0.0).amax();
        assert!(slopes(&trajectory, 0.0).amax() < 1e-11 * largest);
        // Newton's step from any point leads to the optimum: these are the normal equations.
        let slope = slopes(&still, 0.0);
        let columns: Vec<_> = (0..INPUTS)
            .map(|i| {
                let mut moved = still.clone();
                moved.inputs[i / 3][i % 3] += 1.0;
                slopes(&moved, 0.0) - slope
            })
            .collect();
        let solution = SMatrix::<f64, INPUTS, INPUTS>::from_columns(&columns)
            .cholesky()
            .unwrap()
            .solve(&-slope);
        for (i, value) in solution.iter().enumerate() {
            assert!((trajectory.inputs[i / 3][i % 3] - value).abs() < 1e-10, "{i}");
        }
    }

    #[test]
    fn oracle_optimum_solves_the_normal_equations() {
        assert_stationary::<1>();
        assert_stationary::<2>();
    }

    fn assert_parts_give_the_whole<const O: usize>() {
        let (mut lq, trajectory) = optimum::<O>();
        lq.arrive(&start(), &affine());
        for k in [O, O + 1, 7, 13, 14, N] {
            // The stationary point of arrival cost plus cost-to-go lies on the optimal trajectory,
            // and both directions lead back to that trajectory.
            let ((weight, mean), (to_go, slope)) = (lq.arrival(k), lq.to_go(k));
            for axis in 0..3 {
                let (weight, to_go): (SMatrix<f64, O, O>, _) =
                    (of_axis(weight, axis), of_axis(to_go, axis));
                let part = |state: &State<O>| SVector::<f64, O>::from_fn(|i, _| state[i][axis]);
                let joint =
                    (weight + to_go).try_inverse().unwrap() * (weight * part(&mean) - part(&slope));
                assert!((joint - part(&trajectory.states[k])).amax() < 1e-10, "stage {k}");
            }
            let mut again = ErrorTrajectory::new(N);
            again.states[k] = trajectory.states[k];
            lq.trace_back(k, &affine(), &mut again);
            lq.follow(k, &affine(), &mut again);
            assert!(
                again.distance(&trajectory) < 1e-10,
                "stage {k}: {}",
                again.distance(&trajectory)
            );
        }
        // Tracking the optimum from another start gives the optimum from that start.
        let elsewhere: State<O> = std::array::from_fn(|i| start::<O>()[i] * 1.5);
        let (mut tracked, mut optimum) = (trajectory.clone(), trajectory.clone());
        tracked.states[0] = elsewhere;
        lq.track(&trajectory, &affine(), &mut tracked);
        lq.solve(&elsewhere, &affine(), &mut optimum);
        assert!(tracked.distance(&optimum) < 1e-12);
    }

    #[test]
    fn oracle_parts_of_the_horizon_give_the_optimum_of_the_whole() {
        assert_parts_give_the_whole::<1>();
        assert_parts_give_the_whole::<2>();
    }
}
