//! Data of an FMU's `modelDescription.xml` that a master needs: variables, units of measure,
//! enumerations, and the dependencies of outputs on inputs.

use crate::quantity::{self, Scaling, UnitDefinition};
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::OnceLock;

/// The model description of an FMU.
#[derive(Clone, Debug, Default)]
pub struct ModelDescription {
    /// FMI version, from the attribute `fmiVersion`.
    pub fmi_version: String,
    /// Name of the model, from the attribute `modelName`.
    pub model_name: String,
    /// Identifier of the build, from the attribute `guid`.
    pub guid: String,
    /// Description of the model, from the attribute `description`.
    pub description: String,
    /// Version of the model, from the attribute `version`.
    pub version: String,
    /// Tool that exported the FMU, from the attribute `generationTool`.
    pub generation_tool: String,
    /// Co-simulation capabilities, if the FMU offers co-simulation.
    pub co_simulation: Option<Interface>,
    /// Model exchange capabilities, if the FMU offers model exchange.
    pub model_exchange: Option<Interface>,
    /// Scheduled execution capabilities, if the FMU offers this interface of FMI 3.0.
    pub scheduled_execution: Option<Interface>,
    /// Positions, in `variables`, of the derivatives of the continuous states, in the order of the
    /// states.
    pub derivatives: Vec<usize>,
    /// Number of event indicators.
    pub event_indicators: usize,
    /// Simulation settings that the FMU proposes.
    pub default_experiment: DefaultExperiment,
    /// Unit definitions of the FMU.
    pub units: Vec<UnitDefinition>,
    /// All variables, in the order of the file.
    pub variables: Vec<Variable>,
    /// Positions, in `variables`, of the variables that each output depends on at the same instant;
    /// only for outputs that declare them.
    pub dependencies: BTreeMap<usize, Vec<usize>>,
    /// Whether this describes a lookup table, which only names its units.
    pub is_lookup_table: bool,
    /// Whether the file has a `ModelStructure`, which FMI requires.
    pub has_structure: bool,
    /// Index of the variables by name.
    pub by_name: ByName,
    /// What FMI 3.0 calls each scalar variable, by [`Variable::reference`]; empty for FMI 2.0.
    pub places: Vec<Place>,
    /// Arrays of FMI 3.0 by name, whose elements are variables.
    pub arrays: BTreeMap<String, Array>,
}

/// Place of a scalar variable in FMI 3.0, whose value references stand for whole arrays.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Place {
    /// Type of the variable.
    pub scalar: ScalarType,
    /// Value reference of the variable in the file.
    pub reference: u32,
    /// Number of the element, in row-major order; 0 for a scalar.
    pub element: usize,
    /// Number of elements; 1 for a scalar.
    pub length: usize,
}

/// A type of FMI 3.0. An enumeration is an `Int64`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[expect(missing_docs, reason = "the names are those of the standard")]
pub enum ScalarType {
    Float64,
    Float32,
    Int8,
    UInt8,
    Int16,
    UInt16,
    Int32,
    UInt32,
    Int64,
    UInt64,
    Boolean,
    String,
    Binary,
    Clock,
}

/// An array of FMI 3.0.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Array {
    /// Number of elements along each dimension.
    pub shape: Vec<usize>,
    /// Positions of its elements among the variables, in row-major order.
    pub elements: Range<usize>,
}

/// Positions of variables in the order of their names, put in order by the first search. The
/// variables must not change afterwards.
#[derive(Clone, Debug, Default)]
pub struct ByName(OnceLock<Vec<u32>>);

/// An interface's model identifier and its capability flags.
#[derive(Clone, Debug, Default)]
pub struct Interface {
    /// Name of the library in the archive, without file extension.
    pub model_identifier: String,
    /// Attributes that are set to `true`, as `name`, and attributes with a number, as `name=value`.
    pub capabilities: Vec<String>,
}

impl Interface {
    /// Returns whether a capability flag is set, by its name in FMI 2.0. In FMI 3.0 it may have
    /// capital letters or an s at its end.
    pub fn has(&self, capability: &str) -> bool {
        let plain = |name: &str| name.trim_end_matches('s').to_ascii_lowercase();
        self.capabilities.iter().any(|name| plain(name) == plain(capability))
    }
}

/// The interface by which an instance is called.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum InterfaceKind {
    /// The instance steps itself.
    #[default]
    CoSimulation,
    /// The program integrates the continuous states of the instance.
    ModelExchange {
        /// Relative tolerance of the integration.
        tolerance: f64,
    },
}

