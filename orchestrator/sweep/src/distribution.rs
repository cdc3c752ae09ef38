//! The distribution of a parameter that varies: its quantile function, with units converted.

mod reader;
mod shape;

use crate::design::Place;
use crate::texts::short;
use crate::vary::Vary;
use cosim::system::System;
use cosim::variation::{SettingValue, Target};
use reader::Reader;
use shape::{Continuous, Shape, count};

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
        let mut shape = reader.shape(&vary.asked()?)?;
        let Shape::Continuous(continuous) = &mut shape else {
            let given = [("within", vary.within.is_some()), ("levels", vary.levels.is_some())];
            return match given.iter().find(|(_, is_given)| *is_given) {
                Some((key, _)) => Err(format!("{key} is for continuous distributions only")),
                None => Ok(Self(shape)),
            };
        };
        if let Some(within) = &vary.within {
            let [low, high] = within;
            continuous.truncate(reader.number(low)?, reader.number(high)?)?;
        }
        if vary.levels.is_some_and(|levels| levels < 2) {
            return Err("levels must be at least 2".into());
        }
        continuous.levels = vary.levels.map(u64::from);
        // All values that can be drawn must be within the limits of the variable.
        for end in continuous.ends.into_iter().flatten() {
            reader.checked(end)?;
        }
        Ok(Self(shape))
    }

    /// Returns the number of levels in a factorial design.
    ///
    /// # Errors
    /// Returns an error if the distribution has none.
    pub fn levels(&self) -> Result<u64, String> {
        match &self.0 {
            Shape::List { values, .. } => Ok(values.len() as u64),
            Shape::Whole(ends) => Ok(count(*ends)),
            Shape::Case(_) => {
                Err("a factorial design cannot vary a parameter by case, which has no levels"
                    .into())
            }
            Shape::Continuous(Continuous { levels: None, .. }) => {
                Err("a factorial design needs levels here".into())
            }
            Shape::Continuous(Continuous { ends: None, .. }) => {
                Err("the distribution is unbounded: a factorial design needs within here".into())
            }
            Shape::Continuous(Continuous { levels: Some(levels), .. }) => Ok(*levels),
        }
    }

    /// Checks that the distribution has ends.
    ///
    /// # Errors
    /// Returns an error if it has none, so that there are no corners.
    pub fn check_ends(&self) -> Result<(), String> {
        match self.0 {
            Shape::Continuous(Continuous { ends: None, .. }) => {
                Err("the distribution is unbounded: corners and searches need within here".into())
            }
            _ => Ok(()),
        }
    }

    /// Returns the distribution in words.
    pub fn in_words(&self) -> String {
        match &self.0 {
            Shape::Continuous(continuous) => continuous.in_words(),
            Shape::Whole([low, high]) => format!("integers, {low} to {high}"),
            Shape::List { values, .. } => {
                let shown = values.iter().take(6).map(|value| match value {
                    SettingValue::Real(value) => short(*value),
                    other => other.to_json().to_string(),
                });
                let more = if values.len() > 6 { ", …" } else { "" };
                format!("one of {}{more}", shown.collect::<Vec<_>>().join(", "))
            }
            Shape::Case(seeds) => format!("number of the case + {}", seeds.first),
        }
    }

    /// Returns whether values can be between any two of them, so that correlations and searches
    /// make sense.
    pub fn is_ordered(&self) -> bool {
        match &self.0 {
            Shape::Continuous(_) | Shape::Whole(_) => true,
            Shape::List { values, .. } => {
                matches!(values.first(), Some(SettingValue::Real(_) | SettingValue::Integer(_)))
            }
            Shape::Case(_) => false,
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

    /// Returns the value at a place for the case with this number.
    pub fn value(&self, place: Place, case: u64) -> SettingValue {
        match &self.0 {
            Shape::Continuous(continuous) => SettingValue::Real(continuous.value(place)),
            Shape::Whole(ends) => {
                let index = match place {
                    Place::Quantile(unit) => (unit * count(*ends) as f64) as u64,
                    place => index(place),
                };
                let offset = index.min(count(*ends) - 1);
                SettingValue::Integer((i64::from(ends[0]) + offset.cast_signed()) as i32)
            }
            Shape::List { values, sums } => {
                let index = match place {
                    Place::Quantile(unit) => sums.partition_point(|sum| *sum <= unit),
                    place => index(place) as usize,
                };
                values[index.min(values.len().saturating_sub(1))].clone()
            }
            // The ends of the seeds are those of an integer.
            Shape::Case(seeds) => SettingValue::Integer(seeds.of(case) as i32),
        }
    }
}

/// Returns the index of a level or an end; that of the upper end is larger than any index.
fn index(place: Place) -> u64 {
    match place {
        Place::Level(level) => level,
        Place::End(true) => u64::MAX,
        Place::End(false) | Place::Quantile(_) => 0,
    }
}
