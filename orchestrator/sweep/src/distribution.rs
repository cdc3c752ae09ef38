//! The distribution of a parameter that varies: its quantile function, with units converted.

mod reader;
mod shape;

use crate::design::Place;
use crate::texts::short;
use crate::vary::Vary;
use cosim::system::System;
use cosim::variation::{SettingValue, Target};
use reader::Reader;
use shape::Shape;
use statrs::distribution::ContinuousCDF;
use statrs::statistics::{Distribution as _, Mode};

/// Smallest part of a distribution that a truncation may leave, as a share of all up to there.
const SMALLEST: f64 = 1e-9;

/// Distribution of the values of a parameter.
#[derive(Clone, Debug)]
pub struct Distribution {
    shape: Shape,
    /// Probabilities between which the quantiles lie, if the distribution is cut off.
    between: [f64; 2],
    /// Smallest and largest value, if there are any.
    ends: Option<[f64; 2]>,
    /// Number of levels in a factorial design, and 0 if it was not given.
    levels: u64,
}

impl Distribution {
    /// Reads the distribution of `vary` for a target, in a sweep with this seed.
    ///
    /// # Errors
    /// Returns an error if there is not exactly one distribution, or if it cannot be that of the
    /// target.
    pub fn new(vary: &Vary, target: Target, system: &System, seed: u64) -> Result<Self, String> {
        let reader = Reader { system, target, seed };
        let shape = reader.shape(vary)?;
        let is_continuous = !matches!(shape, Shape::List(..) | Shape::Case(_) | Shape::Whole(_));
        let mut distribution = Self {
            ends: shape.ends(),
            shape,
            between: [0.0, 1.0],
            levels: u64::from(vary.levels.unwrap_or(0)),
        };
        if let Some(within) = &vary.within {
            if !is_continuous {
                return Err("within is for continuous distributions only".into());
            }
            let [low, high] = within.get_ref();
            let (low, high) = (reader.number(low)?, reader.number(high)?);
            if low >= high {
                return Err(format!(
                    "within = [{low}, {high}]: the second value must be larger than the first one"
                ));
            }
            let [from, to] = [distribution.shape.below(low), distribution.shape.below(high)];
            // Of a smaller part of the upper tail, few values could be told apart.
            if to - from <= SMALLEST * to {
                return Err(format!(
                    "within = [{low}, {high}]: the distribution has next to no values between them"
                ));
            }
            distribution.between = [from, to];
            let [least, most] = distribution.ends.unwrap_or([f64::NEG_INFINITY, f64::INFINITY]);
            distribution.ends = Some([low.max(least), high.min(most)]);
        }
        if vary.levels.is_some() && !is_continuous {
            return Err("levels is for continuous distributions only".into());
        }
        if vary.levels.is_some_and(|levels| levels < 2) {
            return Err("levels must be at least 2".into());
        }
        if vary.weights.is_some() && vary.list.is_none() {
            return Err("weights are for a list only".into());
        }
        // All values that can be drawn must be within the limits of the variable.
        for end in distribution.ends.into_iter().flatten() {
            reader.checked(end)?;
        }
        Ok(distribution)
    }

    /// Returns the number of levels in a factorial design.
    ///
    /// # Errors
    /// Returns an error if the distribution has none.
    pub fn levels(&self) -> Result<u64, String> {
        match &self.shape {
            Shape::List(values, _) => Ok(values.len() as u64),
            Shape::Whole([low, high]) => Ok((i64::from(*high) - i64::from(*low) + 1) as u64),
            Shape::Case(_) => {
                Err("a factorial design cannot vary a parameter by case, which has no levels"
                    .into())
            }
            _ if self.levels == 0 => Err("a factorial design needs levels here".into()),
            _ if self.ends.is_none() => {
                Err("the distribution is unbounded: a factorial design needs within here".into())
            }
            _ => Ok(self.levels),
        }
    }

    /// Checks that the distribution has ends.
    ///
    /// # Errors
    /// Returns an error if it has none, so that there are no corners.
    pub fn check_ends(&self) -> Result<(), String> {
        match self.shape {
            Shape::List(..) | Shape::Whole(_) | Shape::Case(_) => Ok(()),
            _ if self.ends.is_some() => Ok(()),
            _ => Err("the distribution is unbounded: corners and searches need within here".into()),
        }
    }

