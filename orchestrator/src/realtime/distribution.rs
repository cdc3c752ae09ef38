//! How durations are distributed.

use hdrhistogram::Histogram;
use serde::{Deserialize, Serialize};
use std::time::Duration;

/// Longest duration that is told from longer ones: an hour.
const LONGEST: Duration = Duration::from_secs(3600);
/// Columns of the histogram that is written: the first ends here, each further one is so many times as wide.
const FIRST: Duration = Duration::from_micros(1);
const WIDER: f64 = std::f64::consts::SQRT_2;

/// Counts durations, to three digits, without allocating.
#[derive(Clone, Debug)]
pub struct Distribution(Histogram<u32>);

/// What is said of a distribution, all in ms.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Summary {
    /// Number of durations.
    pub count: u64,
    /// Shortest.
    pub min: f64,
    /// Median.
    pub median: f64,
    /// 99 % are not longer.
    pub p99: f64,
    /// Longest.
    pub max: f64,
    /// Upper ends of columns, the first starting at 0, with the number of durations in them.
    pub histogram: Vec<(f64, u64)>,
}

impl Default for Distribution {
    fn default() -> Self {
        let counts = Histogram::new_with_bounds(1, LONGEST.as_nanos() as u64, 3);
        Self(counts.expect("the bounds are in order"))
    }
}

impl Distribution {
    /// One more.
    pub fn record(&mut self, duration: Duration) {
        self.0.saturating_record(duration.as_nanos().min(LONGEST.as_nanos()) as u64);
    }

    /// Number, quantiles and histogram.
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
            histogram: columns.map(|c| (ms(c.value_iterated_to()), c.count_since_last_iteration())).collect(),
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
        let near =
            |found: f64, expected: f64| assert!((found / expected - 1.0).abs() < 1e-3, "{found} {expected}");
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
