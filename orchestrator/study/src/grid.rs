//! Grids of candidates and scenarios. There is a run for each pair, so that a study describes each
//! candidate and each scenario only once.

use crate::runs::Run;
use cosim::document::Source;
use cosim::error::Error;
use fmi_master::names;
use schemars::JsonSchema;
use serde::Deserialize;
use std::collections::BTreeMap;
use toml::Spanned;

/// A grid of candidates and scenarios, which defines the runs `SCENARIO-CANDIDATE`. A candidate has
/// the keys `fmu`, `set`, `without` and `measures` of its runs. A scenario has the others, and its
/// label is their group.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct Grid {
    /// Candidates that are compared with each other, with the changes that put each into any
    /// experiment.
    #[serde(rename = "candidate")]
    candidates: Vec<Run>,
    /// Scenarios in which the candidates are compared.
    #[serde(rename = "scenario")]
    scenarios: Vec<Run>,
}

impl Grid {
    /// Returns the runs of the grid, scenario by scenario.
    ///
    /// # Errors
    /// Returns an error if `set_for` names a candidate that does not exist.
    pub(crate) fn runs(&self, source: &Source) -> Result<Vec<Run>, Error> {
        let mut runs = Vec::new();
        for scenario in &self.scenarios {
            let ids = self.candidates.iter().map(|candidate| candidate.id.get_ref().as_str());
            source.check_names(scenario.set_for.keys(), "[[grid.candidate]]", ids)?;
            for candidate in &self.candidates {
                let id = candidate.id.get_ref();
                let set_for = scenario.set_for.iter().find(|(other, _)| other.get_ref() == id);
                let mut set = scenario.set.clone();
                set.retain(|name, _| !candidate.without.contains(name));
                set.extend(candidate.set.clone());
                set.extend(set_for.into_iter().flat_map(|(_, set)| set.clone()));
                let id = format!("{}-{id}", scenario.id.get_ref());
                runs.push(Run {
                    id: Spanned::new(scenario.id.span(), id),
                    label: candidate.label.clone(),
                    color: candidate.color,
                    group: scenario.label.clone(),
                    fmu: candidate.fmu.clone(),
                    set,
                    without: candidate.without.clone(),
                    set_for: BTreeMap::new(),
                    measures: [&scenario.measures[..], &candidate.measures].concat(),
                    ..scenario.clone()
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
