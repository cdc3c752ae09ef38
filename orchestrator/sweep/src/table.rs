//! Tables of cases: one row for each case. They are written as Parquet files, with units in the
//! metadata.

mod file;

use cosim::error::Error;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use std::ops::Range;
use std::path::Path;

/// Values of a column.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Values {
    /// Real numbers, some of which may be missing.
    Real(Vec<Option<f64>>),
    /// Whole numbers.
    Integer(Vec<i64>),
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
            Self::Real(values) => values[row],
            Self::Integer(values) => Some(values[row] as f64),
            Self::Flag(values) => Some(f64::from(u8::from(values[row]))),
            Self::Text(_) => None,
        }
    }

    /// Returns a value as JSON.
    pub fn json(&self, row: usize) -> Value {
        for_any!(self, values => json!(values[row]))
    }

    /// Moves the values of another column of the same type behind these.
    fn append(&mut self, other: Self) {
        match (self, other) {
            (Self::Real(values), Self::Real(more)) => values.extend(more),
            (Self::Integer(values), Self::Integer(more)) => values.extend(more),
            (Self::Flag(values), Self::Flag(more)) => values.extend(more),
            (Self::Text(values), Self::Text(more)) => values.extend(more),
            _ => unreachable!("a column has the same type in all parts"),
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

    /// Returns the numbers of the column with this name, as [`Values::numbers`] does.
    pub fn numbers(&self, name: &str) -> Vec<f64> {
        self.column(name).map(Values::numbers).unwrap_or_default()
    }

    /// Returns the texts of the column with this name; none if it has no texts.
    pub fn texts(&self, name: &str) -> &[String] {
        if let Some(Values::Text(texts)) = self.column(name) { texts } else { &[] }
    }

    /// Returns whether the rows are those of these cases, in order.
    pub fn has_cases(&self, cases: &Range<u64>) -> bool {
        let Some(Values::Integer(numbers)) = self.column("case") else { return false };
        numbers.iter().map(|number| number.cast_unsigned()).eq(cases.clone())
    }

    /// Adds the rows of another table, which has the same columns.
    pub fn append(&mut self, other: Self) {
        if self.columns.is_empty() {
            *self = other;
            return;
        }
        for (column, more) in self.columns.iter_mut().zip(other.columns) {
            column.values.append(more.values);
        }
    }

    /// Writes the table as a Parquet file with the units of its columns, which are JSON.
    ///
    /// # Errors
    /// Returns an error if the file cannot be written.
    pub fn write(&self, path: &Path, units: String) -> Result<(), Error> {
        file::write(self, path, units)
    }
}

#[cfg(test)]
mod tests;
