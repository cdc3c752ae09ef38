//! The published settings, from `data/crmpc-2022.toml`.

use super::settings::{Constraints, Guarantee, InitialState, ObserverSettings, Settings};
use crate::error_dynamics::Gain;
use crate::mpc::SolverSettings;
use serde::Deserialize;
use std::sync::LazyLock;
use vehicle::data;
use vehicle::scenario::Scenario;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    weights: Weights,
    schedule: Schedule,
    gains: Gains,
    bounds: Bounds,
    guarantee: Robust,
    solver: Solver,
    published: Published,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Weights {
    p: [f64; 6],
    q: [f64; 3],
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Schedule {
    horizon: usize,
    period_optimisation: f64,
    period_feedback: f64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Gains {
    feedback: Gain,
    terminal: Gain,
    tube: Gain,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Bounds {
    inertia_error: f64,
    sideslip_deg: f64,
    reference_rate_deg_s: f64,
    reference_acceleration_deg_s2: f64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Robust {
    feedback: Gain,
    sideslip_deg: f64,
    observer_time_constant: f64,
    observer_stiffness: f64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Solver {
    max_iterations: u32,
}

/// The constants that Chai 2022, section 5.1 prints for its own design.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Published {
    /// Terminal weight G per axis: G11, G12, G22.
    pub g: [f64; 3],
    /// Bound r̄₀ as printed.
    pub r0: f64,
    /// Bound r̄₁ as printed.
    pub r1: f64,
    /// Bound Ω̄ as printed.
    pub omega: f64,
    /// Condition number Ī·Ī′ as printed.
    pub condition: f64,
    /// Peak c̄ of the step response as printed.
    pub c: f64,
    /// Terminal radius ε₁ as printed.
    pub epsilon1: f64,
    /// Terminal radius ε₂ as printed.
    pub epsilon2: f64,
}

fn embedded() -> &'static File {
    static READ: LazyLock<File> = LazyLock::new(|| {
        data::embedded("crmpc-2022.toml", include_str!("../../data/crmpc-2022.toml"))
    });
    &READ
}

impl Settings {
    /// Returns the settings of Chai 2022, section 5.1, with its vehicle at the nominal inertia and
    /// measured initial state. With the robust set, K is ours.
    #[allow(clippy::missing_panics_doc)]
    pub fn new(constraints: Constraints) -> Self {
        let scenario = Scenario::crmpc2022();
        // This cannot fail: the scenario's own tests read its inertia.
        let body = scenario.inertia.body(1.0).unwrap_or_else(|error| panic!("{error}"));
        let File { weights, schedule, gains, bounds, guarantee, solver, .. } = embedded();
        Self {
            body,
            limit_rate: scenario.limit_rate,
            limit_moment: scenario.limit_moment,
            constraints,
            initial_state: InitialState::Measured,
            horizon: schedule.horizon,
            period_optimisation: schedule.period_optimisation,
            period_feedback: schedule.period_feedback,
            p: weights.p,
            q: weights.q,
            feedback: match constraints {
                Constraints::Robust => guarantee.feedback,
                Constraints::Paper => gains.feedback,
            },
            terminal: gains.terminal,
            tube: gains.tube,
            disturbance_bound: scenario.disturbance.bound,
            inertia_error: bounds.inertia_error,
            tensor_error: 0.0,
            angle_error: 0.0,
            rate_error: 0.0,
            delay: 0.0,
            delay_error: 0.0,
            sideslip_domain: guarantee.sideslip_deg.to_radians(),
            guarantee: Guarantee::Required,
            observer: ObserverSettings {
                active: true,
                time_constant: guarantee.observer_time_constant,
                stiffness: guarantee.observer_stiffness,
            },
            sideslip_bound: bounds.sideslip_deg.to_radians(),
            reference_rate: bounds.reference_rate_deg_s.to_radians(),
            reference_acceleration: bounds.reference_acceleration_deg_s2.to_radians(),
            solver: SolverSettings::new(solver.max_iterations),
        }
    }
}

impl Published {
    /// Returns the printed constants.
    pub fn crmpc2022() -> Self {
        embedded().published
    }
}
