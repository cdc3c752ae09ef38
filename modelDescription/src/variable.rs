//! One variable of a unit: everything that `modelDescription.xml` says of it, and nothing of how it is computed.

use crate::unit::Unit;
use serde::{Deserialize, Serialize};

/// Role of a variable, FMI 2.0 section 2.2.7.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Causality {
    /// Set by the user before the simulation, constant during it.
    Parameter,
    /// Provided by another unit.
    Input,
    /// Computed by this unit for others.
    Output,
    /// Computed by this unit, for looking at only.
    Local,
    /// The simulation time.
    Independent,
}

/// When a variable may change, FMI 2.0 section 2.2.7.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Variability {
    /// Constant after initialization.
    Fixed,
    /// Changes at events or communication points only.
    Discrete,
    /// May change at any time.
    Continuous,
}

/// Names of an enumeration's items, counted from 1 as FMI does.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct EnumerationType {
    /// Name of the `SimpleType`, for example `DisturbanceKind`.
    pub name: String,
    /// What the enumeration chooses.
    pub description: String,
    /// Item names with their descriptions, in the order of their values 1, 2, ….
    pub items: Vec<(String, String)>,
}

/// Type of a variable with the attributes that only this type has. Limits and start values are in the unit itself,
/// never in its display unit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Kind {
    /// A 64-bit float.
    Real {
        /// Physical unit; `None` for a plain number.
        unit: Option<Unit>,
        /// Smallest allowed value.
        min: Option<f64>,
        /// Largest allowed value.
        max: Option<f64>,
        /// Typical magnitude.
        nominal: Option<f64>,
        /// Start value; present exactly where FMI wants one.
        start: Option<f64>,
        /// Name of the variable this one is the time derivative of.
        derivative_of: Option<String>,
    },
    /// A 32-bit integer.
    Integer {
        /// Smallest allowed value.
        min: Option<i32>,
        /// Largest allowed value.
        max: Option<i32>,
        /// Start value; present exactly where FMI wants one.
        start: Option<i32>,
    },
    /// A truth value.
    Boolean {
        /// Start value; present exactly where FMI wants one.
        start: Option<bool>,
    },
    /// One of named items.
    Enumeration {
        /// The items.
        of: EnumerationType,
        /// Start value (1-based item number); present exactly where FMI wants one.
        start: Option<i32>,
    },
    /// Text.
    String {
        /// Start value; present exactly where FMI wants one.
        start: Option<String>,
    },
}

/// A variable as `modelDescription.xml` declares it. Its value reference is its position in the table, for all types.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Variable {
    /// Structured name, dotted.
    pub name: String,
    /// One line: what it is.
    pub description: String,
    /// Role.
    pub causality: Causality,
    /// When it may change.
    pub variability: Variability,
    /// Type, unit, limits, start.
    pub kind: Kind,
    /// For calculated variables: names of the inputs and states that its value at an instant depends on.
    pub dependencies: Vec<String>,
}
