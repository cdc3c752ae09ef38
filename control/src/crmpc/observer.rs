//! Observer that estimates the disturbance from the rates.

use super::settings::{InitialState, Settings};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use vehicle::dynamics::RigidBody;
use vehicle::kinematics;
use vehicle::math::exp_m1;

/// Largest size of the estimate, relative to the bound of the disturbance.
const BEYOND: f64 = 2.0;

/// Estimate of the disturbance Δ, with the data for the next one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Observed {
    /// Estimated disturbance Δ̂, rad/s².
    pub disturbance: Vector3<f64>,
    /// Angles and rates x_ω at the last tick and the acceleration commanded there; `None` before
    /// the first tick.
    last: Option<[Vector3<f64>; 3]>,
}

impl Observed {
    /// Updates the estimate with the rates x_ω at a tick. Their change beyond the commanded
    /// acceleration is the mean of Δ over the period. It is filtered by a first-order lag and
    /// limited to twice the bound of Δ.
    pub(super) fn observe(&mut self, s: &Settings, rates: &Vector3<f64>) {
        if let Some([_, before, commanded]) = self.last {
            let residual = (rates - before) / s.period_feedback - commanded;
            let weight = -exp_m1(-s.period_feedback / s.observer.time_constant);
            self.disturbance += (residual - self.disturbance) * weight;
            let bound = BEYOND * s.disturbance_bound;
            self.disturbance.apply(|value| *value = value.clamp(-bound, bound));
        }
    }

    /// Stores angles, rates and command for the next tick.
    pub(super) fn remember(&mut self, state: [&Vector3<f64>; 2], commanded: &Vector3<f64>) {
        self.last = Some([*state[0], *state[1], *commanded]);
    }

    /// Returns the acceleration commanded at the last tick, rad/s²; `None` before the first.
    pub(super) fn commanded(&self) -> Option<Vector3<f64>> {
        self.last.map(|[_, _, commanded]| commanded)
    }

    /// Returns the acceleration at the last tick without moment, rad/s²; `None` before the first.
    pub(super) fn without_moment(&self, body: &RigidBody) -> Option<Vector3<f64>> {
        self.last.map(|[angles, rates, _]| body.drift(&angles, &rates))
    }

    /// Replaces the stored command by the acceleration that `applied` (N m) gives.
    pub(super) fn limit(&mut self, body: &RigidBody, applied: &Vector3<f64>) {
        if let Some([angles, rates, commanded]) = &mut self.last {
            let u = kinematics::r(angles) * body.inverse * applied;
            *commanded = u + body.drift(angles, rates);
        }
    }

    /// Returns the shift of the reference's angles. Under a constant Δ the vehicle comes to rest
    /// beside the nominal motion, at a distance of Δ over a stiffness; the nominal motion must
    /// therefore come to rest at the same distance on the other side.
    pub(super) fn shift(&self, s: &Settings) -> Vector3<f64> {
        if !s.observer.active || s.initial_state == InitialState::Nominal {
            return Vector3::zeros();
        }
        -self.disturbance / s.observer.stiffness
    }
}
