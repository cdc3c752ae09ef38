//! Tables of cases as Parquet files: one row for each case, units and items in the metadata.

mod file;
mod guard;

pub use file::{Reader, Writer};

use cosim::files;
use parquet::basic::Type as Physical;
use parquet::column::writer::ColumnWriter;
use parquet::data_type::ByteArray;
use parquet::errors::ParquetError;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use sha2::{Digest, Sha256};
use std::ops::Range;

/// Values of a column.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Values {
    /// Real numbers.
    Real(Vec<f64>),
    /// Real numbers, some of which may be missing.
    Optional(Vec<Option<f64>>),
    /// Whole numbers, such as that of a case.
    Count(Vec<i64>),
    /// Integers of an FMU.
    Integer(Vec<i32>),
    /// Truth values.
    Flag(Vec<bool>),
    /// Texts, such as items of an enumeration.
    Text(Vec<String>),
}

/// Evaluates the same expression for the values of a column, whatever their type.
macro_rules! for_any {
    ($column:expr, $values:ident => $result:expr) => {
        match $column {
            Values::Real($values) => $result,
            Values::Optional($values) => $result,
            Values::Count($values) => $result,
            Values::Integer($values) => $result,
            Values::Flag($values) => $result,
            Values::Text($values) => $result,
        }
    };
}

impl Values {
    /// Returns the number of values.
    pub fn len(&self) -> usize {
        for_any!(self, values => values.len())
    }

    /// Returns whether there are no values.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Returns the values as numbers, with 1 and 0 for yes and no. Missing values and texts become
    /// NaN.
    pub fn numbers(&self) -> Vec<f64> {
        (0..self.len()).map(|row| self.number(row).unwrap_or(f64::NAN)).collect()
    }

    /// Returns a value as a number, with 1 and 0 for yes and no; `None` if it is missing or a text.
    pub fn number(&self, row: usize) -> Option<f64> {
        match self {
            Self::Real(values) => Some(values[row]),
            Self::Optional(values) => values[row],
            Self::Count(values) => Some(values[row] as f64),
            Self::Integer(values) => Some(f64::from(values[row])),
            Self::Flag(values) => Some(f64::from(u8::from(values[row]))),
            Self::Text(_) => None,
        }
    }

    /// Returns a value as JSON.
    pub fn json(&self, row: usize) -> Value {
        for_any!(self, values => json!(values[row]))
    }

    /// Moves the values of another column of the same type behind these.
    fn append(&mut self, other: Self) -> Result<(), ParquetError> {
        match (self, other) {
            (Self::Real(values), Self::Real(more)) => values.extend(more),
            (Self::Optional(values), Self::Optional(more)) => values.extend(more),
            (Self::Count(values), Self::Count(more)) => values.extend(more),
            (Self::Integer(values), Self::Integer(more)) => values.extend(more),
            (Self::Flag(values), Self::Flag(more)) => values.extend(more),
            (Self::Text(values), Self::Text(more)) => values.extend(more),
            _ => return Err(ParquetError::General("columns of different types".into())),
        }
        Ok(())
    }

    fn physical(&self) -> Physical {
        match self {
            Self::Real(_) | Self::Optional(_) => Physical::DOUBLE,
            Self::Count(_) => Physical::INT64,
            Self::Integer(_) => Physical::INT32,
            Self::Flag(_) => Physical::BOOLEAN,
            Self::Text(_) => Physical::BYTE_ARRAY,
        }
    }

    /// Writes the first `count` values.
    fn write(&self, count: usize, writer: &mut ColumnWriter) -> Result<usize, ParquetError> {
        match (self, writer) {
            (Self::Real(values), ColumnWriter::DoubleColumnWriter(writer)) => {
                writer.write_batch(&values[..count], None, None)
            }
            (Self::Optional(values), ColumnWriter::DoubleColumnWriter(writer)) => {
                let values = &values[..count];
                let present: Vec<f64> = values.iter().copied().flatten().collect();
                let levels: Vec<i16> = values.iter().map(|v| i16::from(v.is_some())).collect();
                writer.write_batch(&present, Some(&levels), None)
            }
            (Self::Count(values), ColumnWriter::Int64ColumnWriter(writer)) => {
                writer.write_batch(&values[..count], None, None)
            }
            (Self::Integer(values), ColumnWriter::Int32ColumnWriter(writer)) => {
                writer.write_batch(&values[..count], None, None)
            }
            (Self::Flag(values), ColumnWriter::BoolColumnWriter(writer)) => {
                writer.write_batch(&values[..count], None, None)
            }
            (Self::Text(values), ColumnWriter::ByteArrayColumnWriter(writer)) => {
                let bytes = values[..count].iter().map(|text| ByteArray::from(text.as_str()));
                writer.write_batch(&bytes.collect::<Vec<_>>(), None, None)
            }
            _ => Err(ParquetError::General("a column is of another type than its values".into())),
        }
    }

    /// Feeds the values to a hash, so that no two columns give the same.
    fn hash(&self, digest: &mut Sha256) {
        digest.update((self.len() as u64).to_le_bytes());
        match self {
            Self::Real(values) => values.iter().for_each(|v| digest.update(v.to_le_bytes())),
            Self::Optional(values) => values.iter().for_each(|value| {
                digest.update([u8::from(value.is_some())]);
                digest.update(value.unwrap_or(0.0).to_le_bytes());
            }),
            Self::Count(values) => values.iter().for_each(|v| digest.update(v.to_le_bytes())),
            Self::Integer(values) => values.iter().for_each(|v| digest.update(v.to_le_bytes())),
            Self::Flag(values) => values.iter().for_each(|v| digest.update([u8::from(*v)])),
            Self::Text(values) => values.iter().for_each(|text| {
                digest.update((text.len() as u64).to_le_bytes());
                digest.update(text);
            }),
        }
    }
}

/// A column with its name and values.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Column {
    /// Name of the column, unique in its table.
    pub name: String,
    /// Values, one for each row.
    pub values: Values,
}

/// A table of cases, whose columns have the same length.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct CaseTable {
    /// Columns of the table, in order.
    pub columns: Vec<Column>,
}

impl CaseTable {
    /// Returns the number of rows.
    pub fn rows(&self) -> usize {
        self.columns.first().map_or(0, |column| column.values.len())
    }

    /// Returns the column with this name.
    pub fn column(&self, name: &str) -> Option<&Values> {
        self.columns.iter().find(|column| column.name == name).map(|column| &column.values)
    }

    /// Returns whether the rows are those of these cases, in order.
    pub fn has_cases(&self, cases: &Range<u64>) -> bool {
        let Some(Values::Count(numbers)) = self.column("case") else { return false };
        numbers.iter().map(|number| number.cast_unsigned()).eq(cases.clone())
    }

    /// Returns a hash of names and values, as hexadecimal digits.
    pub fn digest(&self) -> String {
        let mut digest = Sha256::new();
        for column in &self.columns {
            digest.update((column.name.len() as u64).to_le_bytes());
            digest.update(&column.name);
            column.values.hash(&mut digest);
        }
        files::hexadecimal(&digest.finalize())
    }

    fn append(&mut self, other: Self) -> Result<(), ParquetError> {
        if self.columns.is_empty() {
            *self = other;
            return Ok(());
        }
        for (column, more) in self.columns.iter_mut().zip(other.columns) {
            column.values.append(more.values)?;
        }
        Ok(())
    }

    fn remove_first(&mut self, rows: usize) {
        for column in &mut self.columns {
            for_any!(&mut column.values, values => drop(values.drain(..rows)));
        }
    }
}

#[cfg(test)]
mod tests;
