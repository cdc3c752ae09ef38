//! `CRMPC`: its own parameters and outputs.

use crate::law::{Law, Vehicle};
use crate::solver::{self, SolverOutputs, SolverParameters};
use crate::table::{self, ANGLES, enumeration, item, number, sampled_inputs, shown, shown_vector, vector};
use crate::unit::Unit;
use control::crmpc::{
    Constraints, Crmpc, Guarantee, InitialState, Memory, ObserverSettings, Settings, Standing,
};
use control::error::DesignError;
use control::sampled::Gain;
use fmi2_export::Table;
use fmi2_export::table::{discrete_output, parameter};
use model_description::unit;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

/// Parameters and outputs of CRMPC. Enumerations are held as their 1-based item number.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct CrmpcLaw {
    constraints: i32,
    initial_state: i32,
    horizon: i32,
    period_optimisation: f64,
    period_feedback: f64,
    p: [f64; 6],
    q: [f64; 3],
    feedback: Gain,
    terminal: Gain,
    tube: Gain,
    disturbance_bound: f64,
    inertia_error: f64,
    angle_error: f64,
    rate_error: f64,
    guarantee: i32,
    sideslip_domain: f64,
    observer: ObserverSettings,
    sideslip_bound: f64,
    reference_rate: f64,
    reference_acceleration: f64,
    solver: SolverParameters,
    shown: Shown,
}

/// What the outputs show.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
struct Shown {
    angles: Vector3<f64>,
    rates: Vector3<f64>,
    in_force: bool,
    /// Item number of [`STANDINGS`].
    standing: i32,
    rate_margin: f64,
    moment_margin: f64,
    disturbance: Vector3<f64>,
    solver: SolverOutputs,
}

const CONSTRAINTS: [(Constraints, &str, &str); 2] = [
    (Constraints::Robust, "robust", "the limits themselves, tightened by what the error dynamics can reach"),
    (Constraints::Paper, "paper", "the sets as printed, which do not imply the limits"),
];
const INITIAL_STATES: [(InitialState, &str, &str); 3] = [
    (InitialState::Measured, "measured", "the nominal motion starts at the measured state"),
    (InitialState::Tube, "tube", "it starts anywhere in an invariant set around the measured state"),
    (
        InitialState::Nominal,
        "nominal",
        "it starts where the previous plan put it, the first at the measured state",
    ),
];

const GUARANTEES: [(Guarantee, &str, &str); 2] = [
    (Guarantee::Required, "required", "settings for which the robust set cannot be guaranteed are refused"),
    (Guarantee::BestEffort, "bestEffort", "they run all the same, without guarantee"),
];
const STANDINGS: [(Standing, &str, &str); 6] = [
    (Standing::None, "none", "no optimisation yet, or sets that guarantee nothing"),
    (Standing::Pending, "pending", "a plan is certified, but its first command has not acted yet"),
    (Standing::InForce, "inForce", "the limits are kept for as long as the assumptions hold"),
    (Standing::Refused, "refused", "the design does not hold for the settings: best effort"),
    (
        Standing::Uncertified,
        "uncertified",
        "no plan has been found that keeps the conditions of the guarantee",
    ),
    (Standing::Exceeded, "exceeded", "the vehicle is further from the plan than the assumptions explain"),
];

impl Default for CrmpcLaw {
    fn default() -> Self {
        let s = Settings::new(Constraints::Robust);
        Self {
            constraints: number(&CONSTRAINTS, &s.constraints),
            initial_state: number(&INITIAL_STATES, &s.initial_state),
            horizon: i32::try_from(s.horizon).unwrap_or(i32::MAX),
            period_optimisation: s.period_optimisation,
            period_feedback: s.period_feedback,
            p: s.p,
            q: s.q,
            feedback: s.feedback,
            terminal: s.terminal,
            tube: s.tube,
            disturbance_bound: s.disturbance_bound,
            inertia_error: s.inertia_error,
            angle_error: s.angle_error,
            rate_error: s.rate_error,
            guarantee: number(&GUARANTEES, &s.guarantee),
            sideslip_domain: s.sideslip_domain,
            observer: s.observer,
            sideslip_bound: s.sideslip_bound,
            reference_rate: s.reference_rate,
            reference_acceleration: s.reference_acceleration,
            solver: SolverParameters::from(&s.solver),
            shown: Shown::default(),
        }
    }
}

