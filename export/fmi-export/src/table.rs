//! Variable table of an FMU: the FMI attributes of each variable, and the field of the model that
//! holds its value. Both follow from the declarations of the model's fields, which the crate
//! [`settings`] explains.

use crate::scalar::Scalar;
use model_description::DefaultExperiment;
use model_description::unit::Unit;
use model_description::variable::{
    Causality, EnumerationType, Variability, Variable, VariableKind,
};
use settings::{Declared, Field, Kind, Place, Role, Setting};
use std::sync::Arc;

/// Access to the fields of a part of the model by their positions in it.
type Part<M> = Arc<dyn Fn(&mut M, usize) -> Field<'_> + Send + Sync>;

/// A declared variable together with its field.
pub struct Entry<M> {
    pub(crate) variable: Variable,
    part: Part<M>,
    /// Position in the part of the model.
    index: usize,
}

impl<M> Entry<M> {
    /// Returns the field that holds the value of the variable.
    pub(crate) fn field<'a>(&self, model: &'a mut M) -> Field<'a> {
        (self.part)(model, self.index)
    }

    /// Says why the model's value is not allowed, if the variable is set from outside.
    pub(crate) fn problem(&self, model: &mut M) -> Option<String> {
        let Variable { name, kind, .. } = &self.variable;
        if self.variable.is_calculated() {
            return None;
        }
        let problem = match self.field(model) {
            Field::Real(field) => field.problem(kind),
            field => number(&field).and_then(|number| number.problem(kind)),
        };
        problem.map(|problem| format!("'{name}' {problem}"))
    }
}

/// Returns the number of an integer or a choice in FMI, which counts the items of a choice from 1.
/// A choice that is none of the items is 0.
pub(crate) fn number(field: &Field) -> Option<i32> {
    let (number, first) = match field {
        Field::Integer(number) => (number.number(), 0),
        Field::Choice(item) => (item.number(), 1),
        _ => return None,
    };
    Some(i32::try_from(number).map_or(i32::MAX, |number| number.saturating_add(first)))
}

/// Description of an FMU: its texts, its default experiment and its variable table.
pub struct Description<M> {
    /// Model name and archive name, for example `CRMPC`.
    pub name: &'static str,
    /// Purpose of the FMU, in one line.
    pub description: &'static str,
    /// HTML fragment that describes the computation of the FMU, with equations and sources.
    pub documentation: String,
    /// Version of the FMU's crate.
    pub version: &'static str,
    /// Whether the FMU also supports model exchange, with states and derivatives.
    pub model_exchange: bool,
    /// Number of event indicators in model exchange.
    pub event_indicators: usize,
    /// Default experiment that the FMU proposes.
    pub default_experiment: DefaultExperiment,
    /// Variable table of the FMU.
    pub table: VariableTable<M>,
}

impl<M> Description<M> {
    /// Describes an FMU for co-simulation and, if it has continuous states, for model exchange, by
    /// its name, its purpose and its variables.
    pub fn new(name: &'static str, description: &'static str, table: VariableTable<M>) -> Self {
        let model_exchange = table.variables().any(|variable| variable.derivative_of().is_some());
        Self {
            name,
            description,
            documentation: String::new(),
            version: "",
            model_exchange,
            event_indicators: 0,
            default_experiment: DefaultExperiment::default(),
            table,
        }
    }
}

/// The variables of an FMU in order; the position of each is its value reference.
pub struct VariableTable<M> {
    pub(crate) entries: Vec<Entry<M>>,
    /// Settings that a file sets, which are no variables.
    of_file: Vec<Setting>,
}

impl<M> VariableTable<M> {
    pub(crate) fn variables(&self) -> impl Iterator<Item = &Variable> {
        self.entries.iter().map(|entry| &entry.variable)
    }

    /// Returns an HTML table of the settings that a file sets; empty if there are none, or if no
    /// variable names a file.
    pub(crate) fn settings_of_the_file(&self) -> String {
        let names_a_file = self.variables().any(|variable| variable.name == "settings.file");
        if self.of_file.is_empty() || !names_a_file {
            return String::new();
        }
        let row = |Setting { place, kind }: &Setting| {
            let Place { name, text, unit, .. } = place;
            let items = match kind {
                Kind::Choice(items, _) => items.items.iter().map(|item| item.0).collect(),
                _ => Vec::new(),
            };
            format!(
                "<tr><td><code>{name}</code></td><td>{unit}</td><td>{} {}</td></tr>\n",
                text.replace('&', "&amp;").replace('<', "&lt;"),
                items.join(", ")
            )
        };
        let rows: String = self.of_file.iter().map(row).collect();
        format!(
            "<h3>Settings of <code>settings.file</code></h3>\n<p>A TOML file may set what is no parameter. \
             A number is in this unit; a text such as <code>\"20 deg\"</code> says its own.</p>\n\
             <table><tr><th>name</th><th>unit</th><th>meaning</th></tr>\n{rows}</table>\n"
        )
    }
}

