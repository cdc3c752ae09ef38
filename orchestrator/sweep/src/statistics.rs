//! Statistics of a sample of cases, with confidence intervals.

use serde::Serialize;
use statrs::distribution::{Beta, Binomial, ContinuousCDF, DiscreteCDF};

/// Confidence of the intervals in a report.
pub const CONFIDENCE: f64 = 0.95;

/// A probability that was estimated from a sample.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Probability {
    /// Number of events.
    pub events: u64,
    /// Number of cases.
    pub cases: u64,
    /// Share of the events.
    pub share: f64,
    /// Lower end of the interval, by Clopper and Pearson.
    pub low: f64,
    /// Upper end of the interval. Without an event it is the bound that the cases prove.
    pub high: f64,
}

impl Probability {
    /// Estimates a probability from `events` among `cases`. Each end is exceeded with half of the
    /// remaining probability; without an event (or with nothing else) the other end has all of it,
    /// as the bound that so many cases prove. Over all outcomes the interval holds with at least
    /// `1 - 1.5 (1 - confidence)`, because such a bound is exceeded twice as often as an end of the
    /// other intervals.
    pub fn new(events: u64, cases: u64, confidence: f64) -> Self {
        let (k, n) = (events as f64, cases as f64);
        let rest = 1.0 - confidence;
        let tail = if events == 0 || events == cases { rest } else { rest / 2.0 };
        let quantile =
            |a: f64, b: f64, p: f64| Beta::new(a, b).map_or(f64::NAN, |beta| beta.inverse_cdf(p));
        let low = if events == 0 { 0.0 } else { quantile(k, n - k + 1.0, tail) };
        let high = if events == cases { 1.0 } else { quantile(k + 1.0, n - k, 1.0 - tail) };
        Self { events, cases, share: k / n, low, high }
    }
}

/// Numbers that describe a measure over all cases that have it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Summary {
    /// Number of cases with a value.
    pub cases: u64,
    /// Arithmetic mean.
    pub mean: f64,
    /// Standard deviation of the sample.
    pub deviation: f64,
    /// Quantiles with their confidence intervals.
    pub quantiles: Vec<Quantile>,
    /// Number of the case with the largest value.
    pub worst: u64,
}

/// A quantile of a measure.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Quantile {
    /// Probability below the quantile; 0 and 1 denote the smallest and largest value.
    pub probability: f64,
    /// Value in the sample.
    pub value: f64,
    /// Lower end of the confidence interval, which is a value of the sample; none if the sample is
    /// too small.
    pub low: Option<f64>,
    /// Upper end of the confidence interval.
    pub high: Option<f64>,
}

/// Probabilities of the quantiles in a summary.
pub const PROBABILITIES: [f64; 7] = [0.0, 0.05, 0.5, 0.95, 0.99, 0.999, 1.0];

/// Describes the values of a measure; the position of a value is the number of its case. Values
/// that are not numbers are missing. Returns `None` if all are.
pub fn summary(values: &[f64]) -> Option<Summary> {
    let mut sorted: Vec<f64> = values.iter().copied().filter(|value| !value.is_nan()).collect();
    sorted.sort_unstable_by(f64::total_cmp);
    let largest = *sorted.last()?;
    let n = sorted.len() as f64;
    let mean = sorted.iter().sum::<f64>() / n;
    let squares: f64 = sorted.iter().map(|value| (value - mean).powi(2)).sum();
    let worst = values.iter().position(|value| *value == largest).unwrap_or(0);
    Some(Summary {
        cases: sorted.len() as u64,
        mean,
        deviation: (squares / (n - 1.0)).sqrt(),
        quantiles: PROBABILITIES.map(|p| quantile(&sorted, p)).to_vec(),
        worst: worst as u64,
    })
}

/// Returns a quantile of sorted values by nearest rank, with an interval of order statistics.
fn quantile(sorted: &[f64], probability: f64) -> Quantile {
    let n = sorted.len();
    let rank = ((probability * n as f64).ceil() as usize).clamp(1, n);
    let value = sorted[rank - 1];
    let none = Quantile { probability, value, low: None, high: None };
    if probability <= 0.0 || probability >= 1.0 {
        return none;
    }
    // The number of values below the quantile is binomial.
    let Ok(below) = Binomial::new(probability, n as u64) else { return none };
    let tail = (1.0 - CONFIDENCE) / 2.0;
    // Largest r with P(fewer than r values below) <= tail, and smallest s with P(at least s values
    // below) <= tail; the values with these ranks are the ends.
    let r = first(n as u64, |count| below.cdf(count) > tail);
    let s = first(n as u64, |count| below.sf(count) <= tail) + 1;
    let value_at = |rank: u64| sorted.get((rank as usize).checked_sub(1)?).copied();
    Quantile { low: value_at(r), high: value_at(s), ..none }
}

