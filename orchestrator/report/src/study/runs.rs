//! What a study says about its scenario and its runs.

use super::values::Quantity;
use crate::figure::Color;
use cosim::experiment::Observe;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::PathBuf;
use toml::{Spanned, Value};

/// One line of the scenario.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Fact {
    /// What it is.
    pub what: String,
    /// Its value, with unit.
    pub value: String,
    /// Where it comes from.
    #[serde(default)]
    pub source: String,
}

/// A gap in the paper, and what fills it here.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Assumption {
    /// What the paper does not say.
    pub silent: String,
    /// What is taken instead.
    pub taken: String,
}

/// An experiment that is run, once or for several values of a parameter.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Run {
    /// Short name.
    #[schemars(with = "String")]
    pub id: Spanned<String>,
    /// Name in legends and tables.
    pub label: String,
    /// Colour of its curves.
    pub color: Color,
    /// Heading of its rows in an overview; none if it is empty.
    #[serde(default)]
    pub group: String,
    /// Experiment file, beside the study.
    pub experiment: PathBuf,
    /// Components that are other FMUs than in the experiment.
    #[serde(default)]
    pub fmu: BTreeMap<String, String>,
    /// Parameters that differ from the experiment's.
    #[serde(default)]
    #[schemars(with = "BTreeMap<String, cosim::experiment::Scalar>")]
    pub set: BTreeMap<String, Value>,
    /// Parameters of the experiment that are left at the FMU's own value.
    #[serde(default)]
    pub unset: Vec<String>,
    /// A parameter that takes several values.
    pub vary: Option<Vary>,
    /// Whether its first run has the machine for itself.
    #[serde(default)]
    pub timed: bool,
    /// Bounds that it is held against, by id.
    #[serde(default)]
    #[schemars(with = "Vec<String>")]
    pub within: Vec<Spanned<String>>,
    /// Further numbers that are taken of it, by id.
    #[serde(default)]
    #[schemars(with = "Vec<String>")]
    pub measures: Vec<Spanned<String>>,
    /// What its experiment asks for; no key of a study file.
    #[serde(skip)]
    pub observe: Observe,
}

/// Values `first`, `first` + 1, … of a parameter.
#[derive(Clone, Debug, Deserialize, JsonSchema, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Vary {
    /// `component.parameter`, or several of them that take the same values.
    pub parameter: Parameters,
    /// The first value.
    pub first: i32,
    /// How many.
    pub count: u32,
}

impl Vary {
    /// How many values there are of at most so many, of which one is the least.
    pub(super) fn limited(&self, members: Option<u32>) -> u32 {
        members.map_or(self.count, |limit| self.count.min(limit.max(1)))
    }
}

/// One parameter or several.
#[derive(Clone, Debug, Deserialize, JsonSchema, Serialize)]
#[serde(untagged)]
pub enum Parameters {
    /// One.
    One(String),
    /// Several.
    Several(Vec<String>),
}

impl Parameters {
    /// All of them.
    pub fn all(&self) -> &[String] {
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
    /// Short name.
    pub id: String,
    /// A list of signals: all of them must be within the bound for a sample to count.
    #[schemars(with = "String")]
    pub signals: Spanned<String>,
    /// The bound.
    pub bound: Quantity,
}
