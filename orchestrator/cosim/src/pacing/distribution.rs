//! Distributions of durations, with their quantiles and histograms.

use hdrhistogram::Histogram;
use serde::{Deserialize, Serialize};
use std::time::Duration;

/// Upper end of the range in which durations are distinguished, which is an hour.
const LONGEST: Duration = Duration::from_secs(3600);
/// Width of the first column of the written histogram; each further column ends at a constant
/// multiple of the one before.
const FIRST: Duration = Duration::from_micros(1);
const WIDER: f64 = std::f64::consts::SQRT_2;

/// Counts durations to three digits, without allocating memory.
#[derive(Clone, Debug)]
pub struct Distribution(Histogram<u32>);

/// Summary of a distribution; all durations are in ms.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Summary {
    /// Number of durations that were recorded.
    pub count: u64,
    /// Shortest of the durations, ms.
    pub min: f64,
    /// Median of the durations, ms.
    pub median: f64,
    /// 99th percentile of the durations, ms.
    pub p99: f64,
    /// Longest of the durations, ms.
    pub max: f64,
    /// Upper ends of the histogram's columns, ms, with the number of durations in each. The first
    /// column starts at 0.
    pub histogram: Vec<(f64, u64)>,
}

impl Default for Distribution {
    fn default() -> Self {
        let counts = Histogram::new_with_bounds(1, LONGEST.as_nanos() as u64, 3);
        Self(counts.expect("the bounds are in order"))
    }
}

impl Distribution {
    /// Adds one duration to the distribution.
    pub fn record(&mut self, duration: Duration) {
        self.0.saturating_record(duration.as_nanos().min(LONGEST.as_nanos()) as u64);
    }

    /// Summarizes the distribution by its number of durations, quantiles and histogram.
    pub fn summary(&self) -> Summary {
        if self.0.is_empty() {
            return Summary::default();
        }
        let ms = |nanoseconds: u64| nanoseconds as f64 * 1e-6;
        let columns = self.0.iter_log(FIRST.as_nanos() as u64, WIDER);
        Summary {
            count: self.0.len(),
            min: ms(self.0.min()),
            median: ms(self.0.value_at_quantile(0.5)),
            p99: ms(self.0.value_at_quantile(0.99)),
            max: ms(self.0.max()),
            histogram: columns
                .map(|c| (ms(c.value_iterated_to()), c.count_since_last_iteration()))
                .collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn oracle_a_hundred_durations_by_hand() {
        let mut distribution = Distribution::default();
        assert_eq!(distribution.summary(), Summary::default());
        for milliseconds in 1..=100 {
            distribution.record(Duration::from_millis(milliseconds));
        }
        let summary = distribution.summary();
        let near = |value: f64, expected: f64| {
            assert!((value / expected - 1.0).abs() < 1e-3, "{value} {expected}");
        };
        near(summary.min, 1.0);
        near(summary.median, 50.0);
        near(summary.p99, 99.0);
        near(summary.max, 100.0);
        assert_eq!(summary.count, 100);
        assert_eq!(summary.histogram.iter().map(|(_, count)| count).sum::<u64>(), 100);
        assert!(summary.histogram.windows(2).all(|pair| pair[0].0 < pair[1].0));
        assert!(summary.histogram.last().unwrap().0 >= 100.0);
    }

    #[test]
    fn what_is_longer_than_an_hour_counts_as_an_hour() {
        let mut distribution = Distribution::default();
        distribution.record(Duration::MAX);
        assert!((distribution.summary().max / 3.6e6 - 1.0).abs() < 1e-3);
    }
}
