//! What an optimisation reports, whichever controller does it.

use serde::{Deserialize, Serialize};

/// How the last plan came about.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Status {
    /// No optimisation yet.
    #[default]
    None,
    /// The unconstrained optimum satisfies every constraint exactly, so it is the optimum.
    Unconstrained,
    /// The cone solver's optimum.
    Constrained,
    /// The cone solver did not succeed: the shifted previous plan with the terminal law.
    Fallback,
}

/// What the optimisation reports.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Report {
    /// Origin of the plan in force.
    pub status: Status,
    /// Optimal cost; of the shifted plan in a fallback.
    pub cost: f64,
    /// Iterations of the cone solver, summed over its passes.
    pub iterations: u32,
    /// Wall-clock time of the last optimisation, s. Not reproducible.
    pub time: f64,
    /// Optimisations so far.
    pub solves: u32,
    /// Fallbacks so far.
    pub fallbacks: u32,
}
