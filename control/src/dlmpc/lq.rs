//! The outer problem without constraints: finite-horizon linear-quadratic optimum, per axis.
//!
//! E⁺ = E + h w + d, cost Σ_{k<N} (P E² + Q w²) + P E_N². As in [`crate::lq`], cost-to-go and arrival cost let a part of the
//! horizon stand for the whole of it; here all of them are scalars.

/// Cost-to-go S E² + 2 p E + const of one stage, without p.
#[derive(Clone, Copy, Debug)]
struct Stage {
    /// S of the next stage.
    next_weight: f64,
    /// Q + h² S.
    curvature: f64,
}

/// Cost of getting from the fixed start to E_k, (E_k − Ē)²/Π + const: a Kalman filter's covariance, with h w as process noise
/// of variance h²/Q and the stage cost as a measurement of E = 0 with information P.
#[derive(Clone, Copy, Debug)]
struct Arrival {
    /// Π before the stage's own cost is counted.
    spread: f64,
    /// Ē⁺ = discount·Ē once it is counted.
    discount: f64,
    /// E_k = Ē_k⁺ + smoother·(E_k+1 − Ē_k+1).
    smoother: f64,
}

/// Unconstrained optimum of one axis.
#[derive(Clone, Debug)]
pub(super) struct AngleLq {
    h: f64,
    q: f64,
    p: f64,
    stages: Vec<Stage>,
    arrivals: Vec<Arrival>,
    /// p of the last solve, one per stage 0..=N.
    costate: Vec<f64>,
    /// Ē of the last forward sweep, one per stage 0..=N.
    mean: Vec<f64>,
}

impl AngleLq {
    /// For `horizon` steps of `h` s with weights `p` on the angle and `q` on its rate.
    pub(super) fn new(horizon: usize, h: f64, p: f64, q: f64) -> Self {
        let mut weight = p;
        let mut stages = Vec::with_capacity(horizon);
        for _ in 0..horizon {
            let stage = Stage { next_weight: weight, curvature: q + h * h * weight };
            weight = p + q * weight / stage.curvature;
            stages.push(stage);
        }
        stages.reverse();

        let mut spread = 0.0;
        let mut arrivals = Vec::with_capacity(horizon + 1);
        for _ in 0..=horizon {
            let discount = 1.0 / (1.0 + spread * p);
            let counted = discount * spread;
            let next = counted + h * h / q;
            arrivals.push(Arrival { spread, discount, smoother: counted / next });
            spread = next;
        }
        let zeros = vec![0.0; horizon + 1];
        Self { h, q, p, stages, arrivals, costate: zeros.clone(), mean: zeros }
    }

    /// Gain κ of the first stage: w = −κ E without affine terms.
    pub(super) fn gain(&self) -> f64 {
        self.stages.first().map_or(0.0, |stage| self.h * stage.next_weight / stage.curvature)
    }

    /// The optimum from `start`, given the affine terms d_0 … d_{N−1}; calls `visit` with (k, E_k, w_k) for k < N and returns
    /// E_N.
    pub(super) fn solve(
        &mut self,
        start: f64,
        affine: impl Fn(usize) -> f64,
        visit: impl FnMut(usize, f64, f64),
    ) -> f64 {
        let n = self.stages.len();
        self.costate[n] = 0.0;
        for k in (0..n).rev() {
            let Stage { next_weight, curvature } = self.stages[k];
            self.costate[k] = self.q / curvature * (self.costate[k + 1] + next_weight * affine(k));
        }
        self.follow(0, start, affine, visit)
    }

    /// The optimal motion from E_`first` = `start` on, with the costates of the last [`Self::solve`]; as there, calls `visit`
    /// for `first` ≤ k < N and returns E_N.
    pub(super) fn follow(
        &self,
        first: usize,
        start: f64,
        affine: impl Fn(usize) -> f64,
        mut visit: impl FnMut(usize, f64, f64),
    ) -> f64 {
        let mut error = start;
        for (k, stage) in self.stages.iter().enumerate().skip(first) {
            let moved = error + affine(k);
            let w = -self.h * (stage.next_weight * moved + self.costate[k + 1]) / stage.curvature;
            visit(k, error, w);
            error = moved + self.h * w;
        }
        error
    }

