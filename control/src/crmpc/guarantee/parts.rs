//! The parts of the deviation, by the way in which they add up (docs/proof.md, steps 1 and 2).

use super::deviation::Deviation;
use super::dynamics::Dynamics;
use super::geometry::TURN;
use super::mismatch::{Drive, InertiaMoments, Mismatch};
use crate::crmpc::settings::Settings;
use crate::error_dynamics::{InitialTicks, Reach};
use std::f64::consts::SQRT_2;

/// Causes of the deviation, separated by the way in which they add up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Parts {
    /// All causes that drive the vehicle off its prediction, except the mismatch.
    pub drive: Drive,
    /// Difference between the acceleration and the one that the law intended.
    pub mismatch: Mismatch,
    /// Larger effects of the ticks before the nominal trajectory began, see [`InitialTicks`]: on the mean
    /// of the mismatch, on the predictions, and on the angle shift.
    pub initial: [InitialTicks; 3],
    /// Shift of the angle per time, see [`Dynamics::angle_shift`], rad/s.
    pub angle_shift: f64,
    /// Largest angle drift, before the nominal trajectory began or later, see [`Drive`], rad/s.
    pub angle_drift: f64,
    /// Deviation of the rates between two ticks, see [`Dynamics::between`], rad/s.
    pub between: f64,
    /// Bound on the norm of all parts together, rad/s².
    pub norm: f64,
    /// Moment of the inertia error.
    pub inertia: InertiaPart,
}

/// The part of K ô that compensates for the inertia error, as a moment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InertiaPart {
    /// Moments in which the inertia error shows, N m.
    pub moments: InertiaMoments,
    /// Square root of the condition number of I, by which a part in any direction grows if it is
    /// expressed as a moment.
    pub root_condition: f64,
    /// Growth rate of the moment while the vehicle turns, 1/s.
    pub turning: f64,
    /// Share by which the moment is larger because the attitude is measured with an error.
    pub turned: f64,
    /// Share by which the moment is larger because the vehicle was faster before the nominal
    /// trajectory began.
    pub turned_initially: f64,
    /// Moment by which the inertia error amounts to more before the nominal trajectory began, N m.
    pub initial_moment: f64,
}

/// Largest effects at one tick, per unit of their causes (docs/proof.md, step 2).
pub(super) struct Reaches {
    /// Of the disturbance and of the inertia error.
    pub(super) disturbance: Reach,
    /// Part of its feedback by causes before the nominal trajectory began.
    pub(super) initial_feedback: f64,
    /// Of the errors of measured angles and rates.
    pub(super) errors: [Reach; 2],
    /// Of changes of the rates from one prediction to the next.
    pub(super) changes: Reach,
    /// Of changes of the predicted rates within a prediction.
    pub(super) mispredictions: Reach,
    /// Of shifts of the angle by the angle shift.
    pub(super) shifts: Reach,
}

impl Parts {
    /// Computes all parts from the bounds on the dynamics.
    pub(super) fn new(s: &Settings, dynamics: &Dynamics) -> Self {
        let before = dynamics.before(s);
        let (drive, larger) = (dynamics.drive(s), before.drive(s));
        let first = before.mismatch(s, &larger);
        let mut mismatch = dynamics.mismatch(s, &drive);
        if !first.mean.is_finite() {
            mismatch = Mismatch::UNBOUNDED;
        }
        // The peak and the unseen rate are those from before the beginning, where the inertia error
        // and the angle drift have a larger effect, too; `initial` enlarges the others.
        let more =
            (larger.of_inertia + larger.of_angle_drift) - (drive.of_inertia + drive.of_angle_drift);
        mismatch.peak = first.peak + more;
        mismatch.unseen_rate = first.unseen_rate + more * s.delay;
        // The first ⌈d/τ⌉ predictions begin before the nominal trajectory does.
        let ticks = (s.delay / s.period_feedback).ceil() as usize;
        let initial = |first: f64, later: f64| InitialTicks {
            ticks,
            excess: if first > later { first / later - 1.0 } else { 0.0 },
        };
        let angle_shift = dynamics.angle_shift(s);
        Self {
            initial: [
                initial(first.mean + more, mismatch.mean),
                initial(first.mispredicted, mismatch.mispredicted),
                initial(before.angle_shift(s), angle_shift),
            ],
            angle_shift,
            angle_drift: larger.angle_drift,
            between: before.between(s),
            norm: drive.all + mismatch.mean,
            inertia: InertiaPart::new(s, dynamics, &before, [&drive, &larger]),
            drive,
            mismatch,
        }
    }

