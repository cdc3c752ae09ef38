//! Writes the recorded variables to a file, one row for each communication point, without loss of
//! precision.

use crate::error::Error;
use crate::run::{Observer, Sample};
use fmi_master::description::Carrier;
use std::fs::File;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Name of the file in the folder of results: comma-separated text with enough digits to read back
/// the same bits.
pub const FILE: &str = "results.csv";

/// Number of bytes that are held in memory before they are written.
const HELD: usize = 1 << 16;
/// Time after which rows are written with the next one, so that a crash of the process loses only
/// rows that came within such a time.
const PERIOD: Duration = Duration::from_secs(1);

/// A variable that is recorded.
#[derive(Clone, Debug)]
pub struct Column {
    /// Full name of the variable, `component.variable`.
    pub name: String,
    /// Index of the variable among a sample's values.
    pub place: usize,
    /// Type in which the values are transferred.
    pub carrier: Carrier,
}

/// A results file that is being written.
pub struct Recorder {
    path: PathBuf,
    file: File,
    /// Rows that are not yet written, and the time since when.
    held: Vec<u8>,
    since: Instant,
    columns: Vec<Column>,
    every: u64,
}

impl Recorder {
    /// Creates the file. A row is written at every `every`-th tick.
    ///
    /// # Errors
    /// Returns an error if the file cannot be written.
    pub fn create(path: &Path, columns: Vec<Column>, every: u32) -> Result<Self, Error> {
        let file = File::create(path).map_err(Error::file(path))?;
        let mut head = csv::Writer::from_writer(Vec::with_capacity(HELD + (1 << 12)));
        let names = ["time"].into_iter().chain(columns.iter().map(|column| &*column.name));
        // Writing to memory cannot fail.
        let _ = head.write_record(names);
        let (held, since) = (head.into_inner().unwrap_or_default(), Instant::now());
        Ok(Self { path: path.to_path_buf(), file, held, since, columns, every: every.into() })
    }

    /// Writes the rows that are still in memory.
    ///
    /// # Errors
    /// Returns an error if the file cannot be written.
    pub fn finish(&mut self) -> Result<(), Error> {
        let outcome = self.file.write_all(&self.held);
        self.held.clear();
        self.since = Instant::now();
        outcome.map_err(Error::file(&self.path))
    }
}

impl Observer for Recorder {
    fn observe(&mut self, sample: &Sample) -> Result<(), Error> {
        if !sample.tick.is_multiple_of(self.every) && !sample.last {
            return Ok(());
        }
        let (mut real, mut integer) = (zmij::Buffer::new(), itoa::Buffer::new());
        self.held.extend_from_slice(real.format(sample.time).as_bytes());
        for Column { place, carrier, .. } in &self.columns {
            let value = sample.values[*place];
            let text = match carrier {
                Carrier::Real => real.format(value),
                // The conversion is exact, because the value came from an `i32`.
                Carrier::Integer | Carrier::Boolean => integer.format(value as i32),
            };
            self.held.push(b',');
            self.held.extend_from_slice(text.as_bytes());
        }
        self.held.push(b'\n');
        let may_wait = self.held.len() < HELD && self.since.elapsed() < PERIOD;
        if may_wait { Ok(()) } else { self.finish() }
    }
}

impl Drop for Recorder {
    /// Writes the rows that are still held if a panic ends the run. There is nobody to tell if this
    /// fails.
    fn drop(&mut self) {
        let _ = self.finish();
    }
}

#[cfg(test)]
mod tests;
