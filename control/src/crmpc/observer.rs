//! Observer that estimates the disturbance from the rates, and the part that is explained.

use super::guarantee::Observable;
use super::settings::{InitialState, Settings};
use crate::consistency::Excess;
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
    /// Excess of the changes of x_ω beyond those by the commanded acceleration, rad/s.
    excess: Excess,
    /// Largest recent size of the acceleration by the commanded moment in each component, rad/s².
    by_moment: Vector3<f64>,
    /// Whether the assumptions do not explain the rates at the last tick.
    is_contradicted: bool,
    /// Angles and rates x_ω at the last tick and the acceleration commanded there; `None` before
    /// the first tick.
    last: Option<[Vector3<f64>; 3]>,
    /// Whether the measurement of the last tick was older than that.
    was_stale: bool,
}

impl Observed {
    /// Updates the estimate with the rates x_ω at a tick. Their change beyond the commanded
    /// acceleration is the mean of Δ over the period. It is filtered by a first-order lag and
    /// limited to twice the bound of Δ. `by_known` returns the acceleration by the known moment,
    /// which acts alone before the first command does. A measurement that is stale has its share in
    /// the mean, but is judged by no assumption.
    pub(super) fn observe(
        &mut self,
        s: &Settings,
        observable: &Observable,
        rates: &Vector3<f64>,
        is_stale: bool,
        by_known: impl FnOnce() -> Vector3<f64>,
    ) {
        self.is_contradicted = false;
        let was_stale = std::mem::replace(&mut self.was_stale, is_stale);
        let Some([angles, before, commanded]) = self.last else {
            self.by_moment = by_known().abs();
            return;
        };
        let residual = (rates - before) / s.period_feedback - commanded;
        let weight = -exp_m1(-s.period_feedback / s.observer.time_constant);
        self.disturbance += (residual - self.disturbance) * weight;
        let bound = BEYOND * s.disturbance_bound;
        self.disturbance.apply(|value| *value = value.clamp(-bound, bound));
        let by_moment = (commanded - s.body.drift(&angles, &before)).abs();
        self.by_moment = by_moment.sup(&(self.by_moment * observable.retained));
        if is_stale || was_stale {
            self.excess = Excess::default();
            return;
        }
        let allowed = observable.largest(&self.by_moment) * s.period_feedback;
        self.is_contradicted =
            !self.excess.add(&(residual * s.period_feedback), &allowed, observable.once);
    }

    /// Returns whether the assumptions explain all that was observed. Without a bound they explain
    /// nothing.
    pub(super) fn is_explained(&self, observable: &Observable) -> bool {
        observable.is_finite() && !self.is_contradicted
    }

    /// Stores angles, rates and commanded acceleration for the next tick.
    pub(super) fn remember(&mut self, last: [Vector3<f64>; 3]) {
        self.last = Some(last);
    }

    /// Replaces the stored command by the acceleration that `applied` (N m) gives.
    pub(super) fn limit(&mut self, body: &RigidBody, applied: &Vector3<f64>) {
        if let Some([angles, rates, commanded]) = &mut self.last {
            let u = kinematics::r(angles) * body.inverse * applied;
            *commanded = u + body.drift(angles, rates);
        }
    }

    /// Returns the shift of the reference's angles. Under a constant Δ the vehicle comes to rest
    /// beside the nominal trajectory, at a distance of Δ over a stiffness; the nominal trajectory
    /// must therefore come to rest at the same distance on the other side.
    pub(super) fn shift(&self, s: &Settings) -> Vector3<f64> {
        if !s.observer.active || s.initial_state == InitialState::Nominal {
            return Vector3::zeros();
        }
        -self.disturbance / s.observer.stiffness
    }
}
