//! Variable table of an FMU: the FMI attributes of each, and the field of the model that holds
//! its value.
//!
//! FMUs declare hundreds of variables, so the functions that a declaration calls are not inlined:
//! libraries are smaller that way.

mod real;

pub use real::Real;

use crate::scalar::Scalar;
use model_description::DefaultExperiment;
use model_description::variable::{
    Causality, EnumerationType, Variability, Variable, VariableKind,
};
use settings::{Choice, Declared, Field, Numbered, Setting};
use std::sync::Arc;

type Setter<M> = Box<dyn Fn(&mut M, i32) + Send + Sync>;
type Lens<M, T> = Box<dyn Fn(&mut M) -> &mut T + Send + Sync>;
/// A part of the model with declared settings.
type Part<M> = Arc<dyn Fn(&mut M) -> &mut (dyn Declared + 'static) + Send + Sync>;

/// Access to the field that holds a variable's value.
pub(crate) enum Access<M> {
    Real(Lens<M, f64>),
    /// Access to an integer or enumeration field.
    Integer(Integer<M>),
    Boolean(Lens<M, bool>),
    String(Lens<M, String>),
}

/// Access to a field of some type that FMI sees as an integer.
pub(crate) struct Integer<M> {
    pub(crate) get: Box<dyn Fn(&mut M) -> i32 + Send + Sync>,
    /// Setter that is called only with values that the declaration allows.
    pub(crate) set: Setter<M>,
}

/// Message for an impossible case, as the declaration of a setting and its field have one source.
const NO_FIELD: &str = "a setting has a field of its declared type";

/// Returns access to a setting with numbered values, which FMI numbers from `first` on where the
/// setting numbers them from 0. A value without a number is 0 or less.
fn numbered<M: 'static>(part: Part<M>, index: usize, first: i32) -> Access<M> {
    let other = Arc::clone(&part);
    let get = move |model: &mut M| match part(model).field(index) {
        Ok(Field::Integer(field) | Field::Choice(field)) => fmi_number(field, first),
        _ => unreachable!("{NO_FIELD}"),
    };
    let set = move |model: &mut M, value: i32| match other(model).field(index) {
        Ok(Field::Integer(field) | Field::Choice(field)) => {
            field.set_number(i64::from(value) - i64::from(first));
        }
        _ => unreachable!("{NO_FIELD}"),
    };
    Access::Integer(Integer { get: Box::new(get), set: Box::new(set) })
}

fn fmi_number(value: &dyn Numbered, first: i32) -> i32 {
    i32::try_from(value.number()).map_or(i32::MAX, |number| number.saturating_add(first))
}

