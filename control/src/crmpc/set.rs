//! An optimisation as data, and the parts that the constraint sets `robust` and `paper` share.

use crate::linearise::Linear;
use crate::mpc::{self, NormConstraint};
use nalgebra::{Matrix3, Vector6};
use vehicle::reference::Reference;

/// Relative tolerance in checks of constraints, for rounding.
pub(super) const ROUNDING: f64 = 1e-9;

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
