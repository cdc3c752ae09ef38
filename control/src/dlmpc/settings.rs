//! Settings of DLMPC, with the published and the tuned ones from `data/dlmpc-2022.toml`.

use crate::error::{DesignError, invalid, positive};
use crate::mpc::SolverSettings;
use serde::{Deserialize, Serialize};
use settings::Declared;
use std::sync::LazyLock;
use vehicle::axes::NUMBERED_ANGLES;
use vehicle::data::Tables;
use vehicle::dynamics::RigidBody;
use vehicle::scenario::Scenario;

/// Gains of the inner layer's terminal sliding mode. Units with rad and s.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Declared)]
pub struct SlidingMode {
    /// Gain of the linear term in the reaching law of the inner layer; below 2/period.feedback.
    #[setting(unit = "1/s", min = 0.0, nominal = 5.0)]
    pub q: f64,
    /// Gain of the term with exponent rho in the reaching law of the inner layer.
    #[setting(min = 0.0, nominal = 5.0)]
    pub p: f64,
    /// Gain Gamma of the integral term in the sliding variable of the inner layer.
    #[setting(min = 0.0, nominal = 0.1)]
    pub gamma: f64,
    /// Exponent rho in the integral term and in the reaching law of the inner layer.
    #[setting(above = 0.0, below = 1.0)]
    pub rho: f64,
}

/// Settings of the controller. Units SI, angles rad.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Declared)]
pub struct Settings {
    /// Model of the vehicle that the controller uses.
    #[setting(skip)]
    pub body: RigidBody,
    /// Limit on ‖ω‖, rad/s.
    #[setting(skip)]
    pub limit_rate: f64,
    /// Limit on ‖m‖, N m.
    #[setting(skip)]
    pub limit_moment: f64,
    /// Number of prediction steps of the outer layer.
    #[setting(min = 2, max = 1000)]
    pub horizon: usize,
    /// Sampling period of the outer layer and length of a prediction step; a whole multiple of
    /// period.feedback.
    #[setting(name = "period.optimisation", unit = "s", min = 1e-3, max = 10.0, nominal = 0.2)]
    pub period_optimisation: f64,
    /// Sampling period of the inner layer.
    #[setting(name = "period.feedback", unit = "s", min = 1e-4, max = 10.0, nominal = 0.04)]
    pub period_feedback: f64,
    /// Settings of the solvers of the outer optimisation.
    pub solver: SolverSettings,
    /// Weight P on the tracking error, diagonal.
    #[setting(name = "weight.P", each = NUMBERED_ANGLES, min = 0.0, nominal = 50.0)]
    pub p: [f64; 3],
    /// Weight Q on the derivative of the tracking error, diagonal.
    #[setting(name = "weight.Q", each = NUMBERED_ANGLES, above = 0.0, nominal = 10.0)]
    pub q: [f64; 3],
    /// Gains of the inner layer.
    pub sliding_mode: SlidingMode,
}

static FILE: LazyLock<Tables> =
    LazyLock::new(|| Tables::new("dlmpc-2022.toml", include_str!("../../data/dlmpc-2022.toml")));

impl Settings {
    /// Returns the settings of Chai 2022, section 5.1, with its vehicle at the nominal inertia.
    #[allow(clippy::missing_panics_doc)]
    pub fn published() -> Self {
        let scenario = Scenario::crmpc2022();
        let mut settings = Self {
            // This cannot fail, as the tests that use it show: the files are embedded.
            body: scenario.inertia.body(1.0).unwrap_or_else(|error| panic!("{error}")),
            limit_rate: scenario.limit_rate,
            limit_moment: scenario.limit_moment,
            ..Self::default()
        };
        FILE.set("settings", &mut settings);
        settings
    }

    /// Returns the published settings with the gains that `examples/tune_dlmpc.rs` found.
    pub fn tuned() -> Self {
        let mut settings = Self::published();
        FILE.set("tuned", &mut settings);
        settings
    }

    /// Checks all settings and returns the number of inner ticks per optimisation.
    ///
    /// # Errors
    /// Returns an error that names the setting at fault.
    pub(super) fn ratio(&self) -> Result<u64, DesignError> {
        settings::check(self)?;
        positive("limit.rate", self.limit_rate)?;
        positive("limit.moment", self.limit_moment)?;
        // Far from the manifold s⁺ = (1 − q T) s, which must not grow.
        let (q, high) = (self.sliding_mode.q, 2.0 / self.period_feedback);
        if q >= high {
            return Err(invalid("slidingMode.q", q, format!("must be below {high}")));
        }
        let (optimisation, feedback) = (self.period_optimisation, self.period_feedback);
        let ratio = (optimisation / feedback).round();
        if ratio < 1.0 || (ratio * feedback - optimisation).abs() > 1e-9 * optimisation {
            return Err(DesignError::Periods { optimisation, feedback });
        }
        Ok(ratio as u64)
    }
}
