//! Writes the recorded variables to a CSV file, a row per communication point, digits enough to read back the same bits.

use crate::error::Error;
use crate::master::{Observer, Sample};
use crate::wiring::Carrier;
use std::fmt::Write as _;
use std::fs::File;
use std::path::{Path, PathBuf};

/// A CSV file in the making.
pub struct Recorder {
    path: PathBuf,
    writer: csv::Writer<File>,
    /// For each column, which of the sample's values it shows, and how.
    columns: Vec<(usize, Carrier)>,
    /// For each column, the names of an enumeration's items by which its values are told; none: by numbers.
    items: Vec<Vec<(String, i32)>>,
    every: u64,
    record: csv::StringRecord,
    field: String,
}

impl Recorder {
    /// Creates the file. `time` heads the column of times; `columns` are name, place among the sample's values and type; `every` is the number of ticks
    /// from row to row.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn create(
        path: &Path,
        time: &str,
        columns: &[(&str, usize, Carrier)],
        every: u32,
    ) -> Result<Self, Error> {
        let file = File::create(path).map_err(Error::file(path))?;
        let writer = csv::WriterBuilder::new().buffer_capacity(1 << 16).from_writer(file);
        let mut recorder = Self {
            path: path.to_path_buf(),
            writer,
            columns: columns.iter().map(|(_, place, carrier)| (*place, *carrier)).collect(),
            items: Vec::new(),
            every: u64::from(every),
            record: csv::StringRecord::new(),
            field: String::new(),
        };
        recorder.record.push_field(time);
        for (name, ..) in columns {
            recorder.record.push_field(name);
        }
        recorder.write()?;
        Ok(recorder)
    }

    /// Tells enumerations by the names of their items, which are given for each column.
    #[must_use]
    pub fn with_names(self, items: Vec<Vec<(String, i32)>>) -> Self {
        Self { items, ..self }
    }

    fn write(&mut self) -> Result<(), Error> {
        let outcome = self.writer.write_record(&self.record);
        self.record.clear();
        outcome.map_err(|error| Error::file(&self.path)(error.into()))
    }

    fn push(&mut self, value: f64, carrier: Carrier) {
        self.field.clear();
        // Writing to a string cannot fail.
        let _ = match carrier {
            Carrier::Real => write!(self.field, "{value:?}"),
            Carrier::Integer | Carrier::Boolean => write!(self.field, "{value}"),
        };
        self.record.push_field(&self.field);
    }

    /// Writes what is still in memory. Also done when the value is dropped, but then without telling of failure.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn finish(&mut self) -> Result<(), Error> {
        self.writer.flush().map_err(Error::file(&self.path))
    }
}

impl Observer for Recorder {
    fn observe(&mut self, sample: &Sample) -> Result<(), Error> {
        if !sample.tick.is_multiple_of(self.every) && !sample.last {
            return Ok(());
        }
        self.push(sample.time, Carrier::Real);
        for index in 0..self.columns.len() {
            let (place, carrier) = self.columns[index];
            let value = sample.values[place];
            let mut items = self.items.get(index).into_iter().flatten();
            match items.find(|(_, item)| f64::from(*item) == value) {
                Some((name, _)) => self.record.push_field(name),
                None => self.push(value, carrier),
            }
        }
        self.write()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_read_back_to_the_same_bits() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("results.csv");
        let columns = [("a.x", 1, Carrier::Real), ("a.n", 0, Carrier::Integer)];
        let mut recorder = Recorder::create(&path, "time", &columns, 2).unwrap();
        let values = [0.1 + 0.2, 1e-300, f64::MAX, -0.0, 5e-324];
        for (tick, value) in values.iter().enumerate() {
            let sample = Sample {
                tick: tick as u64,
                time: tick as f64 * 0.04,
                last: tick == 3,
                values: &[7.0, *value],
            };
            recorder.observe(&sample).unwrap();
        }
        recorder.finish().unwrap();
        let mut reader = csv::Reader::from_path(&path).unwrap();
        assert_eq!(reader.headers().unwrap(), vec!["time", "a.x", "a.n"]);
        let rows: Vec<Vec<String>> =
            reader.records().map(|row| row.unwrap().iter().map(String::from).collect()).collect();
        let bits: Vec<u64> = rows.iter().map(|row| row[1].parse::<f64>().unwrap().to_bits()).collect();
        // Every second tick, and the last.
        assert_eq!(bits, [0, 2, 3, 4].map(|index: usize| values[index].to_bits()));
        assert_eq!(rows[0][2], "7");
    }
}