    /// Returns the effect of the mismatch, which may have any direction: `mean` by the changes,
    /// `mispredicted` by the mispredictions, and the angle shift and the angle drift by the shifts.
    pub(super) fn mismatched(&self, reaches: &Reaches) -> Reach {
        let Mismatch { mean, mispredicted, .. } = self.mismatch;
        let Reaches { changes, mispredictions, shifts, .. } = reaches;
        let of_errors = mispredictions.times(mispredicted);
        changes
            .times(mean)
            .plus(&of_errors)
            .plus(&shifts.times(self.angle_shift + self.angle_drift))
    }

    /// Returns the deviation at a tick (docs/proof.md, steps 2 and 3).
    ///
    /// With ρ per unit of a bound on each component, and v the norm of the parts with any
    /// direction, two axes deviate by √2 ρ + v and all three by √3 ρ + v. The vehicle itself
    /// deviates further by the part that no measurement shows yet (`unseen_rate`), and between two
    /// ticks: an angle by τ²/8 times the largest acceleration, a rate by `between`. K ô has the
    /// part in a box ρ_fb Δ̄ and that of the errors, the ball of the mismatch, and the moment of
    /// the inertia error. Angles in rad, rates in rad/s, K ô in rad/s² or N m.
    pub(super) fn deviation(&self, s: &Settings, reaches: &Reaches) -> Deviation {
        let root3 = 3.0_f64.sqrt();
        let Drive { all, of_two, of_angle_drift, .. } = self.drive;
        let Mismatch { peak, unseen_rate, .. } = self.mismatch;
        let (errors, of_mismatch) = (reaches.of_errors(s), self.mismatched(reaches));
        let reach = &reaches.disturbance;
        let on_two =
            |of: fn(&Reach) -> f64| of(reach) * of_two + SQRT_2 * of(&errors) + of(&of_mismatch);
        let on_all =
            |of: fn(&Reach) -> f64| of(reach) * all + root3 * of(&errors) + of(&of_mismatch);
        let tau = s.period_feedback;
        let accelerated =
            all * (1.0 + reach.feedback) + root3 * errors.feedback + of_mismatch.feedback + peak;
        Deviation {
            angle: on_two(|reach| reach.angle)
                + (unseen_rate + self.angle_drift) * s.delay
                + tau * tau / 8.0 * accelerated,
            rate: on_all(|reach| reach.rate) + unseen_rate + self.between,
            seen_angle: on_two(|reach| reach.seen_angle),
            seen_rate: on_all(|reach| reach.seen_rate),
            middle_angle: on_two(|reach| reach.middle_angle),
            middle_rate: on_all(|reach| reach.middle_rate),
            feedback: reach.feedback * s.disturbance_bound + errors.feedback,
            feedback_norm: of_mismatch.feedback + reach.feedback * of_angle_drift,
            feedback_moment: self.inertia.feedback_moment(reach, reaches.initial_feedback, tau),
        }
    }
}

impl InertiaPart {
    /// If the vehicle has turned by o since the inertia error caused a part of the deviation, the
    /// moment that compensates for it is larger by up to the share ‖I (W − W′) R′ I⁻¹‖ ≤
    /// I_max/I_min √2 ‖o‖ ‖R‖ (docs/proof.md, step 4).
    fn new(
        s: &Settings,
        dynamics: &Dynamics,
        before: &Dynamics,
        [drive, larger]: [&Drive; 2],
    ) -> Self {
        let Dynamics { smallest, largest, rate, .. } = dynamics;
        let moments = InertiaMoments::new(s, &dynamics.vehicle, (*smallest, *largest));
        let any_before =
            InertiaMoments::new(s, &before.vehicle, (before.smallest, before.largest)).any;
        let by_turn = largest / smallest * TURN * before.geometry.r;
        Self {
            moments,
            root_condition: (largest / smallest).sqrt(),
            turning: by_turn * (rate + larger.angle_drift),
            turned: by_turn * drive.angle_error,
            turned_initially: by_turn * (before.rate - rate) * s.delay,
            // No turn makes a moment larger than ‖I‖ ‖R‖ ‖I⁻¹‖ does.
            initial_moment: (any_before - moments.any) * largest / smallest * before.geometry.r,
        }
    }

    /// Returns the moment that K ô requires for the inertia error, N m. Each part has grown by
    /// `turning` since it was caused, on average half a period τ more than at the ticks.
    fn feedback_moment(&self, reach: &Reach, initial_feedback: f64, tau: f64) -> f64 {
        let InertiaMoments { along, any } = self.moments;
        (along + self.root_condition * any) * reach.feedback
            + (along + any)
                * (self.turning * (reach.feedback_age + 0.5 * tau * reach.feedback)
                    + self.turned * reach.feedback
                    + self.turned_initially * initial_feedback)
            + self.initial_moment * initial_feedback
    }
}

impl Reaches {
    /// Returns the effect of the errors of measurement.
    pub(super) fn of_errors(&self, s: &Settings) -> Reach {
        self.errors[0].times(s.angle_error).plus(&self.errors[1].times(s.rate_error))
    }
}
