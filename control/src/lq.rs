//! The tracking problem without constraints: finite-horizon linear-quadratic optimum, per axis.
//!
//! E⁺ = A E + B v + d, A = [1 h; 0 1], B = [h²/2; h], cost Σ h(EᵀPE + Q v²) + E_NᵀG E_N. Gains and cost-to-go depend on the
//! weights alone and are computed once; the affine part (reference curvature between samples, jumps) costs one
//! backward sweep per sample. Cost-to-go and arrival cost let a part of the horizon stand for the whole of it.

use crate::sampled::{response, transition};
use nalgebra::{Matrix2, RowVector2, Vector2};

/// Gain, closed loop and cost-to-go of one stage of one axis.
#[derive(Clone, Copy, Debug)]
struct Stage {
    /// v = gain·E − feedforward·(S⁺ d + p⁺)
    gain: RowVector2<f64>,
    feedforward: RowVector2<f64>,
    closed_loop_transposed: Matrix2<f64>,
    /// Cost-to-go weight S⁺ of the *next* stage.
    next_weight: Matrix2<f64>,
    /// Cost-to-go weight S of this stage.
    weight: Matrix2<f64>,
}

/// Cost of getting from the fixed start to E_k, (E_k − Ē)ᵀ Π⁻¹ (E_k − Ē) + const: a Kalman filter's covariance, with v as
/// process noise of variance 1/(hQ) and the stage cost as a measurement of E = 0 with information hP.
#[derive(Clone, Copy, Debug)]
struct Arrival {
    /// Π before the stage's own cost is counted.
    spread: Matrix2<f64>,
    /// Ē⁺ = discount·Ē once it is counted.
    discount: Matrix2<f64>,
    /// E_k = Ē_k⁺ + smoother·(E_k+1 − Ē_k+1).
    smoother: Matrix2<f64>,
}

/// Offline part of the unconstrained optimum of one axis.
#[derive(Clone, Debug)]
pub struct TrackingLq {
    a: Matrix2<f64>,
    b: Vector2<f64>,
    stages: Vec<Stage>,
    arrivals: Vec<Arrival>,
    /// Costate p of the last solve, one per stage 0..=N.
    costate: Vec<Vector2<f64>>,
    /// Ē of the last forward sweep, one per stage 0..=N.
    mean: Vec<Vector2<f64>>,
}

impl TrackingLq {
    /// For `horizon` steps of `h` s with stage weights `p` (angle, rate), `q` and terminal weight `g`.
    pub fn new(horizon: usize, h: f64, p: Vector2<f64>, q: f64, g: Matrix2<f64>) -> Self {
        let (a, b) = (transition(h), response(h));
        let mut weight = g;
        let mut stages = Vec::with_capacity(horizon);
        for _ in 0..horizon {
            let curvature = h * q + (b.transpose() * weight * b).x;
            let feedforward = b.transpose() / curvature;
            let gain = -(feedforward * weight * a);
            let closed_loop = a + b * gain;
            let next_weight = weight;
            let full = Matrix2::from_diagonal(&(p * h)) + a.transpose() * next_weight * closed_loop;
            weight = 0.5 * (full + full.transpose());
            stages.push(Stage {
                gain,
                feedforward,
                closed_loop_transposed: closed_loop.transpose(),
                next_weight,
                weight,
            });
        }
        stages.reverse();

        let information = Matrix2::from_diagonal(&(p * h));
        let noise = b * b.transpose() / (h * q);
        let mut spread = Matrix2::<f64>::zeros();
        let mut arrivals = Vec::with_capacity(horizon + 1);
        for _ in 0..=horizon {
            // (Π⁻¹ + hP)⁻¹ Π⁻¹, written so that it also holds for a singular Π.
            let discount = (Matrix2::<f64>::identity() + spread * information)
                .try_inverse()
                .unwrap_or_else(Matrix2::identity);
            let counted = discount * spread;
            let next = a * counted * a.transpose() + noise;
            // Π_1 has rank one, but then E_0 is known anyway and `counted` is zero.
            let smoother =
                next.try_inverse().map_or_else(Matrix2::zeros, |inverse| counted * a.transpose() * inverse);
            arrivals.push(Arrival { spread, discount, smoother });
            spread = 0.5 * (next + next.transpose());
        }
        let zeros = vec![Vector2::zeros(); horizon + 1];
        Self { a, b, stages, arrivals, costate: zeros.clone(), mean: zeros }
    }

    /// The optimum from `start`, given the affine terms d_0 … d_{N−1}; calls `visit` with (k, E_k, v_k) for k < N and
    /// returns E_N.
    pub fn solve(
        &mut self,
        start: Vector2<f64>,
        affine: impl Fn(usize) -> Vector2<f64>,
        visit: impl FnMut(usize, Vector2<f64>, f64),
    ) -> Vector2<f64> {
        let n = self.stages.len();
        self.costate[n] = Vector2::zeros();
        for k in (0..n).rev() {
            let stage = &self.stages[k];
            self.costate[k] =
                stage.closed_loop_transposed * (self.costate[k + 1] + stage.next_weight * affine(k));
        }
        self.follow(0, start, affine, visit)
    }

