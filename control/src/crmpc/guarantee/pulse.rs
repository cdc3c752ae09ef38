//! Pulses by the feedback: jumps of the rates if a command begins to act at another time than
//! assumed (docs/proof.md, step 7). Those by the plan's own changes are in
//! [`super::switching`].

use super::deviation::Deviation;
use super::parts::{Parts, PulseFactors, Reaches};
use crate::crmpc::settings::Settings;
use crate::error_dynamics::Reach;
use std::f64::consts::SQRT_2;

/// Jump of the rates at a tick, rad/s: in each component, and as a norm beyond that.
pub(super) struct Pulse {
    of_box: f64,
    of_ball: f64,
}

impl Pulse {
    /// Returns the pulse at each tick because a command changes by K (ô⁺ − ô), which is δ times
    /// that change times the factors.
    ///
    /// Each pulse changes the later commands too, by a share δ X of itself, X being the reach
    /// `change` of pulses, so that all together are at most 1/(1 − δ X) times the first (small-gain
    /// theorem). The parts that stay within the axes are a box; those that the inertia error and
    /// the mismatch turn are a ball.
    pub(super) fn new(s: &Settings, parts: &Parts, reaches: &Reaches) -> Self {
        if s.delay_error == 0.0 {
            return Self { of_box: 0.0, of_ball: 0.0 };
        }
        let PulseFactors { common, inertia, mismatch, turn, .. } = parts.pulse;
        let all = inertia * (1.0 + mismatch);
        let again = s.delay_error * reaches.pulses.change;
        if again * all >= 1.0 {
            return Self { of_box: f64::INFINITY, of_ball: f64::INFINITY };
        }
        let (errors, reach) = (reaches.of_errors(s), &reaches.disturbance);
        let of_box = (reach.change * s.disturbance_bound + errors.change) / (1.0 - again * common);
        let besides = (all - common) * 3.0_f64.sqrt() * of_box + all * turn;
        let by_inertia = reach.change * (parts.drive.of_inertia + parts.drive.of_creep)
            + parts.mismatched(reaches).change
            + again * besides;
        let of_ball = by_inertia / (1.0 - again * all);
        Self {
            of_box: s.delay_error * common * of_box,
            of_ball: s.delay_error * (all * of_ball + besides),
        }
    }

    /// Returns the largest jump in any direction, rad/s.
    pub(super) fn norm(&self) -> f64 {
        3.0_f64.sqrt() * self.of_box + self.of_ball
    }

    /// Returns the deviation that this pulse at each tick causes. `pulses` is per unit of it, and
    /// `largest` bounds the pulse at any tick, which may show between two ticks already (rad/s).
    pub(super) fn deviation(&self, s: &Settings, pulses: &Reach, largest: f64) -> Deviation {
        let Self { of_box, of_ball } = *self;
        if of_box == 0.0 && of_ball == 0.0 {
            return Deviation::default();
        }
        let (of_two, norm) = (SQRT_2 * of_box + of_ball, self.norm());
        let tau = s.period_feedback;
        Deviation {
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
