//! Signals that are observed in a run: a variable, the difference of two, or the norm of several.
//! Each of them may be divided by another variable. The difference of two angles may be taken the
//! shorter way round, and an angle as the turn nearest to another one.
//!
//! ```text
//! plant.rate.p
//! plant.attitude.alpha - controller.reference.alpha
//! turn(plant.attitude.sigma - controller.reference.sigma)
//! controller.reference.sigma near plant.attitude.sigma
//! norm(plant.rate.p, plant.rate.q, plant.rate.r) / controller.limit.rate
//! ```

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;
use std::fmt;
use std::iter;

/// Tolerance with which limits count as met, because of rounding.
const ROUNDING: f64 = 1e-9;

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

/// A variable, and the variable that it is combined with, if any.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Term<Variable> {
    /// Variable that the term starts from.
    pub value: Variable,
    /// Variable that it is combined with, and how.
    pub with: Option<(Relation, Variable)>,
}

/// How a term combines two variables.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Relation {
    /// Their difference, `a - b`.
    Minus,
    /// The difference of two angles the shorter way round, `turn(a - b)`.
    Turn,
    /// The first angle and the whole turns that bring it nearest to the second, `a near b`.
    Near,
}

impl Relation {
    /// Combines two values; `whole` is a whole turn in their unit.
    pub fn combine(self, value: f64, other: f64, whole: f64) -> f64 {
        let turns = ((value - other) / whole).round();
        match self {
            Self::Minus => value - other,
            // Without turns the difference keeps its bits.
            Self::Turn if turns == 0.0 => value - other,
            Self::Turn => value - other - turns * whole,
            Self::Near => value - turns * whole,
        }
    }

    /// Returns a whole turn in this unit; not a number for [`Relation::Minus`], which needs none.
    ///
    /// # Errors
    /// Refuses a unit that is not one of angles.
    pub fn whole_turn(self, unit: &str) -> Result<f64, String> {
        match (self, unit) {
            (Self::Minus, _) => Ok(f64::NAN),
            (_, "deg") => Ok(360.0),
            (_, "rad") => Ok(std::f64::consts::TAU),
            _ => Err(format!("turn(…) and near need angles in rad or deg, not in \"{unit}\"")),
        }
    }
}

impl<Variable> Term<Variable> {
    /// Creates the term of a single variable.
    pub fn single(value: Variable) -> Self {
        Self { value, with: None }
    }

    /// Returns the variables of the term.
    pub fn variables(&self) -> impl Iterator<Item = &Variable> {
        iter::once(&self.value).chain(self.with.as_ref().map(|with| &with.1))
    }
}

impl Term<String> {
    fn read(text: &str) -> Self {
        let text = text.trim();
        let inside = text.strip_prefix("turn(").and_then(|rest| rest.strip_suffix(')'));
        let minus = if inside.is_some() { Relation::Turn } else { Relation::Minus };
        let text = inside.unwrap_or(text);
        for (word, relation) in [(" - ", minus), (" near ", Relation::Near)] {
            if let Some((value, other)) = text.split_once(word) {
                let other = other.trim().to_string();
                return Self { value: value.trim().into(), with: Some((relation, other)) };
            }
        }
        Self::single(text.into())
    }
}

impl fmt::Display for Term<String> {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let value = &self.value;
        match &self.with {
            None => f.write_str(value),
            Some((Relation::Minus, other)) => write!(f, "{value} - {other}"),
            Some((Relation::Turn, other)) => write!(f, "turn({value} - {other})"),
            Some((Relation::Near, other)) => write!(f, "{value} near {other}"),
        }
    }
}

impl TryFrom<String> for Signal {
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        let (whole, over) = match text.split_once(" / ") {
            Some((whole, over)) => (whole.trim(), Some(over.trim().to_string())),
            None => (text.trim(), None),
        };
        let inside = whole.strip_prefix("norm(").and_then(|rest| rest.strip_suffix(')'));
        let mut depth = 0;
        // The name of an element of a matrix has a comma in brackets.
        let is_between = |letter: char| {
            depth += i32::from(letter == '[') - i32::from(letter == ']');
            letter == ',' && depth == 0
        };
        let terms: Vec<_> = inside.unwrap_or(whole).split(is_between).map(Term::read).collect();
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
        let terms = signal.terms.iter().map(Term::to_string).collect::<Vec<_>>().join(", ");
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
        let terms = self.terms.iter().flat_map(Term::variables);
        terms.chain(&self.over).map(String::as_str)
    }

    /// Returns the names of all variables in the signal.
    pub fn paths(&self) -> BTreeSet<&str> {
        self.all_paths().collect()
    }
}

