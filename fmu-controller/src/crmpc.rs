//! `CRMPC` as an FMU.

use crate::solver;
use control::crmpc::{
    Constraints, Contradiction, Crmpc, GuaranteeStatus, Margins, Memory, POINTS, PlanPoint,
    Settings, Supervision, Tracked, points,
};
use control::error::DesignError;
use control::report::SolverReport;
use controller_export::table::{shown, shown_vector};
use controller_export::{Law, Vehicle};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use settings::Declared;
use vehicle::axes::{ANGLES, Entry};

/// Share of the moment limit for the plan below which optimisations take several times as long
/// (docs/guarantee.md has iterations for other disturbance bounds).
const LITTLE_MOMENT: f64 = 0.1;

/// Outputs of CRMPC.
#[derive(Clone, Debug, Default, Serialize, Deserialize, Declared)]
pub struct CrmpcLaw {
    /// Nominal {} at the last tick.
    #[setting(name = "nominal", each = ANGLES, unit = "rad", nominal = 0.1)]
    angles: Vector3<f64>,
    /// Derivative of the nominal {} at the last tick.
    #[setting(name = "nominalRate", each = ANGLES, unit = "rad/s", nominal = 0.05)]
    rates: Vector3<f64>,
    /// Whether the guarantee of the robust set is in force at the last tick.
    #[setting(name = "guarantee.inForce")]
    in_force: bool,
    #[setting(name = "guarantee")]
    supervision: Supervision,
    #[setting(name = "guarantee")]
    margins: Margins,
    #[setting(name = "tracked")]
    tracked: Tracked,
    /// Share of limit.moment that remains for the plan at rest, after the reserve for disturbances,
    /// errors and delay.
    #[setting(name = "guarantee.momentLeft")]
    moment_left: f64,
    /// Time of a turn by 120 deg from rest to rest with what the reserves leave of limit.moment and
    /// limit.rate; a reference that is that far away is reached about so late.
    #[setting(name = "guarantee.turnTime", unit = "s", nominal = 30.0)]
    turn_time: f64,
    /// Largest error of the measured angles that the guarantee allows, fast and slow together; 0 if
    /// the constraints give none.
    #[setting(name = "guarantee.angleError", unit = "rad", nominal = 0.01)]
    angle_error: f64,
    /// Gain K of the feedback law in force: factor on the {}.
    #[setting(name = "feedback.gain", each = GAINS, units = ["1/s2", "1/s"], nominal = 5.0)]
    gain: [f64; 2],
    /// Observer's estimate of the disturbance of the second derivative of the {}.
    #[setting(name = "disturbanceEstimate", each = ANGLES, unit = "rad/s2", nominal = 0.03)]
    disturbance: Vector3<f64>,
    #[setting(name = "solver")]
    report: SolverReport,
    // As locals, these variables need no ports in block diagrams.
    #[setting(local, depends_on = [])]
    plan: ShownPlan,
}

const GAINS: [Entry; 2] = [(".k1", "angle"), (".k2", "rate")];

/// The plan in force, if the settings ask for it.
#[derive(Clone, Debug, Default, Serialize, Deserialize, Declared)]
struct ShownPlan {
    /// Time at which the plan begins, later than its optimisation by the delay; 0 unless plan.shown.
    #[setting(unit = "s", nominal = 10.0)]
    began: f64,
    #[setting(name = "")]
    points: [ShownPoint; POINTS],
}

/// One point of the plan.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize, Declared)]
struct ShownPoint {
    /// Time from plan.began to this point of the plan.
    #[setting(unit = "s")]
    time: f64,
    #[setting(name = "")]
    norms: PlanPoint,
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
        self.tracked = Tracked { angles: shown_vector(&memory.tracked.angles), ..memory.tracked };
        self.moment_left = shown(memory.moment_left);
        self.turn_time = shown(memory.turn_time);
        self.angle_error = match settings.constraints {
            Constraints::Robust => settings.angle_error + settings.slow_angle_error,
            Constraints::Paper => 0.0,
        };
        self.gain = [memory.gain.k1, memory.gain.k2];
        self.disturbance = shown_vector(&memory.observed.disturbance);
        self.report = solver::shown_report(&memory.report);
    }

    fn warning(before: &Memory, after: &Memory) -> Option<&'static str> {
        // The warning is given the first time only; `guarantee.status` shows later times.
        let (earlier, now) = (&before.supervision, &after.supervision);
        if now.ended == 1 && earlier.ended == 0 {
            return Some(match now.contradiction {
                Contradiction::Step => {
                    "the guarantee is no longer in force: a tick used inputs that had been set before it"
                }
                Contradiction::Delay => {
                    "the guarantee is no longer in force: the loop delay differs from delay + measurement.age by more than half a period"
                }
                Contradiction::Disturbance => {
                    "the guarantee is no longer in force: the observed disturbance is larger than disturbance.bound, inertia.error and estimation.rateError allow with the given delay"
                }
                Contradiction::Motion => {
                    "the guarantee is no longer in force: the measured angles have not moved as the measured rates say"
                }
                Contradiction::KnownMoment => {
                    "the guarantee is no longer in force: knownMoment.* is larger than knownMoment.bound, or has changed by more than knownMoment.change while a plan was followed"
                }
                Contradiction::Schedule => {
                    "the guarantee is no longer in force: scheduled.limitMoment has fallen, or scheduled.disturbanceBound risen, by more than the plan reserves"
                }
                Contradiction::Errors => {
                    "the guarantee is no longer in force: scheduled.angleError is larger than estimation.angleError and estimation.slowAngleError together"
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
        let steps = points(settings.horizon).into_iter().zip(&memory.shown);
        for (point, (step, norms)) in self.points.iter_mut().zip(steps) {
            point.time = step as f64 * settings.period_optimisation;
            point.norms = PlanPoint {
                rate: shown(norms.rate),
                rate_bound: shown(norms.rate_bound),
                moment: shown(norms.moment),
                moment_bound: shown(norms.moment_bound),
            };
        }
    }
}
