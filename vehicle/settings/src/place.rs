//! The place of a value among settings: what is declared there.

use std::borrow::Cow;

/// Ending of the name of an entry, and what the entry is for.
pub type Entry = (&'static str, &'static str);

/// Part that a value plays in a model.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Role {
    /// It is set before a simulation.
    #[default]
    Parameter,
    /// It is given during a simulation.
    Input,
    /// It is computed for others.
    Output,
    /// It is computed for observation only.
    Local,
    /// It is set by a file alone, for those who tune a model.
    File,
}

/// Declarations in the attribute of a field.
#[derive(Clone, Copy, Debug, Default)]
#[expect(clippy::struct_excessive_bools, reason = "they are keys without a value")]
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
    pub each: &'static [Entry],
    /// The same for the columns of a matrix, or for the entries of vectors in an array.
    pub columns: &'static [Entry],
    /// Units of the entries; empty if all have the same.
    pub units: &'static [&'static str],
    /// Typical magnitudes of the entries; empty if all have the same.
    pub nominals: &'static [f64],
    /// Whether the entries of an array are listed field by field.
    pub by_column: bool,
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
    /// Part that the value plays in a model.
    pub role: Option<Role>,
    /// Whether the value changes at events or communication points only.
    pub is_discrete: bool,
    /// Whether an input may stay unconnected.
    pub is_optional: bool,
    /// State whose time derivative the value is; empty for none.
    pub derivative: &'static str,
    /// Inputs and states on which the value depends at the same instant, or `None` for those of the
    /// structure's field.
    pub depends_on: Option<&'static [&'static str]>,
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
    /// Part that the value plays in a model.
    pub role: Role,
    /// Whether the value changes at events or communication points only.
    pub is_discrete: bool,
    /// Whether an input may stay unconnected.
    pub is_optional: bool,
    /// State whose time derivative the value is; empty for none.
    pub derivative: String,
    /// Inputs and states on which the value depends at the same instant.
    pub depends_on: Vec<String>,
    each: &'static [Entry],
    columns: &'static [Entry],
    units: &'static [&'static str],
    nominals: &'static [f64],
    pub(crate) by_column: bool,
    /// Numbers at the end of the name, as `[2]`.
    numbers: String,
    /// Distance from the value to which all names belong, in bytes.
    pub(crate) offset: usize,
}

impl Place {
    /// Returns the place of a field of the value at this place, `offset` bytes from its beginning.
    #[must_use]
    pub fn at(&self, about: &About, offset: usize) -> Self {
        let structure = self.name.as_str();
        let name = match (about.name, about.name.strip_prefix('+')) {
            ("", _) => structure.to_owned(),
            (_, Some(rest)) => self.named(rest),
            (name, _) => self.named(&format!(".{name}")),
        };
        let text = if self.is_template() {
            let ending = format!(".{}", about.name);
            self.text.replace("{.}", &ending).replace("{}", about.text)
        } else if about.is_part {
            self.continued(about.text)
        } else {
            about.text.to_owned()
        };
        let own = about.used_with.replace('~', structure);
        let used_with = match (self.used_with.as_str(), own.as_str()) {
            ("", _) => own,
            (structure, "") => structure.to_owned(),
            (structure, own) => format!("{structure} and {own}"),
        };
        let number = self.numbers.trim_matches(['[', ']']);
        Self {
            name,
            text: if number.is_empty() { text } else { text.replace("{#}", number) },
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
            used_with: if number.is_empty() { used_with } else { used_with.replace("{#}", number) },
            role: about.role.unwrap_or(self.role),
            is_discrete: about.is_discrete || self.is_discrete,
            is_optional: about.is_optional || self.is_optional,
            derivative: about.derivative.to_owned(),
            depends_on: about.depends_on.map_or_else(
                || self.depends_on.clone(),
                |names| names.iter().map(|name| (*name).to_owned()).collect(),
            ),
            each: if about.each.is_empty() { self.each } else { about.each },
            columns: about.columns,
            units: about.units,
            nominals: about.nominals,
            by_column: about.by_column,
            numbers: self.numbers.clone(),
            offset: self.offset + offset,
        }
    }

