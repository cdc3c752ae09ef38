//! The shapes of distributions, and their quantile functions.

use crate::texts::shown;
use cosim::variation::SettingValue;
use statrs::distribution::{ContinuousCDF, Normal, Uniform};
use statrs::statistics::{Distribution as _, Max, Min};

/// Smallest part of a distribution that a truncation may leave, as a share of all up to there.
const SMALLEST: f64 = 1e-9;

/// Shape of a distribution.
#[derive(Clone, Debug)]
pub(super) enum Shape {
    Continuous(Continuous),
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

/// A continuous distribution, which may be truncated.
#[derive(Clone, Debug)]
pub(super) struct Continuous {
    whole: Whole,
    /// Probabilities between which the quantiles lie.
    between: [f64; 2],
    /// Smallest and largest value, if there are any.
    pub(super) ends: Option<[f64; 2]>,
}

/// A continuous distribution before a truncation.
#[derive(Clone, Debug)]
pub(super) enum Whole {
    Uniform(Uniform),
    Normal(Normal),
}

impl Whole {
    fn function(&self) -> &dyn ContinuousCDF<f64, f64> {
        match self {
            Self::Uniform(distribution) => distribution,
            Self::Normal(distribution) => distribution,
        }
    }

    fn ends(&self) -> Option<[f64; 2]> {
        let ends = [self.function().min(), self.function().max()];
        ends.iter().all(|end| end.is_finite()).then_some(ends)
    }
}

impl From<Whole> for Shape {
    fn from(whole: Whole) -> Self {
        let ends = whole.ends();
        Self::Continuous(Continuous { whole, between: [0.0, 1.0], ends })
    }
}

impl Continuous {
    /// Cuts off what lies outside two values.
    ///
    /// # Errors
    /// Returns an error if next to nothing is left.
    pub(super) fn truncate(&mut self, low: f64, high: f64) -> Result<(), String> {
        if low >= high {
            return Err(format!(
                "within = [{low}, {high}]: the second value must be larger than the first one"
            ));
        }
        let [from, to] = [low, high].map(|value| self.whole.function().cdf(value));
        // In a smaller part of the upper tail, few values could be distinguished.
        if to - from <= SMALLEST * to {
            return Err(format!(
                "within = [{low}, {high}]: the distribution has next to no values between them"
            ));
        }
        self.between = [from, to];
        let [least, most] = self.bounds();
        self.ends = Some([low.max(least), high.min(most)]);
        Ok(())
    }

    /// Returns the ends, which are infinite if there are none.
    fn bounds(&self) -> [f64; 2] {
        self.ends.unwrap_or([f64::NEG_INFINITY, f64::INFINITY])
    }

    pub(super) fn value(&self, unit: f64) -> f64 {
        let [low, high] = match self.ends {
            // Rounding must not miss an end.
            Some([low, _]) if unit <= 0.0 => return low,
            Some([_, high]) if unit >= 1.0 => return high,
            _ => self.bounds(),
        };
        let [from, to] = self.between;
        let mut unit = from + unit * (to - from);
        if self.whole.ends().is_none() {
            // The ends of an unbounded distribution are infinite.
            unit = unit.clamp(f64::MIN_POSITIVE, 1.0 - f64::EPSILON / 2.0);
        }
        self.whole.function().inverse_cdf(unit).clamp(low, high)
    }

    pub(super) fn in_words(&self) -> String {
        let ends = |[low, high]: [f64; 2]| format!("{} to {}", shown(low), shown(high));
        let number = |number: Option<f64>| shown(number.unwrap_or(f64::NAN));
        let whole = match &self.whole {
            Whole::Uniform(uniform) => format!("uniform, {}", ends([uniform.min(), uniform.max()])),
            Whole::Normal(normal) => {
                let (mean, deviation) = (number(normal.mean()), number(normal.std_dev()));
                format!("normal, mean {mean}, deviation {deviation}")
            }
        };
        match self.ends {
            Some(bounds) if self.whole.ends() != Some(bounds) => {
                format!("{whole}, within {}", ends(bounds))
            }
            _ => whole,
        }
    }
}