impl InterfaceKind {
    /// Returns the name of the interface in texts.
    pub fn name(self) -> &'static str {
        match self {
            Self::CoSimulation => "co-simulation",
            Self::ModelExchange { .. } => "model exchange",
        }
    }
}

/// Simulation settings that the FMU proposes.
#[derive(Clone, Copy, Debug, Default)]
pub struct DefaultExperiment {
    /// Start time of the simulation, s.
    pub start: Option<f64>,
    /// Stop time of the simulation, s.
    pub stop: Option<f64>,
    /// Length of the communication step, s.
    pub step: Option<f64>,
    /// Relative tolerance of the integration.
    pub tolerance: Option<f64>,
}

/// A scalar variable of an FMU.
#[derive(Clone, Debug, Default)]
pub struct Variable {
    /// Name of the variable.
    pub name: String,
    /// Value reference, which identifies the variable in the get and set calls of its type. In FMI
    /// 3.0 it is the index of its [`Place`].
    pub reference: u32,
    /// Description of the variable's meaning.
    pub description: String,
    /// Causality: `parameter`, `input`, `output`, `local`, ….
    pub causality: Cow<'static, str>,
    /// Variability: `fixed`, `discrete`, `continuous`, ….
    pub variability: Cow<'static, str>,
    /// Type of the variable, with its attributes.
    pub kind: VariableKind,
    /// Start value as the file writes it.
    pub start: Option<String>,
    /// Position of the continuous state whose derivative by time this variable is.
    pub derivative_of: Option<usize>,
    /// Whether an annotation says that an input may stay unconnected.
    pub is_optional: bool,
}

impl Variable {
    /// Returns the name of the type in the variable's version of FMI.
    pub fn type_name(&self, place: Option<&Place>) -> String {
        match (&self.kind, place) {
            (VariableKind::Real { .. } | VariableKind::Integer { .. }, Some(place)) => {
                format!("{:?}", place.scalar)
            }
            (kind, _) => kind.name().into(),
        }
    }

    /// Returns the typical magnitude of the value, in the variable's unit: 1 if none is declared,
    /// as FMI says.
    pub fn nominal(&self) -> f64 {
        match self.kind {
            VariableKind::Real { nominal: Some(nominal), .. } if nominal > 0.0 => nominal,
            _ => 1.0,
        }
    }
}

/// Type of a variable, with the attributes of that type.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum VariableKind {
    /// A real number, held as a 64-bit float.
    Real {
        /// Name of the unit, if any.
        unit: Option<String>,
        /// Unit in which the value is displayed.
        display_unit: Option<String>,
        /// Whether the value is a difference of two, so that the zero of a unit does not matter.
        is_relative: bool,
        /// Smallest allowed value, in the variable's unit.
        min: Option<f64>,
        /// Largest allowed value, in the variable's unit.
        max: Option<f64>,
        /// Typical magnitude of the value, in the variable's unit.
        nominal: Option<f64>,
    },
    /// An integer number of 32 bits.
    Integer {
        /// Smallest allowed value, if any.
        min: Option<i32>,
        /// Largest allowed value, if any.
        max: Option<i32>,
    },
    /// A truth value, true or false.
    #[default]
    Boolean,
    /// A choice among named items.
    Enumeration {
        /// Names of the items, with their values.
        items: Vec<(String, i32)>,
    },
    /// A text of any length.
    String,
    /// Bytes of FMI 3.0, which are shown only.
    Binary,
    /// A clock of FMI 3.0, which is shown only.
    Clock {
        /// What its ticks depend on, from the attribute `intervalVariability`.
        interval: String,
    },
}

impl VariableKind {
    /// Returns the name of the unit, if there is one.
    pub fn unit(&self) -> Option<&str> {
        match self {
            Self::Real { unit, .. } => unit.as_deref(),
            _ => None,
        }
    }

    /// Returns whether the value is a difference of two.
    pub fn is_relative(&self) -> bool {
        matches!(self, Self::Real { is_relative: true, .. })
    }

    /// Returns the items of an enumeration; none for other types.
    pub fn items(&self) -> &[(String, i32)] {
        match self {
            Self::Enumeration { items } => items,
            _ => &[],
        }
    }

