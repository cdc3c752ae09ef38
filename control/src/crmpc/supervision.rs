//! Supervision of the guarantee: its status, tick by tick.
//!
//! The theorem needs a certified plan and true assumptions. The plan is certified where it is made,
//! and `robust/judging.rs` finds contradictions of the assumptions. Once one has been contradicted,
//! the guarantee is in force again only after nothing has contradicted them for a while.

use serde::{Deserialize, Serialize};
use settings::{Choice, Declared};

/// Time without contradiction after which the assumptions are trusted again, s: those on inputs that
/// the law is told, and those that measurements contradict, which a lasting fault need not do at
/// every tick.
const PROBATION: f64 = 1.0;
const PROBATION_OF_MEASUREMENTS: f64 = 3.0;

/// Status of the guarantee of the robust set at the last tick.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Choice)]
pub enum GuaranteeStatus {
    /// No optimisation yet, or constraint sets that give no guarantee.
    #[default]
    None,
    /// a plan is certified, but its first command does not act yet.
    Pending,
    /// The limits are kept as long as the assumptions hold.
    InForce,
    /// No guarantee is possible with these settings; the controller runs as best effort.
    Refused,
    /// No plan was found that satisfies the conditions of the guarantee.
    Uncertified,
    /// An assumption was contradicted within the last second, or by measurements within the last
    /// three; guarantee.contradiction shows which.
    Exceeded,
    /// a tick within the last second used inputs that had been set before it; step with
    /// period.feedback or a whole fraction of it.
    Stale,
}

impl GuaranteeStatus {
    pub(super) fn is_assured(self) -> bool {
        matches!(self, Self::Pending | Self::InForce)
    }
}

/// Contradiction of an assumption of the guarantee, until the assumption is trusted again.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Choice)]
pub enum Contradiction {
    /// No contradiction.
    #[default]
    None,
    /// a tick used inputs that had been set before it, because of the communication step.
    Step,
    /// loopDelay.estimate differs from delay + measurement.age by more than half a period.
    Delay,
    /// The observed disturbance is larger than disturbance.bound, inertia.error and
    /// estimation.rateError allow.
    Disturbance,
    /// The deviation from the plan is larger than the assumed disturbance, inertia, measurement
    /// errors and delay allow.
    Deviation,
    /// a limit is exceeded, or the law requires a moment beyond limit.moment.
    Limit,
    /// The measured angles have not moved as the measured rates say, by more than the assumed errors
    /// and disturbance allow.
    Motion,
    /// knownMoment.* is larger than knownMoment.bound, or has changed by more than
    /// knownMoment.change since the plan in force was made.
    KnownMoment,
    /// The turn that the inputs trajectory.* give has changed by more than trajectory.turnChange
    /// since the plan in force was made.
    Turn,
    /// scheduled.limitMoment has fallen, or scheduled.disturbanceBound risen, by more than the plan
    /// in force reserves.
    Schedule,
    /// scheduled.angleError is larger than estimation.angleError and estimation.slowAngleError
    /// together.
    Errors,
}

/// Status of the guarantee that is shown.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Declared)]
pub struct Supervision {
    /// Status of the guarantee of the robust set at the last tick.
    pub status: GuaranteeStatus,
    /// Contradiction of an assumption of the guarantee, until the assumption is trusted again.
    pub contradiction: Contradiction,
    /// Ticks left until the assumptions are trusted again.
    #[setting(skip)]
    probation: u32,
    /// Number of times that a guarantee in force or pending has ended.
    #[setting(skip)]
    pub ended: u32,
}

impl Supervision {
    /// Takes the status of the plan and a contradiction of the assumptions at a tick, one `period`
    /// (s) after the last.
    pub(super) fn judge(
        &mut self,
        plan: GuaranteeStatus,
        contradiction: Contradiction,
        period: f64,
    ) {
        let was_assured = self.status.is_assured();
        if contradiction == Contradiction::None {
            self.probation = self.probation.saturating_sub(1);
            if self.probation == 0 {
                self.contradiction = Contradiction::None;
            }
        } else {
            self.contradiction = contradiction;
            let probation = match contradiction {
                Contradiction::Step
                | Contradiction::KnownMoment
                | Contradiction::Turn
                | Contradiction::Schedule
                | Contradiction::Errors => PROBATION,
                _ => PROBATION_OF_MEASUREMENTS,
            };
            self.probation = self.probation.max((probation / period).ceil() as u32);
        }
        self.status = match (plan, self.contradiction) {
            (GuaranteeStatus::None | GuaranteeStatus::Refused, _) | (_, Contradiction::None) => {
                plan
            }
            (_, Contradiction::Step) => GuaranteeStatus::Stale,
            _ => GuaranteeStatus::Exceeded,
        };
        self.ended = self.ended.saturating_add(u32::from(was_assured && !self.status.is_assured()));
    }
}

#[cfg(test)]
mod tests {
    use super::{Contradiction, GuaranteeStatus, Supervision};

    #[test]
    fn trust_returns_seconds_after_the_last_contradiction() {
        let mut supervision = Supervision::default();
        let mut judge = |contradiction| {
            supervision.judge(GuaranteeStatus::InForce, contradiction, 0.04);
            supervision.status
        };
        assert_eq!(judge(Contradiction::None), GuaranteeStatus::InForce);
        for _ in 0..3 {
            assert_eq!(judge(Contradiction::Motion), GuaranteeStatus::Exceeded);
        }
        for _ in 1..75 {
            assert_eq!(judge(Contradiction::None), GuaranteeStatus::Exceeded);
        }
        assert_eq!(judge(Contradiction::None), GuaranteeStatus::InForce);
        assert_eq!(judge(Contradiction::Step), GuaranteeStatus::Stale);
        assert_eq!(supervision.ended, 2);
    }
}