impl Law for CrmpcLaw {
    type Controller = Crmpc;
    type Settings = Settings;

    const NAME: &'static str = "CRMPC";
    const DESCRIPTION: &'static str =
        "Centralised robust model predictive attitude controller of Chai et al. (2022)";
    const DOCUMENTATION: &'static str = concat!(include_str!("crmpc.html"), include_str!("wiring.html"));

    fn declare(table: Table<Unit<Self>>) -> Table<Unit<Self>> {
        outputs(guarantee(bounds(gains(schedule(table)))))
    }

    #[allow(private_interfaces)]
    fn settings(&self, vehicle: &Vehicle) -> Self::Settings {
        Settings {
            body: vehicle.body,
            limit_rate: vehicle.limit_rate,
            limit_moment: vehicle.limit_moment,
            constraints: item(&CONSTRAINTS, self.constraints),
            initial_state: item(&INITIAL_STATES, self.initial_state),
            horizon: self.horizon.max(0).cast_unsigned() as usize,
            period_optimisation: self.period_optimisation,
            period_feedback: self.period_feedback,
            p: self.p,
            q: self.q,
            feedback: self.feedback,
            terminal: self.terminal,
            tube: self.tube,
            disturbance_bound: self.disturbance_bound,
            inertia_error: self.inertia_error,
            angle_error: self.angle_error,
            rate_error: self.rate_error,
            delay: vehicle.latency.total(),
            sideslip_domain: self.sideslip_domain,
            guarantee: item(&GUARANTEES, self.guarantee),
            observer: self.observer,
            sideslip_bound: self.sideslip_bound,
            reference_rate: self.reference_rate,
            reference_acceleration: self.reference_acceleration,
            solver: self.solver.settings(),
        }
    }

    fn design(settings: Self::Settings) -> Result<Self::Controller, DesignError> {
        Crmpc::new(settings)
    }

    fn show(&mut self, memory: &Memory) {
        self.shown = Shown {
            angles: shown_vector(&memory.nominal.fixed_rows::<3>(0).into()),
            rates: shown_vector(&memory.nominal.fixed_rows::<3>(3).into()),
            in_force: memory.standing == Standing::InForce,
            standing: number(&STANDINGS, &memory.standing),
            rate_margin: shown(memory.margins.rate),
            moment_margin: shown(memory.margins.moment),
            disturbance: shown_vector(&memory.observed.disturbance),
            solver: SolverOutputs::from(&memory.report),
        };
    }

    fn warning(before: &Memory, after: &Memory) -> Option<&'static str> {
        // Said the first time only; `guarantee.status` shows the others.
        let ends = after.ended == 1 && before.ended == 0;
        match (before.standing, after.standing) {
            (_, Standing::Exceeded) if ends => Some(
                "the guarantee is no longer in force: the vehicle is further from the plan than disturbance.bound, inertia.error, estimation.*, measurement.age and delay explain",
            ),
            (Standing::None, Standing::Uncertified) => {
                Some("the guarantee is not in force: no plan keeps its conditions from the present state")
            }
            (Standing::None, Standing::Refused) => {
                Some("constraints = robust cannot be guaranteed with these settings; it runs as best effort")
            }
            _ => solver::warning(&before.report, &after.report),
        }
    }
}

#[cfg(test)]
impl CrmpcLaw {
    pub(crate) fn set_feedback(&mut self, k1: f64, k2: f64, period: f64) {
        self.feedback = Gain { k1, k2 };
        self.period_feedback = period;
    }

