//! Parameters and outputs of `DLMPC`.

use crate::solver;
use control::dlmpc::{Dlmpc, Memory, Settings};
use control::error::DesignError;
use control::report::SolverReport;
use controller_export::table::{self, ANGLES, RATES, sampled_output, shown_vector, vector};
use controller_export::{ControllerFmu, Law, Vehicle};
use fmi2_export::VariableTable;
use fmi2_export::fields::Fields;
use fmi2_export::table::parameter;
use model_description::unit;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

/// Parameters and outputs of DLMPC.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct DlmpcLaw {
    /// Settings of the controller; body and limits in them are replaced by those of the vehicle.
    pub(crate) settings: Settings,
    shown: Shown,
}

/// Values that the outputs show.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
struct Shown {
    rate_command: Vector3<f64>,
    sliding: Vector3<f64>,
    report: SolverReport,
    inner_time: f64,
}

impl Default for DlmpcLaw {
    fn default() -> Self {
        Self { settings: Settings::published(), shown: Shown::default() }
    }
}

impl Law for DlmpcLaw {
    type Controller = Dlmpc;
    type Settings = Settings;

    const NAME: &'static str = "DLMPC";
    const DESCRIPTION: &'static str = "Double-layered model predictive and sliding-mode attitude controller, a comparison law of Chai et al. (2022)";
    const DOCUMENTATION: &'static str = include_str!("dlmpc.html");
    const FIELDS: &'static Fields = &[("sliding_mode", "slidingMode")];

    fn period() -> f64 {
        Settings::published().period_feedback
    }

    fn declare(table: VariableTable<ControllerFmu<Self>>) -> VariableTable<ControllerFmu<Self>> {
        outputs(sliding_mode(weights(schedule(table))))
    }

    fn settings(&self, vehicle: &Vehicle) -> Settings {
        Settings {
            body: vehicle.body,
            limit_rate: vehicle.limit_rate,
            limit_moment: vehicle.limit_moment,
            period_feedback: vehicle.period,
            ..self.settings
        }
    }

    fn design(settings: Self::Settings) -> Result<Self::Controller, DesignError> {
        Dlmpc::new(settings)
    }

    fn show(&mut self, memory: &Memory) {
        self.shown = Shown {
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

fn schedule(table: Controller) -> Controller {
    let horizon = parameter("horizon", "Number of prediction steps of the outer layer");
    let optimisation = parameter(
        "period.optimisation",
        "Sampling period of the outer layer and length of a prediction step; a whole multiple of period.feedback",
    );
    let table = table
        .integer(horizon, (Some(2), Some(1000)), |m| &mut m.law.settings.horizon)
        .real(optimisation.real().unit(unit::time()).min(1e-3).max(10.0).nominal(0.2), |m| {
            &mut m.law.settings.period_optimisation
        });
    let table = table::period(table, "inner layer");
    solver::parameters(table, |law| &mut law.settings.solver)
}

fn weights(mut table: Controller) -> Controller {
    for (i, (_, meaning)) in ANGLES.into_iter().enumerate() {
        let text = table::weight_text(table::TRACKING_ERROR, meaning, ("P", i));
        let p = parameter(&format!("weight.P[{}]", i + 1), &text).real().min(0.0).nominal(50.0);
        table = table.real(p, move |m| &mut m.law.settings.p[i]);
    }
    for (i, (_, meaning)) in ANGLES.into_iter().enumerate() {
        let text = table::weight_text(table::ERROR_RATE, meaning, ("Q", i));
        let q = parameter(&format!("weight.Q[{}]", i + 1), &text).real().min(0.0).nominal(10.0);
        table = table.real(q, move |m| &mut m.law.settings.q[i]);
    }
    table
}

fn sliding_mode(table: Controller) -> Controller {
    let q = parameter(
        "slidingMode.q",
        "Gain of the linear term in the reaching law of the inner layer; below 2/period.feedback",
    );
    let p = parameter(
        "slidingMode.p",
        "Gain of the term with exponent rho in the reaching law of the inner layer",
    );
    let gamma = parameter(
        "slidingMode.gamma",
        "Gain of the integral term in the sliding variable of the inner layer",
    );
    let rho = parameter(
        "slidingMode.rho",
        "Exponent rho in the integral term and in the reaching law of the inner layer; above 0 and below 1",
    );
    table
        .real(q.real().unit(unit::gain_rate()).min(0.0).nominal(5.0), |m| {
            &mut m.law.settings.sliding_mode.q
        })
        .real(p.real().min(0.0).nominal(5.0), |m| &mut m.law.settings.sliding_mode.p)
        .real(gamma.real().min(0.0).nominal(0.1), |m| &mut m.law.settings.sliding_mode.gamma)
        .real(rho.real().min(0.0).max(1.0), |m| &mut m.law.settings.sliding_mode.rho)
}

fn outputs(table: Controller) -> Controller {
    let sampled = sampled_output;
    let command = |axis: &str, meaning: &str| {
        let text = format!(
            "Body {meaning} rate commanded by the outer layer, held for period.optimisation"
        );
        sampled(&format!("rateCommand.{axis}"), &text)
            .real()
            .unit(unit::angular_rate())
            .nominal(0.05)
    };
    let sliding = |axis: &str, meaning: &str| {
        let text = format!("Sliding variable of the {meaning} rate at the last tick");
        sampled(&format!("slidingVariable.{axis}"), &text)
            .real()
            .unit(unit::angular_rate())
            .nominal(0.01)
    };
    let time = sampled(
        "innerLaw.time",
        "Wall-clock time of the last evaluation of the inner layer; not reproducible",
    );
    let table = vector(table, RATES, command, |m| &mut m.law.shown.rate_command);
    let table = vector(table, RATES, sliding, |m| &mut m.law.shown.sliding);
    solver::outputs(table, |law| &mut law.shown.report)
        .real(time.real().unit(unit::time()).nominal(1e-6), |m| &mut m.law.shown.inner_time)
}
