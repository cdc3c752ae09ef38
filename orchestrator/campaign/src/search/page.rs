//! The page of a search: the worst case against its limits, how it was found, and how to fly it.

use super::{CASE, SearchOutcome, Tried};
use crate::flight::{Flight, Row};
use crate::plan::Plan;
use crate::track::Track;
use cosim::error::Error;
use cosim::experiment::{MeasureKind, name_of};
use cosim::files;
use cosim::interrupt::Interrupt;
use cosim::signal::{Resolved, Signal};
use cosim::variation::SettingValue;
use cosim_report::figure::{Color, Curve, Figure, Legend, Panel, Shape, svg, with_unit};
use cosim_report::page::head;
use cosim_report::recording::panels::{CURVES, symbols};
use cosim_report::run_page::thin;
use maud::{DOCTYPE, Markup, PreEscaped, html};
use std::path::Path;
use sweep::texts::short;

/// On a narrow screen the figures scroll, because their texts would be too small to read.
const STYLE: &str = ".plot { overflow-x: auto; } .plot svg { min-width: 640px; }";

/// Writes `history.svg` and `report.html`, for which the worst case is flown again.
///
/// # Errors
/// Returns an error if the worst case cannot be flown, or if a file cannot be written.
pub(super) fn write(
    plan: &Plan,
    outcome: &SearchOutcome,
    tried: &[Tried],
    worst: &Row,
) -> Result<(), Error> {
    let out = &outcome.out;
    let history = history(plan, outcome, tried);
    svg::write(&history, &out.join("history.svg"))?;
    let worst_case = worst_case(plan, outcome, worst)?;
    let drawn = (!worst_case.panels.is_empty()).then(|| svg::element(&worst_case));
    let page = page(plan, outcome, worst, drawn.as_deref(), &svg::element(&history));
    files::write(&out.join("report.html"), page)
}

/// Returns the bound of the first limit on a measure, and whether values must lie below it.
fn bound(plan: &Plan, measure: &str) -> Option<(f64, bool)> {
    let limit = plan.campaign.limits.iter().find(|limit| limit.measure.get_ref() == measure)?;
    limit.at_most.map(|most| (most, true)).or(limit.at_least.map(|least| (least, false)))
}

fn limit_line(limit: f64) -> Curve {
    Curve::new("limit", Color::LIMIT, Shape::Horizontal, vec![f64::NAN], vec![limit])
}

fn panel(title: &str, x_label: &str, y_label: String, curves: Vec<Curve>) -> Panel {
    Panel { title: title.into(), x_label: x_label.into(), y_label, curves, ..Panel::default() }
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
    curves.extend(bound(plan, &outcome.measure).map(|(limit, _)| limit_line(limit)));
    let label = with_unit(plan.words(&outcome.measure), &outcome.unit);
    Figure {
        title: format!("{}: search for the worst case", outcome.title),
        columns: 1,
        legend: Legend::Above,
        panels: vec![panel("", "number of cases", label, curves)],
    }
}

/// Signals that a limit judges.
struct Judged {
    measure: String,
    unit: String,
    factor: f64,
    limit: Option<f64>,
    signals: Vec<(String, Resolved)>,
}

/// Flies the worst case again and draws the signals of the measure that was searched, and of all
/// others that have a limit.
fn worst_case(plan: &Plan, outcome: &SearchOutcome, worst: &Row) -> Result<Figure, Error> {
    // An interrupt of the search must not end this flight.
    let interrupt = Interrupt::default();
    let mut flight = Flight::new(plan, false, &interrupt)?.without_ends();
    let limited = plan.campaign.limits.iter().map(|limit| limit.measure.get_ref());
    let mut measures: Vec<&String> = vec![&outcome.measure];
    for measure in limited {
        if !measures.contains(&measure) {
            measures.push(measure);
        }
    }
    let mut drawn = Vec::new();
    for measure in measures {
        drawn.extend(judged(plan, &mut flight, measure)?);
    }
    let signals = drawn.iter().flat_map(|Judged { factor, signals, .. }| {
        signals.iter().map(|(_, signal)| (*factor, signal.clone()))
    });
    let mut track = Track::new(signals.collect(), 1);
    flight.fly_with(CASE, worst.values.clone(), &mut [&mut track])?;
    let time = thin::times(&track.time);
    let mut values = track.values.iter().map(|values| thin::values(values));
    let panels = drawn.iter().map(|judged| {
        // A single signal is named by the title, because its name may be long.
        let (alone, title) = match &judged.signals[..] {
            [(name, _)] => (true, format!("{}: {name}", judged.measure)),
            _ => (false, judged.measure.clone()),
        };
        let own: Vec<_> = values.by_ref().take(judged.signals.len()).collect();
        let signals = judged.signals.iter().zip(own).zip(Color::CURVES);
        let curves = signals.map(|(((name, _), values), color)| {
            let name = if alone { "worst case" } else { name };
            Curve::new(name, color, Shape::Line, time.clone(), values)
        });
        let mut curves: Vec<Curve> = curves.collect();
        curves.extend(judged.limit.map(limit_line));
        let unit = if judged.unit.is_empty() { "ratio" } else { &judged.unit };
        panel(&title, "time, s", unit.to_string(), curves)
    });
    let panels = panels.collect();
    Ok(Figure { title: "The worst case".into(), columns: 1, legend: Legend::Above, panels })
}

