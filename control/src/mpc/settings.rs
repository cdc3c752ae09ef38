//! Settings of an optimisation.

use serde::{Deserialize, Serialize};

/// The solver that is tried first if the shortcuts do not lead to the optimum.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "camelCase")]
pub enum Method {
    /// The interior point method on the Riccati recursion, with the cone solver where it fails.
    #[default]
    Riccati,
    /// The cone solver alone, without the Riccati method.
    Cone,
}

/// The form of the norm constraints for the Riccati method; the cone solver always receives
/// linearised constraints.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "camelCase")]
pub enum Nonlinearity {
    /// The norm constraints are functions of the trajectory.
    #[default]
    Exact,
    /// The norm constraints are linearised about the previous plan.
    Frozen,
}

/// Settings that choose and limit the solvers of an optimisation.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SolverSettings {
    /// Solver that is tried first.
    pub method: Method,
    /// Form of the norm constraints that it receives.
    pub nonlinearity: Nonlinearity,
    /// Largest number of iterations of each solver in each pass.
    pub max_iterations: u32,
    /// Whether the shortcuts, cheaper exact ways to the optimum, are tried first.
    pub shortcuts: bool,
    /// Wall-clock time after which no further iteration or solver is started, s; 0 for no limit.
    /// Runs with a time budget are not reproducible.
    pub time_budget: f64,
    /// Iterations of all solvers together after which no further one is started; 0 for no limit.
    pub iteration_budget: u32,
}

impl SolverSettings {
    /// Returns the default settings with the given limit on iterations.
    pub fn new(max_iterations: u32) -> Self {
        Self {
            method: Method::default(),
            nonlinearity: Nonlinearity::default(),
            max_iterations,
            shortcuts: true,
            time_budget: 0.0,
            iteration_budget: 0,
        }
    }

    /// Returns whether the Riccati method is tried first, with the norm constraints as functions of
    /// the trajectory.
    pub(super) fn is_exact_riccati(&self) -> bool {
        (self.method, self.nonlinearity) == (Method::Riccati, Nonlinearity::Exact)
    }
}
