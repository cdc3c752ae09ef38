//! The shapes of distributions, and their quantile functions.

use cosim::variation::SettingValue;
use statrs::distribution::{ContinuousCDF, LogNormal, Normal, Triangular};

/// Shape of a distribution.
#[derive(Clone, Debug)]
pub(super) enum Shape {
    Uniform([f64; 2]),
    /// Integers, both ends included.
    Whole([i32; 2]),
    Normal(Normal),
    LogNormal(LogNormal),
    Triangular(Triangular),
    /// Values with the probabilities up to and including each of them.
    List(Vec<SettingValue>, Vec<f64>),
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

impl Shape {
    pub(super) fn ends(&self) -> Option<[f64; 2]> {
        match self {
            Self::Uniform(ends) => Some(*ends),
            Self::Whole(ends) => Some(ends.map(f64::from)),
            Self::Triangular(distribution) => {
                Some([distribution.inverse_cdf(0.0), distribution.inverse_cdf(1.0)])
            }
            _ => None,
        }
    }

    /// Returns the probability of values up to this one.
    pub(super) fn below(&self, value: f64) -> f64 {
        match self {
            Self::Uniform([low, high]) => ((value - low) / (high - low)).clamp(0.0, 1.0),
            Self::Normal(distribution) => distribution.cdf(value),
            Self::LogNormal(distribution) => distribution.cdf(value),
            Self::Triangular(distribution) => distribution.cdf(value),
            Self::Whole(_) | Self::List(..) | Self::Case { .. } => f64::NAN,
        }
    }

    pub(super) fn quantile(&self, unit: f64) -> f64 {
        // The ends of an unbounded distribution are infinite.
        let inside = unit.clamp(f64::MIN_POSITIVE, 1.0 - f64::EPSILON / 2.0);
        match self {
            Self::Uniform([low, high]) => low + unit * (high - low),
            Self::Normal(distribution) => distribution.inverse_cdf(inside),
            Self::LogNormal(distribution) => distribution.inverse_cdf(inside),
            Self::Triangular(distribution) => distribution.inverse_cdf(unit),
            Self::Whole(_) | Self::List(..) | Self::Case { .. } => f64::NAN,
        }
    }
}
