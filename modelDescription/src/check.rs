//! Search for contradictions in a description, so that they are detected before an importer meets
//! them.

use crate::condition;
use crate::unit::Unit;
use crate::variable::{Causality, EnumerationType, Variability, Variable, VariableKind};
use crate::{Error, ModelDescription};
use std::collections::{HashMap, HashSet};

impl ModelDescription {
    /// Checks the description against itself and against FMI 2.0.
    ///
    /// # Errors
    /// Names the first variable at fault and says what is wrong with it.
    pub fn check(&self) -> Result<(), Error> {
        self.find_problem()
            .map_or(Ok(()), |problem| Err(Error::Description { fmu: self.name.clone(), problem }))
    }

    fn find_problem(&self) -> Option<String> {
        let identifier = |text: &str| {
            text.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_')
                && text.chars().all(|c| c.is_ascii_alphanumeric() || c == '_')
        };
        if !identifier(&self.name) {
            return Some(
                "the name must be a C identifier, as FMI makes it the model identifier".into(),
            );
        }
        if !self.co_simulation && !self.model_exchange {
            return Some("it is neither for co-simulation nor for model exchange".into());
        }
        let experiment = self.default_experiment;
        if ![experiment.start, experiment.stop, experiment.tolerance, experiment.step]
            .iter()
            .all(|x| x.is_finite())
        {
            return Some("the default experiment holds a number that is not finite".into());
        }
        // FMI 3.0 has the time as a variable.
        let time = String::from("time");
        let mut names = HashSet::from([&time]);
        let mut derived = HashSet::new();
        let mut units: HashMap<&str, &Unit> = HashMap::new();
        let mut enumerations: HashMap<&str, &EnumerationType> = HashMap::new();
        for variable in &self.variables {
            let name = &variable.name;
            if !structured(name) {
                return Some(format!(
                    "'{name}' is not a structured name such as 'initial.alpha' or 'jet[3]'"
                ));
            }
            if !names.insert(name) {
                return Some(format!("'{name}' is declared twice"));
            }
            if let Some(problem) = self.find_problem_in(variable) {
                return Some(format!("'{name}' {problem}"));
            }
            if let Some(state) = variable.derivative_of()
                && !derived.insert(state)
            {
                return Some(format!("'{state}' has a second derivative, '{name}'"));
            }
            match &variable.kind {
                VariableKind::Real { unit: Some(unit), .. } if !unit.is_known() => {
                    return Some(format!("'{name}' has the unknown unit '{}'", unit.name));
                }
                VariableKind::Real { unit: Some(unit), .. }
                    if *units.entry(&unit.name).or_insert(unit) != unit =>
                {
                    return Some(format!(
                        "'{name}' defines unit '{}' differently from a variable before it",
                        unit.name
                    ));
                }
                VariableKind::Enumeration { enumeration_type, .. }
                    if *enumerations.entry(&enumeration_type.name).or_insert(enumeration_type)
                        != enumeration_type =>
                {
                    return Some(format!(
                        "'{name}' defines '{}' differently from a variable before it",
                        enumeration_type.name
                    ));
                }
                _ => {}
            }
        }
        None
    }

    fn find_problem_in(&self, variable: &Variable) -> Option<String> {
        if variable.variability == Variability::Continuous
            && !matches!(variable.kind, VariableKind::Real { .. })
        {
            return Some("is not a Real, so it must be fixed or discrete".into());
        }
        if (variable.causality == Causality::Parameter)
            != (variable.variability == Variability::Fixed)
        {
            return Some("must be both a parameter and fixed, or neither".into());
        }
        let is_input_or_state = |name: &&String| {
            self.variables.iter().find(|other| other.name == **name).is_some_and(|other| {
                let is_derivative = |variable: &Variable| variable.derivative_of() == Some(name);
                other.causality == Causality::Input || self.variables.iter().any(is_derivative)
            })
        };
        if let Some(name) = variable.dependencies.iter().find(|name| !is_input_or_state(name)) {
            return Some(format!("depends on '{name}', which is neither an input nor a state"));
        }
        if let Some(problem) = condition::problem(&variable.used_with, &self.variables) {
            return Some(problem);
        }
        if let Some(state) = variable.derivative_of() {
            let continuous = |other: &Variable| {
                other.name == state
                    && other.is_calculated()
                    && other.variability == Variability::Continuous
            };
            if !self.variables.iter().any(continuous) {
                return Some(format!(
                    "is the derivative of '{state}', which is not a continuous output or local"
                ));
            }
        }
        let needs_start = !variable.is_calculated();
        let (present, in_range) = match &variable.kind {
            VariableKind::Real { min, max, start, .. } => {
                let numbers = [*min, *max, *start];
                if numbers.iter().flatten().any(|x| !x.is_finite()) {
                    return Some("has a limit or start value that is not finite".into());
                }
                (start.is_some(), within(*min, *start, *max))
            }
            VariableKind::Integer { min, max, start } => {
                (start.is_some(), within(*min, *start, *max))
            }
            VariableKind::Enumeration { enumeration_type, start } => {
                let last = i32::try_from(enumeration_type.items.len()).ok();
                (start.is_some(), within(Some(1), *start, last))
            }
            VariableKind::Boolean { start } => (start.is_some(), true),
            VariableKind::String { start } => (start.is_some(), true),
        };
        if present != needs_start {
            return Some(
                if needs_start {
                    "needs a start value"
                } else {
                    "is calculated and has a start value"
                }
                .into(),
            );
        }
        (!in_range).then(|| "has a start value outside its limits".into())
    }
}

fn within<T: PartialOrd>(min: Option<T>, value: Option<T>, max: Option<T>) -> bool {
    value.is_none_or(|value| {
        min.is_none_or(|min| min <= value) && max.is_none_or(|max| value <= max)
    })
}

/// Whether a name follows FMI's structured naming convention without quoted names: `a.b[1,2].c`, or
/// `der(a.b)`.
fn structured(name: &str) -> bool {
    let inner = name.strip_prefix("der(").and_then(|rest| rest.strip_suffix(')')).unwrap_or(name);
    inner.split('.').all(|part| {
        let (word, indices) =
            part.split_once('[').map_or((part, None), |(word, rest)| (word, Some(rest)));
        let index = |text: &str| !text.is_empty() && text.bytes().all(|b| b.is_ascii_digit());
        word.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_')
            && word.bytes().all(|b| b.is_ascii_alphanumeric() || b == b'_')
            && indices.is_none_or(|rest| {
                rest.strip_suffix(']').is_some_and(|list| list.split(',').all(index))
            })
    })
}