/// Returns access to a setting whose field is of one variant of [`Field`].
macro_rules! access {
    ($variant:ident, $part:ident, $index:ident) => {
        Box::new(move |model| match $part(model).field($index) {
            Ok(Field::$variant(field)) => field,
            _ => unreachable!("{NO_FIELD}"),
        })
    };
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

/// A declared variable together with its field.
pub struct Entry<M> {
    pub(crate) variable: Variable,
    pub(crate) access: Access<M>,
}

impl<M> Entry<M> {
    /// Says why the model's value is not allowed, if the variable is set from outside.
    pub(crate) fn problem(&self, model: &mut M) -> Option<String> {
        let Variable { name, kind, .. } = &self.variable;
        if self.variable.is_calculated() {
            return None;
        }
        let problem = match &self.access {
            Access::Real(field) => field(model).problem(kind),
            Access::Integer(field) => (field.get)(model).problem(kind),
            Access::Boolean(_) | Access::String(_) => None,
        };
        problem.map(|problem| format!("'{name}' {problem}"))
    }
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

/// The variables of an FMU in order; the position of each is its value reference.
pub struct VariableTable<M> {
    pub(crate) entries: Vec<Entry<M>>,
}

impl<M> Default for VariableTable<M> {
    fn default() -> Self {
        Self { entries: Vec::new() }
    }
}

impl<M: 'static> VariableTable<M> {
    /// Makes an empty variable table.
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds a real variable.
    #[must_use]
    pub fn real(
        mut self,
        declaration: Real,
        field: impl Fn(&mut M) -> &mut f64 + Send + Sync + 'static,
    ) -> Self {
        self.push_real(declaration, Box::new(field));
        self
    }

    /// Adds an integer variable, whose field may have any integer type. Values set from outside are
    /// checked against the limits, and a type without negative numbers raises the lower limit to
    /// zero.
    #[must_use]
    pub fn integer<I>(
        mut self,
        common: Common,
        (min, max): (Option<i32>, Option<i32>),
        field: impl Fn(&mut M) -> &mut I + Copy + Send + Sync + 'static,
    ) -> Self
    where
        I: Copy + TryFrom<i32> + TryInto<i32>,
    {
        let is_set = matches!(common.0.causality, Causality::Parameter | Causality::Input);
        let min = min.or((is_set && I::try_from(-1).is_err()).then_some(0));
        let access = Integer {
            get: Box::new(move |model| (*field(model)).try_into().unwrap_or(i32::MAX)),
            set: Box::new(move |model, value| {
                if let Ok(value) = I::try_from(value) {
                    *field(model) = value;
                }
            }),
        };
        self.push(common, VariableKind::Integer { min, max, start: None }, Access::Integer(access));
        self
    }

    /// Adds a boolean variable.
    #[must_use]
    pub fn boolean(
        mut self,
        common: Common,
        field: impl Fn(&mut M) -> &mut bool + Send + Sync + 'static,
    ) -> Self {
        self.push(common, VariableKind::Boolean { start: None }, Access::Boolean(Box::new(field)));
        self
    }

    /// Adds the declared settings of a part of the model as parameters.
    #[must_use]
    pub fn settings<S: Declared + 'static>(
        mut self,
        part: impl Fn(&mut M) -> &mut S + Send + Sync + 'static,
    ) -> Self {
        let part: Part<M> = Arc::new(move |model| part(model));
        for (index, setting) in settings::settings::<S>().into_iter().enumerate() {
            self.push_setting(setting, index, Arc::clone(&part));
        }
        self
    }

    /// Leaves out the variables whose names begin so.
    #[must_use]
    pub fn without(mut self, beginning: &str) -> Self {
        self.entries.retain(|entry| !entry.variable.name.starts_with(beginning));
        self
    }

    #[inline(never)]
    fn push_setting(&mut self, Setting { place, kind }: Setting, index: usize, part: Part<M>) {
        let common = parameter(&place.name, &place.text).used_with(&place.used_with);
        let (min, max) = (place.min.or(place.above), place.max.or(place.below));
        match kind {
            settings::Kind::Real => {
                let real = Real { min, max, nominal: place.nominal, ..common.real() };
                self.push_real(real.unit(&place.unit), access!(Real, part, index));
            }
            settings::Kind::Integer(is_signed) => {
                let min = min.or((!is_signed).then_some(0.0)).map(|min| min as i32);
                let max = max.map(|max| max as i32);
                let kind = VariableKind::Integer { min, max, start: None };
                self.push(common, kind, numbered(part, index, 0));
            }
            settings::Kind::Boolean => {
                let kind = VariableKind::Boolean { start: None };
                self.push(common, kind, Access::Boolean(access!(Boolean, part, index)));
            }
            settings::Kind::Choice(items) => {
                self.push(common, described(&items), numbered(part, index, 1));
            }
            settings::Kind::Text => {
                let kind = VariableKind::String { start: None };
                self.push(common, kind, Access::String(access!(Text, part, index)));
            }
        }
    }

    /// Adds a variable whose field is a [`Choice`].
    #[must_use]
    pub fn choice<T: Choice>(
        mut self,
        common: Common,
        field: impl Fn(&mut M) -> &mut T + Send + Sync + 'static,
    ) -> Self {
        let field = Arc::new(field);
        let other = Arc::clone(&field);
        let access = Integer {
            get: Box::new(move |model| fmi_number(field(model), 1)),
            set: Box::new(move |model, value| {
                other(model).set_number(i64::from(value) - 1);
            }),
        };
        self.push(common, described(&T::items()), Access::Integer(access));
        self
    }

    /// Adds a text variable.
    #[must_use]
    pub fn string(
        mut self,
        common: Common,
        field: impl Fn(&mut M) -> &mut String + Send + Sync + 'static,
    ) -> Self {
        self.push(common, VariableKind::String { start: None }, Access::String(Box::new(field)));
        self
    }

    #[inline(never)]
    fn push_real(&mut self, declaration: Real, field: Lens<M, f64>) {
        let Real { common, unit, min, max, nominal, derivative_of } = declaration;
        let kind = VariableKind::Real { unit, min, max, nominal, start: None, derivative_of };
        self.push(common, kind, Access::Real(field));
    }

    #[inline(never)]
    fn push(&mut self, common: Common, kind: VariableKind, access: Access<M>) {
        self.entries.push(Entry { variable: Variable { kind, ..common.0 }, access });
    }
}

