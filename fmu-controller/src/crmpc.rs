//! `CRMPC` as an FMU.

use crate::solver;
use control::crmpc::{
    Constraints, Contradiction, Crmpc, GuaranteeStatus, Margins, Memory, POINTS, PlanPoint,
    Settings, Supervision, points,
};
use control::error::DesignError;
use control::error_dynamics::Gain;
use control::report::SolverReport;
use controller_export::table::{self, ANGLES, sampled_output, shown, shown_vector, vector};
use controller_export::{ControllerFmu, Law, Vehicle};
use fmi_export::VariableTable;
use fmi_export::table::discrete_local;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use settings::Choice;

/// Share of the moment limit for the plan below which optimisations take several times as long
/// (docs/guarantee.md has iterations for other disturbance bounds).
const LITTLE_MOMENT: f64 = 0.1;

/// Outputs of CRMPC.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct CrmpcLaw {
    angles: Vector3<f64>,
    rates: Vector3<f64>,
    in_force: bool,
    supervision: Supervision,
    margins: Margins,
    moment_left: f64,
    gain: Gain,
    disturbance: Vector3<f64>,
    report: SolverReport,
    plan: ShownPlan,
}

/// The plan in force, if the settings ask for it.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
struct ShownPlan {
    began: f64,
    times: [f64; POINTS],
    points: [PlanPoint; POINTS],
}

impl Law for CrmpcLaw {
    type Controller = Crmpc;
    type Settings = Settings;

    const NAME: &'static str = "CRMPC";
    const DESCRIPTION: &'static str =
        "Centralised robust model predictive attitude controller of Chai et al. (2022)";
    const DOCUMENTATION: &'static str = include_str!("crmpc.html");
    const PLANS: bool = true;

    fn settings() -> Settings {
        Settings::new(Constraints::Robust)
    }

    fn period(settings: &Settings) -> f64 {
        settings.period_feedback
    }

    fn design(settings: Settings, vehicle: &Vehicle) -> Result<Crmpc, DesignError> {
        let Vehicle { body, limit_rate, limit_moment, latency, .. } = *vehicle;
        Crmpc::new(Settings { body, limit_rate, limit_moment, delay: latency.total(), ..settings })
    }

    fn outputs(table: Controller) -> Controller {
        outputs(table)
    }

    fn show(&mut self, settings: &Settings, memory: &Memory) {
        if settings.shows_plan && memory.shown.len() == POINTS {
            self.plan.show(settings, memory);
        }
        // The plan is not moved at every tick, as it is large and seldom asked for.
        self.angles = shown_vector(&memory.nominal.fixed_rows::<3>(0).into());
        self.rates = shown_vector(&memory.nominal.fixed_rows::<3>(3).into());
        self.in_force = memory.supervision.status == GuaranteeStatus::InForce;
        self.supervision = memory.supervision;
        self.margins =
            Margins { rate: shown(memory.margins.rate), moment: shown(memory.margins.moment) };
        self.moment_left = shown(memory.moment_left);
        self.gain = memory.gain;
        self.disturbance = shown_vector(&memory.observed.disturbance);
        self.report = solver::shown_report(&memory.report);
    }

    fn warning(before: &Memory, after: &Memory) -> Option<&'static str> {
        // The warning is given the first time only; `guarantee.status` shows later times.
        let (earlier, now) = (&before.supervision, &after.supervision);
        if now.ended == 1 && earlier.ended == 0 {
            return Some(match now.contradiction {
                Contradiction::Step => {
                    "the guarantee is no longer in force: a tick used inputs that had been set before it; step with period.feedback or a whole fraction of it"
                }
                Contradiction::Delay => {
                    "the guarantee is no longer in force: the loop delay differs from delay + measurement.age by more than delayError"
                }
                Contradiction::Disturbance => {
                    "the guarantee is no longer in force: the observed disturbance is larger than disturbance.bound, inertia.error and estimation.rateError allow with the given delay"
                }
                Contradiction::Frozen => {
                    "the guarantee is no longer in force: the measured angles and rates have been the same at three ticks, although the vehicle moves"
                }
                Contradiction::KnownMoment => {
                    "the guarantee is no longer in force: knownMoment.* is larger than knownMoment.bound, or has changed by more than knownMoment.change while a plan was followed"
                }
                Contradiction::Schedule => {
                    "the guarantee is no longer in force: scheduled.limitMoment has fallen, or scheduled.disturbanceBound risen, by more than the plan reserves"
                }
                Contradiction::Turn => {
                    "the guarantee is no longer in force: the turn given by trajectory.* has changed by more than trajectory.turnChange while a plan was followed"
                }
                Contradiction::Limit => {
                    "the guarantee is no longer in force: a guaranteed limit is exceeded, or the law requires a moment beyond limit.moment"
                }
                Contradiction::Deviation | Contradiction::None => {
                    "the guarantee is no longer in force: the deviation from the plan is larger than disturbance.bound, inertia.error, estimation.*, measurement.age and delay allow"
                }
            });
        }
        match (earlier.status, now.status) {
            (GuaranteeStatus::None, GuaranteeStatus::Uncertified) => Some(
                "the guarantee is not in force: no plan from the present state satisfies its conditions",
            ),
            (GuaranteeStatus::None, GuaranteeStatus::Pending | GuaranteeStatus::InForce)
                if after.moment_left < LITTLE_MOMENT =>
            {
                Some(
                    "the settings leave less than a tenth of limit.moment to the plan (see guarantee.momentLeft), so optimisations take several times as long; a smaller disturbance.bound or delay leaves more",
                )
            }
            (GuaranteeStatus::None, GuaranteeStatus::Refused) => Some(
                "constraints = robust cannot be guaranteed with these settings; the controller runs as best effort",
            ),
            _ => solver::warning(&before.report, &after.report),
        }
    }
}