    fn is_template(&self) -> bool {
        self.text.contains("{}") || self.text.contains("{.}")
    }

    /// Returns the name of this place with an ending, before its numbers.
    fn named(&self, ending: &str) -> String {
        let name = self.name.strip_suffix(&self.numbers).unwrap_or(&self.name);
        let ending = if name.is_empty() { ending.trim_start_matches('.') } else { ending };
        format!("{name}{ending}{}", self.numbers)
    }

    /// Returns the place of an entry of the array or vector at this place, from 0, `offset` bytes
    /// from its beginning. Entries without a declared ending are numbered from 1.
    #[must_use]
    pub fn entry(&self, index: usize, offset: usize) -> Self {
        let number = (index + 1).to_string();
        let ending = self.each.get(index).map(|entry| entry.0);
        let purpose = purpose(self.each, index, &number);
        let mut text = filled(&self.text, &[purpose]);
        if ending.is_some() && !self.is_template() {
            text = format!("{text} ({purpose})");
        }
        let place = Self {
            text,
            unit: self.units.get(index).map_or_else(|| self.unit.clone(), |unit| (*unit).into()),
            nominal: self.nominals.get(index).copied().or(self.nominal),
            each: self.columns,
            columns: &[],
            units: &[],
            nominals: &[],
            offset: self.offset + offset,
            ..self.clone()
        };
        if let Some(ending) = ending {
            return Self { name: self.named(ending), ..place }.ended(ending, &number);
        }
        let numbers = format!("{}[{number}]", self.numbers);
        Self { name: format!("{}[{number}]", self.name), numbers, ..place }.ended("", &number)
    }

    /// Returns the place of a cell of the matrix at this place, `offset` bytes from its beginning;
    /// row and column count from 0.
    #[must_use]
    pub fn cell(&self, row: usize, column: usize, offset: usize) -> Self {
        let numbers = [row + 1, column + 1].map(|number| number.to_string());
        let text = if self.text.contains("{}") {
            let row = purpose(self.each, row, &numbers[0]);
            filled(&self.text, &[row, purpose(self.columns, column, &numbers[1])])
        } else {
            format!("{} (row {}, column {})", self.text, numbers[0], numbers[1])
        };
        let name = self.named(&format!("[{}]", numbers.join(",")));
        Self { name, text, offset: self.offset + offset, ..self.clone() }.ended("", &numbers[1])
    }

    /// Returns the place with the ending of a name and the number of an entry put in.
    fn ended(self, ending: &str, number: &str) -> Self {
        let put = |text: &str| text.replace("{.}", ending).replace("{#}", number);
        Self {
            text: put(&self.text),
            used_with: put(&self.used_with),
            derivative: put(&self.derivative),
            depends_on: self.depends_on.iter().map(|name| put(name)).collect(),
            ..self
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

/// Returns what an entry is for: what is declared, or its number.
fn purpose<'a>(each: &'static [Entry], index: usize, number: &'a str) -> &'a str {
    each.get(index).map_or(number, |entry| entry.1)
}

/// Puts the purposes of an entry into its sentence, where `{}` stands for them.
fn filled(text: &str, purposes: &[&str]) -> String {
    let filled =
        purposes.iter().fold(text.to_owned(), |text, purpose| text.replacen("{}", purpose, 1));
    if !text.starts_with("{}") {
        return filled;
    }
    let mut letters = filled.chars();
    letters.next().into_iter().flat_map(char::to_uppercase).chain(letters).collect()
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
        let gust = Place::default().at(&about("gust", "translation = entry"), 0);
        assert_eq!(gust.used_with, "translation = entry");
        assert_eq!(gust.at(&about("north", ""), 0).used_with, "translation = entry");
        let start = gust.at(&about("start", "~.north != 0"), 8);
        assert_eq!(start.used_with, "translation = entry and gust.north != 0");
    }
}