    /// Returns the name of the type in FMI.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Real { .. } => "Real",
            Self::Integer { .. } => "Integer",
            Self::Boolean => "Boolean",
            Self::Enumeration { .. } => "Enumeration",
            Self::String => "String",
            Self::Binary => "Binary",
            Self::Clock { .. } => "Clock",
        }
    }

    /// Returns the type in words, if its values are not transferred.
    pub fn untransferred(&self) -> Option<&'static str> {
        match self {
            Self::String => Some("a text"),
            Self::Binary => Some("of type Binary"),
            Self::Clock { .. } => Some("of type Clock"),
            _ => None,
        }
    }
}

impl ModelDescription {
    /// Returns the place of a variable in FMI 3.0; `None` in FMI 2.0.
    pub fn place(&self, variable: &Variable) -> Option<&Place> {
        self.places.get(variable.reference as usize)
    }

    /// Returns whether the FMU is one of FMI 3.0 or a later minor version.
    pub fn is_fmi3(&self) -> bool {
        self.fmi_version.starts_with("3.")
    }

    /// Returns the positions of the elements of the array with this name; none if there is no such
    /// array.
    pub fn elements(&self, array: &str) -> Range<usize> {
        self.arrays.get(array).map_or(0..0, |array| array.elements.clone())
    }

    /// Returns the units of a variable of this kind. FMI ignores their offsets for a difference.
    pub fn units_of(&self, kind: &VariableKind) -> Cow<'_, [UnitDefinition]> {
        if kind.is_relative() {
            return self.units.iter().map(UnitDefinition::of_differences).collect();
        }
        Cow::Borrowed(&self.units)
    }

    /// Returns the scaling that converts values of a variable of this kind to values of a variable
    /// of another FMU.
    ///
    /// # Errors
    /// Returns an error that says how the units differ, if they do not measure the same quantity.
    pub fn conversion(
        &self,
        kind: &VariableKind,
        to: &Self,
        to_kind: &VariableKind,
    ) -> Result<Scaling, String> {
        let (unit, to_unit) = (kind.unit(), to_kind.unit());
        let to_units = to.units_of(to_kind);
        if self.is_lookup_table {
            quantity::named(unit, to_unit, &to_units)
        } else {
            quantity::conversion(unit, &self.units_of(kind), to_unit, &to_units)
        }
    }

    /// Returns an interface, if the FMU offers it.
    pub fn interface(&self, kind: InterfaceKind) -> Option<&Interface> {
        match kind {
            InterfaceKind::CoSimulation => self.co_simulation.as_ref(),
            InterfaceKind::ModelExchange { .. } => self.model_exchange.as_ref(),
        }
    }

    /// Finds the variable with this name and returns it with its position.
    pub fn find(&self, name: &str) -> Option<(usize, &Variable)> {
        let name_of = |position: &u32| self.variables[*position as usize].name.as_str();
        // Of two variables with this name, the first one is meant.
        let ordered = self.by_name.0.get_or_init(|| {
            let mut positions: Vec<u32> = (0..).take(self.variables.len()).collect();
            positions.sort_by(|a, b| name_of(a).cmp(name_of(b)));
            positions
        });
        let place = ordered.partition_point(|position| name_of(position) < name);
        let position = *ordered.get(place).filter(|position| name_of(position) == name)?;
        Some((position as usize, &self.variables[position as usize]))
    }

    /// Returns the positions of the continuous states, each with that of its derivative.
    pub fn states(&self) -> impl Iterator<Item = (usize, usize)> {
        let variables = self.variables.iter().enumerate();
        variables.filter_map(|(position, variable)| {
            let state = variable.derivative_of.filter(|state| *state < self.variables.len())?;
            Some((state, position))
        })
    }

    /// Returns the names of the variables with this causality.
    pub fn names<'a>(&'a self, causality: &'a str) -> impl Iterator<Item = &'a str> + Clone {
        self.variables.iter().filter(move |v| v.causality == causality).map(|v| v.name.as_str())
    }
}

/// Type in which a value is transferred.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Carrier {
    /// A real number as `f64`.
    Real,
    /// An integer or an enumeration's value as `i32`.
    Integer,
    /// A truth value as `i32`, 0 or 1.
    Boolean,
}

impl Carrier {
    /// Returns the type in which values of variables of this kind are transferred; `None` for
    /// texts, bytes and clocks, which are not transferred.
    pub fn for_kind(kind: &VariableKind) -> Option<Self> {
        match kind {
            VariableKind::Real { .. } => Some(Self::Real),
            VariableKind::Integer { .. } | VariableKind::Enumeration { .. } => Some(Self::Integer),
            VariableKind::Boolean => Some(Self::Boolean),
            VariableKind::String | VariableKind::Binary | VariableKind::Clock { .. } => None,
        }
    }
}