/// Finds the signals of a measure. There are none for metrics of a guarantee and of margins.
fn judged(plan: &Plan, flight: &mut Flight, name: &str) -> Result<Option<Judged>, Error> {
    let observe = &plan.sweep.experiment().observe;
    let Some(measure) = observe.metrics.get(name) else { return Ok(None) };
    let list = observe.list(measure.signals.get_ref()).map_err(Error::experiment)?;
    let signals = list.iter().take(CURVES).map(|signal| {
        let resolved = flight.system().resolve(signal).map_err(Error::experiment)?;
        Ok((symbols(&Signal::to_string(signal)), resolved))
    });
    let signals: Vec<(String, Resolved)> = signals.collect::<Result<_, Error>>()?;
    // Only the largest value has its limit in the same picture as the signals.
    let is_largest = measure.kind == MeasureKind::Largest;
    let own = signals.first().map(|(_, signal)| signal.unit.clone()).unwrap_or_default();
    let shown = measure.unit.as_ref().filter(|_| is_largest);
    Ok(Some(Judged {
        measure: plan.words(name).into(),
        unit: shown.map_or(own, |shown| shown.name.clone()),
        factor: shown.map_or(1.0, |shown| shown.factor),
        limit: bound(plan, name).map(|(limit, _)| limit).filter(|_| is_largest),
        signals,
    }))
}

fn page(
    plan: &Plan,
    outcome: &SearchOutcome,
    worst: &Row,
    worst_case: Option<&str>,
    history: &str,
) -> String {
    let markup = html! {
        (DOCTYPE)
        html lang="en" {
            (head(&outcome.title))
            body {
                style { (PreEscaped(STYLE)) }
                header {
                    h1 { (outcome.title) }
                    p.paper { "The worst of " (outcome.cases) " cases that a search flew" }
                    nav {
                        a href="#answer" { "Answer" } " "
                        a href="#worst" { "Worst case" } " "
                        a href="#values" { "Its values" } " "
                        a href="#history" { "Search" }
                    }
                }
                main {
                    section id="answer" {
                        h2 { "Answer" }
                        (answer(plan, outcome))
                        p { "Fly it again, with everything recorded and a page of it:" }
                        p { code { (again(plan, &file(&outcome.out, "worst.toml"))) } }
                    }
                    @if let Some(svg) = worst_case {
                        figure id="worst" { h3 { "The worst case" } div.plot { (PreEscaped(svg)) } }
                    }
                    section id="values" { h2 { "Values of the worst case" } (values(plan, worst)) }
                    figure id="history" { h3 { "The search" } div.plot { (PreEscaped(history)) }
                        figcaption {
                            "Each dot is a case. " (outcome.searches)
                            @if outcome.searches == 1 { " search" } @else { " searches from different starts" }
                            "; it ended because " (outcome.ended) "."
                            @if outcome.failed > 0 { " In " (outcome.failed) " cases an FMU failed." }
                        }
                    }
                    p.note {
                        "A search finds a bad case, but does not prove that it is the worst. "
                        code { "search.parquet" } " holds all cases, and " code { "search.json" } " the numbers of this page. "
                        "Written by orchestrator " (env!("CARGO_PKG_VERSION")) "."
                    }
                }
            }
        }
    };
    markup.into_string()
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
    html! {
        p {
            "The largest value of " b { (plan.words(&outcome.measure)) } " is " b { (short(largest)) (unit) }
            @if let Some((limit, is_upper)) = bound(plan, &outcome.measure) {
                @let kept = if is_upper { largest <= limit } else { largest >= limit };
                ", its limit " (short(limit)) (unit) " "
                @if limit > 0.0 { "(" (short(100.0 * largest / limit)) " % of it) " }
                @if kept { span class="verdict holds" { "kept" } } @else { span class="verdict not" { "broken" } }
            }
            "."
            @if outcome.status != "completed" { " The case is " (outcome.status) "." }
        }
        @if !plan.campaign.limits.is_empty() {
            ul { @for limit in &plan.campaign.limits {
                @let says = if limit.says.is_empty() { &limit.id } else { &limit.says };
                li { (says) ": "
                    @if outcome.broken.contains(&limit.id) { span class="verdict not" { "broken" } }
                    @else { span class="verdict holds" { "kept" } }
                }
            } }
        }
    }
}

fn values(plan: &Plan, worst: &Row) -> Markup {
    html! {
        table {
            thead { tr { th { "Parameter" } th { "Value" } th { "Unit" } th { "Range" } } }
            tbody { @for (varied, value) in plan.sweep.varied.iter().zip(&worst.values) { tr {
                td { code { (varied.name) } } td { (value_text(value)) } td { (varied.unit) }
                td { (varied.distribution.in_words()) }
            } } }
        }
    }
}

fn value_text(value: &SettingValue) -> String {
    match value.to_json() {
        serde_json::Value::String(text) => text,
        other => other.as_f64().map_or_else(|| other.to_string(), short),
    }
}
