//! The common interface of the two constraint sets, `robust` and `paper`.

use super::memory::Memory;
use super::plan::Plan;
use super::planner::Planner;
use super::stages::Stages;
use crate::controller::{Explained, Measurement};
use crate::linearise::Linear;
use crate::mpc::{self, Bounded, NormConstraint};
use nalgebra::{Matrix3, Vector3, Vector6};
use vehicle::reference::Reference;

/// Relative tolerance in checks of constraints, for rounding.
pub(super) const ROUNDING: f64 = 1e-9;

/// The sets of the nominal trajectory, and all that depends on their choice: how a plan is found,
/// how it goes on beyond the horizon, and how the command is limited and supervised. What has a
/// default belongs to the guarantee, which the paper's sets do not give.
pub(super) trait ConstraintSet: Bounded<2> + Send {
    /// Stages of the horizon, into which the preview writes the references.
    fn stages_mut(&mut self) -> &mut Stages;

    /// Share by which a window of the horizon is wider than the violated intervals, at each end.
    fn window_margin(&self) -> f64;

    /// Returns the bounds of the last optimisation, which the optimiser holds if they depend on the
    /// trajectory.
    fn bounds(&self, held: &mpc::Bounds) -> Bounds;

    /// Returns the share of the moment limit that the design leaves to the plan at rest.
    fn moment_left(&self) -> f64 {
        0.0
    }

    /// Takes the rates x_ω (rad/s) that were measured at a tick, before it is planned.
    fn observe(&self, _memory: &mut Memory, _angle_rates: &Vector3<f64>) {}

    /// Returns the shift of the reference's angles, rad.
    fn shift(&self, _memory: &Memory) -> Vector3<f64> {
        Vector3::zeros()
    }

    /// Finds the plan that is followed from the measured state (Θ, x_ω) on. `first` says that there
    /// is no earlier plan.
    fn plan(
        &mut self,
        planner: &mut Planner,
        memory: &mut Memory,
        measured: &Vector6<f64>,
        first: bool,
    ) -> Planned;

    /// Returns the acceleration of the interval that is appended when the plan is shifted as in
    /// (31), rad/s².
    fn beyond_the_horizon(&self, plan: &Plan) -> Vector3<f64>;

    /// Prepares what the plan follows on for its next interval.
    fn move_on(&self, _plan: &mut Plan) {}

    /// Returns the acceleration that is commanded against the estimated disturbance, rad/s².
    fn compensation(&self, _memory: &Memory) -> Vector3<f64> {
        Vector3::zeros()
    }

    /// Returns the moment for an acceleration at angles and rates x_ω, N m.
    fn moment(
        &self,
        angles: &Vector3<f64>,
        angle_rates: &Vector3<f64>,
        acceleration: &Vector3<f64>,
    ) -> Vector3<f64>;

    /// Judges the guarantee by the command of a tick.
    fn supervise(&self, memory: &mut Memory, tick: &Tick);

    /// Returns the limit on the commanded moment, N m.
    fn limit(&self, memory: &Memory) -> f64;

    /// Returns the largest changes of the rates that the assumptions explain.
    fn explained(&self) -> Option<Explained> {
        None
    }
}

/// Outcome of planning.
pub(super) struct Planned {
    pub report: mpc::OptimiserReport,
    /// Whether a guarantee was given, but the vehicle was further from the plan than the
    /// assumptions explain.
    pub left_behind: bool,
}

/// Events of a tick.
pub(super) struct Tick<'a> {
    pub measured: &'a Measurement,
    /// Measured rates x_ω, rad/s.
    pub angle_rates: Vector3<f64>,
    /// Feedback ticks since the last optimisation.
    pub within: u64,
    /// Deviation of the angles and of the rates x_ω from the nominal state, rad and rad/s.
    pub deviation: [Vector3<f64>; 2],
    pub command: Command,
    /// See [`Planned::left_behind`].
    pub left_behind: bool,
}

/// Command of a tick.
pub(super) struct Command {
    /// Nominal acceleration a, rad/s².
    pub nominal: Vector3<f64>,
    /// Commanded acceleration, rad/s².
    pub commanded: Vector3<f64>,
    /// Commanded moment before its limit, N m.
    pub moment: Vector3<f64>,
}

/// An optimisation as data, for benchmarks and tests that solve the same problem by other means.
#[derive(Clone, Debug, PartialEq)]
pub struct Posed {
    /// First state (Θ̃, x̃_ω), rad and rad/s.
    pub start: Vector6<f64>,
    /// References at the prediction times, shifted by the observer.
    pub references: Vec<Reference>,
    /// Weights of the cost (10), sampled.
    pub cost: mpc::Cost<2>,
    /// Bounds of the last pass.
    pub bounds: Bounds,
    /// Trajectory of the errors about which the cone solver linearised the norm constraints.
    pub linearisation_point: mpc::ErrorTrajectory<2>,
}

/// The bounds of an optimisation.
#[derive(Clone, Debug, PartialEq)]
pub struct Bounds {
    /// Bounds at stages 1..=N: on ‖ω̃‖ with the robust set, on ‖x̃_ω‖ with the paper's, rad/s.
    pub rate: Vec<f64>,
    /// Bounds in intervals 0..N: on ‖m̃‖ (N m) with the robust set, on ‖ũ‖ (rad/s²) with the
    /// paper's.
    pub input: Vec<f64>,
    /// Radius ε of ‖Ẽ_N‖_G ≤ ε; only with the paper's set.
    pub terminal: Option<f64>,
}

/// Expresses ‖y‖ ≤ bound in terms of the tracking error and v = a − Θ̈_r.
pub(super) fn norm_constraint(y: &Linear, bound: f64) -> NormConstraint<2> {
    let share = 1.0 / bound;
    let mut by_angles = Matrix3::zeros();
    by_angles.fixed_view_mut::<3, 2>(0, 0).copy_from(&(y.by_angles * share));
    NormConstraint {
        value: y.value * share,
        by_state: [by_angles, y.by_rates * share],
        by_input: y.by_acceleration * share,
    }
}