impl<M: 'static> VariableTable<M> {
    /// Makes the table of the declared fields of a part of the model, or of all of it.
    pub fn new<S: Declared + 'static>(
        part: impl Fn(&mut M) -> &mut S + Send + Sync + 'static,
    ) -> Self {
        Self { entries: Vec::new(), of_file: Vec::new() }.and(part)
    }

    /// Adds the declared fields of another part of the model.
    #[must_use]
    pub fn and<S: Declared + 'static>(
        mut self,
        part: impl Fn(&mut M) -> &mut S + Send + Sync + 'static,
    ) -> Self {
        let settings = settings::settings::<S>();
        let declared: Vec<Setting> = settings.iter().cloned().collect();
        let part: Part<M> = Arc::new(move |model, index| settings.field(part(model), index));
        for (index, setting) in declared.into_iter().enumerate() {
            match causality(setting.place.role) {
                Some(causality) => {
                    let variable = variable(causality, &setting);
                    self.entries.push(Entry { variable, part: Arc::clone(&part), index });
                }
                None => self.of_file.push(setting),
            }
        }
        self
    }

    /// Leaves out the variables whose names begin so.
    #[must_use]
    pub fn without(mut self, beginning: &str) -> Self {
        self.entries.retain(|entry| !entry.variable.name.starts_with(beginning));
        self
    }

    /// Changes the variables whose names begin so.
    #[must_use]
    pub fn change(mut self, beginning: &str, change: impl Fn(&mut Variable)) -> Self {
        for Entry { variable, .. } in &mut self.entries {
            if variable.name.starts_with(beginning) {
                change(variable);
            }
        }
        self
    }
}

/// Returns the variables of a table, in which the beginnings of names among the dependencies are
/// replaced by the names of the inputs and states that begin so.
pub(crate) fn resolved(mut variables: Vec<Variable>) -> Vec<Variable> {
    let states: Vec<String> =
        variables.iter().filter_map(|variable| variable.derivative_of().map(Into::into)).collect();
    let is_known = |variable: &&Variable| {
        variable.causality == Causality::Input || states.contains(&variable.name)
    };
    let known: Vec<String> =
        variables.iter().filter(is_known).map(|variable| variable.name.clone()).collect();
    for variable in &mut variables {
        let resolve = |name: &String| match name.strip_suffix('*') {
            Some(beginning) => {
                known.iter().filter(|name| name.starts_with(beginning)).cloned().collect()
            }
            None => vec![name.clone()],
        };
        variable.dependencies = variable.dependencies.iter().flat_map(resolve).collect();
    }
    variables
}

/// Returns the causality of a variable, or `None` for a setting of a file.
fn causality(role: Role) -> Option<Causality> {
    match role {
        Role::Parameter => Some(Causality::Parameter),
        Role::Input => Some(Causality::Input),
        Role::Output => Some(Causality::Output),
        Role::Local => Some(Causality::Local),
        Role::File => None,
    }
}

/// Returns the variable that a field is.
fn variable(causality: Causality, Setting { place, kind }: &Setting) -> Variable {
    let variability = if causality == Causality::Parameter {
        Variability::Fixed
    } else if place.is_discrete || !matches!(kind, Kind::Real) {
        Variability::Discrete
    } else {
        Variability::Continuous
    };
    let is_set = matches!(causality, Causality::Parameter | Causality::Input);
    let (min, max) = (place.min.or(place.above), place.max.or(place.below));
    let kind = match kind {
        Kind::Real => VariableKind::Real {
            unit: (!place.unit.is_empty()).then(|| Unit::new(&place.unit)),
            min,
            max,
            nominal: place.nominal,
            start: None,
            derivative_of: (!place.derivative.is_empty()).then(|| place.derivative.clone()),
        },
        Kind::Integer(is_signed, _) => VariableKind::Integer {
            min: min.or((is_set && !is_signed).then_some(0.0)).map(|min| min as i32),
            max: max.map(|max| max as i32),
            start: None,
        },
        Kind::Boolean => VariableKind::Boolean { start: None },
        Kind::Choice(items, _) => described(items),
        Kind::Text => VariableKind::String { start: None },
    };
    let mut variable = Variable {
        name: place.name.clone(),
        description: place.text.clone(),
        causality,
        variability,
        kind,
        dependencies: place.depends_on.clone(),
        used_with: String::new(),
        is_optional: place.is_optional,
    };
    variable.use_with(&place.used_with);
    variable
}

fn described(items: &settings::Items) -> VariableKind {
    let listed = items.items.iter().map(|(name, text)| ((*name).into(), (*text).into()));
    let enumeration_type = EnumerationType {
        name: items.name.into(),
        description: items.text.into(),
        items: listed.collect(),
    };
    VariableKind::Enumeration { enumeration_type, start: None }
}