/// Common part of every declaration: name, description and role.
#[derive(Clone, Debug)]
pub struct Common(Variable);

impl Common {
    #[inline(never)]
    fn new(name: &str, description: &str, causality: Causality, variability: Variability) -> Self {
        Self(Variable {
            name: name.into(),
            description: description.into(),
            causality,
            variability,
            // The declaration of the type follows.
            kind: VariableKind::Boolean { start: None },
            dependencies: Vec::new(),
            used_with: String::new(),
            is_optional: false,
        })
    }

    /// Declares that an input may stay unconnected without a warning.
    #[must_use]
    pub fn optional(mut self) -> Self {
        self.0.is_optional = true;
        self
    }

    /// Declares the inputs and states on which the value of a calculated variable depends at the
    /// same instant.
    #[must_use]
    pub fn depends_on<'a>(mut self, names: impl IntoIterator<Item = &'a str>) -> Self {
        self.0.dependencies.extend(names.into_iter().map(String::from));
        self
    }

    /// Declares the [condition](model_description::condition) under which the variable has an
    /// effect. The importer is warned if it sets the variable without effect.
    #[must_use]
    pub fn used_with(mut self, condition: &str) -> Self {
        if !condition.is_empty() {
            self.0.description = format!("{}; used with {condition}", self.0.description);
            self.0.used_with = condition.into();
        }
        self
    }

    /// Continues the declaration as that of a real variable.
    #[inline(never)]
    pub fn real(self) -> Real {
        Real { common: self, unit: None, min: None, max: None, nominal: None, derivative_of: None }
    }
}

/// Declares a fixed parameter with a start value.
pub fn parameter(name: &str, description: &str) -> Common {
    Common::new(name, description, Causality::Parameter, Variability::Fixed)
}
/// Declares a continuous input.
pub fn input(name: &str, description: &str) -> Common {
    Common::new(name, description, Causality::Input, Variability::Continuous)
}
/// Declares an input that changes only at events or communication points. It has no input
/// derivatives. In model exchange a model takes it in
/// [`Model::new_discrete_states`](crate::Model::new_discrete_states) and nowhere else.
pub fn discrete_input(name: &str, description: &str) -> Common {
    Common::new(name, description, Causality::Input, Variability::Discrete)
}
/// Declares a continuous output.
pub fn output(name: &str, description: &str) -> Common {
    Common::new(name, description, Causality::Output, Variability::Continuous)
}
/// Declares an output that changes only at events or communication points.
pub fn discrete_output(name: &str, description: &str) -> Common {
    Common::new(name, description, Causality::Output, Variability::Discrete)
}
/// Declares a local variable that changes at ticks only. Importers show it, but give it no port.
pub fn discrete_local(name: &str, description: &str) -> Common {
    Common::new(name, description, Causality::Local, Variability::Discrete)
}
/// Declares a continuous local variable, which can be observed.
pub fn local(name: &str, description: &str) -> Common {
    Common::new(name, description, Causality::Local, Variability::Continuous)
}
