//! Parquet files of cases.

use super::{CaseTable, Values};
use cosim::error::Error;
use cosim::files::PartialFile;
use parquet::basic::{LogicalType, Repetition, Type as Physical};
use parquet::column::writer::ColumnWriter;
use parquet::data_type::ByteArray;
use parquet::errors::ParquetError;
use parquet::file::metadata::KeyValue;
use parquet::file::properties::{EnabledStatistics, WriterProperties};
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::types::{ColumnPath, Type};
use std::fs::File;
use std::io;
use std::ops::Range;
use std::path::Path;
use std::sync::Arc;

/// Number of rows in a group.
const GROUP: usize = 8192;

/// Writes a table, with the units of its columns as JSON. The file appears under its name when it is
/// complete.
pub(super) fn write(table: &CaseTable, path: &Path, units: String) -> Result<(), Error> {
    let mut partial = PartialFile::create(path)?;
    let write = || {
        let mut writer = begin(partial.file(), table, units)?;
        for start in (0..table.rows()).step_by(GROUP) {
            let mut group = writer.next_row_group()?;
            for column in &table.columns {
                let Some(mut open) = group.next_column()? else { break };
                let rows = start..table.rows().min(start + GROUP);
                write_values(&column.values, rows, open.untyped())?;
                open.close()?;
            }
            group.close()?;
        }
        writer.finish().map(drop)
    };
    write().map_err(|error| Error::file(path)(reason(error)))?;
    partial.finish()
}

fn begin(
    file: &File,
    table: &CaseTable,
    units: String,
) -> Result<SerializedFileWriter<File>, ParquetError> {
    let file = file.try_clone()?;
    let mut properties = WriterProperties::builder()
        .set_dictionary_enabled(false)
        .set_statistics_enabled(EnabledStatistics::None)
        .set_key_value_metadata(Some(vec![KeyValue::new("units".into(), units)]));
    let mut fields = Vec::new();
    for column in &table.columns {
        let (physical, repetition) = match column.values {
            Values::Real(_) => (Physical::DOUBLE, Repetition::OPTIONAL),
            Values::Integer(_) => (Physical::INT64, Repetition::REQUIRED),
            Values::Flag(_) => (Physical::BOOLEAN, Repetition::REQUIRED),
            Values::Text(_) => (Physical::BYTE_ARRAY, Repetition::REQUIRED),
        };
        let is_text = physical == Physical::BYTE_ARRAY;
        if is_text {
            // Texts repeat: items of enumerations, and messages that are mostly empty.
            let name = ColumnPath::new(vec![column.name.clone()]);
            properties = properties.set_column_dictionary_enabled(name, true);
        }
        let field = Type::primitive_type_builder(&column.name, physical)
            .with_repetition(repetition)
            .with_logical_type(is_text.then_some(LogicalType::String))
            .build()?;
        fields.push(Arc::new(field));
    }
    let schema = Arc::new(Type::group_type_builder("cases").with_fields(fields).build()?);
    SerializedFileWriter::new(file, schema, Arc::new(properties.build()))
}

/// Writes the values of these rows.
fn write_values(
    values: &Values,
    rows: Range<usize>,
    writer: &mut ColumnWriter,
) -> Result<usize, ParquetError> {
    match (values, writer) {
        (Values::Real(values), ColumnWriter::DoubleColumnWriter(writer)) => {
            let present: Vec<f64> = values[rows.clone()].iter().copied().flatten().collect();
            let levels: Vec<i16> = values[rows].iter().map(|v| i16::from(v.is_some())).collect();
            writer.write_batch(&present, Some(&levels), None)
        }
        (Values::Integer(values), ColumnWriter::Int64ColumnWriter(writer)) => {
            writer.write_batch(&values[rows], None, None)
        }
        (Values::Flag(values), ColumnWriter::BoolColumnWriter(writer)) => {
            writer.write_batch(&values[rows], None, None)
        }
        (Values::Text(values), ColumnWriter::ByteArrayColumnWriter(writer)) => {
            let bytes = values[rows].iter().map(|text| ByteArray::from(text.as_str()));
            writer.write_batch(&bytes.collect::<Vec<_>>(), None, None)
        }
        _ => Err(ParquetError::General("a column is of another type than its values".into())),
    }
}

/// Returns the reason why a file could not be written.
fn reason(error: ParquetError) -> io::Error {
    match error {
        ParquetError::External(source) => match source.downcast::<io::Error>() {
            Ok(error) => *error,
            Err(other) => io::Error::other(other),
        },
        other => io::Error::other(other),
    }
}
