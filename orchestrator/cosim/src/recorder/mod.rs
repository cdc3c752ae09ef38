//! Writes the recorded variables to a file, one row for each communication point, without loss of
//! precision.

mod column;
mod text;

use crate::error::Error;
use crate::run::{Observer, Sample};
pub use column::Column;
use std::path::Path;
use text::Text;

/// Name of the file in the folder of results: comma-separated text with enough digits to read back
/// the same bits.
pub const FILE: &str = "results.csv";

/// A results file that is being written.
pub struct Recorder {
    text: Text,
    every: u64,
}

impl Recorder {
    /// Creates the file. A row is written at every `every`-th tick. With `labels`, the header holds
    /// the units, and the cells the names of items.
    ///
    /// # Errors
    /// Returns an error if the file cannot be written.
    pub fn create(
        path: &Path,
        columns: &[Column],
        every: u32,
        labels: bool,
    ) -> Result<Self, Error> {
        Ok(Self { text: Text::create(path, columns, labels)?, every: u64::from(every) })
    }

    /// Writes the rows that are still in memory.
    ///
    /// # Errors
    /// Returns an error if the file cannot be written.
    pub fn finish(&mut self) -> Result<(), Error> {
        self.text.finish()
    }
}

impl Observer for Recorder {
    fn observe(&mut self, sample: &Sample) -> Result<(), Error> {
        if !sample.tick.is_multiple_of(self.every) && !sample.last {
            return Ok(());
        }
        self.text.row(sample.time, sample.values)
    }
}

#[cfg(test)]
mod tests;
