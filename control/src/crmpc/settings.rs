//! Settings of CRMPC, with the published ones from `data/crmpc-2022.toml`.

use crate::error_dynamics::Gain;
use crate::mpc::SolverSettings;
use serde::{Deserialize, Serialize};
use settings::{Choice, Declared};
use std::sync::LazyLock;
use toml::Table;
use vehicle::axes::{NUMBERED_ANGLES, NUMBERED_STATE};
use vehicle::data;
use vehicle::dynamics::RigidBody;
use vehicle::scenario::Scenario;

/// Constraint sets of the optimisation for the nominal trajectory.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Choice)]
#[serde(rename_all = "camelCase")]
pub enum Constraints {
    /// Limits limit.rate and limit.moment, tightened by the largest possible deviations from the
    /// nominal trajectory.
    #[default]
    Robust,
    /// Sets as printed in the paper, which do not imply the limits.
    ///
    /// These are ‖x_ω‖ ≤ x̄_tube and ‖u‖ ≤ ū_tube of (21).
    Paper,
}

/// Initial state of the nominal trajectory at each optimisation.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Choice)]
#[serde(rename_all = "camelCase")]
pub enum InitialState {
    /// Measured state.
    #[default]
    Measured,
    /// State predicted by the previous plan; at the first optimisation the measured state.
    ///
    /// The nominal trajectory then never depends on a disturbance, and the deviation obeys the
    /// error dynamics (22) alone.
    Nominal,
}

/// Reaction to settings for which the robust set gives no guarantee.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Choice)]
#[serde(rename_all = "camelCase")]
#[setting(name = "GuaranteePolicy")]
pub enum Guarantee {
    /// The settings are refused at initialization.
    #[default]
    Required,
    /// The controller runs without a guarantee.
    ///
    /// The constraints are tightened as far as there is room.
    BestEffort,
}

/// Settings of the disturbance observer, which shifts the reference of the nominal trajectory so
/// that the vehicle comes to rest on the reference.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Declared)]
pub struct ObserverSettings {
    /// Whether the reference is shifted to cancel the steady deviation that the observed
    /// disturbance causes.
    #[setting(used_with = "constraints = robust")]
    pub active: bool,
    /// Time constant of the disturbance observer's filter.
    #[setting(unit = "s", min = 1e-3, max = 100.0, nominal = 0.2)]
    #[setting(used_with = "constraints = robust and observer.active = true")]
    pub time_constant: f64,
    /// Ratio of the estimated disturbance to the resulting shift of the reference angles.
    ///
    /// This is k in the shift −Δ̂/k.
    #[setting(unit = "1/s2", min = 1e-3, max = 1e3, nominal = 2.5)]
    #[setting(used_with = "constraints = robust and observer.active = true")]
    pub stiffness: f64,
}

