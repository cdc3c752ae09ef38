//! What an optimisation reports, whichever controller does it.

use crate::mpc;
use serde::{Deserialize, Serialize};
use std::time::Instant;

/// How the last plan came about.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Status {
    /// No optimisation yet.
    #[default]
    None,
    /// The unconstrained optimum satisfies every constraint exactly, so it is the optimum.
    Unconstrained,
    /// The optimum with the terminal ball alone satisfies every other constraint exactly, so it is the optimum.
    TerminalBall,
    /// The optimum by the Riccati method.
    Constrained,
    /// The optimum by the cone solver.
    Cone,
    /// No solver succeeded: the shifted previous plan with the terminal law.
    Fallback,
    /// No optimum was found that keeps the conditions of the guarantee: the previous plan as it is, which keeps them.
    Kept,
}

/// What the optimisation reports.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Report {
    /// Origin of the plan in force.
    pub status: Status,
    /// Optimal cost; of the shifted plan in a fallback.
    pub cost: f64,
    /// Iterations of the solvers, summed over their passes.
    pub iterations: u32,
    /// Residual of the conditions of optimality, relative, of the constraints as they are; of the shifted plan in a fallback.
    pub residual: f64,
    /// Wall-clock time of the last optimisation, s. Not reproducible.
    pub time: f64,
    /// Optimisations so far.
    pub solves: u32,
    /// Fallbacks so far.
    pub fallbacks: u32,
    /// Optimisations so far that the budget ended early.
    pub exhausted: u32,
}

impl Report {
    /// Takes over how an optimisation ended that began at `clock`, and whether its budget ended it.
    pub(crate) fn record(&mut self, ended: &mpc::Report, exhausted: bool, clock: Instant) {
        self.status = ended.status;
        self.cost = ended.certificate.cost;
        self.iterations = ended.iterations;
        self.residual = ended.certificate.residual();
        self.solves = self.solves.saturating_add(1);
        self.fallbacks = self.fallbacks.saturating_add(u32::from(ended.status == Status::Fallback));
        self.exhausted = self.exhausted.saturating_add(u32::from(exhausted));
        self.time = clock.elapsed().as_secs_f64();
    }
}