    pub(crate) fn solver_mut(&mut self) -> &mut SolverParameters {
        &mut self.solver
    }
}

type Controller = Table<Unit<CrmpcLaw>>;
type GainField = fn(&mut CrmpcLaw) -> &mut Gain;

fn schedule(table: Controller) -> Controller {
    let constraints = parameter("constraints", "Sets that the optimisation keeps the nominal motion in");
    let initial = parameter("initialState", "Where the nominal motion starts at each optimisation");
    let horizon = parameter("horizon", "Number of prediction steps");
    let optimisation = parameter(
        "period.optimisation",
        "Time between two optimisations and prediction step; a whole multiple of period.feedback",
    );
    let feedback = parameter("period.feedback", "Time between two evaluations of the feedback law");
    let table = table
        .enumeration(
            constraints,
            enumeration(
                "Constraints",
                "Sets that the optimisation keeps the nominal motion in",
                &CONSTRAINTS,
            ),
            |m| &mut m.law.constraints,
        )
        .enumeration(
            initial,
            enumeration("InitialState", "Where the nominal motion starts", &INITIAL_STATES),
            |m| &mut m.law.initial_state,
        )
        .integer(horizon, (Some(2), Some(1000)), |m| &mut m.law.horizon)
        .real(optimisation.real().unit(unit::time()).min(1e-3).max(10.0).nominal(0.2), |m| {
            &mut m.law.period_optimisation
        })
        .real(feedback.real().unit(unit::time()).min(1e-4).max(10.0).nominal(0.04), |m| {
            &mut m.law.period_feedback
        });
    solver::parameters(table, |law| &mut law.solver)
}

fn gains(table: Controller) -> Controller {
    let mut table = table::weights(table, |law| &mut law.p, |law| &mut law.q);
    let sets: [(&str, &str, GainField); 3] = [
        ("feedback", "feedback law K (20)", |law| &mut law.feedback),
        ("terminal", "terminal law (14)", |law| &mut law.terminal),
        ("tube", "paper's tube constant in (21)", |law| &mut law.tube),
    ];
    for (name, of, gain) in sets {
        let k1 =
            parameter(&format!("{name}.k1"), &format!("Gain on the angles of the {of}, negative")).real();
        let k2 = parameter(&format!("{name}.k2"), &format!("Gain on the rates of the {of}, negative")).real();
        table = table
            .real(k1.unit(unit::gain_angle()).max(0.0).nominal(5.0), move |m| &mut gain(&mut m.law).k1)
            .real(k2.unit(unit::gain_rate()).max(0.0).nominal(5.0), move |m| &mut gain(&mut m.law).k2);
    }
    table
}

fn bounds(table: Controller) -> Controller {
    let disturbance = parameter(
        "disturbance.bound",
        "Bound on each component of the disturbance of the angles' second derivatives that the sets are tightened for",
    );
    let inertia = parameter("inertia.error", "Relative inertia error that the robust set is tightened for");
    let angle_error = parameter(
        "estimation.angleError",
        "Bound on the error of each angle given that the robust set is tightened for; it changes no faster than estimation.rateError",
    );
    let rate_error = parameter(
        "estimation.rateError",
        "Bound on the error of the derivative of each angle, as it follows from what is given, that the robust set is tightened for",
    );
    let sideslip =
        parameter("bound.sideslip", "Sideslip angle up to which the bounds of the paper's design hold");
    let rate =
        parameter("bound.referenceRate", "Bound on the reference's rate in the paper's terminal set (13)");
    let acceleration = parameter(
        "bound.referenceAcceleration",
        "Bound on the reference's acceleration in the paper's terminal set (13)",
    );
    table
        .real(disturbance.real().unit(unit::angular_acceleration()).min(0.0).nominal(0.03), |m| {
            &mut m.law.disturbance_bound
        })
        .real(inertia.real().min(0.0).max(0.9).nominal(0.05), |m| &mut m.law.inertia_error)
        .real(sideslip.real().unit(unit::angle()).min(0.0).max(1.5).nominal(0.2), |m| {
            &mut m.law.sideslip_bound
        })
        .real(rate.real().unit(unit::angular_rate()).min(0.0).nominal(0.05), |m| &mut m.law.reference_rate)
        .real(acceleration.real().unit(unit::angular_acceleration()).min(0.0).nominal(0.02), |m| {
            &mut m.law.reference_acceleration
        })
        .real(angle_error.real().unit(unit::angle()).min(0.0).nominal(0.003), |m| &mut m.law.angle_error)
        .real(rate_error.real().unit(unit::angular_rate()).min(0.0).nominal(0.005), |m| &mut m.law.rate_error)
}

