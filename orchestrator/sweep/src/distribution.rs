//! The distribution of a parameter that varies: its quantile function, with units converted.

mod reader;
mod shape;

use crate::texts::shown;
use crate::vary::Vary;
use cosim::system::System;
use cosim::variation::{SettingValue, Target};
use reader::Reader;
use shape::{Shape, Truncated};
use statrs::distribution::ContinuousCDF;
use statrs::statistics::{Distribution as _, Max, Min};

/// Distribution of the values of a parameter.
#[derive(Clone, Debug)]
pub struct Distribution(Shape);

impl Distribution {
    /// Reads the distribution of `vary` for a target, in a sweep with this seed.
    ///
    /// # Errors
    /// Returns an error if there is not exactly one distribution, or if it cannot be that of the
    /// target.
    pub fn new(vary: &Vary, target: Target, system: &System, seed: u64) -> Result<Self, String> {
        let reader = Reader { system, target, seed };
        let shape = reader.shape(&vary.asked()?)?;
        // All values that can be drawn must be within the limits of the variable.
        for end in shape.ends().into_iter().flatten() {
            reader.checked(end)?;
        }
        Ok(Self(shape))
    }

    /// Returns the number of values, of which the design `levels` combines each with all others.
    ///
    /// # Errors
    /// Returns an error if they cannot be counted.
    pub fn levels(&self) -> Result<u64, String> {
        match &self.0 {
            Shape::List { values, .. } => Ok(values.len() as u64),
            _ => Err("the design levels needs single values: a list".into()),
        }
    }

    /// Checks that the distribution has ends.
    ///
    /// # Errors
    /// Returns an error if it has none, so that there are no corners.
    pub fn check_ends(&self) -> Result<(), String> {
        match &self.0 {
            Shape::Normal(normal) if normal.ends.is_none() => {
                Err("the distribution is unbounded: corners and searches need within here".into())
            }
            _ => Ok(()),
        }
    }

    /// Returns the texts among the values.
    pub(crate) fn texts(&self) -> impl Iterator<Item = &str> {
        let values = if let Shape::List { values, .. } = &self.0 { &values[..] } else { &[] };
        values.iter().filter_map(|value| match value {
            SettingValue::Text(text) => Some(text.as_str()),
            _ => None,
        })
    }

    /// Returns the number of different seeds, if the value is a function of the case's number
    /// instead of its place.
    pub fn seeds(&self) -> Option<u64> {
        if let Shape::Case(seeds) = &self.0 { Some(seeds.count()) } else { None }
    }

    /// Returns the quantile of this probability for the case with this number. Those of 0 and 1 are
    /// the ends.
    pub fn value(&self, unit: f64, case: u64) -> SettingValue {
        let [low, high] = self.0.ends().unwrap_or([f64::NEG_INFINITY, f64::INFINITY]);
        let real = |quantile: &dyn Fn(f64) -> f64| {
            // Rounding must not miss an end.
            SettingValue::Real(match unit {
                _ if unit <= 0.0 && low.is_finite() => low,
                _ if unit >= 1.0 && high.is_finite() => high,
                _ => quantile(unit).clamp(low, high),
            })
        };
        match &self.0 {
            Shape::Uniform(uniform) => real(&|unit| uniform.inverse_cdf(unit)),
            Shape::Normal(normal) => real(&|unit| normal.value(unit)),
            Shape::List { values, sums } => {
                let index = sums.partition_point(|sum| *sum <= unit);
                values[index.min(values.len().saturating_sub(1))].clone()
            }
            // The ends of the seeds are those of an integer.
            Shape::Case(seeds) => SettingValue::Integer(seeds.of(case) as i32),
        }
    }

    /// Returns the distribution in words.
    pub fn in_words(&self) -> String {
        let range = |[low, high]: [f64; 2]| format!("{} to {}", shown(low), shown(high));
        match &self.0 {
            Shape::Uniform(uniform) => {
                format!("uniform, {}", range([uniform.min(), uniform.max()]))
            }
            Shape::Normal(Truncated { whole, ends, .. }) => {
                let number = |number: Option<f64>| shown(number.unwrap_or(f64::NAN));
                let (mean, deviation) = (number(whole.mean()), number(whole.std_dev()));
                let within = ends.map(|ends| format!(", within {}", range(ends)));
                let within = within.unwrap_or_default();
                format!("normal, mean {mean}, deviation {deviation}{within}")
            }
            Shape::List { values, .. } => {
                let words = values.iter().take(6).map(|value| match value {
                    SettingValue::Real(value) => shown(*value),
                    other => other.to_json().to_string(),
                });
                let more = if values.len() > 6 { ", …" } else { "" };
                format!("one of {}{more}", words.collect::<Vec<_>>().join(", "))
            }
            Shape::Case(seeds) => format!("number of the case + {}", seeds.first),
        }
    }
}
