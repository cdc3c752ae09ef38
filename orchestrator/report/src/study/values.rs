//! Numbers that a study compares with: what a paper prints, and yardsticks that were computed elsewhere.
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
use fmu_import::names;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// How a value came to be known.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum ValueKind {
    /// Printed in a table.
    Table,
    /// Printed in the text.
    Text,
    /// Read off a figure.
    Figure,
    /// Not printed: computed.
    Computed,
}

/// A number with its origin.
#[derive(Clone, Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Entry {
    /// By which it is referred to.
    pub id: String,
    /// The number.
    pub value: f64,
    /// Its unit; empty if it has none.
    #[serde(default)]
    pub unit: String,
    /// How it came to be known.
    pub kind: ValueKind,
    /// Where it stands, or what computes it.
    pub source: String,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    value: Vec<Entry>,
}

/// A number as it is written, or the id of a value (or, where it says so, `run.metric`).
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum Quantity {
    /// As it is written.
    Number(f64),
    /// By its name.
    Named(String),
}

/// All values of a study.
#[derive(Clone, Debug, Default)]
pub struct Values(pub Vec<Entry>);

/// The factor of what is shown in its own unit.
pub(super) fn unscaled() -> f64 {
    1.0
}

impl Values {
    /// Adds the values of a file.
    ///
    /// # Errors
    /// If it cannot be read, is no such file, or repeats an id.
    pub fn load(&mut self, path: &Path) -> Result<(), Error> {
        let source = Source::load(path)?;
        let File { value } = source.read()?;
        for value in value {
            if self.find(&value.id).is_some() {
                return Err(source.error(&(0..0), format!("there is another value \"{}\"", value.id)));
            }
            self.0.push(value);
        }
        Ok(())
    }

    /// The value of this id.
    pub fn find(&self, id: &str) -> Option<&Entry> {
        self.0.iter().find(|value| value.id == id)
    }

    /// The number that is meant.
    ///
    /// # Errors
    /// Names the id that is not there.
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
