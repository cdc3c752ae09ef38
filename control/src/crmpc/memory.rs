//! The state that CRMPC carries from tick to tick.

use super::horizon::PlanPoint;
use super::observer::Observed;
use super::plan::{Plan, Terms};
use super::supervision::{GuaranteeStatus, Supervision};
use crate::clone_in_place::clone_in_place;
use crate::controller::Scheduled;
use crate::error_dynamics::Gain;
use crate::report::SolverReport;
use nalgebra::{Vector3, Vector6};
use serde::{Deserialize, Serialize};
use settings::{Choice, Declared};
use vehicle::axes::ANGLES;

/// The state that CRMPC carries from tick to tick.
#[derive(Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Memory {
    /// Plan in force, which starts at the last optimisation.
    pub plan: Plan,
    /// Whether `plan` has been filled by an optimisation.
    pub started: bool,
    /// Outcome of the last optimisation.
    pub report: SolverReport,
    /// Known moment at the last tick, N m.
    pub known: Vector3<f64>,
    /// Rates that the turn of the trajectory adds at the last tick, rad/s.
    pub turn: Vector3<f64>,
    /// Limits that are scheduled at the last tick.
    pub scheduled: Scheduled,
    /// Largest recent bound on the disturbance, see [`Scheduled::disturbance_bound`], rad/s².
    pub recent_bound: f64,
    /// Terms of an earlier plan whose commands still act.
    pub acting: Acting,
    /// Nominal state (Θ̃, x̃_ω) at the last tick.
    pub nominal: Vector6<f64>,
    /// Whether the plan in force gives the guarantee, or the reason why not.
    pub guarantee: GuaranteeStatus,
    /// Reported status of the guarantee, which includes contradictions of its assumptions.
    pub supervision: Supervision,
    /// Margins to the limits that the plan in force leaves in its first interval.
    pub margins: Margins,
    /// Share of the moment limit that the design leaves to the plan at rest, see
    /// [`super::Assessment::moment_left`]; zero with the paper's set.
    pub moment_left: f64,
    /// Time of a large turn, see [`super::Design::turn_time`], s.
    pub turn_time: f64,
    /// Reference that the last optimisation tracks.
    pub tracked: Tracked,
    /// Optimisations for which the distance of the tracked reference stays halved, for each halving.
    pub halved_for: u32,
    /// Gain K of the feedback law.
    pub gain: Gain,
    /// Feedback ticks from the beginning of the nominal trajectory to the beginning of the plan in
    /// force.
    pub age: u32,
    /// Feedback ticks until a pending guarantee is in force.
    pub pending: u32,
    /// Estimate of the disturbance with its filter state.
    pub observed: Observed,
    /// Time at which the plan begins: that of its optimisation, later by the delay, s.
    pub planned: f64,
    /// The plan in force at [`super::points`] of its horizon; empty unless the settings ask for it.
    pub shown: Vec<PlanPoint>,
}

impl Memory {
    /// Returns whether the plan in force is certified and the vehicle no further from it than the
    /// assumptions explain.
    pub fn assured(&self) -> bool {
        self.guarantee.is_assured()
    }

    /// Makes room for the first plan, over `horizon` intervals.
    pub(super) fn start(&mut self, horizon: usize) {
        self.plan.resize(horizon);
        self.started = true;
    }
}

clone_in_place!([] Memory { plan, shown });

/// Terms of a plan that hold until the commands of the next one act.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Acting {
    /// The terms.
    pub terms: Terms,
    /// Ticks left, the present one included.
    pub ticks: u32,
}

impl Acting {
    pub(super) fn terms(&self) -> Option<Terms> {
        (self.ticks > 0).then_some(self.terms)
    }
}

/// Reason why a plan does not track the reference itself.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Choice)]
pub enum Instead {
    /// The reference itself is tracked.
    #[default]
    None,
    /// Its sideslip is too near to guarantee.sideslip or beyond, so that the nearest one that can be
    /// reached is tracked.
    Sideslip,
    /// It is far away, so that a point on the way to it is tracked.
    OnTheWay,
}

/// Reference that a plan tracks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Declared)]
pub struct Tracked {
    /// Reference that the plan tracks at its beginning: {}.
    #[setting(name = "", each = ANGLES, unit = "rad", nominal = 0.1)]
    pub angles: Vector3<f64>,
    /// Reason why this is not the reference itself.
    pub instead: Instead,
}

/// Margins that the first interval of a plan leaves to the limits, beyond the reserve for
/// deviations from the plan, as shares of the limits.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Declared)]
pub struct Margins {
    /// Unused share of limit.rate in the plan's first interval, after the reserve for deviations
    /// from the plan.
    #[setting(name = "rateMargin")]
    pub rate: f64,
    /// Unused share of limit.moment in the plan's first interval, after the reserve for deviations
    /// from the plan.
    #[setting(name = "momentMargin")]
    pub moment: f64,
}
