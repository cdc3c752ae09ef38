//! Parameters and outputs of `CRMPC`.

use crate::solver;
use control::crmpc::{
    Constraints, Contradiction, Crmpc, Guarantee, GuaranteeStatus, InitialState, Margins, Memory,
    Settings, Supervision,
};
use control::error::DesignError;
use control::error_dynamics::Gain;
use control::report::SolverReport;
use controller_export::table::{self, ANGLES, sampled_output, shown, shown_vector, vector};
use controller_export::{ControllerFmu, Law, Vehicle};
use fmi2_export::fields::Fields;
use fmi2_export::table::parameter;
use fmi2_export::{Enumeration, VariableTable};
use model_description::unit;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

/// Parameters and outputs of CRMPC.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct CrmpcLaw {
    /// Settings of the controller; body, limits and delay in them are replaced by those of the
    /// vehicle.
    pub(crate) settings: Settings,
    shown: Shown,
}

/// Share of the moment limit for the plan below which optimisations take several times as long
/// (example `loop_times` of `control` with other disturbance bounds).
const LITTLE_MOMENT: f64 = 0.1;

/// Values that the outputs show.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
struct Shown {
    angles: Vector3<f64>,
    rates: Vector3<f64>,
    in_force: bool,
    supervision: Supervision,
    margins: Margins,
    moment_left: f64,
    disturbance: Vector3<f64>,
    report: SolverReport,
}

static CONSTRAINTS: Enumeration<Constraints> = Enumeration {
    name: "Constraints",
    description: "Constraint sets of the optimisation for the nominal trajectory",
    items: &[
        (
            Constraints::Robust,
            "robust",
            "limit.rate and limit.moment, tightened by the largest possible deviations from the nominal trajectory",
        ),
        (
            Constraints::Paper,
            "paper",
            "sets as printed in the paper, which do not imply the limits",
        ),
    ],
};
static INITIAL_STATES: Enumeration<InitialState> = Enumeration {
    name: "InitialState",
    description: "Initial state of the nominal trajectory at each optimisation",
    items: &[
        (InitialState::Measured, "measured", "measured state"),
        (
            InitialState::Tube,
            "tube",
            "state in an invariant set around the measured state, chosen by the optimisation",
        ),
        (
            InitialState::Nominal,
            "nominal",
            "state predicted by the previous plan; at the first optimisation the measured state",
        ),
    ],
};

static POLICIES: Enumeration<Guarantee> = Enumeration {
    name: "GuaranteePolicy",
    description: "Reaction to settings for which the robust set gives no guarantee",
    items: &[
        (Guarantee::Required, "required", "the settings are refused at initialization"),
        (Guarantee::BestEffort, "bestEffort", "the controller runs without a guarantee"),
    ],
};
static GUARANTEE_STATUSES: Enumeration<GuaranteeStatus> = Enumeration {
    name: "GuaranteeStatus",
    description: "Status of the guarantee of the robust set at the last tick",
    items: &[
        (
            GuaranteeStatus::None,
            "none",
            "no optimisation yet, or constraint sets that give no guarantee",
        ),
        (
            GuaranteeStatus::Pending,
            "pending",
            "a plan is certified, but its first command does not act yet",
        ),
        (
            GuaranteeStatus::InForce,
            "inForce",
            "the limits are kept as long as the assumptions hold",
        ),
        (
            GuaranteeStatus::Refused,
            "refused",
            "no guarantee is possible with these settings; the controller runs as best effort",
        ),
        (
            GuaranteeStatus::Uncertified,
            "uncertified",
            "no plan was found that satisfies the conditions of the guarantee",
        ),
        (
            GuaranteeStatus::Exceeded,
            "exceeded",
            "an assumption was contradicted within the last second; guarantee.contradiction shows which",
        ),
        (
            GuaranteeStatus::Stale,
            "stale",
            "a tick within the last second used inputs that had been set before it; step with period.feedback or a whole fraction of it",
        ),
    ],
};

