//! Largest observed disturbance that the assumptions explain.

use super::dynamics::Dynamics;
use super::mismatch::{relative, smallest_in_rates};
use super::parts::Parts;
use crate::crmpc::settings::Settings;
use crate::delay::ticks;
use nalgebra::Vector3;
use vehicle::math::exp;

/// Time constant with which the acceleration by a moment is forgotten, s.
const FORGETTING: f64 = 1.0;

/// Largest change of x_ω, over any time, beyond that by the commanded acceleration, as the
/// assumptions explain it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::crmpc) struct Observable {
    /// Part that does not add up: the difference of the errors of two predicted rates, rad/s.
    pub(in crate::crmpc) once: f64,
    /// Share of the acceleration by a moment that is remembered one period later.
    pub(in crate::crmpc) retained: f64,
    /// Mean by Δ̄, the mismatch, the effect of the inertia error in any direction, and that of the
    /// angle drift, rad/s².
    lasting: f64,
    /// Share of the acceleration by the commanded moments in the same component, and in any
    /// direction, by the common factor of the inertia.
    of_moment: [f64; 2],
}

impl Observable {
    pub(super) fn new(s: &Settings, dynamics: &Dynamics, parts: &Parts) -> Self {
        let Parts { mismatch, initial, .. } = parts;
        let lasting = s.disturbance_bound
            + parts.inertia.moments.any / smallest_in_rates(&dynamics.vehicle, dynamics.smallest)
            + mismatch.mean * (1.0 + initial[0].excess)
            + parts.drive.of_angle_drift;
        // The effect of a command shows later than the command.
        let late = ticks(s.delay, s.period_feedback) as f64 * s.period_feedback;
        let share = relative(s.inertia_error) * exp(late / FORGETTING);
        let turned = parts.inertia.turning * (s.delay + s.period_feedback);
        Self {
            once: 2.0 * (s.rate_error + mismatch.mispredicted * (1.0 + initial[1].excess)),
            retained: exp(-s.period_feedback / FORGETTING),
            lasting,
            of_moment: [share, share * turned],
        }
    }

    /// Returns whether the assumptions bound what can be observed.
    pub(in crate::crmpc) fn is_finite(&self) -> bool {
        (self.once + self.lasting).is_finite()
    }

    /// Returns the largest explained mean of each component, rad/s², with the acceleration by the
    /// commanded moments in each component.
    pub(in crate::crmpc) fn largest(&self, by_moment: &Vector3<f64>) -> Vector3<f64> {
        let [along, any] = self.of_moment;
        (by_moment * along).add_scalar(self.lasting + any * by_moment.norm())
    }
}

#[cfg(test)]
mod tests {
    use crate::crmpc::guarantee::tighten;
    use crate::crmpc::settings::{Constraints, Settings};
    use crate::error_dynamics::Gain;
    use nalgebra::Vector3;

    /// Without other errors, what the rates may show at rest is little more than Δ̄.
    #[test]
    fn oracle_without_errors_only_the_disturbance_is_observed() {
        let feedback = Gain { k1: -1.5, k2: -4.0 };
        let exact = Settings { inertia_error: 0.0, feedback, ..Settings::new(Constraints::Robust) };
        for disturbance_bound in [0.005, 0.02, 0.035] {
            let (tightening, _) = tighten(&Settings { disturbance_bound, ..exact }).unwrap();
            let ratio = tightening.observable.largest(&Vector3::zeros()).x / disturbance_bound;
            assert!((1.0..1.1).contains(&ratio), "{disturbance_bound}: {ratio}");
        }
    }
}
