//! Lookup tables: CSV files whose columns over time are outputs. They need no library, and are
//! described, set, stepped and read as FMUs are.

mod description;
mod instance;

pub(crate) use instance::LookupTableInstance;
use std::fs;
use std::io;
use std::path::Path;
use std::sync::Arc;

/// Returns whether a path is that of a lookup table, by its extension.
pub fn is_lookup_table(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("csv"))
}

/// Largest number of bytes of a file.
const LARGEST: u64 = 1 << 30;
/// Largest number of times and values up to which they are parameters.
const MOST_PARAMETERS: usize = 1000;
/// Kinds of interpolation: the value of the row before, or a straight line between two rows.
const HOLD: f64 = 1.0;
const LINEAR: f64 = 2.0;

/// Largest magnitude of a time, s, with which all differences of times can be computed.
const LONGEST: f64 = 1e12;

/// The columns of a file over time.
///
/// All numbers lie in one list, in which the position of a number is the value reference of its
/// variable: a place for each output, the kind of interpolation, the shift of all times, a factor of
/// each column, the times of the rows (s, none earlier than the one before), and the values row by
/// row.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct LookupTable {
    columns: Vec<Column>,
    numbers: Arc<Vec<f64>>,
    /// Number of rows.
    rows: usize,
}

/// A column that is an output.
#[derive(Clone, Debug, PartialEq)]
struct Column {
    name: String,
    form: Form,
}

/// Type of a column's values.
#[derive(Clone, Debug, PartialEq)]
enum Form {
    /// Real numbers in a unit.
    Real(Option<String>),
    Integer,
    Boolean,
}

impl Column {
    /// Reads a heading: `name`, `name [unit]`, `name [Integer]` or `name [Boolean]`.
    fn new(heading: &str) -> Self {
        let parts = heading.strip_suffix(']').and_then(|rest| rest.rsplit_once(" ["));
        let (name, form) = match parts {
            None => (heading, Form::Real(None)),
            Some((name, "Integer")) => (name, Form::Integer),
            Some((name, "Boolean")) => (name, Form::Boolean),
            Some((name, unit)) => (name, Form::Real(Some(unit.into()))),
        };
        Self { name: name.trim_end().into(), form }
    }

    /// Reads a value, or returns what it must be.
    fn value(&self, text: &str) -> Result<f64, &'static str> {
        match (&self.form, text) {
            (Form::Real(_), _) => number(text),
            (Form::Integer, _) => {
                text.parse().map(|value: i32| value.into()).or(Err("a whole number of 32 bits"))
            }
            (Form::Boolean, "0" | "false") => Ok(0.0),
            (Form::Boolean, "1" | "true") => Ok(1.0),
            (Form::Boolean, _) => Err("0, 1, false or true"),
        }
    }
}

fn number(text: &str) -> Result<f64, &'static str> {
    text.parse().ok().filter(|value: &f64| value.is_finite()).ok_or("a finite number")
}

impl LookupTable {
    /// Reads a lookup table. Its first line names the columns: `time`, and then the outputs as
    /// [`Column::new`] reads them. Lines that begin with `#` are comments.
    ///
    /// # Errors
    /// Returns a text that names the line and the column at fault.
    pub(crate) fn open(path: &Path) -> Result<Self, String> {
        let fault = |error: io::Error| format!("cannot be opened: {error}");
        let size = fs::metadata(path).map_err(fault)?.len();
        if size > LARGEST {
            return Err(format!("refused: it has {size} bytes, at most {LARGEST} are allowed"));
        }
        Self::parse(&fs::read(path).map_err(fault)?)
    }

    fn parse(bytes: &[u8]) -> Result<Self, String> {
        // The reader takes the rest of the file for the content of such quotation marks.
        let is_open = |line: &[u8]| {
            let pieces = line.split(|byte| *byte == b'"').count();
            !line.starts_with(b"#") && pieces.is_multiple_of(2)
        };
        if let Some(place) = bytes.split(|byte| *byte == b'\n').position(is_open) {
            return Err(format!("line {}: a quotation mark is not closed", place + 1));
        }
        let mut reader = csv::ReaderBuilder::new()
            .comment(Some(b'#'))
            .trim(csv::Trim::All)
            .flexible(true)
            .from_reader(bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes));
        let unreadable = |error: csv::Error| format!("is not a lookup table: {error}");
        let headings = reader.headers().map_err(unreadable)?.clone();
        let columns = columns(&headings)?;
        let (mut times, mut values) = (Vec::<f64>::new(), Vec::new());
        let mut row = csv::StringRecord::new();
        while reader.read_record(&mut row).map_err(unreadable)? {
            let line = row.position().map_or(0, csv::Position::line);
            if row.len() != headings.len() {
                let (values, columns) = (row.len(), headings.len());
                return Err(format!("line {line} has {values} values for {columns} columns"));
            }
            let wrong = |place: usize, expected: &str| {
                let (name, text) = (&headings[place], row[place].escape_default());
                format!("line {line}: \"{name}\" is \"{text}\", it must be {expected}")
            };
            let time = number(&row[0]).map_err(|expected| wrong(0, expected))?;
            if time.abs() > LONGEST {
                return Err(wrong(0, &format!("within {LONGEST:e} s of zero")));
            }
            if times.last().is_some_and(|before| *before > time) {
                return Err(wrong(0, "no earlier than in the row before"));
            }
            times.push(time);
            for (place, column) in (1..).zip(&columns) {
                values.push(column.value(&row[place]).map_err(|expected| wrong(place, expected))?);
            }
        }
        if times.is_empty() {
            return Err("is a lookup table without rows".into());
        }
        let (count, rows) = (columns.len(), times.len());
        let numbers = [vec![0.0; count], vec![HOLD, 0.0], vec![1.0; count], times, values].concat();
        Ok(Self { columns, numbers: numbers.into(), rows })
    }

    /// Returns the position of the first time. The position of the kind of interpolation is the
    /// number of columns.
    fn first_time(&self) -> usize {
        2 * self.columns.len() + 2
    }

    /// Returns the times of the rows, s.
    fn times(&self) -> &[f64] {
        &self.numbers[self.first_time()..][..self.rows]
    }

    /// Returns the value of a column in a row.
    fn value(&self, row: usize, column: usize) -> f64 {
        self.numbers[self.first_time() + self.rows + row * self.columns.len() + column]
    }
}

/// Reads the headings.
fn columns(headings: &csv::StringRecord) -> Result<Vec<Column>, String> {
    let mut texts = headings.iter();
    match texts.next().unwrap_or_default() {
        "time" | "time [s]" => {}
        other if other.contains(';') => {
            return Err("is not a lookup table: there must be commas between the columns".into());
        }
        other => {
            let other = other.escape_default();
            return Err(format!(
                "is not a lookup table: the first column is \"{other}\", not \"time\""
            ));
        }
    }
    let columns: Vec<Column> = texts.map(Column::new).collect();
    if columns.is_empty() {
        return Err("is a lookup table without columns beside \"time\"".into());
    }
    if columns.iter().any(|column| column.name.is_empty()) {
        return Err("is a lookup table with a column that has no name".into());
    }
    Ok(columns)
}

#[cfg(test)]
mod tests;
