//! What a study looks at in a run: a variable, the difference of two, or the norm of several.
//!
//! ```text
//! plant.rate.p
//! plant.attitude.alpha - controller.reference.alpha
//! norm(plant.rate.p, plant.rate.q, plant.rate.r)
//! ```

use crate::run::Plan;
use crate::wiring::{Port, find};
use fmu_import::description::Kind;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;

/// A signal as it is written.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Deserialize, Serialize, JsonSchema)]
#[serde(try_from = "String", into = "String")]
pub struct Signal {
    /// `component.variable`, with what is subtracted from it.
    terms: Vec<(String, Option<String>)>,
    norm: bool,
}

impl TryFrom<String> for Signal {
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        let inside = text.trim().strip_prefix("norm(").and_then(|rest| rest.strip_suffix(')'));
        let term = |text: &str| match text.split_once(" - ") {
            Some((from, minus)) => (from.trim().to_string(), Some(minus.trim().to_string())),
            None => (text.trim().to_string(), None),
        };
        let terms: Vec<_> = inside.unwrap_or(&text).split(',').map(term).collect();
        let paths = terms.iter().flat_map(|(from, minus)| std::iter::once(from).chain(minus));
        let broken =
            |path: &&String| !path.contains('.') || path.contains(|c: char| c.is_whitespace() || c == '(');
        if let Some(path) = paths.clone().find(broken) {
            return Err(format!("\"{path}\" in \"{text}\" is no component.variable"));
        }
        if inside.is_none() && terms.len() > 1 {
            return Err(format!("\"{text}\": several variables stand in norm(…) only"));
        }
        Ok(Self { terms, norm: inside.is_some() })
    }
}

impl From<Signal> for String {
    fn from(signal: Signal) -> Self {
        let term = |(from, minus): &(String, Option<String>)| match minus {
            Some(minus) => format!("{from} - {minus}"),
            None => from.clone(),
        };
        let terms: Vec<String> = signal.terms.iter().map(term).collect();
        if signal.norm { format!("norm({})", terms.join(", ")) } else { terms.join(", ") }
    }
}

impl std::fmt::Display for Signal {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        f.write_str(&String::from(self.clone()))
    }
}

/// A signal with its variables found: places among a sample's values.
#[derive(Clone, Debug)]
pub struct Resolved {
    terms: Vec<(usize, Option<usize>)>,
    norm: bool,
    factor: f64,
    /// The unit that [`Self::value`] is in.
    pub unit: String,
}

impl Signal {
    /// The variables it is made of.
    pub fn paths(&self) -> BTreeSet<&str> {
        self.terms
            .iter()
            .flat_map(|(from, minus)| std::iter::once(from).chain(minus))
            .map(String::as_str)
            .collect()
    }

    /// Finds its variables in a plan that records them.
    ///
    /// # Errors
    /// If a variable is not there, or if they are not all in the same unit.
    pub fn resolve(&self, plan: &Plan) -> Result<Resolved, String> {
        let parts = plan.parts();
        let mut shown: Option<(f64, String)> = None;
        let mut place = |path: &str| {
            let port = find(path, &parts).ok_or_else(|| format!("there is no variable \"{path}\""))?;
            let own = display(plan, port);
            match &shown {
                Some(other) if *other != own => {
                    return Err(format!("\"{self}\" mixes {} and {}", other.1, own.1));
                }
                _ => shown = Some(own),
            }
            plan.place(port).ok_or_else(|| format!("\"{path}\" is not recorded"))
        };
        let terms = self
            .terms
            .iter()
            .map(|(from, minus)| Ok((place(from)?, minus.as_deref().map(&mut place).transpose()?)))
            .collect::<Result<Vec<_>, String>>()?;
        let (factor, unit) = shown.unwrap_or((1.0, String::new()));
        Ok(Resolved { terms, norm: self.norm, factor, unit })
    }
}

impl Resolved {
    /// The signal in a sample, in its unit.
    pub fn value(&self, values: &[f64]) -> f64 {
        let term = |&(from, minus): &(usize, Option<usize>)| {
            values[from] - minus.map_or(0.0, |minus: usize| values[minus])
        };
        let value = if self.norm {
            self.terms.iter().map(|t| term(t).powi(2)).sum::<f64>().sqrt()
        } else {
            self.terms.iter().map(term).sum()
        };
        self.factor * value
    }
}

/// Factor to the unit in which a variable wants to be shown, and that unit. Units with an offset stay as they are.
fn display(plan: &Plan, port: Port) -> (f64, String) {
    let parts = plan.parts();
    let description = parts[port.component].description;
    let Kind::Real { unit: Some(unit), display_unit, .. } = &description.variables[port.variable].kind else {
        return (1.0, String::new());
    };
    let defined = description.units.iter().find(|defined| defined.name == *unit);
    defined
        .and_then(|defined| {
            let wanted = display_unit.as_deref()?;
            let (_, factor, _) = defined.displays.iter().find(|d| d.0 == wanted && d.2 == 0.0)?;
            Some((*factor, wanted.to_string()))
        })
        .unwrap_or((1.0, unit.clone()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_signal_reads_back_as_it_was_written() {
        for text in ["a.b", "a.b - c.d", "norm(a.x, a.y - b.y)"] {
            assert_eq!(String::from(Signal::try_from(text.to_string()).unwrap()), text);
        }
    }

    #[test]
    fn what_is_no_signal_is_refused_by_name() {
        for (text, culprit) in [("ab", "\"ab\""), ("a.b, c.d", "norm"), ("a.b - c", "\"c\""), ("", "\"\"")] {
            let message = Signal::try_from(text.to_string()).unwrap_err();
            assert!(message.contains(culprit), "{text}: {message}");
        }
    }

    #[test]
    fn oracle_differences_and_norms_in_the_display_unit() {
        let signal =
            Resolved { terms: vec![(0, Some(1)), (2, None)], norm: true, factor: 10.0, unit: "mm".into() };
        assert_eq!(signal.value(&[5.0, 2.0, 4.0]), 50.0);
    }
}
