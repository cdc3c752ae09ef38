//! The part of a study that describes its scenario and its runs.

use super::values::Quantity;
use crate::figure::Color;
use cosim::experiment::Observe;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::PathBuf;
use toml::{Spanned, Value};

/// A line of the table that describes the scenario.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Fact {
    /// Label of this scenario line, which names the quantity.
    pub what: String,
    /// Value of the quantity, with its unit.
    pub value: String,
    /// Source of the value, such as a page of the paper.
    #[serde(default)]
    pub source: String,
}

/// A gap in the paper, and the assumption that fills it here.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Assumption {
    /// Question that the paper leaves open.
    pub silent: String,
    /// Assumption that is made in its place.
    pub taken: String,
}

/// An experiment that is run once, or for several values of a parameter.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Run {
    /// Id by which the run is referred to.
    #[schemars(with = "String")]
    pub id: Spanned<String>,
    /// Name of the run in legends and tables.
    pub label: String,
    /// Colour of the run's curves.
    pub color: Color,
    /// Heading of the run's rows in an overview. Without it there is no heading.
    #[serde(default)]
    pub group: String,
    /// Path of the experiment file, relative to the study.
    pub experiment: PathBuf,
    /// FMUs that replace those of the experiment, by component.
    #[serde(default)]
    pub fmu: BTreeMap<String, String>,
    /// Parameters that differ from those of the experiment, with their values.
    #[serde(default)]
    #[schemars(with = "BTreeMap<String, cosim::experiment::Scalar>")]
    pub set: BTreeMap<String, Value>,
    /// Parameters that the experiment sets, but that are left at the FMU's own value.
    #[serde(default)]
    pub unset: Vec<String>,
    /// Parameter that takes several values, with these values.
    pub vary: Option<Vary>,
    /// Whether the first of the runs has the machine for itself, so that its computing times are
    /// meaningful.
    #[serde(default)]
    pub timed: bool,
    /// Ids of the bounds that the run is compared with.
    #[serde(default)]
    #[schemars(with = "Vec<String>")]
    pub within: Vec<Spanned<String>>,
    /// Ids of the measures that are computed for the run.
    #[serde(default)]
    #[schemars(with = "Vec<String>")]
    pub measures: Vec<Spanned<String>>,
    /// Metrics, panels and limits of the run's experiment. This is no key of a study file.
    #[serde(skip)]
    pub observe: Observe,
}

/// A parameter and the values `first`, `first` + 1, … that it takes.
#[derive(Clone, Debug, Deserialize, JsonSchema, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Vary {
    /// Name of the parameter, `component.parameter`, or names of several parameters that take the
    /// same values.
    pub parameter: Parameters,
    /// First value that the parameter takes.
    pub first: i32,
    /// Number of values that the parameter takes.
    pub count: u32,
}

impl Vary {
    /// Returns the number of values if there may be at most this many, of which one always remains.
    pub(super) fn limited(&self, members: Option<u32>) -> u32 {
        members.map_or(self.count, |limit| self.count.min(limit.max(1)))
    }
}

/// Name of one parameter, or names of several parameters.
#[derive(Clone, Debug, Deserialize, JsonSchema, Serialize)]
#[serde(untagged)]
pub enum Parameters {
    /// A single parameter is named.
    One(String),
    /// Several parameters are named in a list.
    Several(Vec<String>),
}

impl Parameters {
    /// Returns the names of all parameters.
    pub fn names(&self) -> &[String] {
        match self {
            Self::One(parameter) => std::slice::from_ref(parameter),
            Self::Several(parameters) => parameters,
        }
    }
}

/// A bound on the magnitude of signals.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Within {
    /// Id by which the bound is referred to.
    pub id: String,
    /// Name of a list of signals. A sample counts if all of them are within the bound.
    #[schemars(with = "String")]
    pub signals: Spanned<String>,
    /// Largest magnitude that counts as within the bound, in the unit of the signals.
    pub bound: Quantity,
}