/// All settings of CRMPC. Units are SI, angles in rad.
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
    /// Time from a measurement until the resulting moment acts, s. The law receives the state
    /// predicted for that instant.
    #[setting(skip)]
    pub delay: f64,
    #[allow(missing_docs)] // Its type says what it is.
    pub constraints: Constraints,
    #[allow(missing_docs)]
    pub initial_state: InitialState,
    /// Number of prediction steps.
    #[setting(min = 2, max = 1000)]
    pub horizon: usize,
    /// Sampling period of the optimisation and length of a prediction step; a whole multiple of
    /// period.feedback.
    #[setting(name = "period.optimisation", unit = "s", min = 1e-3, max = 10.0, nominal = 0.2)]
    pub period_optimisation: f64,
    /// Sampling period of the feedback law.
    #[setting(name = "period.feedback", unit = "s", min = 1e-4, max = 10.0, nominal = 0.04)]
    pub period_feedback: f64,
    #[allow(missing_docs)]
    pub solver: SolverSettings,
    /// Weight P on the tracking error and on its derivative, diagonal.
    #[setting(name = "weight.P", each = NUMBERED_STATE, min = 0.0, nominal = 50.0)]
    pub p: [f64; 6],
    /// Weight Q on the second derivative of the tracking error, diagonal.
    #[setting(name = "weight.Q", each = NUMBERED_ANGLES, above = 0.0, nominal = 10.0)]
    pub q: [f64; 3],
    /// Gain K of the feedback law (20), by rule if both factors are 0.
    pub feedback: Gain,
    /// Gain K~ of the terminal law (14).
    #[setting(file)]
    pub terminal: Gain,
    /// Gain for the paper's tube constant in (21).
    #[setting(used_with = "constraints = paper", file)]
    pub tube: Gain,
    /// Bound on each component of the disturbance of the angles' second derivatives; the
    /// constraint sets are tightened for it.
    #[setting(name = "disturbance.bound", unit = "rad/s2", min = 0.0, nominal = 0.03)]
    pub disturbance_bound: f64,
    /// Bound on the relative error of the inertia as a common factor of the tensor; the robust set
    /// is tightened for it.
    #[setting(name = "inertia.error", min = 0.0, max = 0.9, nominal = 0.05)]
    #[setting(used_with = "constraints = robust")]
    pub inertia_error: f64,
    /// Bound on the relative error of the inertia tensor in all six entries, besides the common
    /// factor; the robust set is tightened for it.
    ///
    /// It bounds ‖I^−½ (I_v − I) I^−½‖.
    #[setting(name = "inertia.tensorError", min = 0.0, max = 0.9, nominal = 0.05)]
    #[setting(used_with = "constraints = robust")]
    pub tensor_error: f64,
    /// Largest magnitude of the sideslip angle for which the bounds of the paper's design hold.
    #[setting(name = "bound.sideslip", unit = "rad", min = 0.0, max = 1.5, nominal = 0.2)]
    #[setting(used_with = "constraints = paper")]
    #[setting(file)]
    pub sideslip_bound: f64,
    /// Bound on the norm of the reference's first derivative in the paper's terminal set (13).
    #[setting(name = "bound.referenceRate", unit = "rad/s", min = 0.0, nominal = 0.05)]
    #[setting(used_with = "constraints = paper")]
    #[setting(file)]
    pub reference_rate: f64,
    /// Bound on the norm of the reference's second derivative in the paper's terminal set (13).
    #[setting(name = "bound.referenceAcceleration", unit = "rad/s2", min = 0.0, nominal = 0.02)]
    #[setting(used_with = "constraints = paper")]
    #[setting(file)]
    pub reference_acceleration: f64,
    /// Bound on the measurement error of each angle beside its slow part, which may change
    /// arbitrarily from tick to tick; the robust set is tightened for it.
    #[setting(
        name = "estimation.angleError",
        unit = "rad",
        min = 0.0,
        below = 1.0,
        nominal = 0.003
    )]
    #[setting(used_with = "constraints = robust")]
    pub angle_error: f64,
    /// Bound on the error of each angle's derivative as computed from the measurements, which may
    /// change arbitrarily from tick to tick; the robust set is tightened for it.
    #[setting(
        name = "estimation.rateError",
        unit = "rad/s",
        min = 0.0,
        below = 1.0,
        nominal = 0.005
    )]
    #[setting(used_with = "constraints = robust")]
    pub rate_error: f64,
    /// Bound on the slow part of the measurement error of angle of attack and of sideslip; the
    /// robust set is tightened for it. That of the bank angle may have any size.
    #[setting(
        name = "estimation.slowAngleError",
        unit = "rad",
        min = 0.0,
        max = 0.1,
        nominal = 0.005
    )]
    #[setting(used_with = "constraints = robust")]
    pub slow_angle_error: f64,
    /// Bound on the rate at which the slow part of each angle's measurement error changes; the
    /// robust set is tightened for it.
    #[setting(
        name = "estimation.slowAngleRate",
        unit = "rad/s",
        min = 0.0,
        below = 1.0,
        nominal = 0.001
    )]
    #[setting(used_with = "constraints = robust")]
    pub slow_angle_rate: f64,
    /// Bound on the change of the trajectory's turn, as given by the inputs trajectory.*, while a
    /// plan is followed, which is one period.optimisation or longer. The plan reserves it and the
    /// turn's own rate of limit.rate; without a turn it reserves nothing.
    #[setting(name = "trajectory.turnChange", unit = "rad/s", min = 0.0, nominal = 0.002)]
    #[setting(used_with = "constraints = robust")]
    #[setting(file)]
    pub turn_change: f64,
    /// Bound on the norm of the known moment; the robust set is tightened for it.
    #[setting(name = "knownMoment.bound", unit = "N.m", min = 0.0, nominal = 1e4)]
    #[setting(used_with = "constraints = robust")]
    pub known_bound: f64,
    /// Bound on the norm of the change of the known moment while a plan is followed, which is one
    /// period.optimisation or longer; the robust set is tightened for it.
    #[setting(name = "knownMoment.change", unit = "N.m", min = 0.0, nominal = 1e3)]
    #[setting(used_with = "constraints = robust")]
    pub known_change: f64,
    /// Bound on the fall of scheduled.limitMoment while a plan is followed, which is one
    /// period.optimisation or longer; the plan reserves it of that limit.
    #[setting(name = "scheduled.limitMomentFall", unit = "N.m", min = 0.0, nominal = 1e3)]
    #[setting(used_with = "constraints = robust")]
    pub limit_fall: f64,
    /// Number of bounds on the disturbance for which the robust set is designed: disturbance.bound
    /// times 1, and equal parts of it. A plan takes one that leaves scheduled.disturbanceBound room
    /// to rise by one part while it is followed.
    #[setting(name = "scheduled.disturbanceParts", min = 1, max = 16)]
    #[setting(used_with = "constraints = robust")]
    pub disturbance_parts: usize,
    #[allow(missing_docs)]
    #[setting(name = "guarantee.policy", used_with = "constraints = robust")]
    pub guarantee: Guarantee,
    /// Largest magnitude of the sideslip angle for which the guarantee is given.
    #[setting(name = "guarantee.sideslip", unit = "rad", min = 0.0, max = 0.8, nominal = 0.3)]
    #[setting(used_with = "constraints = robust")]
    pub sideslip_domain: f64,
    #[allow(missing_docs)]
    #[setting(file)]
    pub observer: ObserverSettings,
    /// Whether the variables plan.* are computed at each optimisation.
    #[setting(name = "plan.shown")]
    pub shows_plan: bool,
}

