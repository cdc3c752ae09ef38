//! Writes the recorded variables to `results.csv`.

use super::column::Column;
use crate::error::Error;
use fmi_master::description::Carrier;
use std::fs::File;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Number of bytes that are held in memory before they are written.
const HELD: usize = 1 << 16;
/// Time after which rows are written with the next one, so that a crash of the process loses only
/// rows that came within such a time.
const PERIOD: Duration = Duration::from_secs(1);

/// A CSV file that is being written.
pub(super) struct Text {
    path: PathBuf,
    file: File,
    /// Rows that are not yet written, and the time since when.
    held: Vec<u8>,
    since: Instant,
    columns: Vec<Shown>,
}

/// Format in which a column's values are written.
struct Shown {
    place: usize,
    carrier: Carrier,
    /// Items that are written by their names, which are already formatted as CSV fields.
    items: Vec<(String, i32)>,
}

impl Text {
    /// Creates the file, and prepares its header.
    pub(super) fn create(path: &Path, columns: &[Column], labels: bool) -> Result<Self, Error> {
        let file = File::create(path).map_err(Error::file(path))?;
        let head = |name: &str, unit: Option<&str>| match unit {
            Some(unit) if labels => field(&format!("{name} [{unit}]")),
            _ => field(name),
        };
        let mut held = Vec::with_capacity(HELD + (1 << 12));
        held.extend_from_slice(head("time", Some("s")).as_bytes());
        for Column { name, unit, .. } in columns {
            held.push(b',');
            held.extend_from_slice(head(name, unit.as_deref()).as_bytes());
        }
        held.push(b'\n');
        let shown = |column: &Column| {
            let items =
                column.items.iter().filter(|_| labels).map(|(name, item)| (field(name), *item));
            Shown { place: column.place, carrier: column.carrier, items: items.collect() }
        };
        let columns = columns.iter().map(shown).collect();
        let since = Instant::now();
        Ok(Self { path: path.to_path_buf(), file, held, since, columns })
    }

    pub(super) fn row(&mut self, time: f64, values: &[f64]) -> Result<(), Error> {
        let (mut real, mut integer) = (zmij::Buffer::new(), itoa::Buffer::new());
        self.held.extend_from_slice(real.format(time).as_bytes());
        for Shown { place, carrier, items } in &self.columns {
            let value = values[*place];
            let text = match carrier {
                Carrier::Real => real.format(value),
                // The conversion is exact, because the value came from an `i32`.
                Carrier::Integer | Carrier::Boolean => {
                    let item = items.iter().find(|(_, item)| *item == value as i32);
                    item.map_or_else(|| integer.format(value as i32), |(name, _)| name)
                }
            };
            self.held.push(b',');
            self.held.extend_from_slice(text.as_bytes());
        }
        self.held.push(b'\n');
        let may_wait = self.held.len() < HELD && self.since.elapsed() < PERIOD;
        if may_wait { Ok(()) } else { self.finish() }
    }

    /// Writes the rows that are held in memory.
    pub(super) fn finish(&mut self) -> Result<(), Error> {
        let outcome = self.file.write_all(&self.held);
        self.held.clear();
        self.since = Instant::now();
        outcome.map_err(Error::file(&self.path))
    }
}

impl Drop for Text {
    /// Writes the rows that are still held if a panic ends the run. There is nobody to tell if this
    /// fails.
    fn drop(&mut self) {
        let _ = self.finish();
    }
}

/// Formats a text as a CSV field, in quotation marks if it needs them.
fn field(text: &str) -> String {
    let mut writer =
        csv::WriterBuilder::new().terminator(csv::Terminator::Any(b'\n')).from_writer(Vec::new());
    // Writing to memory cannot fail.
    let _ = writer.write_record([text]);
    let bytes = writer.into_inner().unwrap_or_default();
    String::from_utf8_lossy(&bytes).trim_end_matches('\n').to_owned()
}
