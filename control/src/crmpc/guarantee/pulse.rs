//! Pulses by the feedback: jumps of the rates if a command begins to act at another time than
//! assumed (docs/guarantee.md, step 7). Those by the plan's own changes are in
//! [`super::switching`].

use super::deviation::Deviation;
use super::dynamics::Dynamics;
use super::mismatch::{Drive, relative};
use super::parts::{Parts, Reaches};
use crate::crmpc::settings::Settings;
use crate::error_dynamics::Reach;
use std::f64::consts::SQRT_2;

/// What makes a pulse larger than δ times the change of acceleration that the law intends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PulseFactors {
    /// Factor 1/(1 − ι) by the common factor of the inertia.
    pub common: f64,
    /// Factor by the whole inertia error and by the turn of the attitude until the command acts,
    /// with the jump that `revised` says.
    pub inertia: f64,
    /// Jump of the rates at the next command because of a pulse, relative to the pulse.
    pub revised: f64,
    /// Jump of the rates by the mismatch that a pulse causes until a prediction includes it,
    /// relative to the pulse.
    pub mismatch: f64,
    /// Change of the acceleration from one command to the next while the vehicle turns, rad/s².
    pub turn: f64,
}

impl PulseFactors {
    /// `before` and `drive` are the bounds before the nominal motion began, the larger ones.
    ///
    /// With the growth g over d + τ the pulse's share in the mismatch is (‖∂F/∂x‖ + ½ ‖∂F/∂Θ‖
    /// (d + τ)) (d + τ) g, and a pulse revises the next command by δ (‖∂F/∂x‖ + ‖∂F/∂Θ‖ (d + τ)) g
    /// of itself.
    pub(super) fn new(s: &Settings, before: &Dynamics, drive: &Drive) -> Self {
        let Dynamics { by_rates, by_angles, largest, smallest, geometry, .. } = before;
        let common = relative(s.inertia_error);
        let tensor = relative(s.tensor_error);
        let root_condition = (largest / smallest).sqrt();
        let elapsed = s.delay + s.period_feedback;
        let growth = before.growth(elapsed);
        let (turn, attitude) = before.between_commands(s, drive);
        let inertia =
            (1.0 + common) * (1.0 + tensor * root_condition * geometry.r) * (1.0 + attitude);
        let revised = s.delay_error * inertia * (by_rates + by_angles * elapsed) * growth;
        Self {
            common: 1.0 + common,
            inertia: inertia / (1.0 - revised),
            revised,
            mismatch: (by_rates + 0.5 * by_angles * elapsed) * elapsed * growth,
            turn,
        }
    }
}

/// Jump of the rates at a tick, rad/s: in each component, and as a norm beyond that.
pub(super) struct Pulse {
    of_box: f64,
    of_ball: f64,
}

impl Pulse {
    /// Returns the pulse at each tick because a command changes by K (ô⁺ − ô), which is δ times
    /// that change times the factors.
    ///
    /// Each pulse changes the later commands too, by a share X = δ ‖change‖ of itself, so that the
    /// sum of all is at most 1/(1 − X) times the first (small-gain theorem). The parts that stay
    /// within the axes are a box; what the inertia error and the mismatch turn is a ball.
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
        let by_inertia = reach.change * parts.drive.of_inertia
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
