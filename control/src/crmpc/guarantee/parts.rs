//! The parts of the deviation, by the way in which they add up.

use super::deviation::Deviation;
use super::dynamics::Dynamics;
use super::geometry::TURN;
use super::mismatch::{Drive, Mismatch, inertia_moments};
use crate::crmpc::settings::Settings;
use crate::error_dynamics::{Early, Reach};
use std::f64::consts::SQRT_2;

/// The parts that drive the deviation, separated by the way in which they add up.
pub(super) struct Parts {
    /// Moments of [`inertia_moments`], N m.
    pub(super) along_moment: f64,
    pub(super) any_moment: f64,
    /// Square root of the condition number of I, by which the latter grows if it is expressed as a
    /// moment.
    pub(super) root_condition: f64,
    pub(super) drive: Drive,
    pub(super) mismatch: Mismatch,
    /// Effects before the nominal motion began, see [`Early`]: on the mean of the mismatch, on the
    /// predictions, and on the shift of the angle.
    pub(super) early: [Early; 3],
    /// Shift of the angle per time, see [`Dynamics::swing`].
    pub(super) swing: f64,
    /// Deviation of the rates between two ticks, see [`Dynamics::between`], rad/s.
    pub(super) between: f64,
    /// Bound on the norm of all parts together, rad/s².
    pub(super) norm: f64,
    /// Growth rate of the moment that the inertia error requires while the vehicle turns, 1/s.
    pub(super) turning: f64,
    /// Share by which it is larger because the attitude is measured with an error.
    pub(super) turned: f64,
    /// Share by which it is larger because the vehicle was faster before the nominal motion began.
    pub(super) turned_early: f64,
    /// Moment by which the inertia error amounts to more before the nominal motion began, N m.
    pub(super) early_moment: f64,
    /// Factors by which the inertia error makes the change of acceleration by a moment larger, if
    /// it is a common factor, and in all.
    pub(super) pulse_common: f64,
    pub(super) pulse_inertia: f64,
    /// Jump of the rates at the next command because of a pulse, relative to the pulse; it is
    /// included in `pulse_inertia`.
    pub(super) pulse_revised: f64,
    /// Jump of the rates by the mismatch that a pulse causes, relative to the pulse.
    pub(super) pulse_mismatch: f64,
    /// Change of the acceleration from one command to the next while the vehicle turns, rad/s².
    pub(super) turn: f64,
}

/// Jump of the rates at a tick, rad/s: in each component, and as a norm beyond that.
pub(super) struct Pulse {
    pub(super) of_box: f64,
    pub(super) of_ball: f64,
}

impl Pulse {
    pub(super) fn norm(&self) -> f64 {
        3.0_f64.sqrt() * self.of_box + self.of_ball
    }
}

