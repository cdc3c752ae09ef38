//! What the assumptions explain of the disturbance that is observed.

use super::dynamics::Dynamics;
use super::mismatch::smallest_in_rates;
use super::parts::Parts;
use crate::crmpc::settings::Settings;
use crate::delay::ticks;
use vehicle::math::exp;

/// Largest component of a first-order mean of the change of x_ω beyond the commanded acceleration,
/// as the assumptions explain it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::crmpc) struct Observable {
    /// Part that may last: Δ̄, the mismatch, and what the inertia error does in any direction,
    /// rad/s².
    lasting: f64,
    /// Part by the errors of predicted rates, rad/s. Each prediction has its own error, and a mean
    /// over the time T shows their differences by no more than this over T.
    of_errors: f64,
    /// Share of the acceleration by the moment that the common factor of the inertia causes.
    share: f64,
    /// Growth of a disturbance in what is observed of it.
    growth: f64,
    /// Longest time from the tick of a command to the last measurement that shows what it does, s.
    late: f64,
}

impl Observable {
    pub(super) fn new(s: &Settings, dynamics: &Dynamics, parts: &Parts) -> Self {
        let Parts { mismatch, early, .. } = parts;
        let predicted = s.rate_error + mismatch.mispredicted * (1.0 + early[1].excess);
        let elapsed = s.delay + s.period_feedback;
        let common = s.inertia_error / (1.0 - s.inertia_error);
        let ticks = ticks(s.delay + s.delay_error, s.period_feedback) + 1;
        Self {
            lasting: s.disturbance_bound
                + parts.any_moment / smallest_in_rates(&dynamics.vehicle, dynamics.smallest)
                + mismatch.mean * (1.0 + early[0].excess),
            of_errors: 2.0 * predicted,
            share: common * (1.0 + parts.turning * elapsed),
            growth: dynamics.growth(elapsed),
            late: ticks as f64 * s.period_feedback,
        }
    }

    /// Returns the share of the mean acceleration by the commanded moments that is explained, if
    /// the means have this time constant (s). What a moment does shows later than the command, and
    /// is forgotten later.
    pub(in crate::crmpc) fn of_moment(&self, time_constant: f64) -> f64 {
        self.share * exp(self.late / time_constant)
    }

    /// Returns all else that is explained, rad/s², if the mean acceleration by pulses is
    /// `by_pulses`.
    pub(in crate::crmpc) fn of_others(&self, time_constant: f64, by_pulses: f64) -> f64 {
        self.lasting
            + self.of_errors / time_constant
            + by_pulses * self.growth * exp(self.late / time_constant)
    }
}
