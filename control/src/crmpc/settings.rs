//! Settings of CRMPC.

use crate::error_dynamics::Gain;
use crate::mpc::SolverSettings;
use serde::{Deserialize, Serialize};
use vehicle::dynamics::RigidBody;

/// Choice of the sets within which the optimisation keeps the nominal motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "camelCase")]
pub enum Constraints {
    /// Bounds on ‖ω‖ and ‖m‖ themselves, tightened stage by stage by what the sampled error
    /// dynamics can reach.
    Robust,
    /// Bounds ‖x_ω‖ ≤ x̄_tube and ‖u‖ ≤ ū_tube as printed.
    Paper,
}

/// Choice of the state from which the nominal motion starts at a sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "camelCase")]
pub enum InitialState {
    /// The nominal motion starts at the measured state.
    Measured,
    /// The nominal motion starts anywhere with the measured state inside an invariant set around
    /// it.
    Tube,
    /// The nominal motion starts where the previous plan predicted it, the first time at the
    /// measured state. It then never depends on a disturbance, and the deviation obeys the error
    /// dynamics (22) alone.
    Nominal,
}

/// Reaction to settings for which the design of the robust set does not hold.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "camelCase")]
pub enum Guarantee {
    /// The settings are refused with an error.
    #[default]
    Required,
    /// The controller runs, tightened as far as there is room, and reports that nothing is
    /// guaranteed.
    BestEffort,
}

/// Settings of the disturbance observer, which shifts the reference of the nominal motion so that
/// the vehicle comes to rest on the reference.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ObserverSettings {
    /// Whether the reference is shifted.
    pub active: bool,
    /// Time constant of the observer's filter, s.
    pub time_constant: f64,
    /// Stiffness k in the shift −Δ̂/k of the reference's angles, 1/s².
    pub stiffness: f64,
}

/// All settings of CRMPC. Units are SI, angles in rad.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Settings {
    /// Model of the vehicle that the controller uses.
    pub body: RigidBody,
    /// Limit on ‖ω‖, rad/s.
    pub limit_rate: f64,
    /// Limit on ‖m‖, N m.
    pub limit_moment: f64,
    /// Choice of the constraint sets.
    pub constraints: Constraints,
    /// Choice of the initial state of the nominal motion.
    pub initial_state: InitialState,
    /// Number of prediction steps N.
    pub horizon: usize,
    /// Optimisation period h, s; a whole multiple of the feedback period.
    pub period_optimisation: f64,
    /// Period of the feedback law, s.
    pub period_feedback: f64,
    /// Diagonal of the weight P: angles, then rates.
    pub p: [f64; 6],
    /// Diagonal of the weight Q on the input.
    pub q: [f64; 3],
    /// Gain K of the feedback law (20).
    pub feedback: Gain,
    /// Gain K̃ of the terminal law (14).
    pub terminal: Gain,
    /// Gain with which the paper's c̄ is computed.
    pub tube: Gain,
    /// Disturbance bound Δ̄ per component of x_ω, rad/s².
    pub disturbance_bound: f64,
    /// Relative inertia error that the robust set tolerates if it is a common factor of the tensor.
    pub inertia_error: f64,
    /// Bound on ‖I^−½ (I_v − I) I^−½‖, the relative error of the tensor of inertia in all six
    /// entries that the robust set tolerates besides the common factor.
    pub tensor_error: f64,
    /// Bound on the error of each measured angle, rad. The error may take any value within it at
    /// each tick.
    pub angle_error: f64,
    /// Bound on the error of each measured component of x_ω, rad/s. The error may take any value
    /// within it at each tick.
    pub rate_error: f64,
    /// Time from a measurement until the resulting moment acts, s. The law receives the state
    /// predicted for that instant.
    pub delay: f64,
    /// Largest amount by which the true delay, a constant that nobody knows, differs from `delay`,
    /// s; the robust set is tightened for it.
    pub delay_error: f64,
    /// Largest |β| for which the robust set gives its guarantee, rad.
    pub sideslip_domain: f64,
    /// Reaction to settings for which the design of the robust set does not hold.
    pub guarantee: Guarantee,
    /// Observer of the disturbance; used by the robust set only.
    pub observer: ObserverSettings,
    /// Largest |β| for which the paper's bounds of Lemma 1 are computed, rad.
    pub sideslip_bound: f64,
    /// Bound Θ̄₁ on ‖Θ̇_r‖, rad/s.
    pub reference_rate: f64,
    /// Bound Θ̄₂ on ‖Θ̈_r‖, rad/s².
    pub reference_acceleration: f64,
    /// Settings of the solvers of the optimisation.
    pub solver: SolverSettings,
}
