//! Candidates on scenarios: a run for each pair, so that neither stands in the study more than once.

use super::runs::Run;
use crate::figure::Color;
use cosim::document::Source;
use cosim::error::Error;
use cosim::experiment::Experiment;
use fmu_import::names;
use schemars::JsonSchema;
use serde::Deserialize;
use std::collections::BTreeMap;
use std::path::PathBuf;
use toml::{Spanned, Value};

/// Every candidate on every scenario: the runs `SCENARIO-CANDIDATE`.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct Grid {
    /// What is compared.
    #[serde(rename = "candidate")]
    candidates: Vec<Candidate>,
    /// Where.
    #[serde(rename = "scenario")]
    scenarios: Vec<Scenario>,
}

/// What it takes to put a candidate into any experiment.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct Candidate {
    id: String,
    label: String,
    color: Color,
    #[serde(default)]
    fmu: BTreeMap<String, String>,
    #[serde(default)]
    #[schemars(with = "BTreeMap<String, cosim::experiment::Scalar>")]
    set: BTreeMap<String, Value>,
    /// Parameters that it has not: left out where an experiment sets them.
    #[serde(default)]
    without: Vec<String>,
}

/// An experiment, and what is taken of its runs.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct Scenario {
    #[schemars(with = "String")]
    id: Spanned<String>,
    /// Heading of its rows in an overview.
    label: String,
    experiment: PathBuf,
    /// Parameters that differ from the experiment's, for all candidates that have them.
    #[serde(default)]
    #[schemars(with = "BTreeMap<String, cosim::experiment::Scalar>")]
    set: BTreeMap<String, Value>,
    /// Parameters of single candidates, by their id.
    #[serde(default)]
    #[schemars(with = "BTreeMap<String, BTreeMap<String, cosim::experiment::Scalar>>")]
    set_for: BTreeMap<Spanned<String>, BTreeMap<String, Value>>,
    #[serde(default)]
    timed: bool,
    #[serde(default)]
    #[schemars(with = "Vec<String>")]
    within: Vec<Spanned<String>>,
    #[serde(default)]
    #[schemars(with = "Vec<String>")]
    measures: Vec<Spanned<String>>,
}

impl Grid {
    /// The runs, scenario by scenario.
    ///
    /// # Errors
    /// If an experiment cannot be read, or a candidate is not there.
    pub(super) fn runs(&self, source: &Source) -> Result<Vec<Run>, Error> {
        let mut runs = Vec::new();
        for scenario in &self.scenarios {
            let experiment = Experiment::load(&source.beside(&scenario.experiment))?;
            let ids = self.candidates.iter().map(|candidate| candidate.id.as_str());
            source.known(scenario.set_for.keys(), "[[grid.candidate]]", ids)?;
            for candidate in &self.candidates {
                let own = scenario.set_for.iter().find(|(id, _)| *id.get_ref() == candidate.id);
                let own = own.into_iter().flat_map(|(_, set)| set.clone());
                let has = |name: &String| !candidate.without.contains(name);
                let common = scenario.set.clone().into_iter().filter(|(name, _)| has(name));
                let id = format!("{}-{}", scenario.id.get_ref(), candidate.id);
                runs.push(Run {
                    id: Spanned::new(scenario.id.span(), id),
                    label: candidate.label.clone(),
                    color: candidate.color,
                    group: scenario.label.clone(),
                    experiment: scenario.experiment.clone(),
                    fmu: candidate.fmu.clone(),
                    set: common.chain(candidate.set.clone()).chain(own).collect(),
                    unset: candidate.without.iter().filter(|name| experiment.sets(name)).cloned().collect(),
                    vary: None,
                    timed: scenario.timed,
                    within: scenario.within.clone(),
                    measures: scenario.measures.clone(),
                    observe: experiment.observe.clone(),
                });
            }
        }
        Ok(runs)
    }
}

/// The ids that `names` stand for: themselves, or all that fit a `*`, in the order of `ids`.
///
/// # Errors
/// The name that fits none.
pub(super) fn expand(
    names: &[Spanned<String>],
    ids: &[&str],
) -> Result<Vec<Spanned<String>>, Spanned<String>> {
    let mut all = Vec::new();
    for name in names {
        if !name.get_ref().contains('*') {
            all.push(name.clone());
            continue;
        }
        let before = all.len();
        let fitting = ids.iter().filter(|id| names::matches(name.get_ref(), id));
        all.extend(fitting.map(|id| Spanned::new(name.span(), (*id).to_string())));
        if all.len() == before {
            return Err(name.clone());
        }
    }
    Ok(all)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn patterns_stand_for_the_runs_that_fit_in_their_order() {
        let ids = ["calm-lqr", "calm-fbl", "storm-lqr"];
        let names = |names: &[&str]| -> Vec<_> {
            names.iter().map(|name| Spanned::new(0..0, (*name).to_string())).collect()
        };
        let expanded = |of: &[&str]| expand(&names(of), &ids);
        assert_eq!(expanded(&["storm-*", "calm-*"]).unwrap(), names(&["storm-lqr", "calm-lqr", "calm-fbl"]));
        // What is no pattern is checked elsewhere.
        assert_eq!(expanded(&["calm"]).unwrap(), names(&["calm"]));
        assert_eq!(expanded(&["calm-lqr", "gale-*"]).unwrap_err().into_inner(), "gale-*");
    }
}