/// Returns the first number from which on a condition holds, or `high` if there is none below.
fn first(mut high: u64, holds: impl Fn(u64) -> bool) -> u64 {
    let mut low = 0;
    while low < high {
        let middle = low + (high - low) / 2;
        if holds(middle) {
            high = middle;
        } else {
            low = middle + 1;
        }
    }
    low
}

#[cfg(test)]
mod tests {
    use super::*;
    use statrs::distribution::Discrete;

    #[test]
    fn published_bounds_of_clopper_and_pearson() {
        // The rule of three, exactly: 1 - 0.05^(1/n).
        let none = Probability::new(0, 1000, 0.95);
        assert!((none.high - (1.0 - 0.05_f64.powf(1e-3))).abs() < 1e-12 && none.low == 0.0);
        // R: binom.test(7, 20)$conf.int
        let some = Probability::new(7, 20, 0.95);
        assert!((some.low - 0.1539092).abs() < 1e-6 && (some.high - 0.5921885).abs() < 1e-6);
        let certain = Probability::new(20, 20, 0.95);
        assert!(certain.high == 1.0 && (certain.low - 0.05_f64.powf(1.0 / 20.0)).abs() < 1e-9);
    }

    #[test]
    fn oracle_an_interval_covers_as_often_as_it_says() {
        // All outcomes of 40 cases, weighed with their probability.
        for probability in [0.02, 0.2, 0.5] {
            let binomial = Binomial::new(probability, 40).unwrap();
            let covered: f64 = (0..=40)
                .filter(|k| {
                    let estimate = Probability::new(*k, 40, 0.95);
                    estimate.low <= probability && probability <= estimate.high
                })
                .map(|k| binomial.pmf(k))
                .sum();
            // Without an event the interval has one side: twice the error there.
            assert!(covered >= 0.925, "{probability}: {covered}");
        }
    }

    #[test]
    fn oracle_cases_without_an_event_prove_a_bound() {
        // As many as ln(0.05)/ln(1 - 1e-4), rounded up.
        assert!(Probability::new(0, 29_956, 0.95).high <= 1e-4);
        assert!(Probability::new(0, 29_955, 0.95).high > 1e-4);
    }

    #[test]
    fn oracle_quantiles_by_hand() {
        let values: Vec<f64> = (1..=100).rev().map(f64::from).collect();
        let summary = summary(&values).unwrap();
        assert_eq!((summary.cases, summary.mean, summary.worst), (100, 50.5, 0));
        let quantile = |p: f64| *summary.quantiles.iter().find(|q| q.probability == p).unwrap();
        assert_eq!(
            (quantile(0.0).value, quantile(0.5).value, quantile(0.95).value, quantile(1.0).value),
            (1.0, 50.0, 95.0, 100.0)
        );
        // The usual interval of the median of 100 values: the 40th to the 61st.
        assert_eq!((quantile(0.5).low, quantile(0.5).high), (Some(40.0), Some(61.0)));
        assert_eq!(quantile(0.999).high, None);
        assert!(super::summary(&[f64::NAN]).is_none());
        assert_eq!(super::summary(&[f64::NAN, 3.0, 1.0]).unwrap().worst, 1);
    }

    #[test]
    fn oracle_the_interval_of_a_quantile_covers_it() {
        // Values 1 to n of a uniform distribution: the p-quantile lies between order statistics r
        // and s with the probability that r to s - 1 of n values are below it.
        for (n, p) in [(100, 0.5), (60, 0.95), (1000, 0.99)] {
            let values: Vec<f64> = (1..=n).map(f64::from).collect();
            let estimate = quantile(&values, p);
            let (low, high) = (
                estimate.low.unwrap_or(0.0) as u64,
                estimate.high.map_or(n as u64 + 1, |h| h as u64),
            );
            let binomial = Binomial::new(p, n as u64).unwrap();
            let covered: f64 = (low..high).map(|k| binomial.pmf(k)).sum();
            assert!(covered >= 0.95, "{n} {p}: {covered}");
        }
    }
}
