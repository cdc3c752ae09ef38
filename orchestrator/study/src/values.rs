//! Values that a study compares with: numbers that a paper prints, and yardsticks that were
//! computed elsewhere.
//!
//! ```toml
//! [[value]]
//! id = "ems.crmpc"
//! value = 1.6055
//! unit = "deg"
//! kind = "table"            # table, text, figure (read off one), computed
//! source = "Table I, p. 9"
//! ```

use cosim::document::Source;
use cosim::error::Error;
use fmi_master::names;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// Kind of the origin of a value.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum ValueKind {
    /// The value is printed in a table of the paper.
    Table,
    /// The value is printed in the text of the paper.
    Text,
    /// The value was read off a figure of the paper.
    Figure,
    /// The value is not printed, but was computed.
    Computed,
}

/// A value with its unit and its origin.
#[derive(Clone, Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Entry {
    /// Id by which the value is referred to.
    pub id: String,
    /// The value as a number, in its unit.
    pub value: f64,
    /// Unit of the value; empty if it has none.
    #[serde(default)]
    pub unit: String,
    /// Kind of the value's origin.
    pub kind: ValueKind,
    /// Place in the paper where the value is printed, or the program that computes it.
    pub source: String,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    value: Vec<Entry>,
}

/// A number as it is written, or the id of a value. Where a key says so, it may also be
/// `run.metric`.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum Quantity {
    /// The number is written directly.
    Number(f64),
    /// The number is referred to by its name.
    Named(String),
}

/// All values of a study, from all of its files.
#[derive(Clone, Debug, Default)]
pub struct Values(pub Vec<Entry>);

/// A metric, as `NAME`, or with the factor that gives it the unit of what it is shown with, as
/// `FACTOR * NAME`. Parameters are in the units of the FMU's variables.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(try_from = "String")]
#[schemars(with = "String")]
pub struct ShownMetric {
    /// Name of the metric.
    pub metric: String,
    /// Factor of the metric.
    pub factor: f64,
}

impl TryFrom<String> for ShownMetric {
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        let (factor, metric) = text.split_once(" * ").unwrap_or(("1", &text));
        let number = factor.parse().ok().filter(|factor: &f64| factor.is_finite());
        let problem = || format!("\"{factor}\" is no factor: write \"NAME\" or \"100 * NAME\"");
        Ok(Self { metric: metric.into(), factor: number.ok_or_else(problem)? })
    }
}

impl Values {
    /// Adds the values of a file to those of the study.
    ///
    /// # Errors
    /// Returns an error if the file cannot be read, is not a file of values, or repeats an id.
    pub fn load(&mut self, path: &Path) -> Result<(), Error> {
        let source = Source::load(path)?;
        let File { value } = source.read()?;
        for value in value {
            if self.find(&value.id).is_some() {
                let problem = format!("there is another value \"{}\"", value.id);
                return Err(source.error(&(0..0), problem));
            }
            self.0.push(value);
        }
        Ok(())
    }

    /// Returns the value with this id.
    pub fn find(&self, id: &str) -> Option<&Entry> {
        self.0.iter().find(|value| value.id == id)
    }

    /// Returns the number of a quantity.
    ///
    /// # Errors
    /// Returns an error that names the id if there is no such value.
    pub fn number(&self, quantity: &Quantity) -> Result<f64, String> {
        match quantity {
            Quantity::Number(number) => Ok(*number),
            Quantity::Named(id) => self.find(id).map(|value| value.value).ok_or_else(|| {
                let hint = names::hint(id, self.0.iter().map(|value| value.id.as_str()));
                format!("there is no value \"{id}\"{hint}")
            }),
        }
    }
}
