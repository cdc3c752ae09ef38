//! Tables of cases as Parquet files: one row for each case, units and items in the metadata.

use cosim::error::Error;
use parquet::basic::{LogicalType, Repetition, Type as Physical};
use parquet::column::reader::{ColumnReader, ColumnReaderImpl};
use parquet::column::writer::ColumnWriter;
use parquet::data_type::{ByteArray, DataType};
use parquet::errors::ParquetError;
use parquet::file::metadata::KeyValue;
use parquet::file::properties::{EnabledStatistics, WriterProperties};
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::types::{ColumnPath, Type};
use sha2::{Digest, Sha256};
use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Number of rows in a group. Files of the same rows are the same bytes, however the rows came.
const GROUP: usize = 8192;

/// Values of a column.
#[derive(Clone, Debug, PartialEq)]
pub enum Values {
    /// Real numbers.
    Real(Vec<f64>),
    /// Real numbers, some of which may be missing.
    Optional(Vec<Option<f64>>),
    /// Whole numbers, such as that of a case.
    Count(Vec<i64>),
    /// Integers of a unit.
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

    /// Returns the values as numbers, with 1 and 0 for yes and no; what is missing, and texts, are
    /// not numbers.
    pub fn numbers(&self) -> Vec<f64> {
        match self {
            Self::Real(values) => values.clone(),
            Self::Optional(values) => values.iter().map(|v| v.unwrap_or(f64::NAN)).collect(),
            Self::Count(values) => values.iter().map(|value| *value as f64).collect(),
            Self::Integer(values) => values.iter().copied().map(f64::from).collect(),
            Self::Flag(values) => values.iter().map(|v| f64::from(u8::from(*v))).collect(),
            Self::Text(values) => vec![f64::NAN; values.len()],
        }
    }