fn guarantee(table: Controller) -> Controller {
    let policy = "What happens where the robust set cannot be guaranteed";
    let sideslip = parameter("guarantee.sideslip", "Sideslip angle up to which the guarantee is given");
    let active = parameter(
        "observer.active",
        "Whether the robust set's reference is shifted by what the observed disturbance does to the vehicle",
    );
    let time = parameter("observer.timeConstant", "Time constant of the disturbance observer's filter");
    let stiffness =
        parameter("observer.stiffness", "Observed disturbance over the shift of the reference's angles");
    table
        .enumeration(
            parameter("guarantee.policy", policy),
            enumeration("GuaranteePolicy", policy, &GUARANTEES),
            |m| &mut m.law.guarantee,
        )
        .real(sideslip.real().unit(unit::angle()).min(0.0).max(0.8).nominal(0.3), |m| {
            &mut m.law.sideslip_domain
        })
        .boolean(active, |m| &mut m.law.observer.active)
        .real(time.real().unit(unit::time()).min(1e-3).max(100.0).nominal(0.2), |m| {
            &mut m.law.observer.time_constant
        })
        .real(stiffness.real().unit(unit::gain_angle()).min(1e-3).max(1e3).nominal(2.5), |m| {
            &mut m.law.observer.stiffness
        })
}

fn outputs(table: Controller) -> Controller {
    let sampled = |name: &str, text: &str| discrete_output(name, text).depends_on(sampled_inputs());
    let nominal = |axis: &str, meaning: &str| {
        let text = format!("Nominal {meaning} at the last tick");
        sampled(&format!("nominal.{axis}"), &text).real().unit(unit::angle()).nominal(0.1)
    };
    let rate = |axis: &str, meaning: &str| {
        let text = format!("Rate of the nominal {meaning} at the last tick");
        sampled(&format!("nominalRate.{axis}"), &text).real().unit(unit::angular_rate()).nominal(0.05)
    };
    let table = vector(table, ANGLES, nominal, |m| &mut m.law.shown.angles);
    let table = vector(table, ANGLES, rate, |m| &mut m.law.shown.rates);
    let standing = "Whether the guarantee of the robust set is in force at the last tick, and why not";
    let margin = |name: &str, limit: &str| {
        let text = format!(
            "What the plan leaves of the {limit} in its first interval beyond what is reserved, over the limit"
        );
        sampled(&format!("guarantee.{name}"), &text).real()
    };
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
        .enumeration(
            sampled("guarantee.status", standing),
            enumeration("GuaranteeStatus", standing, &STANDINGS),
            |m| &mut m.law.shown.standing,
        )
        .real(margin("rateMargin", "rate limit"), |m| &mut m.law.shown.rate_margin)
        .real(margin("momentMargin", "moment limit"), |m| &mut m.law.shown.moment_margin);
    let table = vector(table, ANGLES, observed, |m| &mut m.law.shown.disturbance);
    solver::outputs(table, |law| &mut law.shown.solver)
}
