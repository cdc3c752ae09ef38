//! Reads the distribution of a parameter, with units converted.

use super::shape::{Seeds, Shape};
use crate::vary::{Range, Vary};
use cosim::system::System;
use cosim::variation::{SettingValue, Target};
use fmi_master::description::VariableKind;
use statrs::distribution::{LogNormal, Normal, Triangular};
use toml::Value;

/// Largest number of values of a range.
const MOST: u32 = 1_000_000;

/// Reads the values of a distribution for one target.
pub(super) struct Reader<'a> {
    pub(super) system: &'a System,
    pub(super) target: Target,
    /// Seed of the sweep.
    pub(super) seed: u64,
}

impl Reader<'_> {
    pub(super) fn shape(&self, vary: &Vary) -> Result<Shape, String> {
        let given = [
            ("uniform", vary.uniform.is_some()),
            ("normal", vary.normal.is_some()),
            ("log_normal", vary.log_normal.is_some()),
            ("triangular", vary.triangular.is_some()),
            ("list", vary.list.is_some()),
            ("range", vary.range.is_some()),
            ("sign", vary.sign.is_some()),
            ("case", vary.case.is_some()),
        ];
        let chosen: Vec<&str> =
            given.iter().filter(|(_, is_given)| *is_given).map(|(name, _)| *name).collect();
        if chosen.len() != 1 {
            let names = given.map(|(name, _)| name).join(", ");
            let said = if chosen.is_empty() { "none".into() } else { chosen.join(" and ") };
            return Err(format!("one distribution is needed ({names}), but there is {said}"));
        }
        let kind = &self.system.variable(self.target).kind;
        if !matches!(kind, VariableKind::Real { .. })
            && matches!(chosen[0], "normal" | "log_normal" | "triangular")
        {
            return Err(format!(
                "{} is for parameters of type Real, not {}",
                chosen[0],
                kind.name()
            ));
        }
        if let Some(uniform) = &vary.uniform {
            return self.uniform(uniform.get_ref(), kind);
        }
        if let Some(normal) = &vary.normal {
            let normal = normal.get_ref();
            let (mean, deviation) =
                (self.number(&normal.mean)?, self.difference(&normal.deviation)?);
            let normal = Normal::new(mean, deviation);
            return normal
                .map(Shape::Normal)
                .map_err(|_| format!("normal: deviation = {deviation}, but it must be above 0"));
        }
        if let Some(log_normal) = &vary.log_normal {
            let log_normal = log_normal.get_ref();
            let (median, sigma) = (self.number(&log_normal.median)?, finite(log_normal.sigma)?);
            if median <= 0.0 {
                return Err(format!("log_normal: median = {median}, but it must be above 0"));
            }
            return LogNormal::new(median.ln(), sigma)
                .map(Shape::LogNormal)
                .map_err(|_| format!("log_normal: sigma = {sigma}, but it must be above 0"));
        }
        if let Some(triangular) = &vary.triangular {
            let [low, mode, high] = triangular.get_ref();
            let [low, mode, high] = [self.number(low)?, self.number(mode)?, self.number(high)?];
            return Triangular::new(low, high, mode).map(Shape::Triangular).map_err(|_| {
                format!(
                    "triangular = [{low}, {mode}, {high}]: the values must be the smallest, the most likely and the largest one"
                )
            });
        }
        if let Some(list) = &vary.list {
            let values = list.get_ref().iter().map(|value| self.setting(value));
            let values = values.collect::<Result<Vec<_>, _>>()?;
            let is_twice =
                |(place, value): &(usize, &SettingValue)| values[..*place].contains(value);
            if let Some((_, twice)) = values.iter().enumerate().find(is_twice) {
                return Err(format!(
                    "list: {} is there twice; weights make a value more likely",
                    twice.to_json()
                ));
            }
            return weighted(
                values,
                vary.weights.as_ref().map(|weights| weights.get_ref().as_slice()),
            );
        }
        if let Some(range) = &vary.range {
            return self.range(range.get_ref());
        }
        if let Some(sign) = &vary.sign {
            let size = self.number(sign.get_ref())?;
            if size <= 0.0 {
                return Err(format!("sign = {size}: it is a magnitude, which must be above 0"));
            }
            return weighted(vec![self.checked(-size)?, self.checked(size)?], None);
        }
        self.seeds(vary.case.as_ref().map_or(0, |first| *first.get_ref()))
    }

    fn range(&self, range: &Range) -> Result<Shape, String> {
        if !(2..=MOST).contains(&range.count) {
            let count = range.count;
            return Err(format!("range: count = {count}, but it must be from 2 to {MOST}"));
        }
        let (from, to) = (self.number(&range.from)?, self.number(&range.to)?);
        if from >= to {
            return Err(format!("range: from = {from} must be less than to = {to}"));
        }
        let last = f64::from(range.count - 1);
        let value = |i: u32| self.checked(from + (to - from) * f64::from(i) / last);
        weighted((0..range.count).map(value).collect::<Result<_, _>>()?, None)
    }

    fn seeds(&self, first: i64) -> Result<Shape, String> {
        let kind = &self.system.variable(self.target).kind;
        let VariableKind::Integer { min, max } = kind else {
            return Err(format!("case is for parameters of type Integer, not {}", kind.name()));
        };
        self.setting(&Value::Integer(first))?;
        let least = min.map_or(first.min(0), i64::from);
        let most = max.map_or(i64::from(i32::MAX), i64::from);
        Ok(Shape::Case(Seeds::new(first, [least, most], self.seed)))
    }

    fn uniform(&self, ends: &[Value; 2], kind: &VariableKind) -> Result<Shape, String> {
        let reversed = |low: &dyn std::fmt::Display, high: &dyn std::fmt::Display| {
            format!("uniform = [{low}, {high}]: the second value must be larger than the first one")
        };
        let [low, high] = ends;
        if matches!(kind, VariableKind::Integer { .. }) {
            let whole = |value: &Value| match self.setting(value)? {
                SettingValue::Integer(value) => Ok(value),
                other => Err(format!("uniform: {} is no integer", other.to_json())),
            };
            let (low, high) = (whole(low)?, whole(high)?);
            return if low < high {
                Ok(Shape::Whole([low, high]))
            } else {
                Err(reversed(&low, &high))
            };
        }
        if !matches!(kind, VariableKind::Real { .. }) {
            return Err(format!("uniform is for numbers, not for {}: use a list", kind.name()));
        }
        let (low, high) = (self.number(low)?, self.number(high)?);
        if low < high && (high - low).is_finite() {
            Ok(Shape::Uniform([low, high]))
        } else {
            Err(reversed(&low, &high))
        }
    }

    /// Converts a value; text with a percent sign stands for percent of the experiment's value.
    fn setting(&self, written: &Value) -> Result<SettingValue, String> {
        let value = match self.percent(written, |nominal| nominal)? {
            Some(value) => self.checked(value)?,
            None => self.system.value(self.target, written)?,
        };
        if let SettingValue::Real(number) = value {
            finite(number)?;
        }
        Ok(value)
    }

    /// Computes the percentage that a text stands for, of a function of the experiment's value.
    fn percent(&self, written: &Value, of: fn(f64) -> f64) -> Result<Option<f64>, String> {
        let Some(number) = written.as_str().and_then(|text| text.trim().strip_suffix('%')) else {
            return Ok(None);
        };
        let percent: f64 =
            number.trim().parse().map_err(|_| format!("{written} is no percentage"))?;
        let nominal = self.system.nominal(self.target).ok_or_else(|| {
            format!("{written}: neither the experiment nor the FMU gives a value of which this could be a percentage")
        })?;
        Ok(Some(of(nominal) * percent / 100.0))
    }

    /// Converts a number, without a check of the variable's limits: it may be a mean or a bound.
    pub(super) fn number(&self, written: &Value) -> Result<f64, String> {
        if let Some(value) = self.percent(written, |nominal| nominal)? {
            return finite(value);
        }
        finite(match written {
            Value::Float(value) => *value,
            Value::Integer(value) => *value as f64,
            Value::String(text) => self.system.number(self.target, text)?,
            _ => return Err(format!("{written} is no number")),
        })
    }

    /// Converts a difference of two values. A unit whose zero is another one, such as that of
    /// degrees Celsius, has none.
    fn difference(&self, written: &Value) -> Result<f64, String> {
        if let Some(value) = self.percent(written, f64::abs)? {
            return finite(value);
        }
        let unit = written.as_str().and_then(|text| text.trim().split_once(char::is_whitespace));
        if let Some((_, unit)) = unit
            && self.system.number(self.target, &format!("0 {unit}"))? != 0.0
        {
            return Err(format!(
                "{written} is no difference: the zero of its unit is not that of the parameter's"
            ));
        }
        self.number(written)
    }

    /// Checks a number against the limits of the variable.
    pub(super) fn checked(&self, value: f64) -> Result<SettingValue, String> {
        let is_real = matches!(self.system.variable(self.target).kind, VariableKind::Real { .. });
        let written = if is_real || value.fract() != 0.0 {
            Value::Float(value)
        } else {
            Value::Integer(value as i64)
        };
        self.system.value(self.target, &written)
    }
}

fn finite(number: f64) -> Result<f64, String> {
    if number.is_finite() { Ok(number) } else { Err(format!("{number} is no finite number")) }
}

/// Makes a list whose values have these weights, or the same weight each.
fn weighted(values: Vec<SettingValue>, weights: Option<&[f64]>) -> Result<Shape, String> {
    if values.is_empty() {
        return Err("the list is empty".into());
    }
    let equal = vec![1.0; values.len()];
    let weights = weights.unwrap_or(&equal);
    if weights.len() != values.len() {
        return Err(format!("{} weights for {} values", weights.len(), values.len()));
    }
    let sum: f64 = weights.iter().sum();
    if weights.iter().any(|weight| weight.is_nan() || *weight < 0.0)
        || sum <= 0.0
        || sum.is_infinite()
    {
        return Err("weights must not be negative, and not all zero".into());
    }
    let mut reached = 0.0;
    let sums = weights.iter().map(|weight| {
        reached += weight / sum;
        reached
    });
    Ok(Shape::List(values, sums.collect()))
}
