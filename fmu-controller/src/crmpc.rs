//! Parameters and outputs of `CRMPC`.

use crate::solver;
use control::crmpc::{
    Constraints, Contradiction, Crmpc, Guarantee, InitialState, Margins, Memory, Settings,
    Standing, Supervision,
};
use control::error::DesignError;
use control::error_dynamics::Gain;
use control::report::SolverReport;
use controller_export::table::{self, ANGLES, sampled_output, shown, shown_vector, vector};
use controller_export::{ControllerFmu, Law, Vehicle};
use fmi2_export::fields::Fields;
use fmi2_export::table::parameter;
use fmi2_export::{Enumeration, Table};
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

/// Share of the moment limit below which the plan has so little left that optimisations become
/// several times longer (`control`'s example `loop_times` with other disturbance bounds).
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
    description: "Sets that the optimisation keeps the nominal motion in",
    items: &[
        (
            Constraints::Robust,
            "robust",
            "the limits themselves, tightened by what the error dynamics can reach",
        ),
        (Constraints::Paper, "paper", "the sets as printed, which do not imply the limits"),
    ],
};
static INITIAL_STATES: Enumeration<InitialState> = Enumeration {
    name: "InitialState",
    description: "Where the nominal motion starts",
    items: &[
        (InitialState::Measured, "measured", "the nominal motion starts at the measured state"),
        (
            InitialState::Tube,
            "tube",
            "it starts anywhere in an invariant set around the measured state",
        ),
        (
            InitialState::Nominal,
            "nominal",
            "it starts where the previous plan put it, the first at the measured state",
        ),
    ],
};

static GUARANTEES: Enumeration<Guarantee> = Enumeration {
    name: "GuaranteePolicy",
    description: "What happens where the robust set cannot be guaranteed",
    items: &[
        (
            Guarantee::Required,
            "required",
            "settings for which the robust set cannot be guaranteed are refused",
        ),
        (Guarantee::BestEffort, "bestEffort", "they run all the same, without guarantee"),
    ],
};
static STANDINGS: Enumeration<Standing> = Enumeration {
    name: "GuaranteeStatus",
    description: "Whether the guarantee of the robust set is in force at the last tick, and why not",
    items: &[
        (Standing::None, "none", "no optimisation yet, or sets that guarantee nothing"),
        (
            Standing::Pending,
            "pending",
            "a plan is certified, but its first command has not acted yet",
        ),
        (Standing::InForce, "inForce", "the limits are kept for as long as the assumptions hold"),
        (Standing::Refused, "refused", "the design does not hold for the settings: best effort"),
        (
            Standing::Uncertified,
            "uncertified",
            "no plan has been found that keeps the conditions of the guarantee",
        ),
        (
            Standing::Exceeded,
            "exceeded",
            "an assumption is contradicted, see guarantee.contradiction, or was during the last second",
        ),
        (
            Standing::Stale,
            "stale",
            "the inputs were set before the tick, or were during the last second: step with period.feedback or a whole part of it",
        ),
    ],
};

