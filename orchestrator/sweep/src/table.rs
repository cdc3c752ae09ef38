//! Tables of cases as Parquet files: one row for each case, units and items in the metadata.

mod file;
mod guard;

pub use file::{Reader, Writer};

use cosim::files;
use parquet::basic::{Repetition, Type as Physical};
use parquet::column::writer::ColumnWriter;
use parquet::data_type::ByteArray;
use parquet::errors::ParquetError;
use serde_json::{Value, json};
use sha2::{Digest, Sha256};
use std::ops::Range;

/// Values of a column.
#[derive(Clone, Debug, PartialEq)]
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

impl Values {
    /// Returns the number of values.
    pub fn len(&self) -> usize {
        match self {
            Self::Real(values) => values.len(),
            Self::Optional(values) => values.len(),
            Self::Count(values) => values.len(),
            Self::Integer(values) => values.len(),
            Self::Flag(values) => values.len(),
            Self::Text(values) => values.len(),
        }
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
        match self {
            Self::Real(values) => json!(values[row]),
            Self::Optional(values) => json!(values[row]),
            Self::Count(values) => json!(values[row]),
            Self::Integer(values) => json!(values[row]),
            Self::Flag(values) => json!(values[row]),
            Self::Text(values) => json!(values[row]),
        }
    }

    /// Moves the values of another column of the same type behind these.
    fn append(&mut self, other: Self) -> Result<(), ParquetError> {
        match (self, other) {
            (Self::Real(values), Self::Real(mut more)) => values.append(&mut more),
            (Self::Optional(values), Self::Optional(mut more)) => values.append(&mut more),
            (Self::Count(values), Self::Count(mut more)) => values.append(&mut more),
            (Self::Integer(values), Self::Integer(mut more)) => values.append(&mut more),
            (Self::Flag(values), Self::Flag(mut more)) => values.append(&mut more),
            (Self::Text(values), Self::Text(mut more)) => values.append(&mut more),
            _ => return Err(ParquetError::General("columns of different types".into())),
        }
        Ok(())
    }

    /// Splits off the first `count` values.
    fn take(&mut self, count: usize) -> Self {
        fn first<T>(values: &mut Vec<T>, count: usize) -> Vec<T> {
            let rest = values.split_off(count.min(values.len()));
            std::mem::replace(values, rest)
        }
        match self {
            Self::Real(values) => Self::Real(first(values, count)),
            Self::Optional(values) => Self::Optional(first(values, count)),
            Self::Count(values) => Self::Count(first(values, count)),
            Self::Integer(values) => Self::Integer(first(values, count)),
            Self::Flag(values) => Self::Flag(first(values, count)),
            Self::Text(values) => Self::Text(first(values, count)),
        }
    }

    fn physical(&self) -> (Physical, Repetition) {
        match self {
            Self::Real(_) => (Physical::DOUBLE, Repetition::REQUIRED),
            Self::Optional(_) => (Physical::DOUBLE, Repetition::OPTIONAL),
            Self::Count(_) => (Physical::INT64, Repetition::REQUIRED),
            Self::Integer(_) => (Physical::INT32, Repetition::REQUIRED),
            Self::Flag(_) => (Physical::BOOLEAN, Repetition::REQUIRED),
            Self::Text(_) => (Physical::BYTE_ARRAY, Repetition::REQUIRED),
        }
    }

    fn write(&self, writer: &mut ColumnWriter) -> Result<usize, ParquetError> {
        match (self, writer) {
            (Self::Real(values), ColumnWriter::DoubleColumnWriter(writer)) => {
                writer.write_batch(values, None, None)
            }
            (Self::Optional(values), ColumnWriter::DoubleColumnWriter(writer)) => {
                let present: Vec<f64> = values.iter().copied().flatten().collect();
                let levels: Vec<i16> = values.iter().map(|v| i16::from(v.is_some())).collect();
                writer.write_batch(&present, Some(&levels), None)
            }
            (Self::Count(values), ColumnWriter::Int64ColumnWriter(writer)) => {
                writer.write_batch(values, None, None)
            }
            (Self::Integer(values), ColumnWriter::Int32ColumnWriter(writer)) => {
                writer.write_batch(values, None, None)
            }
            (Self::Flag(values), ColumnWriter::BoolColumnWriter(writer)) => {
                writer.write_batch(values, None, None)
            }
            (Self::Text(values), ColumnWriter::ByteArrayColumnWriter(writer)) => {
                let bytes: Vec<ByteArray> =
                    values.iter().map(|text| ByteArray::from(text.as_str())).collect();
                writer.write_batch(&bytes, None, None)
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
#[derive(Clone, Debug, PartialEq)]
pub struct Column {
    /// Name of the column, unique in its table.
    pub name: String,
    /// Values, one for each row.
    pub values: Values,
}

/// A table of cases, whose columns have the same length.
#[derive(Clone, Debug, Default, PartialEq)]
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

    fn take(&mut self, rows: usize) -> Self {
        let column = |column: &mut Column| Column {
            name: column.name.clone(),
            values: column.values.take(rows),
        };
        Self { columns: self.columns.iter_mut().map(column).collect() }
    }
}

#[cfg(test)]
mod tests;
