//! Results of the runs of a study, as they are stored.

use crate::metrics::{Metrics, Value};
use cosim::experiment::Observe;
use cosim::signal::Signal;
use cosim::system::Parameters;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Results of a part.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Outcome {
    /// Results of each member, one for each value of the parameter.
    pub members: Vec<Member>,
    /// Signals of the run's first member, if it belongs to this part.
    pub series: Option<Series>,
    /// Parameters of all components in the first member, if it belongs to this part.
    #[serde(default)]
    pub parameters: Parameters,
    /// Smallest and largest value of each signal over the members, at each communication point.
    pub spread: BTreeMap<Signal, Spread>,
}

/// Results of one member of a run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Member {
    /// Value of the parameter, if one is varied.
    pub value: Option<i32>,
    /// Metrics of the member.
    pub metrics: Metrics,
    /// Comparisons of signals with bounds, by id.
    pub within: BTreeMap<String, Compared>,
    /// Measures that the study defines, by id; null if a measure has no value.
    pub measures: BTreeMap<String, Option<f64>>,
}

impl Member {
    /// Returns whether this member has the same results as another one, apart from computing times.
    pub fn has_same_results(&self, other: &Self, asked: &Observe) -> bool {
        let timeless = |metrics: &Metrics| {
            let mut metrics = Metrics { step_us: BTreeMap::new(), ..metrics.clone() };
            metrics
                .asked
                .retain(|name, _| asked.metrics.get(name).is_none_or(|measure| !measure.timing));
            metrics
        };
        timeless(&self.metrics) == timeless(&other.metrics)
            && self.within == other.within
            && self.measures == other.measures
    }
}

/// Comparison of signals with a bound.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Compared {
    /// Number of samples in which all signals were within the bound.
    pub inside: u64,
    /// Number of all samples that were compared.
    pub samples: u64,
    /// Largest magnitude of any signal.
    pub largest: f64,
    /// Largest magnitude as a multiple of the bound.
    pub ratio: f64,
}

/// Time series of signals.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Series {
    /// Simulated times of the communication points, s.
    pub time: Vec<f64>,
    /// Values at these times, in the unit in which they are shown.
    pub signals: BTreeMap<Signal, Vec<f64>>,
    /// Unit in which each signal is shown.
    pub units: BTreeMap<Signal, String>,
    /// Single values of the metrics that keep them, by name.
    pub samples: BTreeMap<String, Vec<f64>>,
}

/// Smallest and largest value at each communication point.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Spread {
    /// Smallest value at each communication point.
    pub low: Vec<f64>,
    /// Largest value at each communication point.
    pub high: Vec<f64>,
}

impl Spread {
    /// Extends the band so that it also covers these values.
    pub fn widen(&mut self, low: &[f64], high: &[f64]) {
        for (least, value) in self.low.iter_mut().zip(low) {
            *least = least.min(*value);
        }
        for (most, value) in self.high.iter_mut().zip(high) {
            *most = most.max(*value);
        }
    }
}

/// Number of times that a timed run is made; the least of each computing time counts.
pub(super) const REPETITIONS: u32 = 5;

/// Results of one member.
pub(super) struct MemberResult {
    /// Numbers of the member.
    pub(super) member: Member,
    /// Its signals.
    pub(super) series: Series,
    /// Parameters of all components, if it is the run's first member.
    pub(super) parameters: Parameters,
}

impl MemberResult {
    /// Replaces each computing time by the smaller one of two runs that are otherwise the same.
    pub(super) fn keep_least_times(&mut self, other: &Self, observe: &Observe) {
        let (metrics, others) = (&mut self.member.metrics, &other.member.metrics);
        for (name, value) in &mut metrics.asked {
            let is_timing = observe.metrics.get(name).is_some_and(|measure| measure.timing);
            if let (true, Some(Value::Number(time)), Some(Some(Value::Number(other)))) =
                (is_timing, value, others.asked.get(name))
            {
                *time = time.min(*other);
            }
        }
        for (name, time) in &mut metrics.step_us {
            *time = others.step_us.get(name).map_or(*time, |other| time.min(*other));
        }
        for (name, times) in &mut self.series.samples {
            let others = other.series.samples.get(name).into_iter().flatten();
            times.iter_mut().zip(others).for_each(|(time, other)| *time = time.min(*other));
        }
    }
}
