//! `DLMPC` as an FMU.

use crate::solver;
use control::dlmpc::{Dlmpc, Memory, Settings};
use control::error::DesignError;
use control::report::SolverReport;
use controller_export::table::{RATES, sampled_output, shown_vector, vector};
use controller_export::{ControllerFmu, Law, Vehicle};
use fmi_export::VariableTable;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

/// Outputs of DLMPC.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct DlmpcLaw {
    rate_command: Vector3<f64>,
    sliding: Vector3<f64>,
    report: SolverReport,
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

    fn outputs(table: Controller) -> Controller {
        outputs(table)
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

type Controller = VariableTable<ControllerFmu<DlmpcLaw>>;

fn outputs(table: Controller) -> Controller {
    let sampled = sampled_output;
    let command = |axis: &str, meaning: &str| {
        let text = format!(
            "Body {meaning} rate commanded by the outer layer, held for period.optimisation"
        );
        sampled(&format!("rateCommand.{axis}"), &text).real().unit("rad/s").nominal(0.05)
    };
    let sliding = |axis: &str, meaning: &str| {
        let text = format!("Sliding variable of the {meaning} rate at the last tick");
        sampled(&format!("slidingVariable.{axis}"), &text).real().unit("rad/s").nominal(0.01)
    };
    let time = sampled(
        "innerLaw.time",
        "Wall-clock time of the last evaluation of the inner layer; not reproducible",
    );
    let table = vector(table, RATES, command, |m| &mut m.law.rate_command);
    let table = vector(table, RATES, sliding, |m| &mut m.law.sliding);
    solver::outputs(table, |law| &mut law.report)
        .real(time.real().unit("s").nominal(1e-6), |m| &mut m.law.inner_time)
}