/// The gains K that are taken where none is set.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Rule {
    paper: Vec<Gain>,
    robust: Vec<Gain>,
    /// Share of the moment that a gain has to leave, so that no further one is tried.
    pub(super) reserve: f64,
}

impl Rule {
    pub(super) fn candidates(&self, constraints: Constraints) -> &[Gain] {
        match constraints {
            Constraints::Robust => &self.robust,
            Constraints::Paper => &self.paper,
        }
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    settings: Table,
    paper: Table,
    feedback: Rule,
}

const FILE: &str = "crmpc-2022.toml";

fn embedded() -> &'static File {
    static READ: LazyLock<File> =
        LazyLock::new(|| data::embedded(FILE, include_str!("../../data/crmpc-2022.toml")));
    &READ
}

pub(super) fn rule() -> &'static Rule {
    &embedded().feedback
}

impl Settings {
    /// Returns the largest moment of the actuators and the known moment together, N m.
    pub fn limit_total(&self) -> f64 {
        self.limit_moment + self.known_bound
    }

    /// Returns the number of equal parts of disturbance.bound by which a scheduled bound may rise
    /// while a plan is followed, and by which it may have fallen over the time before that has an
    /// effect: the mismatch of a command that was measured up to `delay` + `period.feedback` before
    /// the measurement of a plan, which is up to `delay` old.
    pub fn parts_to_spare(&self) -> f64 {
        let past = 2.0 * self.delay + self.period_feedback;
        (past / self.period_optimisation).ceil().max(1.0)
    }

    /// Returns the part of limit.moment that the known moment may need at any time, N m.
    pub fn needed_by_known(&self) -> f64 {
        self.known_bound + self.known_change
    }

    /// Returns the settings of Chai 2022, section 5.1, with its vehicle at the nominal inertia and
    /// measured initial state. K is left to the rule, see [`Settings::resolved`].
    #[allow(clippy::missing_panics_doc)]
    pub fn new(constraints: Constraints) -> Self {
        let scenario = Scenario::crmpc2022();
        let mut settings = Self {
            // This cannot fail: the scenario's own tests read its inertia.
            body: scenario.inertia.body(1.0).unwrap_or_else(|error| panic!("{error}")),
            limit_rate: scenario.limit_rate,
            limit_moment: scenario.limit_moment,
            disturbance_bound: scenario.disturbance.bound,
            ..Self::default()
        };
        let file = embedded();
        data::set(&mut settings, FILE, &file.settings);
        if constraints == Constraints::Paper {
            data::set(&mut settings, FILE, &file.paper);
        }
        settings
    }
}
