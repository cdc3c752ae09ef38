//! Writes the recorded variables to `results.parquet`.

use super::column::Column;
use crate::error::Error;
use fmi_master::description::Carrier;
use parquet::basic::{Repetition, Type as Physical};
use parquet::column::writer::ColumnWriter;
use parquet::errors::ParquetError;
use parquet::file::metadata::KeyValue;
use parquet::file::properties::{EnabledStatistics, WriterProperties};
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::types::{Type, TypePtr};
use serde_json::{Map, Value, json};
use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Number of rows that are held in memory before they are written as a group.
pub(super) const GROUP: usize = 8192;

/// Values of a column that are not yet written.
enum Values {
    Real(Vec<f64>),
    Integer(Vec<i32>),
    Boolean(Vec<bool>),
}

impl Values {
    fn new(carrier: Carrier) -> Self {
        match carrier {
            Carrier::Real => Self::Real(Vec::with_capacity(GROUP)),
            Carrier::Integer => Self::Integer(Vec::with_capacity(GROUP)),
            Carrier::Boolean => Self::Boolean(Vec::with_capacity(GROUP)),
        }
    }

    fn physical(&self) -> Physical {
        match self {
            Self::Real(_) => Physical::DOUBLE,
            Self::Integer(_) => Physical::INT32,
            Self::Boolean(_) => Physical::BOOLEAN,
        }
    }

    fn push(&mut self, value: f64) {
        match self {
            Self::Real(values) => values.push(value),
            // The conversion is exact, because the value came from an `i32`.
            Self::Integer(values) => values.push(value as i32),
            Self::Boolean(values) => values.push(value != 0.0),
        }
    }

    /// Writes the values to the file and clears them.
    fn write(&mut self, writer: &mut ColumnWriter) -> Result<usize, ParquetError> {
        match (self, writer) {
            (Self::Real(values), ColumnWriter::DoubleColumnWriter(writer)) => {
                let count = writer.write_batch(values, None, None);
                values.clear();
                count
            }
            (Self::Integer(values), ColumnWriter::Int32ColumnWriter(writer)) => {
                let count = writer.write_batch(values, None, None);
                values.clear();
                count
            }
            (Self::Boolean(values), ColumnWriter::BoolColumnWriter(writer)) => {
                let count = writer.write_batch(values, None, None);
                values.clear();
                count
            }
            _ => Err(ParquetError::General("a column is of another type than its values".into())),
        }
    }
}

/// A Parquet file that is being written. It cannot be read before [`Self::finish`] is called.
pub(super) struct Columnar {
    path: PathBuf,
    writer: SerializedFileWriter<File>,
    /// Values of the time that are held in memory, followed by those of each column.
    values: Vec<Values>,
    places: Vec<usize>,
    rows: usize,
    /// Whether a group could not be written, which has been reported.
    is_broken: bool,
}

impl Columnar {
    pub(super) fn create(path: &Path, columns: &[Column]) -> Result<Self, Error> {
        let file = File::create(path).map_err(Error::file(path))?;
        let places = columns.iter().map(|column| column.place).collect();
        let carriers = columns.iter().map(|column| column.carrier);
        let values: Vec<Values> =
            std::iter::once(Carrier::Real).chain(carriers).map(Values::new).collect();
        let names =
            std::iter::once("time").chain(columns.iter().map(|column| column.name.as_str()));
        let metadata = [("units", units(columns)), ("items", items(columns))];
        let metadata = metadata
            .map(|(key, value)| KeyValue::new(key.to_owned(), Value::Object(value).to_string()));
        // Numbers of a simulation hardly repeat, so that neither dictionaries nor statistics save
        // space.
        let properties = WriterProperties::builder()
            .set_dictionary_enabled(false)
            .set_statistics_enabled(EnabledStatistics::None)
            .set_key_value_metadata(Some(metadata.into()))
            .build();
        let writer = schema(names.zip(&values))
            .and_then(|schema| SerializedFileWriter::new(file, schema, Arc::new(properties)))
            .map_err(failed(path))?;
        let (path, rows, is_broken) = (path.to_path_buf(), 0, false);
        Ok(Self { path, writer, values, places, rows, is_broken })
    }

    pub(super) fn row(&mut self, time: f64, values: &[f64]) -> Result<(), Error> {
        let row = std::iter::once(time).chain(self.places.iter().map(|place| values[*place]));
        for (column, value) in self.values.iter_mut().zip(row) {
            column.push(value);
        }
        self.rows += 1;
        if self.rows == GROUP { self.write() } else { Ok(()) }
    }

    /// Writes the rows that are held in memory.
    fn write(&mut self) -> Result<(), Error> {
        self.rows = 0;
        let mut write = || {
            let mut group = self.writer.next_row_group()?;
            for values in &mut self.values {
                let Some(mut column) = group.next_column()? else { break };
                values.write(column.untyped())?;
                column.close()?;
            }
            group.close()
        };
        let outcome = write();
        self.is_broken = outcome.is_err();
        outcome.map(drop).map_err(failed(&self.path))
    }

    pub(super) fn finish(&mut self) -> Result<(), Error> {
        // The group that could not be written stays open, and the file cannot be completed.
        if self.is_broken {
            return Ok(());
        }
        if self.rows > 0 {
            self.write()?;
        }
        self.writer.finish().map(drop).map_err(failed(&self.path))
    }
}

fn schema<'a>(
    columns: impl Iterator<Item = (&'a str, &'a Values)>,
) -> Result<TypePtr, ParquetError> {
    let fields: Result<Vec<TypePtr>, ParquetError> = columns
        .map(|(name, values)| {
            let column = Type::primitive_type_builder(name, values.physical());
            Ok(Arc::new(column.with_repetition(Repetition::REQUIRED).build()?))
        })
        .collect();
    Ok(Arc::new(Type::group_type_builder("results").with_fields(fields?).build()?))
}

/// Collects the units of the columns that have one.
fn units(columns: &[Column]) -> Map<String, Value> {
    let column_units = columns
        .iter()
        .filter_map(|column| Some((column.name.clone(), json!(column.unit.as_ref()?))));
    std::iter::once(("time".to_owned(), json!("s"))).chain(column_units).collect()
}

/// Collects the names of the items of each enumeration, by their numbers.
fn items(columns: &[Column]) -> Map<String, Value> {
    let enumerations = columns.iter().filter(|column| !column.items.is_empty());
    enumerations
        .map(|column| {
            let items = column.items.iter().map(|(name, item)| (item.to_string(), json!(name)));
            (column.name.clone(), Value::Object(items.collect()))
        })
        .collect()
}

fn failed(path: &Path) -> impl FnOnce(ParquetError) -> Error {
    move |error| {
        let source = match error {
            ParquetError::External(source) => match source.downcast::<io::Error>() {
                Ok(error) => *error,
                Err(other) => io::Error::other(other),
            },
            other => io::Error::other(other),
        };
        Error::file(path)(source)
    }
}
