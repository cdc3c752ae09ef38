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
    /// The first integer plus the number of the case, up to the largest one of the variable.
    Case {
        first: i64,
        most: i32,
    },
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
