//! The model description of a lookup table.

use super::{Column, Form, LookupTable, MOST_PARAMETERS};
use fmi_master::description::{Interface, ModelDescription, Variable, VariableKind};
use fmi_master::quantity::UnitDefinition;
use std::collections::BTreeSet;

/// Items of the parameter `interpolation`.
pub(super) const HOLD: i32 = 1;
pub(super) const LINEAR: i32 = 2;

/// Meaning of a variable of a lookup table.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Place {
    /// A column, as an output.
    Output(usize),
    Interpolation,
    Shift,
    /// The factor of a column.
    Scale(usize),
    /// The time of a row.
    Time(usize),
    /// A value, by its position among those of all rows.
    Value(usize),
}

impl LookupTable {
    /// Lists the meanings of the variables. The position in the list is the value reference.
    pub(super) fn places(&self) -> Vec<Place> {
        let (columns, rows) = (self.columns.len(), self.times.len());
        let mut places: Vec<Place> = (0..columns).map(Place::Output).collect();
        places.extend([Place::Interpolation, Place::Shift]);
        let is_real = |index: &usize| matches!(self.columns[*index].form, Form::Real(_));
        places.extend((0..columns).filter(is_real).map(Place::Scale));
        if self.is_settable() {
            places.extend((0..rows).map(Place::Time));
            places.extend((0..rows * columns).map(Place::Value));
        }
        places
    }

    /// Returns the model description. Its name is that of the file.
    pub(crate) fn description(&self, name: &str) -> Result<ModelDescription, String> {
        let places = self.places().into_iter();
        let variables: Vec<Variable> =
            (0..).zip(places).map(|(reference, place)| self.variable(reference, place)).collect();
        let mut names = BTreeSet::new();
        if let Some(twice) = variables.iter().find(|variable| !names.insert(&variable.name)) {
            return Err(format!("is a lookup table in which \"{}\" has two meanings", twice.name));
        }
        let units = self.columns.iter().filter_map(Column::unit);
        let units: BTreeSet<&str> = units.chain(["s"]).collect();
        Ok(ModelDescription {
            fmi_version: "2.0".into(),
            model_name: name.into(),
            guid: name.into(),
            description: self.summary(),
            co_simulation: Some(Interface {
                model_identifier: name.into(),
                capabilities: vec!["canHandleVariableCommunicationStepSize".into()],
            }),
            units: units.into_iter().map(unit).collect(),
            dependencies: (0..self.columns.len()).map(|output| (output, Vec::new())).collect(),
            is_lookup_table: true,
            has_structure: true,
            variables,
            ..ModelDescription::default()
        })
    }

    fn summary(&self) -> String {
        let rows = self.times.len();
        if self.is_settable() {
            return format!("lookup table of {rows} rows");
        }
        format!(
            "lookup table of {rows} rows, whose values cannot be set because there are more than {MOST_PARAMETERS}"
        )
    }

    fn variable(&self, reference: u32, place: Place) -> Variable {
        let count = self.columns.len();
        let items = || vec![("hold".to_string(), HOLD), ("linear".to_string(), LINEAR)];
        let start = |value: f64| Some(value.to_string());
        let (name, kind, start, description) = match place {
            Place::Output(index) => {
                let column = &self.columns[index];
                (column.name.clone(), column.kind(), None, "Column of the lookup table".to_string())
            }
            Place::Interpolation => (
                "interpolation".into(),
                VariableKind::Enumeration { items: items() },
                start(HOLD.into()),
                "Value between two rows: that of the first one, or on a straight line. Whole \
                 numbers and truth values are held"
                    .into(),
            ),
            Place::Shift => {
                let description = "Time that is added to the times of all rows".into();
                ("shift".into(), seconds(), start(0.0), description)
            }
            Place::Scale(index) => {
                let name = format!("scale.{}", self.columns[index].name);
                (name, Form::Real(None).kind(), start(1.0), "Factor of the column".into())
            }
            Place::Time(row) => {
                let name = format!("time[{}]", row + 1);
                (name, seconds(), start(self.times[row]), format!("Time of row {}", row + 1))
            }
            Place::Value(index) => {
                let (column, row) = (&self.columns[index % count], index / count + 1);
                let kind = column.kind();
                let start = if kind == VariableKind::Boolean {
                    Some((self.values[index] != 0.0).to_string())
                } else {
                    start(self.values[index])
                };
                (format!("{}[{row}]", column.name), kind, start, format!("Value in row {row}"))
            }
        };
        let is_output = matches!(place, Place::Output(_));
        Variable {
            name,
            reference,
            description,
            causality: if is_output { "output" } else { "parameter" }.into(),
            variability: if is_output { "discrete" } else { "fixed" }.into(),
            kind,
            start,
            derivative_of: None,
            is_optional: false,
        }
    }
}

impl Column {
    pub(super) fn unit(&self) -> Option<&str> {
        if let Form::Real(unit) = &self.form { unit.as_deref() } else { None }
    }

    fn kind(&self) -> VariableKind {
        self.form.kind()
    }
}

impl Form {
    fn kind(&self) -> VariableKind {
        match self {
            Self::Real(unit) => VariableKind::Real {
                unit: unit.clone(),
                display_unit: None,
                min: None,
                max: None,
                nominal: None,
            },
            Self::Integer => VariableKind::Integer { min: None, max: None },
            Self::Boolean => VariableKind::Boolean,
        }
    }
}

fn seconds() -> VariableKind {
    Form::Real(Some("s".into())).kind()
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