impl ShownPlan {
    fn show(&mut self, settings: &Settings, memory: &Memory) {
        self.began = memory.planned;
        for (time, step) in self.times.iter_mut().zip(points(settings.horizon)) {
            *time = step as f64 * settings.period_optimisation;
        }
        for (to, from) in self.points.iter_mut().zip(&memory.shown) {
            *to = PlanPoint {
                rate: shown(from.rate),
                rate_bound: shown(from.rate_bound),
                moment: shown(from.moment),
                moment_bound: shown(from.moment_bound),
            };
        }
    }
}

type Controller = VariableTable<ControllerFmu<CrmpcLaw>>;
fn outputs(table: Controller) -> Controller {
    let sampled = sampled_output;
    let nominal = |axis: &str, meaning: &str| {
        let text = format!("Nominal {meaning} at the last tick");
        sampled(&format!("nominal.{axis}"), &text).real().unit("rad").nominal(0.1)
    };
    let rate = |axis: &str, meaning: &str| {
        let text = format!("Derivative of the nominal {meaning} at the last tick");
        sampled(&format!("nominalRate.{axis}"), &text).real().unit("rad/s").nominal(0.05)
    };
    let table = vector(table, ANGLES, nominal, |m| &mut m.law.angles);
    let table = vector(table, ANGLES, rate, |m| &mut m.law.rates);
    let margin = |name: &str, limit: &str| {
        let text = format!(
            "Unused share of {limit} in the plan's first interval, after the reserve for deviations from the plan"
        );
        sampled(&format!("guarantee.{name}"), &text).real()
    };
    let left = sampled(
        "guarantee.momentLeft",
        "Share of limit.moment that remains for the plan at rest, after the reserve for disturbances, errors and delay",
    );
    let gain = |name: &str, of: &str| {
        let text = format!("Gain K of the feedback law in force: factor on the {of}");
        sampled(&format!("feedback.gain.{name}"), &text).real().nominal(5.0)
    };
    let disturbance =
        |axis: &str, meaning: &str| table::disturbance_estimate(axis, meaning).nominal(0.03);
    let table = table
        .boolean(
            sampled(
                "guarantee.inForce",
                "Whether the guarantee of the robust set is in force at the last tick",
            ),
            |m| &mut m.law.in_force,
        )
        .choice(sampled("guarantee.status", GuaranteeStatus::TEXT), |m| {
            &mut m.law.supervision.status
        })
        .choice(sampled("guarantee.contradiction", Contradiction::TEXT), |m| {
            &mut m.law.supervision.contradiction
        })
        .real(margin("rateMargin", "limit.rate"), |m| &mut m.law.margins.rate)
        .real(margin("momentMargin", "limit.moment"), |m| &mut m.law.margins.moment)
        .real(left.real(), |m| &mut m.law.moment_left)
        .real(gain("k1", "angle").unit("1/s2"), |m| &mut m.law.gain.k1)
        .real(gain("k2", "rate").unit("1/s"), |m| &mut m.law.gain.k2);
    let table = vector(table, ANGLES, disturbance, |m| &mut m.law.disturbance);
    plan_shown(solver::outputs(table, |law| &mut law.report))
}

/// Adds the variables that show the plan. As locals they need no ports in block diagrams.
fn plan_shown(table: Controller) -> Controller {
    let began = "Time at which the plan begins, later than its optimisation by the delay; 0 unless plan.shown";
    let began = discrete_local("plan.began", began).real().unit("s").nominal(10.0);
    let table = table.real(began, |m| &mut m.law.plan.began);
    let declare = |i: usize, name: &str, text: &str| {
        discrete_local(&format!("plan.{name}[{}]", i + 1), text).real()
    };
    (0..POINTS).fold(table, |table, i| {
        let time = declare(i, "time", "Time from plan.began to this point of the plan");
        let rate = declare(i, "rate", "Norm of the planned body rates at this point");
        let rate_bound = declare(
            i,
            "rateBound",
            "Bound on plan.rate here; what is missing to limit.rate is the tube, the largest difference to the flown norm",
        );
        let moment = declare(
            i,
            "moment",
            "Norm of the moment planned from this point on, less the known moment",
        );
        let moment_bound = declare(
            i,
            "momentBound",
            "Bound on plan.moment here; what is missing to limit.moment is the tube, the largest difference to the flown norm",
        );
        table
            .real(time.unit("s"), move |m| &mut m.law.plan.times[i])
            .real(rate.unit("rad/s").nominal(0.1), move |m| &mut m.law.plan.points[i].rate)
            .real(rate_bound.unit("rad/s").nominal(0.1), move |m| {
                &mut m.law.plan.points[i].rate_bound
            })
            .real(moment.unit("N.m").nominal(1e5), move |m| &mut m.law.plan.points[i].moment)
            .real(moment_bound.unit("N.m").nominal(1e5), move |m| {
                &mut m.law.plan.points[i].moment_bound
            })
    })
}
