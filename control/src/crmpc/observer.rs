//! Observer that estimates the disturbance from the rates, and the part that is explained.

use super::guarantee::{MEANS, Observable};
use super::settings::{InitialState, Settings};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use vehicle::dynamics::RigidBody;
use vehicle::kinematics;

/// Largest size of the estimate, relative to the bound of the disturbance.
const BEYOND: f64 = 2.0;
/// Largest size of a judged mean relative to what the assumptions explain. It is above 1, so that
/// they can be contradicted, and bounded, so that the mean returns soon after a fault.
const ABOVE: f64 = 1.5;

/// Means of the observed quantities, by a first-order filter.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
struct Mean {
    /// Change of x_ω beyond the commanded acceleration, rad/s².
    residual: Vector3<f64>,
    /// Size of the acceleration by the commanded moment in each component, rad/s².
    by_moment: Vector3<f64>,
}

impl Mean {
    fn explained(&self, observable: &Observable) -> Vector3<f64> {
        observable.largest(&self.by_moment)
    }
}

/// Estimate of the disturbance Δ, with the data for the next one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Observed {
    /// Estimated disturbance Δ̂, rad/s².
    pub disturbance: Vector3<f64>,
    /// Means by which the assumptions are judged, the one with the observer's time constant first.
    means: [Mean; MEANS],
    /// Angles and rates x_ω at the last tick and the acceleration commanded there; `None` before
    /// the first tick.
    last: Option<[Vector3<f64>; 3]>,
}

impl Observed {
    /// Updates the estimate with the rates x_ω at a tick. Their change beyond the commanded
    /// acceleration is the mean of Δ over the period. It is filtered by a first-order lag and
    /// limited to twice the bound of Δ.
    pub(super) fn observe(
        &mut self,
        s: &Settings,
        observable: &[Observable; MEANS],
        rates: &Vector3<f64>,
    ) {
        let Some([angles, before, commanded]) = self.last else { return };
        let residual = (rates - before) / s.period_feedback - commanded;
        self.disturbance += (residual - self.disturbance) * observable[0].weight;
        let bound = BEYOND * s.disturbance_bound;
        self.disturbance.apply(|value| *value = value.clamp(-bound, bound));
        let by_moment = (commanded - s.body.drift(&angles, &before)).abs();
        for (mean, observable) in self.means.iter_mut().zip(observable) {
            let weight = observable.weight;
            mean.by_moment += (by_moment - mean.by_moment) * weight;
            mean.residual += (residual - mean.residual) * weight;
            let bound = mean.explained(observable) * ABOVE;
            mean.residual = mean.residual.sup(&-bound).inf(&bound);
        }
    }

    /// Returns whether the assumptions explain all that was observed. Without a bound they explain
    /// nothing.
    pub(super) fn is_explained(&self, observable: &[Observable; MEANS]) -> bool {
        self.means.iter().zip(observable).all(|(mean, observable)| {
            let explained = mean.explained(observable);
            (0..3).all(|i| explained[i].is_finite() && mean.residual[i].abs() <= explained[i])
        })
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
