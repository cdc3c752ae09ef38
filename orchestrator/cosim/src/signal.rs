//! Signals that are observed in a run: a variable, the difference of two, or the norm of several.
//! Each of them may be divided by another variable.
//!
//! ```text
//! plant.rate.p
//! plant.attitude.alpha - controller.reference.alpha
//! norm(plant.rate.p, plant.rate.q, plant.rate.r) / controller.limit.rate
//! ```

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;
use std::fmt;
use std::iter;

/// A signal as an experiment or a study describes it.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Deserialize, Serialize, JsonSchema)]
#[serde(try_from = "String", into = "String")]
#[schemars(with = "String")]
pub struct Signal {
    /// Terms of the signal: a single one, or those whose norm is taken.
    pub terms: Vec<Term<String>>,
    /// Whether the norm is taken.
    pub norm: bool,
    /// Variable that the whole signal is divided by.
    pub over: Option<String>,
}

/// A variable, and the variable that is subtracted from it, if any.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Term<Variable> {
    /// Variable that the term starts from.
    pub value: Variable,
    /// Variable that is subtracted.
    pub minus: Option<Variable>,
}

impl TryFrom<String> for Signal {
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        let (whole, over) = match text.split_once(" / ") {
            Some((whole, over)) => (whole.trim(), Some(over.trim().to_string())),
            None => (text.trim(), None),
        };
        let inside = whole.strip_prefix("norm(").and_then(|rest| rest.strip_suffix(')'));
        let term = |text: &str| match text.split_once(" - ") {
            Some((from, minus)) => {
                Term { value: from.trim().into(), minus: Some(minus.trim().into()) }
            }
            None => Term { value: text.trim().to_string(), minus: None },
        };
        let terms: Vec<_> = inside.unwrap_or(whole).split(',').map(term).collect();
        let signal = Self { terms, norm: inside.is_some(), over };
        let broken = |path: &&str| {
            !path.contains('.') || path.contains(|c: char| c.is_whitespace() || c == '(')
        };
        if let Some(path) = signal.all_paths().find(broken) {
            return Err(format!("\"{path}\" in \"{text}\" is not of the form component.variable"));
        }
        if inside.is_none() && signal.terms.len() > 1 {
            return Err(format!("\"{text}\": several variables can be combined by norm(…) only"));
        }
        Ok(signal)
    }
}

impl From<Signal> for String {
    fn from(signal: Signal) -> Self {
        let term = |term: &Term<String>| match &term.minus {
            Some(minus) => format!("{} - {minus}", term.value),
            None => term.value.clone(),
        };
        let terms = signal.terms.iter().map(term).collect::<Vec<_>>().join(", ");
        let whole = if signal.norm { format!("norm({terms})") } else { terms };
        signal.over.iter().fold(whole, |whole, over| format!("{whole} / {over}"))
    }
}

impl fmt::Display for Signal {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(&String::from(self.clone()))
    }
}

impl Signal {
    fn all_paths(&self) -> impl Iterator<Item = &str> {
        let terms = self.terms.iter().flat_map(|term| iter::once(&term.value).chain(&term.minus));
        terms.chain(&self.over).map(String::as_str)
    }

    /// Returns the names of all variables in the signal.
    pub fn paths(&self) -> BTreeSet<&str> {
        self.all_paths().collect()
    }
}

/// A signal whose variables have been found among the values of a sample.
#[derive(Clone, Debug)]
pub struct Resolved {
    /// Terms of the signal: a single one, or those whose norm is taken.
    pub terms: Vec<Term<usize>>,
    /// Whether the norm is taken.
    pub norm: bool,
    /// Index of the value that the whole signal is divided by.
    pub over: Option<usize>,
    /// Factor from the unit of the variables to the unit of the signal.
    pub factor: f64,
    /// Unit of [`Self::value`].
    pub unit: String,
    /// Whether the signal is a single variable that is not a real number.
    pub is_integer: bool,
    /// Whether a variable of it responds to the inputs of the communication point, so that it is
    /// that of the step before at the stop time.
    pub responds: bool,
}

impl Resolved {
    /// Creates a signal that is the variable at an index of a sample's values.
    pub fn variable(place: usize) -> Self {
        Self::single(Term { value: place, minus: None })
    }

    /// Creates a signal that is the difference of two variables at indices of a sample's values.
    pub fn difference(place: usize, minus: usize) -> Self {
        Self::single(Term { value: place, minus: Some(minus) })
    }

    fn single(term: Term<usize>) -> Self {
        let terms = vec![term];
        Self {
            terms,
            norm: false,
            over: None,
            factor: 1.0,
            unit: String::new(),
            is_integer: false,
            responds: false,
        }
    }

    /// Computes the value of the signal in a sample, in the signal's unit.
    pub fn value(&self, values: &[f64]) -> f64 {
        let term =
            |term: &Term<usize>| values[term.value] - term.minus.map_or(0.0, |minus| values[minus]);
        let value = if self.norm {
            self.terms.iter().map(|t| term(t).powi(2)).sum::<f64>().sqrt()
        } else {
            self.terms.iter().map(term).sum()
        };
        self.factor * value / self.over.map_or(1.0, |over| values[over])
    }
}

/// Returns the unit that all of these signals are in; an empty text if there are none.
///
/// # Errors
/// Returns an error if they are in different units, so that their values cannot be combined.
pub fn common_unit<'a>(signals: impl IntoIterator<Item = &'a Resolved>) -> Result<&'a str, String> {
    let mut units = signals.into_iter().map(|signal| signal.unit.as_str());
    let first = units.next().unwrap_or("");
    match units.find(|unit| *unit != first) {
        Some(other) => Err(format!("mixes signals in \"{first}\" and in \"{other}\"")),
        None => Ok(first),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_signal_reads_back_as_it_was_written() {
        for text in ["a.b", "a.b - c.d", "norm(a.x, a.y - b.y)", "norm(a.x, a.y) / b.z"] {
            assert_eq!(String::from(Signal::try_from(text.to_string()).unwrap()), text);
        }
    }

    #[test]
    fn what_is_no_signal_is_refused_by_name() {
        for (text, culprit) in
            [("ab", "\"ab\""), ("a.b, c.d", "norm"), ("a.b - c", "\"c\""), ("", "\"\"")]
        {
            let message = Signal::try_from(text.to_string()).unwrap_err();
            assert!(message.contains(culprit), "{text}: {message}");
        }
    }

    #[test]
    fn oracle_differences_and_norms_in_the_display_unit() {
        let term = |value, minus| Term { value, minus };
        let mut signal = Resolved {
            terms: vec![term(0, Some(1)), term(2, None)],
            norm: true,
            over: None,
            factor: 10.0,
            unit: "mm".into(),
            is_integer: false,
            responds: false,
        };
        assert_eq!(signal.value(&[5.0, 2.0, 4.0]), 50.0);
        signal.over = Some(1);
        assert_eq!(signal.value(&[5.0, 2.0, 4.0]), 25.0);
    }
}
