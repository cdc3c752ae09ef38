//! Parquet files of cases.

use super::guard::guarded;
use super::{CaseTable, Column, Values};
use cosim::error::Error;
use cosim::files::PartialFile;
use parquet::basic::{LogicalType, Repetition, Type as Physical};
use parquet::column::reader::{ColumnReader, ColumnReaderImpl};
use parquet::data_type::{ByteArray, DataType};
use parquet::errors::ParquetError;
use parquet::file::metadata::KeyValue;
use parquet::file::properties::{EnabledStatistics, WriterProperties};
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::types::{ColumnPath, Type};
use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Number of rows in a group. Files of the same rows are the same bytes, however the rows came.
const GROUP: usize = 8192;

/// A Parquet file that is being written. It appears under its name when it is complete.
pub struct Writer {
    path: PathBuf,
    partial: PartialFile,
    metadata: Vec<KeyValue>,
    file: Option<SerializedFileWriter<File>>,
    waiting: CaseTable,
}

impl Writer {
    /// Begins a file with this metadata, texts by key.
    ///
    /// # Errors
    /// Returns an error if the file's folder cannot be created.
    pub fn create(path: &Path, metadata: &[(&str, String)]) -> Result<Self, Error> {
        let metadata =
            metadata.iter().map(|(key, text)| KeyValue::new((*key).into(), text.clone()));
        Ok(Self {
            path: path.to_path_buf(),
            partial: PartialFile::create(path)?,
            metadata: metadata.collect(),
            file: None,
            waiting: CaseTable::default(),
        })
    }

    /// Adds rows. All tables that are added have the same columns.
    ///
    /// # Errors
    /// Returns an error if the file cannot be written.
    pub fn add(&mut self, rows: CaseTable) -> Result<(), Error> {
        self.waiting.append(rows).map_err(failed(&self.path))?;
        while self.waiting.rows() >= GROUP {
            self.write(GROUP)?;
        }
        Ok(())
    }

    /// Writes the rows that are left, and gives the file its name.
    ///
    /// # Errors
    /// Returns an error if the file cannot be written.
    pub fn finish(mut self) -> Result<(), Error> {
        let rest = self.waiting.rows();
        if rest > 0 || self.file.is_none() {
            self.write(rest)?;
        }
        if let Some(mut writer) = self.file.take() {
            writer.finish().map_err(failed(&self.path))?;
        }
        self.partial.finish()
    }

    /// Writes the first rows that wait as a group.
    fn write(&mut self, rows: usize) -> Result<(), Error> {
        let mut write = || {
            if self.file.is_none() {
                self.file = Some(begin(self.partial.file(), &self.waiting, &self.metadata)?);
            }
            let Some(writer) = &mut self.file else { return Ok(()) };
            let mut group = writer.next_row_group()?;
            for column in &self.waiting.columns {
                let Some(mut open) = group.next_column()? else { break };
                column.values.write(rows, open.untyped())?;
                open.close()?;
            }
            group.close().map(drop)
        };
        write().map_err(failed(&self.path))?;
        self.waiting.remove_first(rows);
        Ok(())
    }
}

