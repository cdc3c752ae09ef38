//! What one member of a run gave, and computing times of repeated runs.

use super::{Member, Series};
use crate::metrics::Value as Metric;
use cosim::experiment::Observe;
use cosim::system::Parameters;

/// Number of times that a timed run is made; the least of each computing time counts.
pub(super) const REPETITIONS: u32 = 5;

/// What one member gave.
pub(super) struct Flown {
    /// Numbers of the member.
    pub(super) member: Member,
    /// Its signals.
    pub(super) series: Series,
    /// Parameters of all components, if it is the run's first member.
    pub(super) parameters: Parameters,
}

impl Flown {
    /// Keeps the smaller one of each computing time of two runs that are otherwise the same.
    pub(super) fn keep_least_times(&mut self, other: &Self, observe: &Observe) {
        let (own, theirs) = (&mut self.member.metrics, &other.member.metrics);
        for (name, value) in &mut own.asked {
            let is_timing = observe.metrics.get(name).is_some_and(|measure| measure.timing);
            if let (true, Some(Metric::Number(own)), Some(Some(Metric::Number(theirs)))) =
                (is_timing, value, theirs.asked.get(name))
            {
                *own = own.min(*theirs);
            }
        }
        for (name, own) in &mut own.step_us {
            *own = theirs.step_us.get(name).map_or(*own, |theirs| own.min(*theirs));
        }
        for (name, own) in &mut self.series.samples {
            let theirs = other.series.samples.get(name).into_iter().flatten();
            own.iter_mut().zip(theirs).for_each(|(own, theirs)| *own = own.min(*theirs));
        }
    }
}