    /// Returns the distribution in words.
    pub fn in_words(&self) -> String {
        let ends = |[low, high]: [f64; 2]| format!("{} to {}", short(low), short(high));
        let whole = match &self.shape {
            Shape::Uniform(bounds) => format!("uniform, {}", ends(*bounds)),
            Shape::Whole([low, high]) => format!("integers, {low} to {high}"),
            Shape::Normal(normal) => {
                let (mean, deviation) = (normal.mean(), normal.std_dev());
                format!(
                    "normal, mean {}, deviation {}",
                    short(mean.unwrap_or(f64::NAN)),
                    short(deviation.unwrap_or(f64::NAN))
                )
            }
            Shape::LogNormal(log_normal) => {
                format!("log-normal, median {}", short(log_normal.inverse_cdf(0.5)))
            }
            Shape::Triangular(triangular) => format!(
                "triangular, {}, most likely {}",
                ends([triangular.inverse_cdf(0.0), triangular.inverse_cdf(1.0)]),
                short(triangular.mode().unwrap_or(f64::NAN))
            ),
            Shape::List(values, _) => {
                let shown = values.iter().take(6).map(|value| match value {
                    SettingValue::Real(value) => short(*value),
                    other => other.to_json().to_string(),
                });
                let more = if values.len() > 6 { ", …" } else { "" };
                format!("one of {}{more}", shown.collect::<Vec<_>>().join(", "))
            }
            Shape::Case(seeds) => format!("number of the case + {}", seeds.first),
        };
        match (self.ends, self.shape.ends()) {
            (Some(bounds), uncut) if uncut != Some(bounds) => {
                format!("{whole}, within {}", ends(bounds))
            }
            _ => whole,
        }
    }

    /// Returns whether values can be between any two of them, so that correlations and searches
    /// make sense.
    pub fn is_ordered(&self) -> bool {
        !matches!(self.shape, Shape::Case(_))
            && !matches!(&self.shape, Shape::List(values, _)
                if !matches!(values.first(), Some(SettingValue::Real(_) | SettingValue::Integer(_))))
    }

    /// Returns the texts among the values.
    pub(crate) fn texts(&self) -> impl Iterator<Item = &str> {
        let values = if let Shape::List(values, _) = &self.shape { &values[..] } else { &[] };
        values.iter().filter_map(|value| match value {
            SettingValue::Text(text) => Some(text.as_str()),
            _ => None,
        })
    }

    /// Returns the number of different seeds, if the value is a function of the case's number
    /// instead of its place.
    pub fn seeds(&self) -> Option<u64> {
        if let Shape::Case(seeds) = &self.shape { Some(seeds.count()) } else { None }
    }

    /// Returns the value at a place for the case with this number.
    pub fn value(&self, place: Place, case: u64) -> SettingValue {
        let last = |values: &[SettingValue]| values.len().saturating_sub(1);
        match (&self.shape, place) {
            // The ends of the seeds are those of an integer.
            (Shape::Case(seeds), _) => SettingValue::Integer(seeds.of(case) as i32),
            (Shape::List(values, sums), Place::Quantile(unit)) => {
                let index = sums.partition_point(|sum| *sum <= unit);
                values[index.min(last(values))].clone()
            }
            (Shape::List(values, _), Place::Level(level)) => {
                values[(level as usize).min(last(values))].clone()
            }
            (Shape::List(values, _), Place::End(is_last)) => {
                values[if is_last { last(values) } else { 0 }].clone()
            }
            (Shape::Whole([low, high]), place) => {
                let count = (i64::from(*high) - i64::from(*low) + 1) as f64;
                let offset = match place {
                    Place::Quantile(unit) => (unit * count).floor(),
                    Place::Level(level) => level as f64,
                    Place::End(is_last) => f64::from(u8::from(is_last)) * (count - 1.0),
                };
                SettingValue::Integer((f64::from(*low) + offset.min(count - 1.0)) as i32)
            }
            (_, Place::End(is_last)) => {
                SettingValue::Real(self.ends.map_or(f64::NAN, |ends| ends[usize::from(is_last)]))
            }
            (_, Place::Level(level)) if level == 0 || level + 1 >= self.levels => {
                self.value(Place::End(level > 0), case)
            }
            (_, Place::Level(level)) => {
                let unit = level as f64 / (self.levels - 1) as f64;
                self.value(Place::Quantile(unit), case)
            }
            (shape, Place::Quantile(unit)) => {
                let [from, to] = self.between;
                let value = shape.quantile(from + unit * (to - from));
                let [low, high] = self.ends.unwrap_or([f64::NEG_INFINITY, f64::INFINITY]);
                SettingValue::Real(value.clamp(low, high))
            }
        }
    }
}
