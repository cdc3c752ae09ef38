//! Grids of candidates and scenarios. There is a run for each pair, so that a study describes each
//! candidate and each scenario only once.

use crate::runs::Run;
use cosim::document::Source;
use cosim::error::Error;
use cosim::experiment::Experiment;
use cosim_report::figure::Color;
use fmi_master::names;
use schemars::JsonSchema;
use serde::Deserialize;
use std::collections::BTreeMap;
use std::path::PathBuf;
use sweep::vary::DesignKind;
use toml::{Spanned, Value};

/// A grid of candidates and scenarios, which defines the runs `SCENARIO-CANDIDATE`.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct Grid {
    /// Candidates that are compared with each other.
    #[serde(rename = "candidate")]
    candidates: Vec<Candidate>,
    /// Scenarios in which the candidates are compared.
    #[serde(rename = "scenario")]
    scenarios: Vec<Scenario>,
}

/// A candidate, with the changes that put it into any experiment.
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
    /// Parameters that the candidate does not have. They are left out if an experiment sets them.
    #[serde(default)]
    without: Vec<String>,
    /// Measures of the candidate in all scenarios, in addition to those of the scenario.
    #[serde(default)]
    #[schemars(with = "Vec<String>")]
    measures: Vec<Spanned<String>>,
}

/// An experiment in which all candidates are run, with the measures of its runs.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct Scenario {
    #[schemars(with = "String")]
    id: Spanned<String>,
    /// Heading of the scenario's rows in an overview.
    label: String,
    experiment: PathBuf,
    /// Parameters that differ from those of the experiment, for all candidates that have them.
    #[serde(default)]
    #[schemars(with = "BTreeMap<String, cosim::experiment::Scalar>")]
    set: BTreeMap<String, Value>,
    /// Parameters of single candidates, by the id of the candidate.
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
    /// Returns the runs of the grid, scenario by scenario.
    ///
    /// # Errors
    /// Returns an error if an experiment cannot be read, or a candidate does not exist.
    pub(crate) fn runs(&self, source: &Source) -> Result<Vec<Run>, Error> {
        let mut runs = Vec::new();
        for scenario in &self.scenarios {
            let experiment = Experiment::load(&source.beside(&scenario.experiment))?;
            let ids = self.candidates.iter().map(|candidate| candidate.id.as_str());
            source.check_names(scenario.set_for.keys(), "[[grid.candidate]]", ids)?;
            for candidate in &self.candidates {
                let Candidate { id, without, .. } = candidate;
                let set_for = scenario.set_for.iter().find(|(other, _)| other.get_ref() == id);
                let set_for = set_for.into_iter().flat_map(|(_, set)| set.clone());
                let mut set = scenario.set.clone();
                set.retain(|name, _| !without.contains(name));
                set.extend(candidate.set.clone());
                set.extend(set_for);
                let unset = without.iter().filter(|name| experiment.sets(name));
                let id = format!("{}-{id}", scenario.id.get_ref());
                runs.push(Run {
                    id: Spanned::new(scenario.id.span(), id),
                    label: candidate.label.clone(),
                    color: candidate.color,
                    group: scenario.label.clone(),
                    experiment: scenario.experiment.clone(),
                    fmu: candidate.fmu.clone(),
                    set,
                    unset: unset.cloned().collect(),
                    vary: Vec::new(),
                    correlations: Vec::new(),
                    cases: None,
                    design: DesignKind::default(),
                    seed: 1,
                    timed: scenario.timed,
                    within: scenario.within.clone(),
                    measures: [&scenario.measures[..], &candidate.measures].concat(),
                    observe: experiment.observe.clone(),
                });
            }
        }
        Ok(runs)
    }
}

/// Replaces patterns by ids: a name with a `*` becomes all ids that fit it, in the order of `ids`,
/// and another name stays as it is.
///
/// # Errors
/// Returns the name that fits no id.
pub(crate) fn expand(
    names: &[Spanned<String>],
    ids: &[&str],
) -> Result<Vec<Spanned<String>>, Spanned<String>> {
    let mut expanded = Vec::new();
    for name in names {
        if !name.get_ref().contains('*') {
            expanded.push(name.clone());
            continue;
        }
        let before = expanded.len();
        let fitting = ids.iter().filter(|id| names::matches(name.get_ref(), id));
        expanded.extend(fitting.map(|id| Spanned::new(name.span(), (*id).to_string())));
        if expanded.len() == before {
            return Err(name.clone());
        }
    }
    Ok(expanded)
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
        let expanded = |patterns: &[&str]| expand(&names(patterns), &ids);
        assert_eq!(
            expanded(&["storm-*", "calm-*"]).unwrap(),
            names(&["storm-lqr", "calm-lqr", "calm-fbl"])
        );
        // A name without a `*` is checked elsewhere.
        assert_eq!(expanded(&["calm"]).unwrap(), names(&["calm"]));
        assert_eq!(expanded(&["calm-lqr", "gale-*"]).unwrap_err().into_inner(), "gale-*");
    }
}