impl Signal {
    /// Resolves the signal. `find` returns the index of a variable in a sample's values, the factor
    /// to the unit in which it is displayed, and this unit.
    ///
    /// # Errors
    /// Returns an error if a variable is not found, or if units differ.
    pub fn resolve(
        &self,
        mut find: impl FnMut(&str) -> Result<(usize, f64, String), String>,
    ) -> Result<Resolved, String> {
        let mut shown: Option<(f64, String)> = None;
        let terms = self.terms.iter().map(|term| {
            let mut place = |path: &str| {
                let (place, factor, unit) = find(path)?;
                let (_, other) = shown.get_or_insert_with(|| (factor, unit.clone()));
                if *other != unit {
                    return Err(format!("\"{self}\" mixes {other} and {unit}"));
                }
                Ok(place)
            };
            let value = place(&term.value)?;
            let with = term.with.as_ref();
            let with = with.map(|(relation, path)| place(path).map(|place| (*relation, place)));
            Ok(Term { value, with: with.transpose()? })
        });
        let terms = terms.collect::<Result<Vec<_>, String>>()?;
        let (mut factor, mut unit) = shown.unwrap_or((1.0, String::new()));
        let turns = terms.iter().filter_map(|term| term.with).map(|with| with.0.whole_turn(&unit));
        let turns = turns.collect::<Result<Vec<_>, _>>();
        let turns = turns.map_err(|problem| format!("\"{self}\": {problem}"))?;
        let whole_turn = turns.into_iter().fold(f64::NAN, f64::max) / factor;
        let over = self.over.as_deref().map(find).transpose()?;
        let over = over.map(|(place, divisor, name)| {
            if name != unit {
                return Err(format!("\"{self}\" divides {unit} by {name}"));
            }
            (factor, unit) = (factor / divisor, String::new());
            Ok(place)
        });
        let (over, norm) = (over.transpose()?, self.norm);
        let (is_integer, responds) = (false, false);
        Ok(Resolved { terms, norm, over, whole_turn, factor, unit, is_integer, responds })
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
    /// A whole turn in the unit of the variables, if a term needs it.
    pub whole_turn: f64,
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
        Self::single(Term::single(place))
    }

    /// Creates a signal that is the difference of two variables at indices of a sample's values.
    pub fn difference(place: usize, minus: usize) -> Self {
        Self::single(Term { value: place, with: Some((Relation::Minus, minus)) })
    }

    fn single(term: Term<usize>) -> Self {
        let terms = vec![term];
        Self {
            terms,
            norm: false,
            over: None,
            whole_turn: f64::NAN,
            factor: 1.0,
            unit: String::new(),
            is_integer: false,
            responds: false,
        }
    }

    /// Returns by how much the first variable of a difference has moved between the values of two
    /// samples, in the signal's unit; `None` if the signal is no difference.
    pub fn moved(&self, before: &[f64], values: &[f64]) -> Option<f64> {
        let [Term { value, with: Some((relation, _)) }] = self.terms[..] else { return None };
        let moved = relation.combine(values[value], before[value], self.whole_turn);
        (!self.norm && self.over.is_none()).then_some(self.factor * moved)
    }

    /// Computes the value of the signal in a sample, in the signal's unit.
    pub fn value(&self, values: &[f64]) -> f64 {
        self.factor * self.undivided(values) / self.over.map_or(1.0, |over| values[over])
    }

    /// Returns whether the magnitude of the signal is more than 1, or not a number. Of a signal that
    /// is divided, 0 is not more than 0.
    pub fn is_beyond_one(&self, values: &[f64]) -> bool {
        let most = self.over.map_or(1.0, |over| values[over]);
        let size = (self.factor * self.undivided(values)).abs();
        size > most * (1.0 + ROUNDING) || size.is_nan() || most.is_nan()
    }

    fn undivided(&self, values: &[f64]) -> f64 {
        let term = |term: &Term<usize>| match term.with {
            None => values[term.value],
            Some((relation, other)) => {
                relation.combine(values[term.value], values[other], self.whole_turn)
            }
        };
        if self.norm {
            self.terms.iter().map(|t| term(t).powi(2)).sum::<f64>().sqrt()
        } else {
            self.terms.iter().map(term).sum()
        }
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
        for text in [
            "a.b",
            "a.b - c.d",
            "turn(a.b - c.d)",
            "a.b near c.d",
            "norm(a.x, turn(b.y - c.y))",
            "norm(a.x, a.y - b.y)",
            "norm(a.x, a.y) / b.z",
            "a.x[1,2]",
            "norm(a.x[1,2], a.y[2,1])",
        ] {
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
        let term = |value, minus: Option<usize>| Term {
            value,
            with: minus.map(|minus| (Relation::Minus, minus)),
        };
        let mut signal = Resolved {
            terms: vec![term(0, Some(1)), term(2, None)],
            norm: true,
            over: None,
            whole_turn: f64::NAN,
            factor: 10.0,
            unit: "mm".into(),
            is_integer: false,
            responds: false,
        };
        assert_eq!(signal.value(&[5.0, 2.0, 4.0]), 50.0);
        signal.over = Some(1);
        assert_eq!(signal.value(&[5.0, 2.0, 4.0]), 25.0);
    }

    #[test]
    fn oracle_angles_are_compared_the_shorter_way_round() {
        for (a, b, difference, near) in [
            (179.0, -179.0, -2.0, -181.0),
            (-179.0, 179.0, 2.0, 181.0),
            (539.0, 179.0, 0.0, 179.0),
            (10.0, 4.0, 6.0, 10.0),
        ] {
            assert_eq!(Relation::Turn.combine(a, b, 360.0), difference, "{a} {b}");
            assert_eq!(Relation::Near.combine(a, b, 360.0), near, "{a} {b}");
        }
        assert_eq!(
            Relation::Turn.combine(0.3, 0.1, 360.0),
            0.3 - 0.1,
            "the same bits without turns"
        );
        assert!(Relation::Near.whole_turn("N.m").unwrap_err().contains("N.m"));
    }
}
