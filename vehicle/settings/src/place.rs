//! The place of a value among settings: what is declared there.

use std::borrow::Cow;

/// Declarations in the attribute of a field.
#[derive(Clone, Copy, Debug, Default)]
pub struct About {
    /// Name; empty for a structure whose fields are named by themselves.
    pub name: &'static str,
    /// Sentence without full stop.
    pub text: &'static str,
    /// Unit of measure: empty for that of the structure's field, `1` for none.
    pub unit: &'static str,
    /// Whether the unit is that of the time derivative of the structure's field.
    pub is_rate: bool,
    /// Endings of the names of the entries, and what each is for.
    pub each: &'static [(&'static str, &'static str)],
    /// Whether the sentence continues that of the structure's field.
    pub is_part: bool,
    /// Smallest value that is allowed.
    pub min: Option<f64>,
    /// Largest value that is allowed.
    pub max: Option<f64>,
    /// Lower end that is not allowed itself.
    pub above: Option<f64>,
    /// Upper end that is not allowed itself.
    pub below: Option<f64>,
    /// Typical magnitude.
    pub nominal: Option<f64>,
    /// Value at the start, if no file has it.
    pub start: Option<f64>,
    /// Condition on other settings under which this one has an effect; empty for always. In it `~`
    /// stands for the name of the structure.
    pub used_with: &'static str,
}

/// The place of a value among the settings.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Place {
    /// Full name, with dots.
    pub name: String,
    /// Sentence without full stop.
    pub text: String,
    /// Unit of measure; empty for none.
    pub unit: Cow<'static, str>,
    /// Smallest value that is allowed.
    pub min: Option<f64>,
    /// Largest value that is allowed.
    pub max: Option<f64>,
    /// Lower end that is not allowed itself.
    pub above: Option<f64>,
    /// Upper end that is not allowed itself.
    pub below: Option<f64>,
    /// Typical magnitude.
    pub nominal: Option<f64>,
    /// Value at the start, if no file has it.
    pub start: Option<f64>,
    /// Conditions on other settings under which this one has an effect, those of the structures
    /// first; empty for always.
    pub used_with: String,
    each: &'static [(&'static str, &'static str)],
}

impl Place {
    /// Returns the place of a field of the value at this place.
    #[must_use]
    pub fn at(&self, about: &About) -> Self {
        let name = match (self.name.as_str(), about.name) {
            ("", name) | (name, "") => name.to_owned(),
            (structure, name) => format!("{structure}.{name}"),
        };
        let text = if about.is_part { self.continued(about.text) } else { about.text.to_owned() };
        Self {
            name,
            text,
            unit: match about.unit {
                "" if about.is_rate => rate(&self.unit).into(),
                "" => self.unit.clone(),
                "1" => "".into(),
                unit => unit.into(),
            },
            min: about.min.or(self.min),
            max: about.max.or(self.max),
            above: about.above.or(self.above),
            below: about.below.or(self.below),
            nominal: about.nominal.or(self.nominal),
            start: about.start.or(self.start),
            used_with: match (self.used_with.as_str(), about.used_with) {
                ("", own) => own.replace('~', &self.name),
                (structure, "") => structure.to_owned(),
                (structure, own) => format!("{structure} and {}", own.replace('~', &self.name)),
            },
            each: if about.each.is_empty() { self.each } else { about.each },
        }
    }

    /// Returns the place of an entry of the array or vector at this place, from 0. Entries without
    /// a declared ending are numbered from 1.
    #[must_use]
    pub fn entry(&self, index: usize) -> Self {
        match self.each.get(index) {
            Some((ending, purpose)) => Self {
                name: format!("{}{ending}", self.name),
                text: format!("{} ({purpose})", self.text),
                ..self.clone()
            },
            None => Self { name: format!("{}[{}]", self.name, index + 1), ..self.clone() },
        }
    }

    /// Returns the place of a cell of the matrix at this place; row and column count from 0.
    #[must_use]
    pub fn cell(&self, row: usize, column: usize) -> Self {
        let (row, column) = (row + 1, column + 1);
        Self {
            name: format!("{}[{row},{column}]", self.name),
            text: format!("{} (row {row}, column {column})", self.text),
            ..self.clone()
        }
    }

    fn continued(&self, text: &str) -> String {
        let mut letters = text.chars();
        let first = letters.next().into_iter().flat_map(char::to_lowercase);
        let text: String = first.chain(letters).collect();
        if self.text.is_empty() { text } else { format!("{}: {text}", self.text) }
    }

    /// Returns the requirement that a value violates, if any.
    pub fn problem(&self, value: f64) -> Option<String> {
        let too_low = self.min.filter(|min| value < *min).map(|min| format!("at least {min}"));
        let too_high = self.max.filter(|max| value > *max).map(|max| format!("at most {max}"));
        let not_above = self.above.filter(|end| value <= *end).map(|end| format!("above {end}"));
        let not_below = self.below.filter(|end| value >= *end).map(|end| format!("below {end}"));
        let finite = (!value.is_finite()).then(|| "a finite number".to_owned());
        let requirement = finite.or(too_low).or(too_high).or(not_above).or(not_below)?;
        Some(format!("must be {requirement}"))
    }
}

/// Returns the unit of the rate of a quantity with this unit.
fn rate(unit: &str) -> String {
    match unit.rsplit_once("/s") {
        Some((quantity, "")) => format!("{quantity}/s2"),
        Some((quantity, "2")) => format!("{quantity}/s3"),
        _ => format!("{unit}/s"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn conditions_are_joined_from_the_structure_to_the_field() {
        let about = |name, used_with| About { name, used_with, ..About::default() };
        let gust = Place::default().at(&about("gust", "translation = entry"));
        assert_eq!(gust.used_with, "translation = entry");
        assert_eq!(gust.at(&about("north", "")).used_with, "translation = entry");
        let start = gust.at(&about("start", "~.north != 0"));
        assert_eq!(start.used_with, "translation = entry and gust.north != 0");
    }
}
