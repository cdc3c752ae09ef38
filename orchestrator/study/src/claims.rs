//! Verdicts on whether the claims of a paper hold in our runs.

use crate::comparisons::{Check, Claim, Relation};
use crate::definition::Study;
use crate::results::{Metric, Numbers, Results, is_reference, resolve};
use crate::values::Quantity;
use cosim::experiment::MeasureKind;
use serde::Serialize;
use sweep::statistics::{CONFIDENCE, Probability};

/// Verdict on a claim of the paper.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// Every check holds for every pair of cases.
    Holds,
    /// Some checks hold, or a check holds for some pairs of cases.
    HoldsPartly,
    /// No check holds for any pair of cases.
    DoesNotHold,
    /// There are no runs with which the claim can be judged.
    NotJudged,
}

impl Verdict {
    /// Returns the verdict in words, for a reader.
    pub fn text(self) -> &'static str {
        match self {
            Self::Holds => "holds",
            Self::HoldsPartly => "holds partly",
            Self::DoesNotHold => "does not hold",
            Self::NotJudged => "not judged",
        }
    }

    fn from_counts(held: usize, total: usize) -> Self {
        match held {
            _ if total == 0 => Self::NotJudged,
            0 => Self::DoesNotHold,
            _ if held == total => Self::Holds,
            _ => Self::HoldsPartly,
        }
    }
}

/// Outcome of one check of a claim.
#[derive(Clone, Debug, PartialEq)]
pub struct Checked {
    /// Numbers on the left side of the relation.
    pub left: Numbers,
    /// Numbers on the right side of the relation.
    pub right: Numbers,
    /// Relative difference (left − right)/right for each pair.
    pub difference: Numbers,
    /// Margin that the paper claims, as a fraction.
    pub by: Option<f64>,
    /// Number of pairs of cases that were compared. If one of a pair has no number, the relation
    /// does not hold for it.
    pub pairs: usize,
    /// Number of pairs for which the relation holds.
    pub held: usize,
}

impl Checked {
    /// Returns the probability that the relation holds for a pair, with 95 % confidence; `None` for
    /// a single pair, or none. It holds for pairs that were drawn independently.
    pub fn probability(&self) -> Option<Probability> {
        let (held, pairs) = (self.held as u64, self.pairs as u64);
        (pairs > 1).then(|| Probability::new(held, pairs, CONFIDENCE))
    }

    /// Returns the verdict of this check alone.
    pub fn verdict(&self) -> Verdict {
        Verdict::from_counts(self.held, self.pairs)
    }
}

/// Outcome of a claim with all of its checks.
#[derive(Clone, Debug, PartialEq)]
pub struct Judged {
    /// Verdict over all checks of the claim.
    pub verdict: Verdict,
    /// Outcome of each check of the claim.
    pub checks: Vec<Checked>,
}

/// Rejects checks that compare runs which cannot be paired.
///
/// # Errors
/// Returns an error that describes the first faulty check.
pub(crate) fn check_pairs(study: &Study) -> Result<(), String> {
    let cases = |reference: &str| Ok::<_, String>(study.runs[resolve(study, reference)?.0].count());
    for check in study.claims.iter().flat_map(|claim| &claim.checks) {
        let Quantity::Named(right) = &check.right else { continue };
        if !is_reference(study, &check.right) {
            continue;
        }
        let counts = [cases(&check.left)?, cases(right)?];
        if counts[0] != counts[1] && !counts.contains(&1) {
            return Err(format!(
                "check \"{}\": {} has {} cases, {right} has {}: they cannot be paired",
                check.label, check.left, counts[0], counts[1]
            ));
        }
    }
    Ok(())
}

/// Judges a claim by its checks.
///
/// # Errors
/// Returns an error if a check refers to a missing item, or a run has no such quantity.
pub fn judge(claim: &Claim, results: &Results) -> Result<Judged, String> {
    let checks =
        claim.checks.iter().map(|check| compare(check, results)).collect::<Result<Vec<_>, _>>()?;
    let is_open = checks.iter().any(|checked| checked.pairs == 0);
    let sum = |count: fn(&Checked) -> usize| checks.iter().map(count).sum();
    let pairs = if is_open { 0 } else { sum(|checked| checked.pairs) };
    Ok(Judged { verdict: Verdict::from_counts(sum(|checked| checked.held), pairs), checks })
}

fn compare(check: &Check, results: &Results) -> Result<Checked, String> {
    let left = never_is_infinite(&check.left, results, results.case_numbers(&check.left)?);
    let right = results.quantity(&check.right)?;
    let right = match &check.right {
        Quantity::Named(name) => never_is_infinite(name, results, right),
        Quantity::Number(_) => right,
    };
    let by = check.by.as_ref().map(|by| results.study.values.number(by)).transpose()?;
    // If one side has no number at all, there is nothing to compare.
    let is_empty = [&left, &right].iter().any(|side| side.iter().flatten().next().is_none());
    let pairs = if is_empty { 0 } else { left.len().max(right.len()) };
    let at = |side: &[Option<f64>], k: usize| side[k % side.len()];
    let compared: Vec<(f64, f64)> =
        (0..pairs).filter_map(|k| Some((at(&left, k)?, at(&right, k)?))).collect();
    let held = compared.iter().filter(|(left, right)| stand(check.relation, *left, *right, by));
    let difference = compared.iter().map(|(left, right)| left / right - 1.0);
    Ok(Checked {
        held: held.count(),
        difference: finite(difference),
        left: finite(left.into_iter().flatten()),
        right: finite(right.into_iter().flatten()),
        by,
        pairs,
    })
}

