//! Settings of an optimisation.

use serde::{Deserialize, Serialize};
use settings::{Choice, Declared};

/// Solver of the optimisation, used where the shortcuts do not find the optimum.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Choice)]
#[serde(rename_all = "camelCase")]
#[setting(name = "Solver")]
pub enum Method {
    /// Interior-point method on the Riccati recursion; the cone solver where this method fails.
    #[default]
    Riccati,
    /// Cone solver Clarabel.
    Cone,
}

/// Settings that choose and limit the solvers of an optimisation.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Declared)]
pub struct SolverSettings {
    #[allow(missing_docs)] // Its type says what it is.
    #[setting(name = "")]
    pub method: Method,
    /// Maximum number of iterations of each solver in each pass.
    #[setting(min = 1, max = 1000, file)]
    pub max_iterations: u32,
    /// Whether shortcuts to the same optimum are tried first: without constraints, with the
    /// terminal constraint only, then on windows of the horizon.
    #[setting(name = "exits")]
    pub shortcuts: bool,
    /// Wall-clock time after which an optimisation starts no further iteration or solver; 0 for no
    /// limit; runs with a time budget are not reproducible.
    #[setting(unit = "s", min = 0.0, nominal = 1e-3)]
    pub time_budget: f64,
    /// Number of iterations, summed over all solvers and passes, after which an optimisation starts
    /// no further one; 0 for no limit; runs remain reproducible.
    #[setting(min = 0, max = 100_000)]
    pub iteration_budget: u32,
}

impl Default for SolverSettings {
    /// Returns settings without limits, with the shortcuts and the Riccati method first.
    fn default() -> Self {
        Self {
            method: Method::default(),
            max_iterations: 1000,
            shortcuts: true,
            time_budget: 0.0,
            iteration_budget: 0,
        }
    }
}
