//! Contradictions of the assumptions of the theorem at a tick.

use super::Robust;
use crate::controller::{Doubt, Measurement, Scheduled};
use crate::crmpc::feedback::{Feedback, Tick};
use crate::crmpc::memory::{Acting, Memory};
use crate::crmpc::plan::Terms;
use crate::crmpc::set::ROUNDING;
use crate::crmpc::settings::Settings;
use crate::crmpc::supervision::{Contradiction, GuaranteeStatus};
use nalgebra::Vector3;
use vehicle::math::cos;

/// Returns whether a value keeps its bound, except for rounding.
fn keeps(value: f64, bound: f64) -> bool {
    value <= bound * (1.0 + ROUNDING) + 1e-12
}

/// Returns the assumption that the measurements contradict, as far as that shows without a plan.
fn shown(measured: &Measurement) -> Option<Contradiction> {
    match measured.doubt {
        _ if measured.stale => Some(Contradiction::Step),
        Some(Doubt::Motion) => Some(Contradiction::Motion),
        Some(Doubt::OtherDelay) => Some(Contradiction::Delay),
        Some(Doubt::Unexplained) => Some(Contradiction::Disturbance),
        None => None,
    }
}

/// Returns the first assumption that does not hold.
fn first(found: &[(bool, Contradiction)]) -> Option<Contradiction> {
    found.iter().find(|(holds, _)| !holds).map(|(_, what)| *what)
}

impl Robust {
    /// Judges the guarantee at a tick: by the state that was measured, by the feedback and the
    /// moment (N m) before its limit, and by the contradiction that an optimisation has `found`.
    pub(super) fn judge(
        &self,
        memory: &mut Memory,
        tick: &Tick,
        feedback: &Feedback,
        moment: &Vector3<f64>,
        found: Option<Contradiction>,
    ) {
        let measured = tick.measured;
        let asked = moment - measured.known_moment;
        let limit_moment = self.settings.limit_moment.min(measured.scheduled.limit_moment);
        let limits_kept = asked.norm() <= limit_moment * (1.0 + ROUNDING)
            && (measured.rates - measured.turn).norm() <= self.design.tightening.explained.rate;
        let Feedback { deviation, nominal, commanded } = feedback;
        let explained = self.explains(memory, tick.within, deviation, &(commanded - nominal));
        let Settings { angle_error, slow_angle_error, .. } = self.settings;
        let declared = keeps(measured.scheduled.angle_error, angle_error + slow_angle_error);
        let assumed = [
            (declared, Contradiction::Errors),
            (self.keeps_turn(memory, measured), Contradiction::Turn),
            (self.keeps_known_moment(memory, measured), Contradiction::KnownMoment),
            (self.keeps_schedule(memory), Contradiction::Schedule),
            (self.credible(memory), Contradiction::Disturbance),
        ];
        let seen = [(explained, Contradiction::Deviation), (limits_kept, Contradiction::Limit)];
        // As long as no plan was certified, a motion beyond the limits, or away from the plan,
        // contradicts nothing.
        let certified = memory.supervision.status.is_assured()
            || memory.supervision.contradiction != Contradiction::None;
        let contradiction = shown(measured)
            .or_else(|| first(&assumed))
            .or(found)
            .or_else(|| first(&seen).filter(|_| certified))
            .unwrap_or_default();
        if memory.assured() && !(first(&assumed).is_none() && explained && limits_kept) {
            memory.guarantee = GuaranteeStatus::Exceeded;
        }
        if memory.guarantee == GuaranteeStatus::Pending && memory.pending == 0 {
            memory.guarantee = GuaranteeStatus::InForce;
        }
        memory.observed.remember([measured.angles, tick.angle_rates, *commanded]);
        let period = self.settings.period_feedback;
        memory.supervision.judge(memory.guarantee, contradiction, period);
    }

    /// Returns whether the assumptions explain the observed disturbance.
    pub(super) fn credible(&self, memory: &Memory) -> bool {
        memory.observed.is_explained(&self.design.tightening.observable)
    }