    /// Weight 1/Π and centre Ē of the cost of arriving at stage `k` ≥ 1 from `start`.
    pub(super) fn arrival_cost(&mut self, k: usize, start: f64, affine: impl Fn(usize) -> f64) -> (f64, f64) {
        self.mean[0] = start;
        for j in 0..k {
            self.mean[j + 1] = self.arrivals[j].discount * self.mean[j] + affine(j);
        }
        (1.0 / self.arrivals[k].spread, self.mean[k])
    }

    /// The optimal motion that arrives at E_k = `end`, after [`Self::arrival_cost`] of the same `k`: calls `visit` with
    /// (j, E_j) for j = k−1 down to 0.
    pub(super) fn trace_back(&self, k: usize, end: f64, mut visit: impl FnMut(usize, f64)) {
        let mut error = end;
        for j in (0..k).rev() {
            let Arrival { discount, smoother, .. } = self.arrivals[j];
            error = discount * self.mean[j] + smoother * (error - self.mean[j + 1]);
            visit(j, error);
        }
    }

    /// Weight S_k and costate p_k of the cost-to-go S E² + 2 p E + const at stage `k`, as of the last [`Self::solve`].
    pub(super) fn cost_to_go(&self, k: usize) -> (f64, f64) {
        let weight = match k.checked_sub(1) {
            Some(before) => self.stages[before].next_weight,
            None => self.stages.first().map_or(self.p, |s| self.p + self.q * s.next_weight / s.curvature),
        };
        (weight, self.costate[k])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{DMatrix, DVector};

    const START: f64 = 0.1;

    fn affine(k: usize) -> f64 {
        if k == 17 { 0.08 } else { 1e-3 * k as f64 }
    }

    #[test]
    fn oracle_optimum_solves_the_normal_equations() {
        let (n, h, p, q) = (30, 0.2, 50.0, 10.0);
        let residual = |w: &DVector<f64>| {
            let mut error = START;
            let mut rows = Vec::new();
            for k in 0..n {
                rows.extend([f64::sqrt(p) * error, f64::sqrt(q) * w[k]]);
                error += h * w[k] + affine(k);
            }
            rows.push(f64::sqrt(p) * error);
            DVector::from_vec(rows)
        };
        let zero = residual(&DVector::zeros(n));
        let columns = (0..n).map(|k| residual(&DVector::from_fn(n, |i, _| f64::from(i == k))) - &zero);
        let jacobian = DMatrix::from_columns(&columns.collect::<Vec<_>>());
        let oracle =
            (jacobian.transpose() * &jacobian).cholesky().unwrap().solve(&(-jacobian.transpose() * zero));
        let mut ours = DVector::zeros(n);
        AngleLq::new(n, h, p, q).solve(START, affine, |k, _, w| ours[k] = w);
        assert!((ours - &oracle).norm() < 1e-12 * oracle.norm());
    }

    #[test]
    fn oracle_parts_of_the_horizon_give_the_optimum_of_the_whole() {
        let n = 30;
        let mut lq = AngleLq::new(n, 0.2, 50.0, 10.0);
        let mut optimum = vec![0.0; n + 1];
        optimum[n] = lq.solve(START, affine, |k, error, _| optimum[k] = error);
        for k in [1, 2, 10, 18, 30] {
            let (to_go, costate) = lq.cost_to_go(k);
            let (arrival, centre) = lq.arrival_cost(k, START, affine);
            let joint = (arrival * centre - costate) / (to_go + arrival);
            assert!((joint - optimum[k]).abs() < 1e-13, "stage {k}");
            lq.trace_back(k, optimum[k], |j, error| {
                assert!((error - optimum[j]).abs() < 1e-12, "{j} from {k}");
            });
            let last = lq.follow(k, optimum[k], affine, |j, error, _| {
                assert!((error - optimum[j]).abs() < 1e-12, "{j} from {k}");
            });
            assert!((last - optimum[n]).abs() < 1e-12);
        }
    }
}
