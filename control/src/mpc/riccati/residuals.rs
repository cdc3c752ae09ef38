//! Residuals of an iterate, (2) to (4): stationarity, feasibility and complementarity.

use super::iterate::Riccati;
use super::pair::Pair;
use crate::mpc::constraints::Constraints;
use crate::mpc::problem::{Chain, Problem, Start, State, add, apply, dot, zero_state};
use nalgebra::Vector3;

/// Relative residuals below which a trajectory counts as the optimum.
const STATIONARITY: f64 = 1e-6;
pub(super) const GAP: f64 = 1e-9;

/// Distance of the iterate from the optimum.
#[derive(Clone, Copy, Debug)]
pub(super) struct Residuals {
    /// Largest slope of (3), relative to its largest part.
    pub stationarity: f64,
    /// Largest |c + s|, (4).
    pub feasibility: f64,
    /// Sum Σ sλ over all included inequalities, (4).
    pub gap: f64,
    /// Half the cost of the iterate.
    pub cost: f64,
    /// Number of included inequalities, at least 1.
    pub count: f64,
}

impl Residuals {
    pub(super) fn converged(&self, feasibility: f64) -> bool {
        self.stationarity <= STATIONARITY && self.feasibility <= feasibility && self.is_closed()
    }

    /// Returns whether complementarity has converged.
    pub(super) fn is_closed(&self) -> bool {
        self.gap <= GAP * self.cost
    }

    /// Returns the mean μ of sλ.
    pub(super) fn mean(&self) -> f64 {
        self.gap / self.count
    }
}

impl<const O: usize> Riccati<O> {
    /// Computes the residuals of the optimality conditions at the iterate: (4), and (3) with the
    /// costates (2) of the trajectory.
    pub(super) fn residuals<C: Constraints<O>>(&mut self, problem: &Problem<O, C>) -> Residuals {
        let (mut feasibility, mut gap, mut count) = (0.0_f64, 0.0, 0.0_f64);
        self.each_pair(problem, |pair| {
            let excess = (pair.c + pair.slack).abs();
            // A value that is not a number must stay visible.
            feasibility =
                if excess.is_nan() || excess > feasibility { excess } else { feasibility };
            gap += pair.slack * pair.multiplier;
            count += 1.0;
        });
        let (mut largest, mut scale) = (0.0_f64, f64::MIN_POSITIVE);
        self.adjoint(
            problem,
            |pair| pair.multiplier,
            |present, future| {
                largest = largest.max((present + future).amax());
                scale = scale.max(present.amax()).max(future.amax());
            },
        );
        // A slope in E_0 remains as a slope in the inputs before; for a double integrator it is
        // largest in the first or the last of them.
        if let Start::Arrival(..) = problem.start {
            let way = self.before.saturating_sub(1) as f64 * problem.chain.step;
            let first = Chain::new(way).adjoint(&self.first.1);
            for costate in [&self.first.1, &first] {
                largest = largest.max(problem.chain.input_adjoint(costate).amax());
            }
        }
        Residuals {
            stationarity: largest / scale,
            feasibility,
            gap,
            cost: self.cost(problem),
            count: count.max(1.0),
        }
    }

    /// Returns half the cost of the iterate, without the term that is linear in its end.
    pub(super) fn cost<C: Constraints<O>>(&self, problem: &Problem<O, C>) -> f64 {
        let stages = self.stages[..self.horizon].iter();
        let inner: f64 = stages
            .map(|stage| {
                dot(&stage.state, &problem.cost.slope(&stage.state))
                    + stage.input.dot(&problem.cost.input.component_mul(&stage.input))
            })
            .sum();
        let end = &self.stages[self.horizon].state;
        0.5 * (inner + dot(end, &problem.end.weighted(end)))
    }

    /// Computes ∇L from the end to the start, (2) and (3). `visit` receives two parts of the slope
    /// in each input: the stage's own, and the part of all later stages. The slope in E_0 remains
    /// in `first`.
    fn adjoint<C: Constraints<O>>(
        &mut self,
        problem: &Problem<O, C>,
        multiplier: impl Fn(&Pair) -> f64,
        mut visit: impl FnMut(Vector3<f64>, Vector3<f64>),
    ) {
        let last = self.horizon;
        let mut p = self.end_slope(problem, &multiplier);
        for stage in self.stages[..last].iter().rev() {
            let (q, r) = stage.slope(problem, &multiplier);
            visit(r, problem.chain.input_adjoint(&p));
            p = add(&problem.chain.adjoint(&p), &q);
        }
        self.first.1 = add(&p, &self.start_slope(problem));
    }

    /// Returns the slope ∂L/∂E_N at the last stage.
    pub(super) fn end_slope<C: Constraints<O>>(
        &self,
        problem: &Problem<O, C>,
        multiplier: &impl Fn(&Pair) -> f64,
    ) -> State<O> {
        let stage = &self.stages[self.horizon];
        let mut weight = 1.0;
        if let Some(radius) = problem.end.radius {
            weight += multiplier(&self.terminal) / (radius * radius);
        }
        let weighted = problem.end.weighted(&stage.state);
        let mut slope: State<O> =
            std::array::from_fn(|i| weighted[i] * weight + problem.end.slope[i]);
        if stage.state_pair.watched {
            let multiplier = multiplier(&stage.state_pair);
            slope = std::array::from_fn(|i| slope[i] + stage.slopes.state[i] * multiplier);
        }
        slope
    }

    /// Returns the part of ∂L/∂E_0 that comes from the arrival cost.
    pub(super) fn start_slope<C>(&self, problem: &Problem<O, C>) -> State<O> {
        match &problem.start {
            Start::Fixed(_) => zero_state(),
            Start::Arrival(weight, mean) => {
                apply(weight, &std::array::from_fn(|i| self.stages[0].state[i] - mean[i]))
            }
        }
    }
}
