//! `DLMPC` as an FMU.

use crate::solver;
use control::dlmpc::{Dlmpc, Memory, Settings};
use control::error::DesignError;
use control::report::SolverReport;
use controller_export::table::shown_vector;
use controller_export::{Law, Vehicle};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use settings::Declared;
use vehicle::axes::RATES;

/// Outputs of DLMPC.
#[derive(Clone, Debug, Default, Serialize, Deserialize, Declared)]
pub struct DlmpcLaw {
    /// Body {} commanded by the outer layer, held for period.optimisation.
    #[setting(each = RATES, unit = "rad/s", nominal = 0.05)]
    rate_command: Vector3<f64>,
    /// Sliding variable of the {} at the last tick.
    #[setting(name = "slidingVariable", each = RATES, unit = "rad/s", nominal = 0.01)]
    sliding: Vector3<f64>,
    #[setting(name = "solver")]
    report: SolverReport,
    /// Wall-clock time of the last evaluation of the inner layer; not reproducible.
    #[setting(name = "innerLaw.time", unit = "s", nominal = 1e-6)]
    inner_time: f64,
}

impl Law for DlmpcLaw {
    type Controller = Dlmpc;
    type Settings = Settings;

    const NAME: &'static str = "DLMPC";
    const DESCRIPTION: &'static str = "Double-layered model predictive and sliding-mode attitude controller, a comparison law of Chai et al. (2022)";
    const DOCUMENTATION: &'static str = include_str!("dlmpc.html");
    const PLANS: bool = true;

    fn settings() -> Settings {
        Settings::published()
    }

    fn period(settings: &Settings) -> f64 {
        settings.period_feedback
    }

    fn design(settings: Settings, vehicle: &Vehicle) -> Result<Dlmpc, DesignError> {
        let Vehicle { body, limit_rate, limit_moment, .. } = *vehicle;
        Dlmpc::new(Settings { body, limit_rate, limit_moment, ..settings })
    }

    fn show(&mut self, _settings: &Settings, memory: &Memory) {
        *self = Self {
            rate_command: shown_vector(&memory.rate_command),
            sliding: shown_vector(&memory.sliding),
            report: solver::shown_report(&memory.report),
            inner_time: memory.inner_time,
        };
    }

    fn warning(before: &Memory, after: &Memory) -> Option<&'static str> {
        solver::warning(&before.report, &after.report)
    }
}
