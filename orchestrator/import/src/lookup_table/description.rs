//! The variables of a lookup table.

use super::{Form, HOLD, LINEAR, LONGEST, LookupTable, MOST_PARAMETERS};
use fmi_master::description::{Interface, ModelDescription, Variable, VariableKind};
use fmi_master::quantity::UnitDefinition;
use std::collections::BTreeSet;

impl LookupTable {
    /// Describes the variables in the form of an FMU, whose name is that of the file.
    ///
    /// # Errors
    /// Returns a text that names a variable that the file has twice.
    pub(crate) fn description(&self, name: &str) -> Result<ModelDescription, String> {
        let variables = self.variables();
        let mut names = BTreeSet::new();
        if let Some(twice) = variables.iter().find(|variable| !names.insert(&variable.name)) {
            return Err(format!("is a lookup table in which \"{}\" has two meanings", twice.name));
        }
        let units = self.columns.iter().filter_map(|column| column.form.unit());
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

    /// Lists the variables in the order of the numbers. Factors are those of real columns only.
    fn variables(&self) -> Vec<Variable> {
        let seconds = || VariableKind::Real {
            unit: Some("s".into()),
            display_unit: None,
            is_relative: false,
            min: Some(-LONGEST),
            max: Some(LONGEST),
            nominal: None,
        };
        let items = vec![("hold".into(), HOLD as i32), ("linear".into(), LINEAR as i32)];
        let factor = || Form::Real(None).kind();
        let columns = || self.columns.iter().map(|column| (&column.name, column.form.kind()));
        let mut entries: Vec<(String, VariableKind, &str)> = columns()
            .map(|(name, kind)| (name.clone(), kind, "Column of the lookup table"))
            .collect();
        let interpolation = "Value between two rows: that of the first one, or on a straight \
                             line. Whole numbers and truth values are held";
        entries.push(("interpolation".into(), VariableKind::Enumeration { items }, interpolation));
        entries.push(("shift".into(), seconds(), "Time that is added to the times of all rows"));
        entries.extend(
            columns().map(|(name, _)| (format!("scale.{name}"), factor(), "Factor of the column")),
        );
        if self.rows * (1 + self.columns.len()) <= MOST_PARAMETERS {
            let rows = 1..=self.rows;
            let time = |row| (format!("time[{row}]"), seconds(), "Time of the row");
            entries.extend(rows.clone().map(time));
            entries.extend(rows.flat_map(|row| {
                columns()
                    .map(move |(name, kind)| (format!("{name}[{row}]"), kind, "Value in the row"))
            }));
        }
        let count = self.columns.len();
        let scaled = |place: usize| self.columns.get(place.wrapping_sub(count + 2));
        let is_used = |place: usize| scaled(place).is_none_or(|column| column.form.is_real());
        let variable =
            |(place, (name, kind, description)): (usize, (String, VariableKind, &str))| {
                let number = self.numbers[place];
                let start = match kind {
                    VariableKind::Boolean => (number != 0.0).to_string(),
                    _ => number.to_string(),
                };
                let is_output = place < count;
                Variable {
                    name,
                    reference: place as u32,
                    description: description.into(),
                    causality: if is_output { "output" } else { "parameter" }.into(),
                    variability: if is_output { "discrete" } else { "fixed" }.into(),
                    kind,
                    start: (!is_output).then_some(start),
                    ..Variable::default()
                }
            };
        entries.into_iter().enumerate().filter(|(place, _)| is_used(*place)).map(variable).collect()
    }
}

impl Form {
    pub(super) fn is_real(&self) -> bool {
        matches!(self, Self::Real(_))
    }

    fn unit(&self) -> Option<&str> {
        if let Self::Real(unit) = self { unit.as_deref() } else { None }
    }

    fn kind(&self) -> VariableKind {
        match self {
            Self::Real(unit) => VariableKind::Real {
                unit: unit.clone(),
                display_unit: None,
                is_relative: false,
                min: None,
                max: None,
                nominal: None,
            },
            Self::Integer => VariableKind::Integer { min: None, max: None },
            Self::Boolean => VariableKind::Boolean,
        }
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
