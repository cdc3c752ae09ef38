//! Settings of DLMPC, with the published and the tuned ones from `data/dlmpc-2022.toml`.

use crate::error::DesignError;
use crate::mpc::SolverSettings;
use serde::{Deserialize, Serialize};
use std::sync::LazyLock;
use vehicle::data;
use vehicle::dynamics::RigidBody;
use vehicle::scenario::Scenario;

/// Gains of the inner layer's terminal sliding mode. Units with rad and s.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SlidingMode {
    /// Linear reaching gain q, 1/s.
    pub q: f64,
    /// Reaching gain p of the power ρ.
    pub p: f64,
    /// Gain Γ of the manifold.
    pub gamma: f64,
    /// Power ρ of the manifold and of the reaching law, between 0 and 1.
    pub rho: f64,
}

/// Settings of the controller. Units SI, angles rad.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Settings {
    /// Model of the vehicle that the controller uses.
    pub body: RigidBody,
    /// Limit on ‖ω‖, rad/s.
    pub limit_rate: f64,
    /// Limit on ‖m‖, N m.
    pub limit_moment: f64,
    /// Number of prediction steps of the outer layer.
    pub horizon: usize,
    /// Period of the outer layer and its prediction step, s.
    pub period_optimisation: f64,
    /// Period of the inner layer, s.
    pub period_feedback: f64,
    /// Diagonal of the weight P on the angles.
    pub p: [f64; 3],
    /// Diagonal of the weight Q on the rates.
    pub q: [f64; 3],
    /// Gains of the inner layer.
    pub sliding_mode: SlidingMode,
    /// Settings of the solvers of the outer optimisation.
    pub solver: SolverSettings,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    outer: Outer,
    inner: Inner,
    solver: Solver,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Outer {
    horizon: usize,
    period: f64,
    p: [f64; 3],
    q: [f64; 3],
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Inner {
    period: f64,
    #[serde(rename = "prediction_horizon")]
    _prediction_horizon: f64,
    published: SlidingMode,
    tuned: SlidingMode,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Solver {
    max_iterations: u32,
}

impl Settings {
    /// Returns the settings of Chai 2022, section 5.1, with its vehicle at the nominal inertia.
    #[allow(clippy::missing_panics_doc)]
    pub fn published() -> Self {
        let scenario = Scenario::crmpc2022();
        // This cannot fail, as the tests that use it show: the files are embedded.
        let body = scenario.inertia.body(1.0).unwrap_or_else(|error| panic!("{error}"));
        let File { outer, inner, solver } = embedded();
        Self {
            body,
            limit_rate: scenario.limit_rate,
            limit_moment: scenario.limit_moment,
            horizon: outer.horizon,
            period_optimisation: outer.period,
            period_feedback: inner.period,
            p: outer.p,
            q: outer.q,
            sliding_mode: inner.published,
            solver: SolverSettings::new(solver.max_iterations),
        }
    }

    /// Returns the published settings with the gains that `examples/tune_dlmpc.rs` found.
    pub fn tuned() -> Self {
        Self { sliding_mode: embedded().inner.tuned, ..Self::published() }
    }

    /// Checks all settings and returns the number of inner ticks per optimisation.
    ///
    /// # Errors
    /// Returns an error that names the setting at fault.
    pub(super) fn ratio(&self) -> Result<u64, DesignError> {
        let SlidingMode { q, p, gamma, rho } = self.sliding_mode;
        let positive = [
            ("limit_rate", self.limit_rate),
            ("limit_moment", self.limit_moment),
            ("period_optimisation", self.period_optimisation),
            ("period_feedback", self.period_feedback),
            ("horizon", self.horizon as f64),
            ("sliding_mode.rho", rho),
        ];
        for (name, value) in positive {
            if !(value > 0.0 && value.is_finite()) {
                return Err(DesignError::NotPositive { name, value });
            }
        }
        for (name, weights) in [("p", self.p), ("q", self.q)] {
            for (i, value) in weights.into_iter().enumerate() {
                if !(value.is_finite() && (value > 0.0 || (name == "p" && value == 0.0))) {
                    return Err(DesignError::Weight { name, index: i + 1, value });
                }
            }
        }
        // Far from the manifold s⁺ = (1 − q T) s, which must not grow.
        let ranges = [
            ("sliding_mode.q", q, 2.0 / self.period_feedback),
            ("sliding_mode.p", p, f64::INFINITY),
            ("sliding_mode.gamma", gamma, f64::INFINITY),
            ("sliding_mode.rho", rho, 1.0),
        ];
        for (name, value, high) in ranges {
            if !(0.0..high).contains(&value) {
                return Err(DesignError::OutOfRange { name, value, low: 0.0, high });
            }
        }
        let (optimisation, feedback) = (self.period_optimisation, self.period_feedback);
        let ratio = (optimisation / feedback).round();
        if ratio < 1.0 || (ratio * feedback - optimisation).abs() > 1e-9 * optimisation {
            return Err(DesignError::Periods { optimisation, feedback });
        }
        Ok(ratio as u64)
    }
}

fn embedded() -> &'static File {
    static READ: LazyLock<File> = LazyLock::new(|| {
        data::embedded("dlmpc-2022.toml", include_str!("../../data/dlmpc-2022.toml"))
    });
    &READ
}