fn finite(numbers: impl Iterator<Item = f64>) -> Numbers {
    Numbers(numbers.filter(|number| number.is_finite()).collect())
}

/// Returns whether two numbers stand in a relation, with `by` as the least difference. A run that
/// never settles is later than any that does, and neither below nor at most another such run.
fn stand(relation: Relation, left: f64, right: f64, by: Option<f64>) -> bool {
    let margin = if right.is_finite() { by.unwrap_or(0.0) * right.abs() } else { 0.0 };
    match relation {
        Relation::Below => left < right - margin,
        Relation::Above => left > right + margin,
        Relation::AtMost => left.is_finite() && left <= right - margin,
        Relation::AtLeast => left >= right + margin,
    }
}

/// Replaces a missing settling time by infinity, so that it can be compared.
fn never_is_infinite(
    reference: &str,
    results: &Results,
    numbers: Vec<Option<f64>>,
) -> Vec<Option<f64>> {
    let settles = |id: &str| {
        let measure = results.study.measures.iter().find(|measure| measure.id == id);
        measure.is_some_and(|measure| measure.kind == MeasureKind::Settling)
    };
    match resolve(results.study, reference) {
        Ok((_, Metric::Column { name, .. }))
            if name.strip_prefix("measure.").is_some_and(settles) =>
        {
            numbers.into_iter().map(|number| number.or(Some(f64::INFINITY))).collect()
        }
        _ => numbers,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::results::RunResult;
    use std::path::Path;
    use sweep::table::{CaseTable, Column, Values};

    fn study() -> Study {
        let path = "../experiments/two-loop-smc/study.toml";
        Study::load(&Path::new(env!("CARGO_MANIFEST_DIR")).join(path)).unwrap()
    }

    /// Returns a table with the values of a measure.
    fn measured(id: &str, values: &[Option<f64>]) -> CaseTable {
        let values = Values::Real(values.to_vec());
        CaseTable { columns: vec![Column { name: format!("measure.{id}"), values }] }
    }

    fn checked(held: usize, pairs: usize) -> Checked {
        let one = Numbers(vec![1.0]);
        let difference = Numbers(vec![0.0; pairs]);
        Checked { left: one.clone(), right: one, difference, by: None, pairs, held }
    }

    #[test]
    fn equal_numbers_are_neither_below_nor_above() {
        use Relation::{Above, AtLeast, AtMost, Below};
        let study = study();
        let check = study.claims[0].checks[0].clone();
        let (place, _) = resolve(&study, &check.left).unwrap();
        let held = |relation, value: f64, right: f64, by: Option<f64>| {
            let mut runs = vec![RunResult::default(); study.runs.len()];
            runs[place].parts = vec![measured("late", &[Some(value)])];
            let (right, by) = (Quantity::Number(right), by.map(Quantity::Number));
            let check = Check { relation, right, by, ..check.clone() };
            compare(&check, &Results { study: &study, runs }).unwrap().held == 1
        };
        assert_eq!(
            [Below, Above, AtMost, AtLeast].map(|r| held(r, 2.0, 2.0, None)),
            [false, false, true, true]
        );
        // Also against zero, where a fraction of the right number says nothing.
        assert_eq!(
            [Below, Above, AtMost, AtLeast].map(|r| held(r, 0.0, 0.0, None)),
            [false, false, true, true]
        );
        assert!(held(Below, 0.4, 1.0, Some(0.5)) && !held(Below, 0.6, 1.0, Some(0.5)));
        assert!(held(Above, 1.6, 1.0, Some(0.5)) && !held(Above, 1.4, 1.0, Some(0.5)));
    }

    #[test]
    fn what_never_settles_is_later_than_all_that_does() {
        use Relation::{Above, AtMost, Below};
        let never = f64::INFINITY;
        for by in [None, Some(0.1)] {
            assert!(stand(Below, 3.0, never, by) && stand(AtMost, 3.0, never, by));
            assert!(!stand(Below, never, 3.0, by) && !stand(AtMost, never, 3.0, by));
            assert!(stand(Above, never, 3.0, by) && !stand(Above, 3.0, never, by));
            assert!(!stand(Below, never, never, by) && !stand(AtMost, never, never, by));
        }
    }

    #[test]
    fn a_check_holds_if_it_does_for_all_pairs() {
        assert_eq!(checked(3, 3).verdict(), Verdict::Holds);
        assert_eq!(checked(2, 3).verdict(), Verdict::HoldsPartly);
        assert_eq!(checked(0, 3).verdict(), Verdict::DoesNotHold);
        assert_eq!(checked(0, 0).verdict(), Verdict::NotJudged);
    }

    #[test]
    fn a_member_without_the_number_does_not_hold_and_is_not_left_out() {
        let study = study();
        let check = study.claims.iter().flat_map(|claim| &claim.checks);
        let check = check.clone().find(|check| check.left == "direct.measure.settling-02").unwrap();
        let mut runs = vec![RunResult::default(); study.runs.len()];
        let (place, _) = resolve(&study, &check.left).unwrap();
        // The second case does not settle.
        runs[place].parts = vec![measured("settling-02", &[Some(5.0), None, Some(6.0)])];
        let checked = compare(check, &Results { study: &study, runs }).unwrap();
        assert_eq!((checked.held, checked.pairs, checked.verdict()), (2, 3, Verdict::HoldsPartly));
        assert_eq!(checked.left.0, [5.0, 6.0]);
    }
}
