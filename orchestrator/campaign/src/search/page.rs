//! The page of a search: the worst case against its limits, how it was found, and how to fly it.

use super::{SearchOutcome, Tried};
use crate::flight::Row;
use crate::plan::Plan;
use cosim::error::Error;
use cosim::experiment::name_of;
use cosim::files;
use cosim::variation::SettingValue;
use cosim_report::figure::{Color, Curve, Figure, Panel, Shape, svg, with_unit};
use cosim_report::page::{Page, Section, figure, table, verdict};
use maud::{Markup, html};
use std::path::Path;
use sweep::texts::shown;

/// Writes `history.svg` and `report.html`.
///
/// # Errors
/// Returns an error if a file cannot be written.
pub(super) fn write(
    plan: &Plan,
    outcome: &SearchOutcome,
    tried: &[Tried],
    worst: &Row,
) -> Result<(), Error> {
    let out = &outcome.out;
    let history = history(plan, outcome, tried);
    svg::write(&history, &out.join("history.svg"))?;
    let figures = figure(&history, &caption(outcome));
    let answer = html! {
        (answer(plan, outcome))
        p { "Fly it again, with everything recorded and a page of it:" }
        p { code { (again(plan, &file(out, "worst.toml"))) } }
    };
    let page = Page {
        title: outcome.title.clone(),
        about: format!("The worst of {} cases that a search flew", outcome.cases),
        answer: String::new(),
        sections: vec![
            Section::new("answer", "Answer", answer),
            Section::new("figures", "Figures", figures).headed(""),
            Section::new("values", "Values of the worst case", values(plan, worst)),
        ],
    };
    files::write(&out.join("report.html"), page.text())
}

/// Returns the bound of the first limit on a measure, and whether values must lie below it.
fn bound(plan: &Plan, measure: &str) -> Option<(f64, bool)> {
    let limit = plan.campaign.limits.iter().find(|limit| limit.measure.get_ref() == measure)?;
    Some(limit.bound())
}

/// Draws the values that were tried, and the largest one so far.
fn history(plan: &Plan, outcome: &SearchOutcome, tried: &[Tried]) -> Figure {
    let number: Vec<f64> = (1..=tried.len()).map(|i| i as f64).collect();
    let values: Vec<f64> = tried.iter().map(|case| case.value).collect();
    let mut largest = f64::NEG_INFINITY;
    let so_far = values.iter().map(|value| {
        largest = largest.max(*value);
        largest
    });
    let so_far = so_far.collect();
    let mut curves = vec![
        Curve::new("case", Color::CURVES[0], Shape::Dots, number.clone(), values),
        Curve::new("largest so far", Color::CURVES[1], Shape::Line, number, so_far),
    ];
    curves.extend(bound(plan, &outcome.measure).map(|(limit, _)| {
        Curve::new("limit", Color::LIMIT, Shape::Horizontal, vec![f64::NAN], vec![limit])
    }));
    let label = with_unit(plan.words(&outcome.measure), &outcome.unit);
    let panel = Panel::new("number of cases", &label, curves);
    Figure::new(format!("{}: search for the worst case", outcome.title), 1, vec![panel])
}

fn caption(outcome: &SearchOutcome) -> Markup {
    html! {
        "Each dot is a case. " (outcome.searches)
        @if outcome.searches == 1 { " search" } @else { " searches from different starts" }
        "; it ended because " (outcome.ended) "."
        @if outcome.failed > 0 { " In " (outcome.failed) " cases an FMU failed." }
    }
}

/// Returns the command that flies the worst case again.
fn again(plan: &Plan, worst: &str) -> String {
    match plan.sweep.experiment().law.as_deref() {
        Some(law) => format!("experiment(\"{worst}\", law={})", name_of(law)),
        None => format!("orchestrator run {worst} --page"),
    }
}

/// Returns the path of a file in the folder of the results, quoted for a shell if it must be.
fn file(out: &Path, name: &str) -> String {
    let path = out.join(name).display().to_string();
    if path.contains(char::is_whitespace) { format!("'{path}'") } else { path }
}

fn answer(plan: &Plan, outcome: &SearchOutcome) -> Markup {
    let unit = if outcome.unit.is_empty() { String::new() } else { format!(" {}", outcome.unit) };
    let largest = outcome.largest;
    let kept = |is: bool| verdict(Some(is), if is { "kept" } else { "broken" });
    html! {
        p {
            "The largest value of " b { (plan.words(&outcome.measure)) } " is " b { (shown(largest)) (unit) }
            @if let Some((limit, is_upper)) = bound(plan, &outcome.measure) {
                ", its limit " (shown(limit)) (unit) " "
                @if limit > 0.0 { "(" (shown(100.0 * largest / limit)) " % of it) " }
                (kept(if is_upper { largest <= limit } else { largest >= limit }))
            }
            "."
            @if outcome.status != "completed" { " The case is " (outcome.status) "." }
        }
        @if !plan.campaign.limits.is_empty() {
            ul { @for limit in &plan.campaign.limits {
                @let says = if limit.says.is_empty() { &limit.id } else { &limit.says };
                li { (says) ": " (kept(!outcome.broken.contains(&limit.id))) }
            } }
        }
    }
}

fn values(plan: &Plan, worst: &Row) -> Markup {
    let rows = plan.sweep.varied.iter().zip(&worst.values).map(|(varied, value)| {
        vec![
            html! { code { (varied.name) } },
            html! { (value_text(value)) },
            html! { (varied.unit) },
            html! { (varied.distribution.in_words()) },
        ]
    });
    html! {
        (table(&["Parameter", "Value", "Unit", "Range"], rows))
        p.note {
            "A search finds a bad case, but does not prove that it is the worst. "
            code { "search.parquet" } " holds all cases, and " code { "search.json" } " the numbers of this page. "
            "Written by orchestrator " (env!("CARGO_PKG_VERSION")) "."
        }
    }
}

fn value_text(value: &SettingValue) -> String {
    match value.to_json() {
        serde_json::Value::String(text) => text,
        other => other.as_f64().map_or_else(|| other.to_string(), shown),
    }
}