const CONTRADICTIONS: Enumeration<Contradiction> = Enumeration {
    name: "Contradiction",
    description: "Contradiction of an assumption of the guarantee within the last second",
    items: &[
        (Contradiction::None, "none", "no contradiction"),
        (
            Contradiction::Step,
            "step",
            "a tick used inputs that had been set before it, because of the communication step",
        ),
        (
            Contradiction::Delay,
            "delay",
            "loopDelay.estimate differs from delay + measurement.age by more than delayError",
        ),
        (
            Contradiction::Disturbance,
            "disturbance",
            "the observed disturbance is larger than disturbance.bound, inertia.error and estimation.rateError allow",
        ),
        (
            Contradiction::Deviation,
            "deviation",
            "the deviation from the plan is larger than the assumed disturbance, inertia, measurement errors and delay allow",
        ),
        (
            Contradiction::Limit,
            "limit",
            "a limit is exceeded, or the law requires a moment beyond limit.moment",
        ),
    ],
};

impl Default for CrmpcLaw {
    fn default() -> Self {
        Self { settings: Settings::new(Constraints::Robust), shown: Shown::default() }
    }
}

impl Law for CrmpcLaw {
    type Controller = Crmpc;
    type Settings = Settings;

    const NAME: &'static str = "CRMPC";
    const DESCRIPTION: &'static str =
        "Centralised robust model predictive attitude controller of Chai et al. (2022)";
    const DOCUMENTATION: &'static str = include_str!("crmpc.html");
    const FIELDS: &'static Fields = &[
        ("observer.time_constant", "observer.timeConstant"),
        ("inertia_error", "inertia.error"),
        ("tensor_error", "inertia.tensorError"),
        ("delay_error", "delayError"),
        ("initial_state", "initialState"),
        ("angle_error", "estimation.angleError"),
        ("rate_error", "estimation.rateError"),
        ("sideslip_domain", "guarantee.sideslip"),
        ("disturbance_bound", "disturbance.bound"),
        ("guarantee", "guarantee.policy"),
    ];

    fn period() -> f64 {
        Settings::new(Constraints::Robust).period_feedback
    }

    fn declare(table: VariableTable<ControllerFmu<Self>>) -> VariableTable<ControllerFmu<Self>> {
        outputs(guarantee(bounds(gains(schedule(table)))))
    }

    fn settings(&self, vehicle: &Vehicle) -> Settings {
        Settings {
            body: vehicle.body,
            limit_rate: vehicle.limit_rate,
            limit_moment: vehicle.limit_moment,
            period_feedback: vehicle.period,
            delay: vehicle.latency.total(),
            ..self.settings
        }
    }

    fn design(settings: Self::Settings) -> Result<Self::Controller, DesignError> {
        Crmpc::new(settings)
    }

    fn show(&mut self, memory: &Memory) {
        self.shown = Shown {
            angles: shown_vector(&memory.nominal.fixed_rows::<3>(0).into()),
            rates: shown_vector(&memory.nominal.fixed_rows::<3>(3).into()),
            in_force: memory.supervision.status == GuaranteeStatus::InForce,
            supervision: memory.supervision,
            margins: Margins {
                rate: shown(memory.margins.rate),
                moment: shown(memory.margins.moment),
            },
            moment_left: shown(memory.moment_left),
            disturbance: shown_vector(&memory.observed.disturbance),
            report: solver::shown_report(&memory.report),
        };
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
                Contradiction::Limit => {
                    "the guarantee is no longer in force: a guaranteed limit is exceeded"
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

type Controller = VariableTable<ControllerFmu<CrmpcLaw>>;
type GainField = fn(&mut CrmpcLaw) -> &mut Gain;

fn schedule(table: Controller) -> Controller {
    let constraints = parameter("constraints", CONSTRAINTS.description);
    let initial = parameter("initialState", INITIAL_STATES.description);
    let horizon = parameter("horizon", "Number of prediction steps");
    let optimisation = parameter(
        "period.optimisation",
        "Sampling period of the optimisation and length of a prediction step; a whole multiple of period.feedback",
    );
    let table = table
        .enumeration(constraints, &CONSTRAINTS, |m| &mut m.law.settings.constraints)
        .enumeration(initial, &INITIAL_STATES, |m| &mut m.law.settings.initial_state)
        .integer(horizon, (Some(2), Some(1000)), |m| &mut m.law.settings.horizon)
        .real(optimisation.real().unit(unit::time()).min(1e-3).max(10.0).nominal(0.2), |m| {
            &mut m.law.settings.period_optimisation
        });
    let table = table::period(table, "feedback law");
    solver::parameters(table, |law| &mut law.settings.solver)
}

fn gains(table: Controller) -> Controller {
    let mut table = table::weights(table, |law| &mut law.settings.p, |law| &mut law.settings.q);
    let sets: [(&str, &str, GainField); 3] = [
        ("feedback", "of the feedback law (20)", |law| &mut law.settings.feedback),
        ("terminal", "of the terminal law (14)", |law| &mut law.settings.terminal),
        ("tube", "for the paper's tube constant in (21)", |law| &mut law.settings.tube),
    ];
    for (name, purpose, gain) in sets {
        let k1 =
            parameter(&format!("{name}.k1"), &format!("Angle gain {purpose}; negative")).real();
        let k2 = parameter(&format!("{name}.k2"), &format!("Rate gain {purpose}; negative")).real();
        table = table
            .real(k1.unit(unit::gain_angle()).max(0.0).nominal(5.0), move |m| {
                &mut gain(&mut m.law).k1
            })
            .real(k2.unit(unit::gain_rate()).max(0.0).nominal(5.0), move |m| {
                &mut gain(&mut m.law).k2
            });
    }
    table
}

fn bounds(table: Controller) -> Controller {
    let disturbance = parameter(
        "disturbance.bound",
        "Bound on each component of the disturbance of the angles' second derivatives; the constraint sets are tightened for it",
    );
    let inertia = parameter(
        "inertia.error",
        "Bound on the relative error of the inertia as a common factor of the tensor; the robust set is tightened for it",
    );
    let tensor = parameter(
        "inertia.tensorError",
        "Bound on the relative error of the inertia tensor in all six entries, besides the common factor; the robust set is tightened for it",
    );
    let delay_error = parameter(
        "delayError",
        "Bound on the difference between the loop delay, which must be constant, and delay + measurement.age; the robust set is tightened for it",
    );
    let angle_error = parameter(
        "estimation.angleError",
        "Bound on the measurement error of each angle, which may change arbitrarily from tick to tick; the robust set is tightened for it",
    );
    let rate_error = parameter(
        "estimation.rateError",
        "Bound on the error of each angle's derivative as computed from the measurements, which may change arbitrarily from tick to tick; the robust set is tightened for it",
    );
    let sideslip = parameter(
        "bound.sideslip",
        "Largest magnitude of the sideslip angle for which the bounds of the paper's design hold",
    );
    let rate = parameter(
        "bound.referenceRate",
        "Bound on the norm of the reference's first derivative in the paper's terminal set (13)",
    );
    let acceleration = parameter(
        "bound.referenceAcceleration",
        "Bound on the norm of the reference's second derivative in the paper's terminal set (13)",
    );
    table
        .real(disturbance.real().unit(unit::angular_acceleration()).min(0.0).nominal(0.03), |m| {
            &mut m.law.settings.disturbance_bound
        })
        .real(inertia.real().min(0.0).max(0.9).nominal(0.05), |m| &mut m.law.settings.inertia_error)
        .real(tensor.real().min(0.0).max(0.9).nominal(0.05), |m| &mut m.law.settings.tensor_error)
        .real(delay_error.real().unit(unit::time()).min(0.0).max(1.0).nominal(0.01), |m| {
            &mut m.law.settings.delay_error
        })
        .real(sideslip.real().unit(unit::angle()).min(0.0).max(1.5).nominal(0.2), |m| {
            &mut m.law.settings.sideslip_bound
        })
        .real(rate.real().unit(unit::angular_rate()).min(0.0).nominal(0.05), |m| {
            &mut m.law.settings.reference_rate
        })
        .real(acceleration.real().unit(unit::angular_acceleration()).min(0.0).nominal(0.02), |m| {
            &mut m.law.settings.reference_acceleration
        })
        .real(angle_error.real().unit(unit::angle()).min(0.0).nominal(0.003), |m| {
            &mut m.law.settings.angle_error
        })
        .real(rate_error.real().unit(unit::angular_rate()).min(0.0).nominal(0.005), |m| {
            &mut m.law.settings.rate_error
        })
}

fn guarantee(table: Controller) -> Controller {
    let sideslip = parameter(
        "guarantee.sideslip",
        "Largest magnitude of the sideslip angle for which the guarantee is given",
    );
    let active = parameter(
        "observer.active",
        "Whether the reference is shifted to cancel the steady deviation that the observed disturbance causes; only with constraints = robust",
    );
    let time =
        parameter("observer.timeConstant", "Time constant of the disturbance observer's filter");
    let stiffness = parameter(
        "observer.stiffness",
        "Ratio of the estimated disturbance to the resulting shift of the reference angles",
    );
    table
        .enumeration(parameter("guarantee.policy", POLICIES.description), &POLICIES, |m| {
            &mut m.law.settings.guarantee
        })
        .real(sideslip.real().unit(unit::angle()).min(0.0).max(0.8).nominal(0.3), |m| {
            &mut m.law.settings.sideslip_domain
        })
        .boolean(active, |m| &mut m.law.settings.observer.active)
        .real(time.real().unit(unit::time()).min(1e-3).max(100.0).nominal(0.2), |m| {
            &mut m.law.settings.observer.time_constant
        })
        .real(stiffness.real().unit(unit::gain_angle()).min(1e-3).max(1e3).nominal(2.5), |m| {
            &mut m.law.settings.observer.stiffness
        })
}

fn outputs(table: Controller) -> Controller {
    let sampled = sampled_output;
    let nominal = |axis: &str, meaning: &str| {
        let text = format!("Nominal {meaning} at the last tick");
        sampled(&format!("nominal.{axis}"), &text).real().unit(unit::angle()).nominal(0.1)
    };
    let rate = |axis: &str, meaning: &str| {
        let text = format!("Derivative of the nominal {meaning} at the last tick");
        sampled(&format!("nominalRate.{axis}"), &text)
            .real()
            .unit(unit::angular_rate())
            .nominal(0.05)
    };
    let table = vector(table, ANGLES, nominal, |m| &mut m.law.shown.angles);
    let table = vector(table, ANGLES, rate, |m| &mut m.law.shown.rates);
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
    let disturbance =
        |axis: &str, meaning: &str| table::disturbance_estimate(axis, meaning).nominal(0.03);
    let table = table
        .boolean(
            sampled(
                "guarantee.inForce",
                "Whether the guarantee of the robust set is in force at the last tick",
            ),
            |m| &mut m.law.shown.in_force,
        )
        .enumeration(
            sampled("guarantee.status", GUARANTEE_STATUSES.description),
            &GUARANTEE_STATUSES,
            |m| &mut m.law.shown.supervision.status,
        )
        .enumeration(
            sampled("guarantee.contradiction", CONTRADICTIONS.description),
            &CONTRADICTIONS,
            |m| &mut m.law.shown.supervision.contradiction,
        )
        .real(margin("rateMargin", "limit.rate"), |m| &mut m.law.shown.margins.rate)
        .real(margin("momentMargin", "limit.moment"), |m| &mut m.law.shown.margins.moment)
        .real(left.real(), |m| &mut m.law.shown.moment_left);
    let table = vector(table, ANGLES, disturbance, |m| &mut m.law.shown.disturbance);
    solver::outputs(table, |law| &mut law.shown.report)
}
