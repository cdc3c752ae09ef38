//! Supervision of the guarantee: what a controller says of it, tick by tick.
//!
//! The theorem needs a certified plan and true assumptions. The plan is certified where it is made,
//! and `robust/judging.rs` finds what contradicts the assumptions. Once one has been contradicted,
//! the guarantee is in force again only after nothing has contradicted them for a while.

use serde::{Deserialize, Serialize};

/// Time without contradiction after which the assumptions are believed again, s.
const PROBATION: f64 = 1.0;

/// Status of the guarantee of the robust set at a tick. While it is in force, ‖ω‖ and ‖m‖ keep
/// their limits for as long as the assumptions hold.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum GuaranteeStatus {
    /// No optimisation has been run yet, or the sets guarantee nothing.
    #[default]
    None,
    /// A plan is certified, and the guarantee comes into force once the delay has passed; until
    /// then moments act that were commanded without it.
    Pending,
    /// The limits are guaranteed from this tick on.
    InForce,
    /// The design does not hold for the settings, so that the controller works on best effort.
    Refused,
    /// No plan has been found that satisfies the conditions of the theorem.
    Uncertified,
    /// The vehicle is further from the plan than the assumptions explain, or something else
    /// contradicts them.
    Exceeded,
    /// The inputs were set before the tick.
    Stale,
}

impl GuaranteeStatus {
    pub(super) fn is_assured(self) -> bool {
        matches!(self, Self::Pending | Self::InForce)
    }
}

/// What contradicts the assumptions of the theorem.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Contradiction {
    /// Nothing does.
    #[default]
    None,
    /// The inputs were set before the tick, because the communication step is longer than the
    /// period of the feedback law, or no part of it.
    Step,
    /// The motion shows another delay of the loop than the one that was told.
    Delay,
    /// The observed disturbance, or the acceleration over a period, is larger than the bounds of
    /// disturbance, inertia and measurement errors explain with the delay that was told.
    Disturbance,
    /// The vehicle is further from the plan than all assumptions together explain.
    Deviation,
    /// A limit is exceeded, or the moment that the law asks for exceeds it.
    Limit,
}

/// Status of the guarantee that is shown.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Supervision {
    /// Status of the guarantee at the last tick.
    pub status: GuaranteeStatus,
    /// Last contradiction, until the assumptions are believed again.
    pub contradiction: Contradiction,
    /// Ticks left until they are.
    probation: u32,
    /// Number of times that a guarantee in force or pending has ended.
    pub ended: u32,
}

impl Supervision {
    /// Takes the status of the plan and what contradicts the assumptions at a tick, one
    /// `period` (s) after the last.
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
            self.probation = (PROBATION / period).ceil() as u32;
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
