//! The part of a study that describes its runs.

use crate::values::Quantity;
use cosim::error::Error as Single;
use cosim::experiment::Observe;
use cosim_report::figure::Color;
use schemars::JsonSchema;
use serde::Deserialize;
use std::collections::BTreeMap;
use std::path::PathBuf;
use sweep::error::Error;
use sweep::vary::{DesignKind, Variation, Vary};
use toml::{Spanned, Value};

/// A gap in the paper, and the assumption that fills it here.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Assumption {
    /// Question that the paper leaves open.
    pub silent: String,
    /// Assumption that is made in its place.
    pub taken: String,
}

/// An experiment that is run once, or in several cases in which parameters vary.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Run {
    /// Id by which the run is referred to.
    #[schemars(with = "String")]
    pub id: Spanned<String>,
    /// Name of the run in legends and tables.
    #[serde(default)]
    pub label: String,
    /// Colour of the run's curves, by default black.
    #[serde(default)]
    pub color: Color,
    /// Heading of the run's rows in an overview. Without it there is no heading.
    #[serde(default)]
    pub group: String,
    /// Path of the experiment file, relative to the study.
    #[serde(default)]
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
    /// Parameters that the run's FMUs do not have. They are left out if the experiment sets them.
    #[serde(default)]
    pub without: Vec<String>,
    /// In a grid: parameters of single candidates, by the id of the candidate.
    #[serde(default)]
    #[schemars(with = "BTreeMap<String, BTreeMap<String, cosim::experiment::Scalar>>")]
    pub set_for: BTreeMap<Spanned<String>, BTreeMap<String, Value>>,
    /// Seeds that are 1 in the first case, 2 in the next one, and so on. Without them there is one
    /// case.
    #[serde(default)]
    #[schemars(with = "Vec<String>")]
    pub seeds: Vec<Spanned<String>>,
    /// Number of cases of the run, which `seeds` need.
    pub cases: Option<u64>,
    /// Whether the first case has the machine for itself, so that its computing times are
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
    /// Metrics, panels and limits of the run's experiment. This is not a key of a study file.
    #[serde(skip)]
    pub observe: Observe,
    /// Seeds as the parameters that vary. This is not a key of a study file.
    #[serde(skip)]
    pub(crate) vary: Vec<Vary>,
}

impl Run {
    /// Returns the number of cases.
    pub fn count(&self) -> u64 {
        self.cases.unwrap_or(1)
    }

    /// Returns the differences between the cases.
    pub fn variation(&self) -> Variation<'_> {
        Variation {
            vary: &self.vary,
            design: DesignKind::Random,
            seed: 1,
            cases: Some(self.count()),
            set: self.set.keys().map(String::as_str).collect(),
        }
    }

    /// Names the run in an error. An interrupt concerns no single run.
    pub(crate) fn failed(&self, source: Single) -> Error {
        let run = self.id.get_ref();
        match source {
            Single::Interrupted { .. } | Single::Call { .. } => {
                Error::of_case(format!("a case of the run {run}"), source)
            }
            source => Error::Run { run: run.as_str().into(), source },
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
