//! One variable of an FMU: everything that `modelDescription.xml` says about it, and nothing about
//! how it is computed.

use crate::unit::Unit;
use serde::{Deserialize, Serialize};

/// Role of a variable, FMI 2.0 section 2.2.7.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Causality {
    /// The user sets it before the simulation, and it stays constant.
    Parameter,
    /// Another FMU provides its value.
    Input,
    /// This FMU computes it for others.
    Output,
    /// This FMU computes it for observation only.
    Local,
    /// It is the simulation time.
    Independent,
}

impl Causality {
    /// Returns the value of the attribute `causality`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Parameter => "parameter",
            Self::Input => "input",
            Self::Output => "output",
            Self::Local => "local",
            Self::Independent => "independent",
        }
    }
}

/// Times at which a variable may change, FMI 2.0 section 2.2.7.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Variability {
    /// It is constant after initialization.
    Fixed,
    /// It changes at events or communication points only.
    Discrete,
    /// It may change at any time.
    Continuous,
}

impl Variability {
    /// Returns the value of the attribute `variability`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Fixed => "fixed",
            Self::Discrete => "discrete",
            Self::Continuous => "continuous",
        }
    }
}

/// Enumeration type with its items, which are counted from 1 as in FMI.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct EnumerationType {
    /// Name of the `SimpleType`, for example `DisturbanceKind`.
    pub name: String,
    /// Description of the choice that the enumeration offers.
    pub description: String,
    /// Names and descriptions of the items, in the order of their values 1, 2, ….
    pub items: Vec<(String, String)>,
}

/// Type of a variable, with the attributes that only this type has. Limits and start values are in
/// the unit of the variable, never in its display unit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum VariableKind {
    /// A floating-point number of 64 bits.
    Real {
        /// Unit of measure of the value, or `None` for a plain number.
        unit: Option<Unit>,
        /// Smallest allowed value of the variable.
        min: Option<f64>,
        /// Largest allowed value of the variable.
        max: Option<f64>,
        /// Typical magnitude of the variable.
        nominal: Option<f64>,
        /// Start value, which is present exactly where FMI demands one.
        start: Option<f64>,
        /// Name of the state whose time derivative this variable is.
        derivative_of: Option<String>,
    },
    /// A signed integer of 32 bits.
    Integer {
        /// Smallest allowed value of the variable.
        min: Option<i32>,
        /// Largest allowed value of the variable.
        max: Option<i32>,
        /// Start value, which is present exactly where FMI demands one.
        start: Option<i32>,
    },
    /// A truth value, true or false.
    Boolean {
        /// Start value, which is present exactly where FMI demands one.
        start: Option<bool>,
    },
    /// One item of an enumeration type.
    Enumeration {
        /// Enumeration type with the allowed items.
        #[serde(rename = "of")]
        enumeration_type: EnumerationType,
        /// Start value as the item's number, counted from 1; it is present exactly where FMI
        /// demands one.
        start: Option<i32>,
    },
    /// A text of any length.
    String {
        /// Start value, which is present exactly where FMI demands one.
        start: Option<String>,
    },
}

/// A variable as `modelDescription.xml` declares it. Its value reference is its position in the
/// variable table, for all types.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Variable {
    /// Structured name with dots, for example `inertia.scale`.
    pub name: String,
    /// Description of the variable, in one line.
    pub description: String,
    /// Role of the variable in the FMU.
    pub causality: Causality,
    /// Times at which the variable may change.
    pub variability: Variability,
    /// Type of the variable with unit, limits and start value.
    pub kind: VariableKind,
    /// Names of the inputs and states on which a calculated variable depends at the same instant.
    pub dependencies: Vec<String>,
    /// [Condition](crate::condition) under which the variable has an effect; empty for always.
    pub used_with: String,
    /// Whether an input may stay unconnected without a warning.
    pub is_optional: bool,
}

impl Variable {
    /// Declares the [condition](crate::condition) under which the variable has an effect; empty for
    /// always. The importer is warned if it sets the variable without effect.
    pub fn use_with(&mut self, condition: &str) {
        if !condition.is_empty() {
            self.description = format!("{}; used with {condition}", self.description);
            self.used_with = condition.into();
        }
    }
}
