//! The tube around one plan: with the deviation by changes of its acceleration, if the delay is not
//! exact.

use super::deviation::Deviation;
use super::pulses::{Carried, Past, Pulses};
use super::reach::Reach;
use crate::interval::Interval;
use control::crmpc::{Plan, Settings};

fn number(value: f64) -> Interval {
    Interval::from(value)
}

impl Reach {
    /// Returns the deviations around a plan whose trajectory began `age` feedback ticks before it.
    pub(super) fn around(&self, s: &Settings, plan: &Plan, age: usize, past: &Past) -> Around<'_> {
        let ratio = (s.period_optimisation / s.period_feedback).round() as usize;
        let timing = (ratio, s.period_optimisation, self.fades);
        let carried = self.pulses.as_ref().map(|all| (all, Carried::new(all, plan, past, timing)));
        let eighth = 0.125 * s.period_feedback * s.period_feedback * (1.0 + 1e-15);
        Around { reach: self, age, carried, eighth, delay_error: number(s.delay_error) }
    }
}

/// The tube around one plan.
pub(super) struct Around<'a> {
    reach: &'a Reach,
    age: usize,
    carried: Option<(&'a Pulses, Carried)>,
    /// τ²/8, s².
    eighth: f64,
    delay_error: Interval,
}

impl Around<'_> {
    fn with(&self, deviation: &Deviation, more: impl Fn(&Carried) -> &[f64; 6]) -> Deviation {
        let Some((_, carried)) = &self.carried else { return *deviation };
        let mut sums = *more(carried);
        // Between two ticks the angle departs from the straight line by the feedback.
        sums[0] += self.eighth * sums[4];
        deviation.pulsed([Interval::ZERO, Interval::ONE], &sums)
    }

    /// Returns the deviations `tick` feedback ticks after the plan began.
    pub(super) fn at(&self, tick: usize) -> Deviation {
        let deviation = self.reach.deviations.get(self.age + tick).unwrap_or(&self.reach.forever);
        self.with(deviation, |carried| carried.at(tick))
    }

    /// Returns the deviation that is never exceeded beyond the horizon.
    pub(super) fn forever(&self) -> Deviation {
        self.with(&self.reach.forever, Carried::forever)
    }

    /// Returns the angle (rad) and the rate (rad/s) that the command of `tick` adds before it is to
    /// act, if it changes the acceleration by `change` (rad/s²) and not as the plan foresees.
    pub(super) fn unforeseen(&self, tick: usize, change: f64) -> [Interval; 2] {
        let Some((pulses, carried)) = &self.carried else { return [Interval::ZERO; 2] };
        let size = number(pulses.per_change()) * number(change);
        let [half, norm] = self.reach.sizes[(self.age + tick).min(self.reach.sizes.len() - 1)];
        let rate = size - half - norm - number(carried.pulse(tick));
        let rate = Interval::point(rate.high.max(0.0));
        [rate * self.delay_error, rate]
    }
}
