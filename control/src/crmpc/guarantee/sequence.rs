//! The deviation tick by tick, from the parts that add up to it.

use super::deviation::Deviation;
use super::losses::RateLoss;
use super::parts::{Parts, Reaches};
use crate::crmpc::settings::Settings;
use crate::error_dynamics::SampledError;

/// The deviation at each feedback tick since the nominal trajectory began. The last tick represents
/// all later ones.
pub(super) struct Sequence {
    pub(super) ticks: Vec<Deviation>,
    /// Feedback ticks per optimisation.
    ratio: usize,
}

impl Sequence {
    pub(super) fn new(s: &Settings, error: &SampledError, parts: &Parts, steps: usize) -> Self {
        let initial = &parts.initial;
        let disturbance = error.reach(steps);
        let [of_angles, of_rates] = error.errors(steps);
        let changes = initial[0].count(&error.changes(steps));
        let mispredictions = error.mispredictions(steps, initial[1]);
        let shifts = initial[2].count(&error.shifts(steps));
        let reaches = |n: usize| Reaches {
            disturbance: disturbance[n],
            initial_feedback: disturbance[n].feedback
                - disturbance[n - n.min(initial[0].ticks)].feedback,
            errors: [of_angles[n], of_rates[n]],
            changes: changes[n],
            mispredictions: mispredictions[n],
            shifts: shifts[n],
        };
        let at = |n: usize| parts.deviation(s, &reaches(n));
        let mut ticks: Vec<Deviation> = (0..=steps).map(at).collect();
        // By errors of the measurement the deviation may be larger at an initial tick than at the
        // last. As the last entry represents all later ticks, it takes the largest of all.
        ticks[steps] = ticks.iter().fold(Deviation::default(), |most, at| most.or(at));
        let ratio = (s.period_optimisation / s.period_feedback).round().max(1.0) as usize;
        Self { ticks, ratio }
    }

    fn at(&self, tick: usize) -> &Deviation {
        &self.ticks[tick.min(self.ticks.len() - 1)]
    }

    /// Returns the largest deviation within the optimisation period that begins at a tick.
    pub(super) fn within(&self, tick: usize) -> Deviation {
        (tick..tick + self.ratio).fold(Deviation::default(), |most, n| most.or(self.at(n)))
    }

    /// Returns the bulge: the largest amount by which a deviation exceeds, within the optimisation
    /// period that begins at a tick, the straight line between its values at both ends.
    pub(super) fn bulge(&self, tick: usize, of: fn(&Deviation) -> f64) -> f64 {
        let ratio = self.ratio;
        let value = |i: usize| of(self.at(tick + i));
        let (from, to) = (value(0), value(ratio));
        let above = |i: usize| value(i) - (from + (to - from) * i as f64 / ratio as f64);
        (1..ratio).map(above).fold(0.0, f64::max)
    }

    /// Returns the loss of rate at a tick and in the optimisation periods (of `h` s) before and
    /// after it, with the bulges of both.
    pub(super) fn rate_loss(&self, tick: usize, h: f64) -> RateLoss {
        let before = tick.checked_sub(self.ratio);
        let with_bulge = |of: fn(&Deviation) -> f64| {
            let before = before.map_or(0.0, |before| self.bulge(before, of));
            of(self.at(tick)) + before.max(self.bulge(tick, of))
        };
        let angle = |n: usize| self.at(n).angle;
        let change = before.map_or(0.0, |before| (angle(tick) - angle(before)).abs());
        let change = change.max((angle(tick + self.ratio) - angle(tick)).abs());
        RateLoss::new(with_bulge(|d| d.angle), with_bulge(|d| d.rate), change, h)
    }
}
