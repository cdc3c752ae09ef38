//! The shapes of distributions, and their quantile functions.

use cosim::variation::SettingValue;
use statrs::distribution::{ContinuousCDF, Normal, Uniform};
use statrs::statistics::{Max, Min};

/// Smallest part of a distribution that a truncation may leave, as a share of all up to there.
const SMALLEST: f64 = 1e-9;

/// Shape of a distribution.
#[derive(Clone, Debug)]
pub(super) enum Shape {
    Uniform(Uniform),
    Normal(Truncated),
    /// Values with the probabilities up to and including each of them.
    List {
        values: Vec<SettingValue>,
        sums: Vec<f64>,
    },
    /// Consecutive integers, one for each case.
    Case(Seeds),
}

/// Seeds that differ from case to case, and from one sweep to another.
#[derive(Clone, Copy, Debug)]
pub(super) struct Seeds {
    /// Seed of case 0.
    pub(super) first: i64,
    /// Smallest and largest value of the parameter.
    ends: [i64; 2],
}

impl Seeds {
    /// Begins at `first` in a sweep with the seed 1, and elsewhere in others. Multiples of the
    /// golden ratio keep the beginnings apart: of 1,000 sweeps whose seeds follow one another, two
    /// begin at least 1/2,210 of the range from each other.
    pub(super) fn new(first: i64, ends: [i64; 2], seed: u64) -> Self {
        let turn = seed.wrapping_sub(1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        let whole = Self { first, ends };
        let shift = (u128::from(turn) * u128::from(whole.count())) >> 64;
        Self { first: whole.of(shift as u64), ends }
    }

    /// Returns the number of different seeds.
    pub(super) fn count(&self) -> u64 {
        self.ends[1].abs_diff(self.ends[0]) + 1
    }

    /// Returns the seed of a case. The smallest follows the largest.
    pub(super) fn of(&self, case: u64) -> i64 {
        let [least, _] = self.ends;
        let place =
            (u128::from(self.first.abs_diff(least)) + u128::from(case)) % u128::from(self.count());
        least + place as i64
    }
}

/// A normal distribution, which may be truncated.
#[derive(Clone, Debug)]
pub(super) struct Truncated {
    pub(super) whole: Normal,
    /// Probabilities between which the quantiles lie.
    between: [f64; 2],
    /// Smallest and largest value, if there are any.
    pub(super) ends: Option<[f64; 2]>,
}

impl Truncated {
    /// Cuts off what lies outside two values, if there are any.
    ///
    /// # Errors
    /// Returns an error if next to nothing is left.
    pub(super) fn new(whole: Normal, ends: Option<[f64; 2]>) -> Result<Self, String> {
        let Some([low, high]) = ends else {
            return Ok(Self { whole, between: [0.0, 1.0], ends });
        };
        if low >= high {
            return Err(reversed("within", low, high));
        }
        let between = [low, high].map(|value| whole.cdf(value));
        // In a smaller part of the upper tail, few values could be distinguished.
        if between[1] - between[0] <= SMALLEST * between[1] {
            return Err(format!(
                "within = [{low}, {high}]: the distribution has next to no values between them"
            ));
        }
        Ok(Self { whole, between, ends })
    }

    /// Returns the quantile of a probability between 0 and 1.
    pub(super) fn value(&self, unit: f64) -> f64 {
        let [from, to] = self.between;
        // The ends of the whole distribution are infinite.
        let unit = (from + unit * (to - from)).clamp(f64::MIN_POSITIVE, 1.0 - f64::EPSILON / 2.0);
        self.whole.inverse_cdf(unit)
    }
}

/// Says that the second one of two values must be larger.
pub(super) fn reversed(key: &str, low: f64, high: f64) -> String {
    format!("{key} = [{low}, {high}]: the second value must be larger than the first one")
}

impl Shape {
    /// Returns the smallest and the largest value of a continuous distribution that has ends.
    pub(super) fn ends(&self) -> Option<[f64; 2]> {
        match self {
            Self::Uniform(uniform) => Some([uniform.min(), uniform.max()]),
            Self::Normal(normal) => normal.ends,
            Self::List { .. } | Self::Case(_) => None,
        }
    }
}
