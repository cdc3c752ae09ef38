//! Claims with their verdicts, a line each, and the evidence behind them.

use crate::claims::{Checked, Judged, Verdict};
use crate::comparisons::{Check, Claim, Relation};
use crate::results::Numbers;
use crate::texts::{difference, several};
use maud::{Markup, html};
use std::fmt::Write as _;
use sweep::texts::shown;

/// Returns the number that stands beside a verdict: the two sides of a single check, or how many
/// checks hold.
fn number(judged: &Judged) -> String {
    let mean = |numbers: &Numbers| {
        if numbers.0.is_empty() { "never".into() } else { shown(numbers.mean()) }
    };
    match &judged.checks[..] {
        [checked] if checked.pairs > 0 => {
            format!("{} against {}", mean(&checked.left), mean(&checked.right))
        }
        checks => {
            let held = checks.iter().filter(|checked| checked.verdict() == Verdict::Holds).count();
            format!("{held} of {} checks", checks.len())
        }
    }
}

pub(super) fn claim(claim: &Claim, judged: &Judged) -> Markup {
    html! {
        details {
            summary {
                span class=(class(judged.verdict)) { (judged.verdict.text()) }
                span { (claim.says) }
                span.number { (number(judged)) }
            }
            ul { @for (check, checked) in claim.checks.iter().zip(&judged.checks) { li { (evidence(check, checked)) } } }
            @if !claim.remark.is_empty() { p.remark { (claim.remark) } }
            p.source { "Source: " (claim.source) }
        }
    }
}

fn class(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Holds => "verdict holds",
        Verdict::HoldsPartly => "verdict partly",
        Verdict::DoesNotHold => "verdict not",
        Verdict::NotJudged => "verdict",
    }
}

fn evidence(check: &Check, checked: &Checked) -> Markup {
    let Checked { held, pairs, .. } = *checked;
    if pairs == 0 {
        return html! { span.verdict { (checked.verdict().text()) } " " (check.label) ": no run has this number" };
    }
    let is_upper = matches!(check.relation, Relation::Below | Relation::AtMost);
    let required = match (checked.by, check.relation) {
        (None, Relation::Below) => "below".to_string(),
        (None, Relation::Above) => "above".to_string(),
        (None, Relation::AtMost) => "not above".to_string(),
        (None, Relation::AtLeast) => "not below".to_string(),
        (Some(by), _) => {
            let size = if by < 0.0 { "at most" } else { "at least" };
            let side = if is_upper == (by < 0.0) { "above" } else { "below" };
            format!("{size} {}\u{a0}% {side}", shown(100.0 * by.abs()))
        }
    };
    let mut count = String::new();
    if let Some(probability) = checked.probability() {
        let [low, high] = [probability.low, probability.high].map(|share| shown(100.0 * share));
        let _ = write!(count, ", in {held} of {pairs} runs, hence {low} to {high}\u{a0}%");
    }
    let missing = pairs - checked.difference.0.len();
    if pairs > 1 && missing > 0 {
        let _ = write!(count, ", of which {missing} do not have this number");
    }
    // Only a time after which something settles can be without a number here.
    let side = |side: &Numbers| if side.0.is_empty() { "never".into() } else { several(side) };
    let is_compared = !checked.difference.0.is_empty();
    html! {
        span class=(class(checked.verdict())) { (checked.verdict().text()) } " "
        (check.label) ": " (side(&checked.left)) " against " (side(&checked.right)) " ("
        @if is_compared { (difference(&checked.difference)) "; " }
        "required: " (required) (count) ")"
    }
}