const CONTRADICTIONS: Enumeration<Contradiction> = Enumeration {
    name: "Contradiction",
    description: "What contradicts an assumption of the guarantee, or did during the last second",
    items: &[
        (Contradiction::None, "none", "nothing"),
        (
            Contradiction::Step,
            "step",
            "the communication step: inputs were set before the tick at which they are used",
        ),
        (
            Contradiction::Delay,
            "delay",
            "the delay of the loop: loopDelay differs from delay + measurement.age by more than delayError",
        ),
        (
            Contradiction::Disturbance,
            "disturbance",
            "the observed disturbance: it exceeds what disturbance.bound, inertia.error and estimation.rateError explain",
        ),
        (
            Contradiction::Deviation,
            "deviation",
            "the vehicle is further from the plan than disturbance, inertia, measurements and delay together explain",
        ),
        (
            Contradiction::Limit,
            "limit",
            "a limit is exceeded, or the moment that the law asks for exceeds it",
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

    fn declare(table: Table<ControllerFmu<Self>>) -> Table<ControllerFmu<Self>> {
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
            in_force: memory.supervision.status == Standing::InForce,
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
        // The warning is given the first time only; `guarantee.status` shows the later ones.
        let (before_then, now) = (&before.supervision, &after.supervision);
        if now.ended == 1 && before_then.ended == 0 {
            return Some(match now.contradiction {
                Contradiction::Step => {
                    "the guarantee is no longer in force: inputs were set before the tick at which they are used; step with period.feedback or a whole part of it"
                }
                Contradiction::Delay => {
                    "the guarantee is no longer in force: the loop has another delay than delay, delayError and measurement.age say"
                }
                Contradiction::Disturbance => {
                    "the guarantee is no longer in force: the observed disturbance is larger than disturbance.bound, inertia.error and estimation.rateError explain with the delay that was told"
                }
                Contradiction::Limit => {
                    "the guarantee is no longer in force: a limit is exceeded although it was guaranteed"
                }
                Contradiction::Deviation | Contradiction::None => {
                    "the guarantee is no longer in force: the vehicle is further from the plan than disturbance.bound, inertia.error, estimation.*, measurement.age and delay explain"
                }
            });
        }
        match (before_then.status, now.status) {
            (Standing::None, Standing::Uncertified) => Some(
                "the guarantee is not in force: no plan keeps its conditions from the present state",
            ),
            (Standing::None, Standing::Pending | Standing::InForce)
                if after.moment_left < LITTLE_MOMENT =>
            {
                Some(
                    "the settings leave less than a tenth of limit.moment to the plan, see guarantee.momentLeft: optimisations take several times as long; a smaller disturbance.bound or delay leaves more",
                )
            }
            (Standing::None, Standing::Refused) => Some(
                "constraints = robust cannot be guaranteed with these settings; it runs as best effort",
            ),
            _ => solver::warning(&before.report, &after.report),
        }
    }
}

type Controller = Table<ControllerFmu<CrmpcLaw>>;
type GainField = fn(&mut CrmpcLaw) -> &mut Gain;

fn schedule(table: Controller) -> Controller {
    let constraints = parameter("constraints", CONSTRAINTS.description);
    let initial = parameter("initialState", "Where the nominal motion starts at each optimisation");
    let horizon = parameter("horizon", "Number of prediction steps");
    let optimisation = parameter(
        "period.optimisation",
        "Time between two optimisations and prediction step; a whole multiple of period.feedback",
    );
    let table = table
        .enumeration(constraints, &CONSTRAINTS, |m| &mut m.law.settings.constraints)
        .enumeration(initial, &INITIAL_STATES, |m| &mut m.law.settings.initial_state)
        .integer(horizon, (Some(2), Some(1000)), |m| &mut m.law.settings.horizon)
        .real(optimisation.real().unit(unit::time()).min(1e-3).max(10.0).nominal(0.2), |m| {
            &mut m.law.settings.period_optimisation
        });
    let table = table::period(table, "Time between two evaluations of the feedback law");
    solver::parameters(table, |law| &mut law.settings.solver)
}

fn gains(table: Controller) -> Controller {
    let mut table = table::weights(table, |law| &mut law.settings.p, |law| &mut law.settings.q);
    let sets: [(&str, &str, GainField); 3] = [
        ("feedback", "feedback law K (20)", |law| &mut law.settings.feedback),
        ("terminal", "terminal law (14)", |law| &mut law.settings.terminal),
        ("tube", "paper's tube constant in (21)", |law| &mut law.settings.tube),
    ];
    for (name, of, gain) in sets {
        let k1 =
            parameter(&format!("{name}.k1"), &format!("Gain on the angles of the {of}, negative"))
                .real();
        let k2 =
            parameter(&format!("{name}.k2"), &format!("Gain on the rates of the {of}, negative"))
                .real();
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
        "Bound on each component of the disturbance of the angles' second derivatives that the sets are tightened for",
    );
    let inertia = parameter(
        "inertia.error",
        "Relative error of the inertia, as a common factor of the tensor, that the robust set is tightened for",
    );
    let tensor = parameter(
        "inertia.tensorError",
        "Relative error of the tensor of inertia, in all six entries, that the robust set is tightened for besides the common factor",
    );
    let delay_error = parameter(
        "delayError",
        "Largest difference between the delay of the loop, which must not change, and delay + measurement.age, that the robust set is tightened for",
    );
    let angle_error = parameter(
        "estimation.angleError",
        "Bound on the error of each angle given that the robust set is tightened for; the error may take any value within it at each tick",
    );
    let rate_error = parameter(
        "estimation.rateError",
        "Bound on the error of the derivative of each angle, as it follows from what is given, that the robust set is tightened for; the error may take any value within it at each tick",
    );
    let sideslip = parameter(
        "bound.sideslip",
        "Sideslip angle up to which the bounds of the paper's design hold",
    );
    let rate = parameter(
        "bound.referenceRate",
        "Bound on the reference's rate in the paper's terminal set (13)",
    );
    let acceleration = parameter(
        "bound.referenceAcceleration",
        "Bound on the reference's acceleration in the paper's terminal set (13)",
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
    let sideslip =
        parameter("guarantee.sideslip", "Sideslip angle up to which the guarantee is given");
    let active = parameter(
        "observer.active",
        "Whether the robust set's reference is shifted by what the observed disturbance does to the vehicle",
    );
    let time =
        parameter("observer.timeConstant", "Time constant of the disturbance observer's filter");
    let stiffness = parameter(
        "observer.stiffness",
        "Observed disturbance over the shift of the reference's angles",
    );
    table
        .enumeration(parameter("guarantee.policy", GUARANTEES.description), &GUARANTEES, |m| {
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
        let text = format!("Rate of the nominal {meaning} at the last tick");
        sampled(&format!("nominalRate.{axis}"), &text)
            .real()
            .unit(unit::angular_rate())
            .nominal(0.05)
    };
    let table = vector(table, ANGLES, nominal, |m| &mut m.law.shown.angles);
    let table = vector(table, ANGLES, rate, |m| &mut m.law.shown.rates);
    let margin = |name: &str, limit: &str| {
        let text = format!(
            "What the plan leaves of the {limit} in its first interval beyond what is reserved, over the limit"
        );
        sampled(&format!("guarantee.{name}"), &text).real()
    };
    let left = sampled(
        "guarantee.momentLeft",
        "Share of the moment limit that the reserve for disturbances, errors and delay leaves to the plan at rest",
    );
    let observed = |axis: &str, meaning: &str| {
        let text = format!("Observed disturbance of the second derivative of the {meaning}");
        sampled(&format!("disturbanceEstimate.{axis}"), &text)
            .real()
            .unit(unit::angular_acceleration())
            .nominal(0.03)
    };
    let table = table
        .boolean(
            sampled(
                "guarantee.inForce",
                "Whether the guarantee of the robust set is in force at the last tick",
            ),
            |m| &mut m.law.shown.in_force,
        )
        .enumeration(sampled("guarantee.status", STANDINGS.description), &STANDINGS, |m| {
            &mut m.law.shown.supervision.status
        })
        .enumeration(
            sampled("guarantee.contradiction", CONTRADICTIONS.description),
            &CONTRADICTIONS,
            |m| &mut m.law.shown.supervision.contradiction,
        )
        .real(margin("rateMargin", "rate limit"), |m| &mut m.law.shown.margins.rate)
        .real(margin("momentMargin", "moment limit"), |m| &mut m.law.shown.margins.moment)
        .real(left.real(), |m| &mut m.law.shown.moment_left);
    let table = vector(table, ANGLES, observed, |m| &mut m.law.shown.disturbance);
    solver::outputs(table, |law| &mut law.shown.report)
}