fn begin(
    file: &File,
    table: &CaseTable,
    metadata: &[KeyValue],
) -> Result<SerializedFileWriter<File>, ParquetError> {
    let file = file.try_clone().map_err(|error| ParquetError::External(Box::new(error)))?;
    let mut properties = WriterProperties::builder()
        .set_dictionary_enabled(false)
        .set_statistics_enabled(EnabledStatistics::None)
        .set_key_value_metadata(Some(metadata.to_vec()));
    let mut fields = Vec::new();
    for column in &table.columns {
        let physical = column.values.physical();
        let repetition = match column.values {
            Values::Optional(_) => Repetition::OPTIONAL,
            _ => Repetition::REQUIRED,
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

/// A Parquet file that was written by [`Writer`].
pub struct Reader {
    path: PathBuf,
    file: SerializedFileReader<File>,
}

impl Reader {
    /// Opens a file.
    ///
    /// # Errors
    /// Returns an error if the file cannot be read or is no Parquet file.
    pub fn open(path: &Path) -> Result<Self, Error> {
        let file = File::open(path).map_err(Error::file(path))?;
        let file = guarded(|| SerializedFileReader::new(file)).map_err(failed(path))?;
        Ok(Self { path: path.to_path_buf(), file })
    }

    /// Returns a text of the metadata.
    pub fn metadata(&self, key: &str) -> Option<&str> {
        let entries = self.file.metadata().file_metadata().key_value_metadata()?;
        entries.iter().find(|entry| entry.key == key)?.value.as_deref()
    }

    /// Returns the number of rows.
    pub fn rows(&self) -> u64 {
        u64::try_from(self.file.metadata().file_metadata().num_rows()).unwrap_or(0)
    }

    /// Reads the column with this name.
    ///
    /// # Errors
    /// Returns an error if there is no such column, or if the file is damaged.
    pub fn column(&self, name: &str) -> Result<Values, Error> {
        let columns = self.file.metadata().file_metadata().schema_descr();
        let index = columns.columns().iter().position(|column| column.name() == name);
        index
            .ok_or_else(|| ParquetError::General(format!("there is no column \"{name}\"")))
            .and_then(|index| guarded(|| self.read(index)))
            .map_err(failed(&self.path))
    }

    /// Reads all columns.
    ///
    /// # Errors
    /// Returns an error if the file is damaged.
    pub fn table(&self) -> Result<CaseTable, Error> {
        let names = self.file.metadata().file_metadata().schema_descr().columns();
        let column = |(index, name): (usize, &str)| {
            Ok(Column { name: name.to_string(), values: self.read(index)? })
        };
        let columns = names.iter().map(|column| column.name()).enumerate().map(column);
        let columns: Result<_, ParquetError> = guarded(|| columns.collect());
        let columns = columns.map_err(failed(&self.path))?;
        Ok(CaseTable { columns })
    }

    fn read(&self, index: usize) -> Result<Values, ParquetError> {
        let mut column: Option<Values> = None;
        for group in 0..self.file.num_row_groups() {
            let group = self.file.get_row_group(group)?;
            let rows = u64::try_from(group.metadata().num_rows()).ok();
            // A damaged file may claim any number of rows, for which there would be no room.
            let rows = rows.filter(|rows| *rows <= self.rows()).map(|rows| rows as usize);
            let rows = rows.ok_or_else(|| {
                ParquetError::General("a group has more rows than the file".into())
            })?;
            let values = match group.get_column_reader(index)? {
                ColumnReader::DoubleColumnReader(reader) => {
                    let descriptor = group.metadata().schema_descr().column(index);
                    if descriptor.max_def_level() == 0 {
                        Values::Real(values_of(reader, rows)?.0)
                    } else {
                        let (present, levels) = values_of(reader, rows)?;
                        let mut present = present.into_iter();
                        let value = |level: i16| (level > 0).then(|| present.next()).flatten();
                        Values::Optional(levels.into_iter().map(value).collect())
                    }
                }
                ColumnReader::Int64ColumnReader(reader) => {
                    Values::Count(values_of(reader, rows)?.0)
                }
                ColumnReader::Int32ColumnReader(reader) => {
                    Values::Integer(values_of(reader, rows)?.0)
                }
                ColumnReader::BoolColumnReader(reader) => Values::Flag(values_of(reader, rows)?.0),
                ColumnReader::ByteArrayColumnReader(reader) => {
                    let (bytes, _) = values_of(reader, rows)?;
                    let text = |bytes: ByteArray| bytes.as_utf8().map(str::to_owned);
                    Values::Text(bytes.into_iter().map(text).collect::<Result<_, _>>()?)
                }
                _ => return Err(ParquetError::General("a column of an unknown type".into())),
            };
            if values.len() != rows {
                return Err(ParquetError::General("a column is too short".into()));
            }
            match &mut column {
                Some(column) => column.append(values)?,
                None => column = Some(values),
            }
        }
        Ok(column.unwrap_or(Values::Real(Vec::new())))
    }
}

/// Reads the values of a column in a group, and the levels that say which of them are there.
fn values_of<T: DataType>(
    mut reader: ColumnReaderImpl<T>,
    rows: usize,
) -> Result<(Vec<T::T>, Vec<i16>), ParquetError> {
    let (mut values, mut levels) = (Vec::new(), Vec::new());
    let mut read = 0;
    while read < rows {
        let (records, _, _) =
            reader.read_records(rows - read, Some(&mut levels), None, &mut values)?;
        if records == 0 {
            break;
        }
        read += records;
    }
    Ok((values, levels))
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