    /// The optimal motion from E_`first` = `start` on, with the costates of the last [`Self::solve`]; as there, calls `visit`
    /// for `first` ≤ k < N and returns E_N.
    pub fn follow(
        &self,
        first: usize,
        start: Vector2<f64>,
        affine: impl Fn(usize) -> Vector2<f64>,
        mut visit: impl FnMut(usize, Vector2<f64>, f64),
    ) -> Vector2<f64> {
        let mut error = start;
        for k in first..self.stages.len() {
            let stage = &self.stages[k];
            let d = affine(k);
            let v =
                (stage.gain * error - stage.feedforward * (stage.next_weight * d + self.costate[k + 1])).x;
            visit(k, error, v);
            error = self.a * error + self.b * v + d;
        }
        error
    }

    /// Weight Π⁻¹ and centre Ē of the cost of arriving at stage `k` from `start`; `k` must be at least 2, as fewer steps
    /// cannot reach every E.
    pub fn arrival_cost(
        &mut self,
        k: usize,
        start: Vector2<f64>,
        affine: impl Fn(usize) -> Vector2<f64>,
    ) -> (Matrix2<f64>, Vector2<f64>) {
        self.mean[0] = start;
        for j in 0..k {
            self.mean[j + 1] = self.a * self.arrivals[j].discount * self.mean[j] + affine(j);
        }
        (self.arrivals[k].spread.try_inverse().unwrap_or_else(Matrix2::zeros), self.mean[k])
    }

    /// The optimal motion that arrives at E_k = `end`, after [`Self::arrival_cost`] of the same `k`: calls `visit` with
    /// (j, E_j) for j = k−1 down to 0.
    pub fn trace_back(&self, k: usize, end: Vector2<f64>, mut visit: impl FnMut(usize, Vector2<f64>)) {
        let mut error = end;
        for j in (0..k).rev() {
            let Arrival { discount, smoother, .. } = self.arrivals[j];
            error = discount * self.mean[j] + smoother * (error - self.mean[j + 1]);
            visit(j, error);
        }
    }

    /// Weight S_k and costate p_k of the cost-to-go EᵀS E + 2 pᵀE + const at stage `k`, as of the last [`Self::solve`].
    pub fn cost_to_go(&self, k: usize) -> (Matrix2<f64>, Vector2<f64>) {
        let weight = if k == 0 { self.stages[0].weight } else { self.stages[k - 1].next_weight };
        (weight, self.costate[k])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{DMatrix, DVector};

    #[test]
    fn oracle_optimum_solves_the_normal_equations() {
        // Dense least squares over v as the oracle, with a jump in the affine term.
        let (n, h, p, q) = (12, 0.2, Vector2::new(50.0, 40.0), 10.0);
        let g = Matrix2::new(80.0, 30.0, 30.0, 36.0);
        let start = Vector2::new(0.1, -0.02);
        let affine = |k: usize| Vector2::new(if k == 7 { 0.08 } else { 1e-3 }, 1e-3 * k as f64);
        let (a, b) = (transition(h), response(h));
        let root = g.cholesky().unwrap().l().transpose();
        let residual = |v: &DVector<f64>| {
            let mut error = start;
            let mut rows = Vec::new();
            for k in 0..n {
                rows.extend([(h * p.x).sqrt() * error.x, (h * p.y).sqrt() * error.y, (h * q).sqrt() * v[k]]);
                error = a * error + b * v[k] + affine(k);
            }
            rows.extend((root * error).iter());
            DVector::from_vec(rows)
        };
        let zero = residual(&DVector::zeros(n));
        let jacobian = DMatrix::from_columns(
            &(0..n)
                .map(|k| residual(&DVector::from_fn(n, |i, _| f64::from(i == k))) - &zero)
                .collect::<Vec<_>>(),
        );
        let oracle =
            (jacobian.transpose() * &jacobian).cholesky().unwrap().solve(&(-jacobian.transpose() * zero));
        let mut ours = DVector::zeros(n);
        TrackingLq::new(n, h, p, q, g).solve(start, affine, |k, _, v| ours[k] = v);
        assert!((ours - &oracle).norm() < 1e-11 * oracle.norm());
    }

    #[test]
    fn oracle_parts_of_the_horizon_give_the_optimum_of_the_whole() {
        // Stationary point of arrival cost + cost-to-go at any stage lies on the optimal motion, and both ways lead back to it.
        let n = 30;
        let mut lq =
            TrackingLq::new(n, 0.2, Vector2::new(50.0, 40.0), 10.0, Matrix2::new(80.0, 30.0, 30.0, 36.0));
        let start = Vector2::new(0.1, -0.02);
        let affine = |k: usize| Vector2::new(if k == 17 { 0.08 } else { 1e-3 }, 1e-3 * k as f64);
        let mut optimum = vec![Vector2::zeros(); n + 1];
        optimum[n] = lq.solve(start, affine, |k, error, _| optimum[k] = error);
        for k in [2, 3, 10, 18, 30] {
            let (to_go, costate) = lq.cost_to_go(k);
            let (arrival, centre) = lq.arrival_cost(k, start, affine);
            let joint = (to_go + arrival).try_inverse().unwrap() * (arrival * centre - costate);
            assert!((joint - optimum[k]).norm() < 1e-11, "stage {k}");
            lq.trace_back(k, optimum[k], |j, error| {
                assert!((error - optimum[j]).norm() < 1e-11, "{j} from {k}");
            });
            let last = lq.follow(k, optimum[k], affine, |j, error, _| {
                assert!((error - optimum[j]).norm() < 1e-11, "{j} from {k}");
            });
            assert!((last - optimum[n]).norm() < 1e-11);
        }
    }
}
