//! Supervision of the guarantee: what a controller says of it, tick by tick.
//!
//! The theorem needs a certified plan and true assumptions. The plan is judged where it is made.
//! The assumptions are judged here, by what contradicts them: once one has been contradicted, the
//! guarantee is in force again only after nothing has contradicted them for a while.

use super::guarantee::{Carried, Deviation, Switching, Tightening};
use super::memory::{Memory, Standing};
use super::robust::Robust;
use super::set::{ROUNDING, Tick};
use super::settings::Settings;
use crate::controller::Measurement;
use crate::linearise;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use vehicle::math::cos;

/// Time without contradiction after which the assumptions are believed again, s.
const PROBATION: f64 = 1.0;

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
    pub status: Standing,
    /// Last contradiction, until the assumptions are believed again.
    pub contradiction: Contradiction,
    /// Ticks left until they are.
    probation: u32,
    /// Number of times that a guarantee in force or pending has ended.
    pub ended: u32,
}

impl Supervision {
    /// Takes the `standing` of the plan and what contradicts the assumptions at a tick, one
    /// `period` (s) after the last.
    pub(super) fn judge(&mut self, standing: Standing, found: Contradiction, period: f64) {
        let was_assured = self.status.is_assured();
        if found == Contradiction::None {
            self.probation = self.probation.saturating_sub(1);
            if self.probation == 0 {
                self.contradiction = Contradiction::None;
            }
        } else {
            self.contradiction = found;
            self.probation = (PROBATION / period).ceil() as u32;
        }
        self.status = match (standing, self.contradiction) {
            (Standing::None | Standing::Refused, _) | (_, Contradiction::None) => standing,
            (_, Contradiction::Step) => Standing::Stale,
            _ => Standing::Exceeded,
        };
        self.ended = self.ended.saturating_add(u32::from(was_assured && !self.status.is_assured()));
    }
}

impl Robust {
    /// Judges the guarantee at a tick: by the state that was measured, and by the moment before its
    /// limit.
    pub(super) fn judge(&self, memory: &mut Memory, tick: &Tick) {
        let Tick { measured, angle_rates, deviation: [angles, rates], command, .. } = tick;
        let limits_kept = command.moment.norm() <= self.settings.limit_moment * (1.0 + ROUNDING)
            && measured.rates.norm() <= self.rate_shown();
        let feedback = command.commanded - command.nominal;
        let explained = self.explains(memory, tick.within, angles, rates, &feedback);
        if memory.assured() && !(explained && self.credible(memory) && limits_kept) {
            memory.standing = Standing::Exceeded;
        }
        let contradiction =
            self.contradiction(memory, measured, explained && !tick.left_behind, limits_kept);
        if memory.standing == Standing::Pending && memory.pending == 0 {
            memory.standing = Standing::InForce;
        }
        memory.observed.remember([&measured.angles, angle_rates], &command.commanded);
        let period = self.settings.period_feedback;
        memory.supervision.judge(memory.standing, contradiction, period);
    }

    /// Returns whether the assumptions explain the observed disturbance.
    pub(super) fn credible(&self, memory: &Memory) -> bool {
        let Tightening { observable, switching, growth, .. } = &self.design.tightening;
        let by_pulses =
            |switching: &Switching| switching.observed(memory.commands.filtered()) * growth;
        let explained = observable + switching.as_deref().map_or(0.0, by_pulses);
        memory.observed.disturbance.amax() <= explained
    }

    /// Returns what contradicts the assumptions at a tick. As long as no plan was certified, a
    /// motion beyond the limits, or away from the plan, contradicts nothing.
    fn contradiction(
        &self,
        memory: &Memory,
        measured: &Measurement,
        explained: bool,
        limits_kept: bool,
    ) -> Contradiction {
        let certified = memory.supervision.status.is_assured()
            || memory.supervision.contradiction != Contradiction::None;
        if measured.stale {
            Contradiction::Step
        } else if measured.has_other_delay {
            Contradiction::Delay
        } else if measured.is_unexplained || !self.credible(memory) {
            Contradiction::Disturbance
        } else if certified && !explained {
            Contradiction::Deviation
        } else if certified && !limits_kept {
            Contradiction::Limit
        } else {
            Contradiction::None
        }
    }

    /// Returns whether the assumptions explain the deviation of the predicted state from the
    /// nominal state, and this K ô, `tick` ticks after the optimisation.
    pub(super) fn explains(
        &self,
        memory: &Memory,
        tick: u64,
        angles: &Vector3<f64>,
        rates: &Vector3<f64>,
        feedback: &Vector3<f64>,
    ) -> bool {
        let carried = self.design.tightening.switching.as_ref();
        let carried = carried.map(|switching| memory.plan.begins_with(switching));
        let tick = memory.age as usize + tick as usize;
        let bounds = self.explained_deviation(tick, &carried.unwrap_or_default());
        let slack = 1.0 + ROUNDING;
        let r = 1.0 / cos(self.settings.sideslip_domain);
        let norm_constraint =
            bounds.feedback_norm + bounds.feedback_moment * r / self.design.smallest_inertia;
        let within =
            |i: usize| feedback[i].abs() <= (bounds.feedback + norm_constraint) * slack + 1e-12;
        angles.xy().norm() <= bounds.seen_angle * slack + 1e-12
            && rates.norm() <= bounds.seen_rate * slack + 1e-12
            && (0..3).all(within)
    }

    /// Returns the largest deviations that the assumptions explain `tick` ticks after a nominal
    /// trajectory began, in a stage that begins with `carried`.
    fn explained_deviation(&self, tick: usize, carried: &Carried) -> Deviation {
        let tightening = &self.design.tightening;
        let explained = *tightening.at(tick);
        let Some(switching) = &tightening.switching else { return explained };
        explained.plus(&switching.deviation(carried))
    }

    /// Returns the largest measured ‖ω‖ that is compatible with the limit, rad/s.
    fn rate_shown(&self) -> f64 {
        let Settings { limit_rate, rate_error, angle_error, .. } = self.settings;
        let of_rates = 3.0_f64.sqrt() * rate_error;
        (limit_rate + of_rates + linearise::TURN_BY_ANGLES * 1.5 * limit_rate * angle_error)
            * (1.0 + ROUNDING)
    }
}