    /// Moves the values of another column of the same type behind these.
    fn append(&mut self, other: Self) -> Result<(), ParquetError> {
        match (self, other) {
            (Self::Real(own), Self::Real(mut other)) => own.append(&mut other),
            (Self::Optional(own), Self::Optional(mut other)) => own.append(&mut other),
            (Self::Count(own), Self::Count(mut other)) => own.append(&mut other),
            (Self::Integer(own), Self::Integer(mut other)) => own.append(&mut other),
            (Self::Flag(own), Self::Flag(mut other)) => own.append(&mut other),
            (Self::Text(own), Self::Text(mut other)) => own.append(&mut other),
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

/// A table whose columns have the same length.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Table {
    /// Columns of the table, in order.
    pub columns: Vec<Column>,
}

impl Table {
    /// Returns the number of rows.
    pub fn rows(&self) -> usize {
        self.columns.first().map_or(0, |column| column.values.len())
    }

    /// Returns the column with this name.
    pub fn column(&self, name: &str) -> Option<&Values> {
        self.columns.iter().find(|column| column.name == name).map(|column| &column.values)
    }

    /// Returns a hash of names and values, as hexadecimal digits.
    pub fn digest(&self) -> String {
        let mut digest = Sha256::new();
        for column in &self.columns {
            digest.update((column.name.len() as u64).to_le_bytes());
            digest.update(&column.name);
            column.values.hash(&mut digest);
        }
        hex(&digest.finalize())
    }

    fn append(&mut self, other: Self) -> Result<(), ParquetError> {
        if self.columns.is_empty() {
            *self = other;
            return Ok(());
        }
        for (own, other) in self.columns.iter_mut().zip(other.columns) {
            own.values.append(other.values)?;
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

/// Formats bytes as hexadecimal digits.
pub(crate) fn hex(bytes: &[u8]) -> String {
    use std::fmt::Write as _;
    bytes.iter().fold(String::new(), |mut text, byte| {
        // Writing to a string cannot fail.
        let _ = write!(text, "{byte:02x}");
        text
    })
}

/// A Parquet file that is being written. It appears under its name when it is complete.
pub struct Writer {
    path: PathBuf,
    unfinished: PathBuf,
    metadata: Vec<KeyValue>,
    writer: Option<SerializedFileWriter<File>>,
    waiting: Table,
}

impl Writer {
    /// Begins a file with this metadata, texts by key.
    ///
    /// # Errors
    /// Returns an error if the file's folder cannot be created.
    pub fn create(path: &Path, metadata: &[(&str, String)]) -> Result<Self, Error> {
        if let Some(folder) = path.parent() {
            fs::create_dir_all(folder).map_err(Error::file(folder))?;
        }
        let metadata =
            metadata.iter().map(|(key, text)| KeyValue::new((*key).into(), text.clone()));
        // Several processes may write the same part, with the same content.
        let unfinished = path.with_extension(format!("unfinished-{}", std::process::id()));
        Ok(Self {
            path: path.to_path_buf(),
            unfinished,
            metadata: metadata.collect(),
            writer: None,
            waiting: Table::default(),
        })
    }

    /// Adds rows. All tables that are added have the same columns.
    ///
    /// # Errors
    /// Returns an error if the file cannot be written.
    pub fn add(&mut self, rows: Table) -> Result<(), Error> {
        self.waiting.append(rows).map_err(failed(&self.unfinished))?;
        while self.waiting.rows() >= GROUP {
            let group = self.waiting.take(GROUP);
            self.write(&group)?;
        }
        Ok(())
    }

    /// Writes the rows that are left, and gives the file its name.
    ///
    /// # Errors
    /// Returns an error if the file cannot be written.
    pub fn finish(mut self) -> Result<(), Error> {
        let rest = std::mem::take(&mut self.waiting);
        if rest.rows() > 0 || self.writer.is_none() {
            self.write(&rest)?;
        }
        if let Some(mut writer) = self.writer.take() {
            writer.finish().map_err(failed(&self.unfinished))?;
        }
        fs::rename(&self.unfinished, &self.path).map_err(Error::file(&self.path))
    }

    fn write(&mut self, rows: &Table) -> Result<(), Error> {
        let mut write = || {
            let writer = match &mut self.writer {
                Some(writer) => writer,
                None => self.writer.insert(begin(&self.unfinished, rows, &self.metadata)?),
            };
            let mut group = writer.next_row_group()?;
            for column in &rows.columns {
                let Some(mut open) = group.next_column()? else { break };
                column.values.write(open.untyped())?;
                open.close()?;
            }
            group.close().map(drop)
        };
        write().map_err(failed(&self.unfinished))
    }
}

impl Drop for Writer {
    fn drop(&mut self) {
        // What was not finished is of no use. If it cannot be removed, the next run writes over it.
        if self.writer.take().is_some() {
            let _ = fs::remove_file(&self.unfinished);
        }
    }
}

fn begin(
    path: &Path,
    table: &Table,
    metadata: &[KeyValue],
) -> Result<SerializedFileWriter<File>, ParquetError> {
    let file = File::create(path).map_err(|error| ParquetError::External(Box::new(error)))?;
    let mut properties = WriterProperties::builder()
        .set_dictionary_enabled(false)
        .set_statistics_enabled(EnabledStatistics::None)
        .set_key_value_metadata(Some(metadata.to_vec()));
    let mut fields = Vec::new();
    for column in &table.columns {
        let (physical, repetition) = column.values.physical();
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
        let file = SerializedFileReader::new(file).map_err(failed(path))?;
        Ok(Self { path: path.to_path_buf(), file })
    }

    /// Returns a text of the metadata.
    pub fn metadata(&self, key: &str) -> Option<&str> {
        let all = self.file.metadata().file_metadata().key_value_metadata()?;
        all.iter().find(|entry| entry.key == key)?.value.as_deref()
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
            .and_then(|index| self.read(index))
            .map_err(failed(&self.path))
    }

    /// Reads all columns.
    ///
    /// # Errors
    /// Returns an error if the file is damaged.
    pub fn table(&self) -> Result<Table, Error> {
        let names = self.file.metadata().file_metadata().schema_descr().columns();
        let column = |(index, name): (usize, &str)| {
            Ok(Column { name: name.to_string(), values: self.read(index)? })
        };
        let columns = names.iter().map(|column| column.name()).enumerate().map(column);
        let columns = columns.collect::<Result<_, ParquetError>>().map_err(failed(&self.path))?;
        Ok(Table { columns })
    }

    fn read(&self, index: usize) -> Result<Values, ParquetError> {
        let mut all: Option<Values> = None;
        for group in 0..self.file.num_row_groups() {
            let group = self.file.get_row_group(group)?;
            let rows = usize::try_from(group.metadata().num_rows())
                .map_err(|error| ParquetError::General(error.to_string()))?;
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
            match &mut all {
                Some(all) => all.append(values)?,
                None => all = Some(values),
            }
        }
        Ok(all.unwrap_or(Values::Real(Vec::new())))
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

#[cfg(test)]
mod tests {
    use super::*;

    fn table(rows: std::ops::Range<usize>) -> Table {
        let column = |name: &str, values| Column { name: name.into(), values };
        Table {
            columns: vec![
                column("case", Values::Count(rows.clone().map(|i| i as i64).collect())),
                column("plant.x", Values::Real(rows.clone().map(|i| i as f64 / 7.0).collect())),
                column(
                    "late",
                    Values::Optional(
                        rows.clone().map(|i| (i % 3 > 0).then_some(i as f64)).collect(),
                    ),
                ),
                column("seed", Values::Integer(rows.clone().map(|i| i as i32 - 5).collect())),
                column("kept", Values::Flag(rows.clone().map(|i| i % 2 == 0).collect())),
                column("status", Values::Text(rows.map(|i| format!("ende {} °", i % 4)).collect())),
            ],
        }
    }

    #[test]
    fn rows_are_read_as_they_were_written() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("deep/a.parquet");
        let whole = table(0..20_000);
        let mut writer = Writer::create(&path, &[("units", "{}".into())]).unwrap();
        writer.add(whole.clone()).unwrap();
        assert!(!path.exists());
        writer.finish().unwrap();
        let reader = Reader::open(&path).unwrap();
        assert_eq!((reader.rows(), reader.metadata("units")), (20_000, Some("{}")));
        assert_eq!(reader.table().unwrap(), whole);
        assert_eq!(reader.column("late").unwrap(), *whole.column("late").unwrap());
        assert!(reader.column("lat").unwrap_err().to_string().contains("no column \"lat\""));
    }

    #[test]
    fn the_bytes_do_not_depend_on_the_pieces() {
        let folder = tempfile::tempdir().unwrap();
        let written = |name: &str, pieces: &[usize]| {
            let path = folder.path().join(name);
            let mut writer = Writer::create(&path, &[]).unwrap();
            let mut start = 0;
            for piece in pieces {
                writer.add(table(start..start + piece)).unwrap();
                start += piece;
            }
            writer.finish().unwrap();
            fs::read(path).unwrap()
        };
        let whole = written("whole", &[20_000]);
        assert_eq!(written("pieces", &[1, 8191, 250, 9000, 2558]), whole);
    }

    #[test]
    fn an_unfinished_file_is_removed() {
        let folder = tempfile::tempdir().unwrap();
        let mut writer = Writer::create(&folder.path().join("a.parquet"), &[]).unwrap();
        writer.add(table(0..10_000)).unwrap();
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
        drop(writer);
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
    }

    #[test]
    fn a_changed_value_has_another_digest() {
        let digest = table(0..10).digest();
        let mut other = table(0..10);
        if let Values::Real(values) = &mut other.columns[1].values {
            values[3] += 1e-15;
        }
        assert_ne!(other.digest(), digest);
    }
}
