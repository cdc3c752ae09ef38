//! Findings of a campaign.

use crate::definition::{Limit, kept_column};
use crate::flight::CaseStatus;
use crate::plan::Plan;
use crate::sensitivity::{Input, Sensitivity, sensitivities};
use serde::Serialize;
use std::collections::BTreeMap;
use sweep::statistics::{CONFIDENCE, Probability, Summary, summary};
use sweep::table::CaseTable;

/// Findings of a campaign, as `summary.json` holds them.
#[derive(Clone, Debug, Serialize)]
pub struct Findings {
    /// Title of the campaign.
    pub title: String,
    /// Number of cases that were flown.
    pub cases: u64,
    /// Number of cases with each status.
    pub status: BTreeMap<&'static str, u64>,
    /// Limits, with the probability that a case breaks them.
    pub limits: Vec<LimitFinding>,
    /// Measures over all cases.
    pub measures: Vec<Measured>,
}

/// A limit over all cases.
#[derive(Clone, Debug, Serialize)]
pub struct LimitFinding {
    /// Id of the limit.
    pub id: String,
    /// Wording of the limit.
    pub says: String,
    /// Probability that a case breaks the limit, with 95 % confidence.
    pub broken: Probability,
}

/// A measure over all cases.
#[derive(Clone, Debug, Serialize)]
pub struct Measured {
    /// Name of the measure.
    pub name: String,
    /// The quantity in words.
    pub words: String,
    /// Unit of the measure, or an empty text.
    pub unit: String,
    /// Its distribution; none if no case has a value.
    pub summary: Option<Summary>,
    /// Sensitivity of the measure to each parameter that is no seed.
    pub sensitivities: Vec<Sensitivity>,
}

/// Computes the findings from a table of cases.
pub(crate) fn findings(plan: &Plan, table: &CaseTable) -> Findings {
    let cases = table.rows() as u64;
    let mut status: BTreeMap<&'static str, u64> =
        CaseStatus::ALL.iter().map(|status| (status.name(), 0)).collect();
    for name in table.texts("status") {
        if let Some(count) = status.get_mut(name.as_str()) {
            *count += 1;
        }
    }
    let limits = plan.campaign.limits.iter().map(|limit| LimitFinding {
        id: limit.id.clone(),
        says: says(plan, limit),
        broken: Probability::new(breaking(table, limit).len() as u64, cases, CONFIDENCE),
    });
    let inputs = plan.sweep.varied.iter().map(|varied| Input {
        name: varied.name.clone(),
        is_seed: varied.is_seed(),
        values: table.numbers(&varied.name),
    });
    let inputs: Vec<Input> = inputs.collect();
    let measures = plan.recorded.iter().map(|recorded| {
        let values = table.numbers(&recorded.name);
        Measured {
            name: recorded.name.clone(),
            words: recorded.words.clone(),
            unit: recorded.unit.clone(),
            summary: summary(&values),
            sensitivities: sensitivities(&inputs, &values),
        }
    });
    Findings {
        title: plan.campaign.title.clone(),
        cases,
        status,
        limits: limits.collect(),
        measures: measures.collect(),
    }
}

/// Returns the numbers of the cases that broke a limit.
pub(crate) fn breaking(table: &CaseTable, limit: &Limit) -> Vec<usize> {
    let kept = table.numbers(&kept_column(&limit.id)).into_iter().enumerate();
    kept.filter(|(_, is_kept)| *is_kept == 0.0).map(|(case, _)| case).collect()
}

/// Returns the wording of a limit.
fn says(plan: &Plan, limit: &Limit) -> String {
    if !limit.says.is_empty() {
        return limit.says.clone();
    }
    let name = limit.measure.get_ref();
    let measure = plan.recorded.iter().find(|recorded| recorded.name == *name);
    let unit = measure.map(|measure| measure.unit.as_str()).unwrap_or_default();
    let (bound, is_upper) = limit.bound();
    let sign = if is_upper { "≤" } else { "≥" };
    format!("{} {sign} {bound} {unit}", plan.words(name)).trim_end().to_string()
}

/// Returns the numbers of the cases with the largest values, the largest first.
pub(crate) fn worst(values: &[f64], count: usize) -> Vec<u64> {
    let mut order: Vec<usize> = (0..values.len()).filter(|i| !values[*i].is_nan()).collect();
    order.sort_by(|a, b| values[*b].total_cmp(&values[*a]));
    order.into_iter().take(count).map(|i| i as u64).collect()
}