    /// Returns whether the trajectory's turn has changed by no more than a plan in force allows.
    fn keeps_turn(&self, memory: &Memory, measured: &Measurement) -> bool {
        let keeps_to = |begun_with: Vector3<f64>| {
            let is_told = begun_with != Vector3::zeros();
            let bound = if is_told { self.settings.turn_change } else { 0.0 };
            keeps((measured.turn - begun_with).norm(), bound)
        };
        !memory.assured()
            || keeps_to(memory.plan.terms.turn)
                && memory.acting.terms().is_none_or(|terms| keeps_to(terms.turn))
    }

    /// Returns whether the known moment keeps its bound, and has changed by no more than a plan in
    /// force allows.
    fn keeps_known_moment(&self, memory: &Memory, measured: &Measurement) -> bool {
        let Settings { known_bound, known_change, .. } = self.settings;
        let known = measured.known_moment;
        keeps(known.norm(), known_bound)
            && (!memory.assured() || keeps((known - memory.plan.terms.known).norm(), known_change))
    }

    /// Returns whether the scheduled limits are still those that a plan in force assumes.
    fn keeps_schedule(&self, memory: &Memory) -> bool {
        let Memory { plan, scheduled: Scheduled { limit_moment, disturbance_bound, .. }, .. } =
            memory;
        let level = memory.acting.terms().map_or(0, |terms| terms.level).max(plan.terms.level);
        !memory.assured()
            || keeps(plan.terms.limit_moment, *limit_moment)
                && (level == 0 || keeps(*disturbance_bound, self.bound_at(level)))
    }

    /// Notes that a plan with other terms takes over at a tick. Until its first command acts, the
    /// turn and the bound on the disturbance of the plan before count as well.
    pub(super) fn note_terms(&self, memory: &mut Memory) {
        let before = memory.plan.terms;
        if memory.assured() && (before.level > self.terms.level || before.turn != self.terms.turn) {
            let acting = memory.acting.terms().map_or(0, |terms| terms.level);
            let terms = Terms { level: before.level.max(acting), ..before };
            memory.acting = Acting { terms, ticks: self.design.delay_ticks + 1 };
        }
        memory.plan.terms = self.terms;
    }

    /// Returns the bound on the disturbance at this level, rad/s².
    fn bound_at(&self, level: usize) -> f64 {
        let Settings { disturbance_bound, disturbance_parts: parts, .. } = self.settings;
        disturbance_bound * (parts.saturating_sub(level) as f64 / parts as f64)
    }

    /// Returns the bound on the disturbance that still has an effect after the one given at a tick,
    /// rad/s². It falls by no more than one part of the whole bound in each optimisation period.
    pub(super) fn recent_bound(&self, memory: &Memory) -> f64 {
        let Settings { disturbance_bound, disturbance_parts, .. } = self.settings;
        let told = memory.scheduled.disturbance_bound.min(disturbance_bound);
        if !memory.started {
            return told;
        }
        let part = disturbance_bound / disturbance_parts as f64;
        told.max(memory.recent_bound - part / self.design.ratio as f64)
    }

    /// Returns the assumptions of a plan that is certified now.
    pub(super) fn terms(&self, memory: &Memory) -> Terms {
        let Settings { limit_moment, limit_fall, disturbance_bound, disturbance_parts, .. } =
            self.settings;
        let parts = disturbance_parts as f64;
        let needed = memory.recent_bound / disturbance_bound * parts;
        let level = parts - needed - self.settings.parts_to_spare();
        Terms {
            known: memory.known,
            turn: memory.turn,
            limit_moment: limit_moment.min(memory.scheduled.limit_moment - limit_fall).max(0.0),
            level: level.max(0.0) as usize,
        }
    }

    /// Returns whether the assumptions explain the deviation of the predicted state from the
    /// nominal state, and this K ô, `tick` ticks after the optimisation.
    pub(super) fn explains(
        &self,
        memory: &Memory,
        tick: u64,
        [angles, rates]: &[Vector3<f64>; 2],
        feedback: &Vector3<f64>,
    ) -> bool {
        let tick = memory.age as usize + tick as usize;
        let bounds = self.design.at_level(memory.plan.terms.level).at(tick);
        let r = 1.0 / cos(self.settings.sideslip_domain);
        let norm_part =
            bounds.feedback_norm + bounds.feedback_moment * r / self.design.smallest_inertia;
        keeps(angles.xy().norm(), bounds.seen_angle)
            && keeps(rates.norm(), bounds.seen_rate)
            && feedback.iter().all(|value| keeps(value.abs(), bounds.feedback + norm_part))
    }
}
