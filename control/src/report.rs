//! Report of an optimisation, common to all controllers with one.

use crate::clock::Instant;
use crate::mpc;
use serde::{Deserialize, Serialize};
use settings::{Choice, Declared};

/// Origin of the plan in force.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Choice)]
pub enum SolverStatus {
    /// No optimisation yet.
    #[default]
    None,
    /// Optimum without constraints, checked to satisfy every constraint.
    Unconstrained,
    /// Optimum with the terminal constraint only, checked to satisfy every other constraint.
    #[serde(rename = "TerminalBall")]
    #[setting(name = "terminalBall")]
    TerminalConstraint,
    /// Optimum found by the Riccati method.
    Constrained,
    /// Optimum found by the cone solver.
    Cone,
    /// Shifted previous plan, continued with the terminal law.
    Fallback,
    /// Previous plan, which satisfies the conditions of the guarantee; no optimum that does was
    /// found.
    Kept,
}

/// Report of an optimisation.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Declared)]
pub struct SolverReport {
    /// Origin of the plan in force.
    pub status: SolverStatus,
    /// Cost of the plan in force.
    pub cost: f64,
    /// Wall-clock time of the last optimisation; not reproducible.
    #[setting(unit = "s", nominal = 1e-3)]
    pub time: f64,
    /// Number of iterations in the last optimisation, summed over all solvers and passes.
    pub iterations: u32,
    /// Relative residual of the optimality conditions for the plan in force, evaluated with the
    /// nonlinear constraints.
    #[setting(nominal = 1e-8)]
    pub residual: f64,
    /// Number of optimisations so far.
    pub solves: u32,
    /// Number of optimisations so far that failed.
    pub fallbacks: u32,
    /// Number of optimisations so far that were ended early by the time or iteration budget.
    pub exhausted: u32,
}

impl SolverReport {
    /// Records the outcome of an optimisation that began at `clock`, and whether its budget ended
    /// it.
    pub(crate) fn record(&mut self, ended: &mpc::OptimiserReport, exhausted: bool, clock: Instant) {
        self.status = ended.status;
        self.cost = ended.certificate.cost;
        self.iterations = ended.iterations;
        self.residual = ended.certificate.residual();
        self.solves = self.solves.saturating_add(1);
        self.fallbacks =
            self.fallbacks.saturating_add(u32::from(ended.status == SolverStatus::Fallback));
        self.exhausted = self.exhausted.saturating_add(u32::from(exhausted));
        self.time = clock.elapsed().as_secs_f64();
    }
}
