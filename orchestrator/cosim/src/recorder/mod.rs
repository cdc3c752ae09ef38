//! Writes the recorded variables to a file, one row for each communication point, without loss of
//! precision.

mod column;
mod columnar;
mod text;

use crate::error::Error;
use crate::run::{Observer, Sample};
pub use column::Column;
use columnar::Columnar;
use schemars::JsonSchema;
use serde::Deserialize;
use std::path::Path;
use text::Text;

/// Format of the file of recorded variables.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Format {
    /// Write results.csv: comma-separated text with enough digits to read back the same bits.
    #[default]
    Csv,
    /// Write results.parquet: Apache Parquet, for long runs. Its metadata holds the units and the
    /// names of items.
    Parquet,
}

impl Format {
    /// Name of the file in the folder of results.
    pub fn file(self) -> &'static str {
        match self {
            Self::Csv => "results.csv",
            Self::Parquet => "results.parquet",
        }
    }
}

enum ResultsTable {
    Text(Text),
    Columnar(Box<Columnar>),
}

/// A results file that is being written.
pub struct Recorder {
    table: ResultsTable,
    every: u64,
}

impl Recorder {
    /// Creates the file. A row is written at every `every`-th tick. With `labels`, the header of a
    /// text file holds the units, and its cells the names of items.
    ///
    /// # Errors
    /// Returns an error if the file cannot be written.
    pub fn create(
        path: &Path,
        format: Format,
        columns: &[Column],
        every: u32,
        labels: bool,
    ) -> Result<Self, Error> {
        let table = match format {
            Format::Csv => ResultsTable::Text(Text::create(path, columns, labels)?),
            Format::Parquet => ResultsTable::Columnar(Box::new(Columnar::create(path, columns)?)),
        };
        Ok(Self { table, every: u64::from(every) })
    }

    /// Writes the rows that are still in memory.
    ///
    /// # Errors
    /// Returns an error if the file cannot be written.
    pub fn finish(&mut self) -> Result<(), Error> {
        match &mut self.table {
            ResultsTable::Text(text) => text.finish(),
            ResultsTable::Columnar(columnar) => columnar.finish(),
        }
    }
}

impl Observer for Recorder {
    fn observe(&mut self, sample: &Sample) -> Result<(), Error> {
        if !sample.tick.is_multiple_of(self.every) && !sample.last {
            return Ok(());
        }
        match &mut self.table {
            ResultsTable::Text(text) => text.row(sample.time, sample.values),
            ResultsTable::Columnar(columnar) => columnar.row(sample.time, sample.values),
        }
    }
}

#[cfg(test)]
mod tests;
