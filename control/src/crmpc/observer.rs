//! What the rates say of the disturbance.

use super::design::{Constraints, InitialState, Settings};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

/// The largest estimate over the bound of the disturbance.
const BEYOND: f64 = 2.0;

/// An estimate of Δ, and what the next one is made from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Observed {
    /// Δ̂, rad/s².
    pub disturbance: Vector3<f64>,
    /// x_ω at the last tick, and the acceleration commanded there; `None` before the first.
    last: Option<[Vector3<f64>; 2]>,
}

impl Observed {
    /// Takes in the rates x_ω at a tick: what they changed by beyond the commanded acceleration is Δ, on average over the period. Filtered by
    /// a lag of first order, and limited to twice what Δ should be.
    pub(super) fn observe(&mut self, s: &Settings, rates: &Vector3<f64>) {
        if s.constraints != Constraints::Robust {
            return;
        }
        if let Some([before, commanded]) = self.last {
            let residual = (rates - before) / s.period_feedback - commanded;
            let weight = -(-s.period_feedback / s.observer.time_constant).exp_m1();
            self.disturbance += (residual - self.disturbance) * weight;
            let bound = BEYOND * s.disturbance_bound;
            self.disturbance.apply(|value| *value = value.clamp(-bound, bound));
        }
    }

    /// For the next tick.
    pub(super) fn remember(&mut self, rates: &Vector3<f64>, commanded: &Vector3<f64>) {
        self.last = Some([*rates, *commanded]);
    }

    /// What is added to the angles of the reference: under a constant Δ the vehicle comes to rest away from the nominal motion by Δ over a stiffness, so
    /// that the nominal motion must come to rest as far on the other side.
    pub(super) fn shift(&self, s: &Settings) -> Vector3<f64> {
        if !s.observer.active
            || s.constraints != Constraints::Robust
            || s.initial_state == InitialState::Nominal
        {
            return Vector3::zeros();
        }
        -self.disturbance / s.observer.stiffness
    }
}
