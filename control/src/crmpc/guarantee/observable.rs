//! Largest observed disturbance that the assumptions explain.

use super::dynamics::Dynamics;
use super::mismatch::{relative, smallest_in_rates};
use super::parts::Parts;
use crate::crmpc::settings::Settings;
use crate::delay::ticks;
use nalgebra::Vector3;
use vehicle::math::{exp, exp_m1};

/// Number of means that are judged.
pub(in crate::crmpc) const MEANS: usize = 5;

/// Largest component of a first-order mean of the change of x_ω beyond the commanded acceleration,
/// as the assumptions explain it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::crmpc) struct Observable {
    /// Weight of the newest value in the mean.
    pub(in crate::crmpc) weight: f64,
    /// Part that may last (Δ̄, the mismatch, the effect of the inertia error in any direction, and
    /// that of the angle drift), and the part by the errors of predicted rates, rad/s².
    others: f64,
    /// Share of the mean acceleration by the commanded moments, by the common factor of the
    /// inertia.
    of_moment: f64,
}

impl Observable {
    /// Returns the explained part of each mean, the one with the observer's time constant first.
    /// The longer a time constant is (s), the less effect the errors of the measured rates have.
    pub(super) fn all(s: &Settings, dynamics: &Dynamics, parts: &Parts) -> [Self; MEANS] {
        [s.observer.time_constant, 0.5, 1.0, 3.0, 8.0]
            .map(|time_constant| Self::new(s, dynamics, parts, time_constant))
    }

    fn new(s: &Settings, dynamics: &Dynamics, parts: &Parts, time_constant: f64) -> Self {
        let Parts { mismatch, initial, .. } = parts;
        let elapsed = s.delay + s.period_feedback;
        let predicted = s.rate_error + mismatch.mispredicted * (1.0 + initial[1].excess);
        let lasting = s.disturbance_bound
            + parts.inertia.moments.any / smallest_in_rates(&dynamics.vehicle, dynamics.smallest)
            + mismatch.mean * (1.0 + initial[0].excess)
            + parts.drive.of_angle_drift;
        // The effect of a command shows later than the command, and is forgotten later.
        let late = ticks(s.delay, s.period_feedback) + 1;
        let remembered = exp(late as f64 * s.period_feedback / time_constant);
        Self {
            weight: -exp_m1(-s.period_feedback / time_constant),
            // Each prediction has its own error, and the mean shows their differences by no more.
            others: lasting + 2.0 * predicted / time_constant,
            of_moment: relative(s.inertia_error)
                * (1.0 + parts.inertia.turning * elapsed)
                * remembered,
        }
    }

    /// Returns the largest explained mean, rad/s², with the mean of the acceleration by the
    /// commanded moments in each component.
    pub(in crate::crmpc) fn largest(&self, by_moment: &Vector3<f64>) -> Vector3<f64> {
        (by_moment * self.of_moment).add_scalar(self.others)
    }
}