impl Parts {
    pub(super) fn new(s: &Settings, dynamics: &Dynamics) -> Self {
        let Dynamics { smallest, largest, rate, .. } = dynamics;
        let before = dynamics.before(s);
        let (drive, larger) = (dynamics.drive(s), before.drive(s));
        let first = before.mismatch(s, &larger);
        let mut mismatch = dynamics.mismatch(s, &drive);
        if !first.mean.is_finite() {
            mismatch = Mismatch::UNBOUNDED;
        }
        // The inertia error has a larger effect, too.
        let more = larger.of_inertia - drive.of_inertia;
        mismatch.peak = first.peak + more;
        mismatch.unseen_rate = first.unseen_rate + more * s.delay;
        let ticks = (s.delay / s.period_feedback).ceil() as usize;
        let early = |first: f64, later: f64| Early {
            ticks,
            excess: if first > later { first / later - 1.0 } else { 0.0 },
        };
        let swing = dynamics.swing(s);
        let early = [
            early(first.mean + more, mismatch.mean),
            early(first.mispredicted, mismatch.mispredicted),
            early(before.swing(s), swing),
        ];
        let (along_moment, any_moment) =
            inertia_moments(s, &dynamics.vehicle, (*smallest, *largest));
        let any_before = inertia_moments(s, &before.vehicle, (before.smallest, before.largest)).1;
        // Bound of ‖I (W − W′) R′ I⁻¹‖ per unit of the angle between both attitudes.
        let by_turn = largest / smallest * TURN * before.geometry.r;
        let common = s.inertia_error / (1.0 - s.inertia_error);
        let tensor = s.tensor_error / (1.0 - s.tensor_error);
        let root_condition = (largest / smallest).sqrt();
        // Until a prediction includes a pulse, the motion differs from its prediction.
        let elapsed = s.delay + s.period_feedback;
        let pulse_mismatch =
            (before.by_rates + 0.5 * before.by_angles * elapsed) * elapsed * before.growth(elapsed);
        let (turn, attitude) = before.between_commands(s, &larger);
        let pulse_inertia =
            (1.0 + common) * (1.0 + tensor * root_condition * before.geometry.r) * (1.0 + attitude);
        // The pulse before is a part of the motion between two commands, too.
        let pulse_revised = s.delay_error
            * pulse_inertia
            * (before.by_rates + before.by_angles * elapsed)
            * before.growth(elapsed);
        Self {
            pulse_common: 1.0 + common,
            pulse_inertia: pulse_inertia / (1.0 - pulse_revised),
            pulse_revised,
            pulse_mismatch,
            turn,
            along_moment,
            any_moment,
            root_condition,
            drive,
            mismatch,
            early,
            swing,
            between: before.between(s),
            norm: drive.all + mismatch.mean,
            turning: by_turn * rate,
            turned: by_turn * drive.angle_error,
            turned_early: by_turn * (before.rate - rate) * s.delay,
            // No turn makes a moment larger than ‖I‖ ‖R‖ ‖I⁻¹‖ does.
            early_moment: (any_before - any_moment) * largest / smallest * before.geometry.r,
        }
    }

    /// Returns the effect of what differs in F, which may have any direction.
    pub(super) fn mismatched(&self, reach: &Reaches) -> Reach {
        let Mismatch { mean, mispredicted, .. } = self.mismatch;
        let Reaches { changes, mispredictions, shifts, .. } = reach;
        let of_errors = mispredictions.times(mispredicted);
        changes.times(mean).plus(&of_errors).plus(&shifts.times(self.swing))
    }

    /// Returns the deviation.
    pub(super) fn deviation(&self, s: &Settings, reach: &Reaches) -> Deviation {
        let root3 = 3.0_f64.sqrt();
        let errors = reach.of_errors(s);
        let Mismatch { peak, unseen_rate, .. } = self.mismatch;
        let Drive { all, of_two, .. } = self.drive;
        let of_mismatch = self.mismatched(reach);
        let early_feedback = reach.early_feedback;
        let reach = &reach.disturbance;
        let tau = s.period_feedback;
        // Between two ticks an angle departs from the straight line by no more than this.
        let accelerated =
            all * (1.0 + reach.feedback) + root3 * errors.feedback + of_mismatch.feedback + peak;
        Deviation {
            angle: reach.angle * of_two
                + SQRT_2 * errors.angle
                + of_mismatch.angle
                + unseen_rate * s.delay
                + tau * tau / 8.0 * accelerated,
            rate: reach.rate * all
                + root3 * errors.rate
                + of_mismatch.rate
                + unseen_rate
                + self.between,
            seen_angle: reach.seen_angle * of_two
                + SQRT_2 * errors.seen_angle
                + of_mismatch.seen_angle,
            seen_rate: reach.seen_rate * all + root3 * errors.seen_rate + of_mismatch.seen_rate,
            middle_angle: reach.middle_angle * of_two
                + SQRT_2 * errors.middle_angle
                + of_mismatch.middle_angle,
            middle_rate: reach.middle_rate * all
                + root3 * errors.middle_rate
                + of_mismatch.middle_rate,
            feedback: reach.feedback * s.disturbance_bound + errors.feedback,
            feedback_norm: of_mismatch.feedback,
            feedback_moment: (self.along_moment + self.root_condition * self.any_moment)
                * reach.feedback
                + (self.along_moment + self.any_moment)
                    * (self.turning * (reach.feedback_age + 0.5 * tau * reach.feedback)
                        + self.turned * reach.feedback
                        + self.turned_early * early_feedback)
                + self.early_moment * early_feedback,
        }
    }
}

