//! Lookup tables: CSV files whose columns over time are outputs. They need no library, and are
//! described, set, stepped and read as FMUs are.

mod instance;

use fmi_master::description::{Interface, ModelDescription, Variable, VariableKind};
use fmi_master::quantity::UnitDefinition;
pub(crate) use instance::LookupTableInstance;
use std::collections::BTreeSet;
use std::path::Path;
use std::sync::Arc;

/// Returns whether a path is that of a lookup table, by its extension.
pub fn is_lookup_table(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("csv"))
}

/// Largest number of times and values up to which they are parameters.
const MOST_PARAMETERS: usize = 1000;
/// Kinds of interpolation: the value of the row before, or a straight line between two rows.
const HOLD: i32 = 1;
const LINEAR: i32 = 2;

/// The columns of a file over time.
///
/// All numbers lie in one list, in which the position of a number is the value reference of its
/// variable: a place for each output, the kind of interpolation, the times of the rows (s, none
/// earlier than the one before), and the values row by row.
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
    unit: Option<String>,
}

impl Column {
    /// Reads a heading: `name` or `name [unit]`.
    fn new(heading: &str) -> Self {
        let parts = heading.strip_suffix(']').and_then(|rest| rest.rsplit_once(" ["));
        let (name, unit) = parts.map_or((heading, None), |(name, unit)| (name, Some(unit.into())));
        Self { name: name.trim_end().into(), unit }
    }
}

impl LookupTable {
    /// Reads a lookup table. Its first line names the columns: `time`, and then the outputs as
    /// [`Column::new`] reads them. Lines that begin with `#` are comments.
    ///
    /// # Errors
    /// Returns a text that names the line and the column at fault.
    pub(crate) fn open(path: &Path) -> Result<Self, String> {
        Self::parse(&std::fs::read(path).map_err(|error| format!("cannot be opened: {error}"))?)
    }

    fn parse(bytes: &[u8]) -> Result<Self, String> {
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
            let number = |place: usize| {
                let number = row[place].parse().ok().filter(|value: &f64| value.is_finite());
                number.ok_or_else(|| wrong(place, "a finite number"))
            };
            let time = number(0)?;
            if times.last().is_some_and(|before| *before > time) {
                return Err(wrong(0, "no earlier than in the row before"));
            }
            times.push(time);
            for place in 1..row.len() {
                values.push(number(place)?);
            }
        }
        if times.is_empty() {
            return Err("is a lookup table without rows".into());
        }
        let rows = times.len();
        let numbers = [vec![0.0; columns.len()], vec![f64::from(HOLD)], times, values].concat();
        Ok(Self { columns, numbers: numbers.into(), rows })
    }

    /// Returns the position of the kind of interpolation.
    fn interpolation(&self) -> usize {
        self.columns.len()
    }

    /// Returns the times of the rows, s.
    fn times(&self) -> &[f64] {
        &self.numbers[self.interpolation() + 1..][..self.rows]
    }

    /// Returns the value of a column in a row.
    fn value(&self, row: usize, column: usize) -> f64 {
        let first = self.interpolation() + 1 + self.rows;
        self.numbers[first + row * self.columns.len() + column]
    }

    /// Describes the variables in the form of an FMU, whose name is that of the file.
    ///
    /// # Errors
    /// Returns a text that names a variable that the file has twice.
    pub(crate) fn description(&self, name: &str) -> Result<ModelDescription, String> {
        let items = vec![("hold".into(), HOLD), ("linear".into(), LINEAR)];
        let columns =
            || self.columns.iter().map(|column| (&column.name, real(column.unit.clone())));
        let mut entries: Vec<(String, VariableKind)> =
            columns().map(|(name, kind)| (name.clone(), kind)).collect();
        entries.push(("interpolation".into(), VariableKind::Enumeration { items }));
        if self.rows * (1 + self.columns.len()) <= MOST_PARAMETERS {
            let rows = 1..=self.rows;
            let seconds = || real(Some("s".into()));
            entries.extend(rows.clone().map(|row| (format!("time[{row}]"), seconds())));
            entries.extend(rows.flat_map(|row| {
                columns().map(move |(name, kind)| (format!("{name}[{row}]"), kind))
            }));
        }
        let entries = entries.into_iter().enumerate();
        let variables: Vec<Variable> = entries
            .map(|(place, (name, kind))| {
                let is_output = place < self.columns.len();
                Variable {
                    name,
                    reference: place as u32,
                    causality: if is_output { "output" } else { "parameter" }.into(),
                    variability: if is_output { "discrete" } else { "fixed" }.into(),
                    kind,
                    start: (!is_output).then(|| self.numbers[place].to_string()),
                    ..Variable::default()
                }
            })
            .collect();
        let mut names = BTreeSet::new();
        if let Some(twice) = variables.iter().find(|variable| !names.insert(&variable.name)) {
            return Err(format!("is a lookup table in which \"{}\" has two meanings", twice.name));
        }
        let units = self.columns.iter().filter_map(|column| column.unit.as_deref());
        let units: BTreeSet<&str> = units.chain(["s"]).collect();
        Ok(ModelDescription {
            fmi_version: "2.0".into(),
            model_name: name.into(),
            guid: name.into(),
            description: format!("lookup table of {} rows", self.rows),
            co_simulation: Some(Interface::default()),
            units: units.into_iter().map(unit).collect(),
            dependencies: (0..self.columns.len()).map(|output| (output, Vec::new())).collect(),
            is_lookup_table: true,
            has_structure: true,
            variables,
            ..ModelDescription::default()
        })
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

fn real(unit: Option<String>) -> VariableKind {
    VariableKind::Real {
        unit,
        display_unit: None,
        is_relative: false,
        min: None,
        max: None,
        nominal: None,
    }
}

/// Returns a unit that is only named. What it measures is defined by the FMU that the column is
/// connected to.
fn unit(name: &str) -> UnitDefinition {
    UnitDefinition {
        name: name.into(),
        exponents: None,
        factor: 1.0,
        offset: 0.0,
        displays: Vec::new(),
    }
}

#[cfg(test)]
mod tests;
