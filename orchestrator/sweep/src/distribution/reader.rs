//! Reads the distribution of a parameter, with units converted.

use super::shape::{Seeds, Shape, Truncated, reversed};
use crate::vary::{Asked, Normal};
use cosim::system::System;
use cosim::variation::{SettingValue, Target};
use fmi_master::description::VariableKind;
use statrs::distribution as statrs;
use toml::Value;

/// Reads the values of a distribution for one target.
pub(super) struct Reader<'a> {
    pub(super) system: &'a System,
    pub(super) target: Target,
    /// Seed of the sweep.
    pub(super) seed: u64,
}

impl Reader<'_> {
    pub(super) fn shape(&self, asked: &Asked) -> Result<Shape, String> {
        match asked {
            Asked::Uniform(ends) => self.uniform(ends),
            Asked::Normal(normal) => self.normal(normal),
            Asked::List { values, weights } => self.list(values, *weights),
            Asked::Case(first) => self.seeds(*first),
        }
    }

    fn kind(&self) -> &VariableKind {
        &self.system.variable(self.target).kind
    }

    /// Refuses a distribution of real numbers for a parameter of another type.
    fn check_real(&self, distribution: &str) -> Result<(), String> {
        match self.kind() {
            VariableKind::Real { .. } => Ok(()),
            kind => {
                let kind = kind.name();
                Err(format!(
                    "{distribution} is for parameters of type Real, not {kind}: use a list"
                ))
            }
        }
    }

    fn uniform(&self, [low, high]: &[Value; 2]) -> Result<Shape, String> {
        self.check_real("uniform")?;
        let (low, high) = (self.number(low)?, self.number(high)?);
        match statrs::Uniform::new(low, high) {
            Ok(uniform) if low < high && (high - low).is_finite() => Ok(Shape::Uniform(uniform)),
            _ => Err(reversed("uniform", low, high)),
        }
    }

    fn normal(&self, normal: &Normal) -> Result<Shape, String> {
        self.check_real("normal")?;
        let mean = self.number(&normal.mean)?;
        let deviation = self.difference(&normal.deviation)?;
        let whole = statrs::Normal::new(mean, deviation)
            .map_err(|_| format!("normal: deviation = {deviation}, but it must be above 0"))?;
        let ends = match &normal.within {
            Some([low, high]) => Some([self.number(low)?, self.number(high)?]),
            None => None,
        };
        Ok(Shape::Normal(Truncated::new(whole, ends)?))
    }

    fn list(&self, values: &[Value], weights: Option<&[f64]>) -> Result<Shape, String> {
        let values =
            values.iter().map(|value| self.setting(value)).collect::<Result<Vec<_>, _>>()?;
        let is_twice = |place: &usize| values[..*place].contains(&values[*place]);
        if let Some(twice) = (0..values.len()).find(is_twice) {
            return Err(format!(
                "list: {} is there twice; weights make a value more likely",
                values[twice].to_json()
            ));
        }
        if values.is_empty() {
            return Err("the list is empty".into());
        }
        let equal = vec![1.0; values.len()];
        let weights = weights.unwrap_or(&equal);
        if weights.len() != values.len() {
            return Err(format!("{} weights for {} values", weights.len(), values.len()));
        }
        let sum: f64 = weights.iter().sum();
        let is_sound = weights.iter().all(|weight| *weight >= 0.0) && sum > 0.0 && sum.is_finite();
        if !is_sound {
            return Err("weights must not be negative, and not all zero".into());
        }
        let mut reached = 0.0;
        let sums = weights.iter().map(|weight| {
            reached += weight / sum;
            reached
        });
        Ok(Shape::List { sums: sums.collect(), values })
    }

    fn seeds(&self, first: i64) -> Result<Shape, String> {
        let VariableKind::Integer { min, max } = self.kind() else {
            let kind = self.kind().name();
            return Err(format!("case is for parameters of type Integer, not {kind}"));
        };
        self.setting(&Value::Integer(first))?;
        let least = min.map_or(first.min(0), i64::from);
        let most = max.map_or(i64::from(i32::MAX), i64::from);
        Ok(Shape::Case(Seeds::new(first, [least, most], self.seed)))
    }

    /// Converts a value; text with a percent sign denotes percent of the experiment's value.
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

    /// Computes the percentage in a text, of a function of the experiment's value.
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
        let is_real = matches!(self.kind(), VariableKind::Real { .. });
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