/// Largest effects at one tick, per unit of their causes: of the disturbance, of the errors of
/// angle and rate, and the others as [`SampledError`] names them.
pub(super) struct Reaches {
    pub(super) disturbance: Reach,
    /// Part of its feedback by what happened before the nominal motion began.
    pub(super) early_feedback: f64,
    pub(super) errors: [Reach; 2],
    pub(super) changes: Reach,
    pub(super) mispredictions: Reach,
    pub(super) shifts: Reach,
}

impl Reaches {
    /// Returns the effect of the errors of measurement.
    pub(super) fn of_errors(&self, s: &Settings) -> Reach {
        self.errors[0].times(s.angle_error).plus(&self.errors[1].times(s.rate_error))
    }
}

impl Parts {
    /// Returns the jump of the rates at each tick, because a command changes by K (ô⁺ − ô) and
    /// begins to act at another time than assumed. The arguments are those of
    /// [`Self::deviation`], with the effect of `pulses` (per rad/s at each tick) beside them.
    ///
    /// Each pulse changes the later commands too. The sum of all is that of a geometric series
    /// (small gain).
    pub(super) fn pulse(&self, s: &Settings, reaches: &Reaches, pulses: &Reach) -> Pulse {
        if s.delay_error == 0.0 {
            return Pulse { of_box: 0.0, of_ball: 0.0 };
        }
        let root3 = 3.0_f64.sqrt();
        let all = self.pulse_inertia * (1.0 + self.pulse_mismatch);
        let again = s.delay_error * pulses.change;
        if again * all >= 1.0 {
            return Pulse { of_box: f64::INFINITY, of_ball: f64::INFINITY };
        }
        let (errors, reach) = (reaches.of_errors(s), &reaches.disturbance);
        let of_box = (reach.change * s.disturbance_bound + errors.change)
            / (1.0 - again * self.pulse_common);
        // The parts that do not keep to the axes are added as norms.
        let besides = (all - self.pulse_common) * root3 * of_box + all * self.turn;
        let by_inertia = reach.change * self.drive.of_inertia
            + self.mismatched(reaches).change
            + again * besides;
        let of_ball = by_inertia / (1.0 - again * all);
        Pulse {
            of_box: s.delay_error * self.pulse_common * of_box,
            of_ball: s.delay_error * (all * of_ball + besides),
        }
    }
}

impl Pulse {
    /// Returns the deviation that this pulse at each tick causes. `pulses` is per unit of it, and
    /// `largest` bounds the jump of the rates at any tick, rad/s.
    pub(super) fn deviation(&self, s: &Settings, pulses: &Reach, largest: f64) -> Deviation {
        let Self { of_box, of_ball } = *self;
        if of_box == 0.0 && of_ball == 0.0 {
            return Deviation::default();
        }
        let (of_two, norm) = (SQRT_2 * of_box + of_ball, self.norm());
        let tau = s.period_feedback;
        Deviation {
            // The last terms are those between two ticks.
            angle: pulses.angle * of_two
                + 0.25 * tau * largest
                + 0.125 * tau * tau * pulses.feedback * norm,
            rate: pulses.rate * norm + largest,
            seen_angle: pulses.seen_angle * of_two,
            seen_rate: pulses.seen_rate * norm,
            middle_angle: pulses.middle_angle * of_two,
            middle_rate: pulses.middle_rate * norm,
            feedback: pulses.feedback * of_box,
            feedback_norm: pulses.feedback * of_ball,
            feedback_moment: 0.0,
        }
    }
}
