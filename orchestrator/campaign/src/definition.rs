//! A campaign as its file describes it.
//!
//! docs/campaigns.md explains all keys; `orchestrator/schema/campaign.json` describes them for
//! editors.

use cosim::document::Source;
use cosim::error::Error;
use cosim::experiment::Measure;
use cosim::signal::Signal;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use sweep::vary::{DesignKind, Vary};
use toml::{Spanned, Value};

/// A campaign: an experiment, the parameters that vary from case to case, and the limits that the
/// cases are to keep.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Campaign {
    /// Title of the campaign, in one line.
    pub title: String,
    /// Description of the campaign, of any length.
    #[serde(default)]
    pub description: String,
    /// Experiment whose cases are flown: a file beside this one, or the name of an experiment.
    #[schemars(with = "String")]
    pub experiment: Spanned<PathBuf>,
    /// Values of parameters that are the same in all cases, as `component.parameter`.
    #[serde(default)]
    #[schemars(with = "BTreeMap<String, cosim::experiment::Scalar>")]
    pub set: BTreeMap<String, Spanned<Value>>,
    /// Seed of all random numbers. Case k depends on the seed and k alone.
    #[serde(default = "one")]
    pub seed: u64,
    /// Number of cases. The design `levels` needs none.
    pub cases: Option<u64>,
    /// Design that places the cases in the space of the varied parameters.
    #[serde(default)]
    pub design: DesignKind,
    /// Parameters that differ from case to case.
    #[serde(default)]
    pub vary: Vec<Vary>,
    /// Lists of signals that measures refer to, by name, in addition to those of the experiment.
    #[serde(default)]
    pub signals: BTreeMap<String, Vec<Signal>>,
    /// Names of metrics of the experiment that are recorded of each case.
    #[serde(default)]
    #[schemars(with = "Vec<String>")]
    pub metrics: Vec<Spanned<String>>,
    /// Further numbers that are computed from the signals of each case.
    #[serde(default, rename = "measure")]
    pub measures: Vec<Measure>,
    /// Limits that each case keeps or breaks.
    #[serde(default, rename = "limit")]
    pub limits: Vec<Limit>,
    /// Search for the worst case, for `orchestrator campaign --worst`.
    pub search: Option<Search>,
    /// The campaign file, together with the files that it extends. This is not a key of the file.
    #[serde(skip)]
    pub source: Source,
}

/// A limit on a measure, which each case keeps or breaks. A case that is lost, fails or ends early
/// breaks all limits.
#[derive(Clone, Debug, Deserialize, JsonSchema, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Limit {
    /// Name of the limit in the results.
    pub id: String,
    /// Wording of the limit in the report.
    #[serde(default)]
    pub says: String,
    /// Metric or measure that is limited.
    #[schemars(with = "String")]
    pub measure: Spanned<String>,
    /// Largest value that keeps the limit, in the unit of the measure.
    pub at_most: Option<f64>,
    /// Smallest value that keeps the limit, in the unit of the measure.
    pub at_least: Option<f64>,
}

impl Limit {
    /// Returns the bound, and whether values must not be above it.
    pub fn bound(&self) -> (f64, bool) {
        let least = || (self.at_least.unwrap_or(f64::NAN), false);
        self.at_most.map_or_else(least, |most| (most, true))
    }

    /// Returns whether a number keeps the limit.
    pub fn is_kept(&self, number: f64) -> bool {
        let (bound, is_upper) = self.bound();
        if is_upper { number <= bound } else { number >= bound }
    }
}

/// A search for the worst case.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Search {
    /// Measure whose largest value is looked for.
    #[schemars(with = "String")]
    pub largest: Spanned<String>,
    /// Number of cases after which the search ends, with those that are flown together with the
    /// last of them.
    #[serde(default = "thousand")]
    pub cases: u64,
}

/// Returns the name of the column that says whether a limit was kept.
pub fn kept_column(limit: &str) -> String {
    format!("kept.{limit}")
}

fn one() -> u64 {
    1
}

fn thousand() -> u64 {
    1000
}

impl Campaign {
    /// Reads a campaign file and all files that it extends.
    ///
    /// # Errors
    /// Returns an error if a file cannot be read, is not TOML, holds an unknown key, or contradicts
    /// itself.
    pub fn load(path: &Path) -> Result<Self, Error> {
        let source = Source::load(path)?;
        let mut campaign: Self = source.read()?;
        campaign.source = source;
        campaign.check_ids()?;
        campaign.limits.iter().try_for_each(|limit| campaign.check_limit(limit))?;
        campaign.check_numbers()?;
        Ok(campaign)
    }

    /// Returns the name of the campaign, which is that of its file.
    pub fn name(&self) -> String {
        let stem = self.source.path.file_stem();
        stem.map_or("campaign".into(), |stem| stem.to_string_lossy().into_owned())
    }

    /// Returns an error that says what is wrong with a limit.
    pub(crate) fn limit_fault(&self, limit: &Limit, problem: &str) -> Error {
        let message = format!("[[limit]] {}: {problem}", limit.id);
        self.source.error(&limit.measure.span(), message)
    }

    /// Returns an error that refers to no line of the file.
    pub(crate) fn fault(&self, message: impl Into<String>) -> Error {
        self.source.error(&(0..0), message)
    }

    fn check_ids(&self) -> Result<(), Error> {
        let mut ids = BTreeSet::new();
        let measures = self.measures.iter().map(|measure| ("measure", &measure.id));
        for (what, id) in measures.chain(self.limits.iter().map(|limit| ("limit", &limit.id))) {
            if id.is_empty() {
                let problem = format!("[[{what}]] has no id, which names it in the results");
                return Err(self.fault(problem));
            }
            if !ids.insert((what, id)) {
                return Err(self.fault(format!("there are two [[{what}]] with the id \"{id}\"")));
            }
        }
        let mut metrics = BTreeSet::new();
        match self.metrics.iter().find(|name| !metrics.insert(name.get_ref())) {
            None => Ok(()),
            Some(twice) => {
                let problem = format!("metrics: \"{}\" is there twice", twice.get_ref());
                Err(self.source.error(&twice.span(), problem))
            }
        }
    }

    fn check_limit(&self, limit: &Limit) -> Result<(), Error> {
        let problem = if limit.at_most.is_some() == limit.at_least.is_some() {
            "one of at_most and at_least is needed"
        } else if !limit.bound().0.is_finite() {
            "the limit is not a finite number"
        } else {
            return Ok(());
        };
        Err(self.limit_fault(limit, problem))
    }

    fn check_numbers(&self) -> Result<(), Error> {
        let faults = [
            (self.cases == Some(0), "cases = 0, but it must be at least 1"),
            (
                self.search.as_ref().is_some_and(|search| search.cases == 0),
                "[search] cases = 0, but it must be at least 1",
            ),
            (self.vary.is_empty(), "nothing varies: add a [[vary]]"),
        ];
        match faults.into_iter().find(|(is_there, _)| *is_there) {
            None => Ok(()),
            Some((_, problem)) => Err(self.fault(problem)),
        }
    }
}
