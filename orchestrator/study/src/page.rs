//! The report as one self-contained HTML page.

use crate::claims::{Checked, Judged, Verdict};
use crate::comparisons::{Check, Claim, ComparisonRow, ComparisonTable, Overview, Relation};
use crate::results::{Numbers, Results, RunResult};
use crate::texts::{percent, several, shown, signed};
use crate::values::{Quantity, ValueKind};
use cosim_report::figure::{self, interactive};
use cosim_report::page::head;
use maud::{DOCTYPE, Markup, PreEscaped, html};
use std::fmt::Write as _;
use sweep::texts::short;

const SCRIPT: &str = include_str!("page.js");

/// Returns the text of the page. `judged` belongs to the study's claims in order, and `drawn` to
/// its figures.
///
/// # Errors
/// Returns an error if the study names an item that does not exist.
pub(crate) fn page(
    results: &Results,
    judged: &[Judged],
    drawn: &[figure::Figure],
) -> Result<String, String> {
    let study = results.study;
    let runs: usize = results.runs.iter().map(RunResult::cases).sum();
    let claims = study.claims.iter().zip(judged).map(|(c, j)| claim(c, j)).collect::<Vec<_>>();
    let tables = study.tables.iter().map(|t| table(t, results)).collect::<Result<Vec<_>, _>>()?;
    let overviews = study.overviews.iter().map(|o| overview(o, results)).collect::<Vec<_>>();
    let markup = html! {
        (DOCTYPE)
        html lang="en" {
            (head(&study.title))
            body {
                header {
                    h1 { (study.title) }
                    p.paper { (study.paper) }
                    nav {
                        @for (id, name) in sections(results) { a href=(format!("#{id}")) { (name) } " " }
                    }
                }
                main {
                    @for paragraph in paragraphs(&study.summary) { p { (paragraph) } }
                    @if !claims.is_empty() {
                    section id="claims" {
                        h2 { "Claims of the paper, and whether they hold here" }
                        table.claims {
                            thead { tr { th { "Claim" } th { "Verdict" } th { "Evidence" } } }
                            tbody { @for row in &claims { (row) } }
                        }
                        p.note {
                            "A number with a range in brackets is the mean over several runs, followed by the smallest and the largest "
                            "value. Differences are taken between runs with the same disturbance. Where a relation was tried in several runs, "
                            "the percentages say how often it holds, with 95\u{a0}% confidence (Clopper and Pearson)."
                        }
                    }
                    }
                    section id="tables" {
                        h2 { "Numbers" }
                        @for table in &tables { (table) }
                        @for overview in &overviews { (overview) }
                    }
                    (plots(results, drawn))
                    (scenario(results))
                    section id="origin" {
                        h2 { "How the numbers were computed" }
                        p {
                            "Orchestrator " (env!("CARGO_PKG_VERSION")) " made " (runs) " simulation runs. All numbers of this page are in "
                            code { "results.json" } ". The folder " code { "runs" } " holds the signals of the first run of each row below. "
                            "A repetition gives the same bits, except for computing times."
                        }
                        (all_runs(results))
                        @if !study.values.0.is_empty() {
                            h3 { "Reference values" }
                            (all_values(results))
                        }
                    }
                }
                script { (PreEscaped(interactive::library())) }
                @for (figure, picture) in study.figures.iter().zip(drawn) {
                    (plot(&figure.id, picture))
                }
                script { (PreEscaped(SCRIPT)) }
            }
        }
    };
    Ok(markup.into_string())
}

/// Returns the section of the page that holds the figures.
fn plots(results: &Results, drawn: &[figure::Figure]) -> Markup {
    html! {
        section id="figures" {
            h2 { "Figures" }
            p.note {
                "Drag to zoom, and double-click to return to the whole view. A click on a name in a legend hides its curve, a "
                "double-click hides all others. The folder " code { "figures" } " beside this page holds each figure as SVG and PNG."
            }
            @for (figure, picture) in results.study.figures.iter().zip(drawn) {
                figure id=(figure.id) {
                    h3 { (figure.title) }
                    div.plot id=(format!("plot-{}", figure.id)) style=(format!("height:{}px", interactive::height(picture))) {}
                    figcaption {
                        (figure.caption) " "
                        a href=(format!("figures/{}.svg", figure.id)) { "SVG" } ", "
                        a href=(format!("figures/{}.png", figure.id)) { "PNG" }
                    }
                }
            }
        }
    }
}

/// Returns the sections with the scenario and the assumptions.
fn scenario(results: &Results) -> Markup {
    html! {
        @if !results.study.scenario.is_empty() { section id="scenario" {
            h2 { "Scenario" }
            table {
                thead { tr { th { "Quantity" } th { "Value" } th { "Source" } } }
                tbody {
                    @for fact in &results.study.scenario {
                        tr { td { (fact.what) } td { (fact.value) } td { (fact.source) } }
                    }
                }
            }
        } }
        @if !results.study.assumptions.is_empty() { section id="assumptions" {
            h2 { "Assumptions where the paper is incomplete or in error" }
            table {
                thead { tr { th { "Gap or error in the paper" } th { "Assumption made here" } } }
                tbody {
                    @for assumption in &results.study.assumptions {
                        tr { td { (assumption.silent) } td { (assumption.taken) } }
                    }
                }
            }
        } }
    }
}

/// Returns the ids and the names of the sections that the page has.
fn sections(results: &Results) -> impl Iterator<Item = (&'static str, &'static str)> {
    let study = results.study;
    let sections = [
        ("claims", "Claims", study.claims.is_empty()),
        ("tables", "Numbers", study.tables.is_empty() && study.overviews.is_empty()),
        ("figures", "Figures", study.figures.is_empty()),
        ("scenario", "Scenario", study.scenario.is_empty()),
        ("assumptions", "Assumptions", study.assumptions.is_empty()),
        ("origin", "Origin", false),
    ];
    sections.into_iter().filter(|(.., empty)| !empty).map(|(id, name, _)| (id, name))
}

fn paragraphs(text: &str) -> impl Iterator<Item = &str> {
    text.split("\n\n").map(str::trim).filter(|paragraph| !paragraph.is_empty())
}

/// Returns the data of a plot, which the page's script draws.
fn plot(id: &str, picture: &figure::Figure) -> Markup {
    let (data, layout) = interactive::plot(picture);
    // A slash may be escaped in JSON. With this no text of a figure can end the element.
    let text =
        serde_json::json!({ "data": data, "layout": layout }).to_string().replace("</", "<\\/");
    html! { script type="application/json" class="figure" data-plot=(format!("plot-{id}")) { (PreEscaped(text)) } }
}

fn claim(claim: &Claim, judged: &Judged) -> Markup {
    html! {
        tr {
            td { (claim.says) " " span.source { "(" (claim.source) ")" } }
            td { span class=(class(judged.verdict)) { (judged.verdict.text()) } }
            td {
                ul { @for (check, checked) in claim.checks.iter().zip(&judged.checks) { li { (evidence(check, checked)) } } }
                @if !claim.remark.is_empty() { p.remark { (claim.remark) } }
            }
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
    let (held, pairs) = (checked.held, checked.pairs);
    if pairs == 0 {
        return html! { span.verdict { (checked.verdict().text()) } " " (check.label) ": no run has this number" };
    }
    let required = match (check.relation, checked.by) {
        (Relation::Below, None) => "below".to_string(),
        (Relation::Above, None) => "above".to_string(),
        (Relation::AtMost, None) => "not above".to_string(),
        (Relation::AtLeast, None) => "not below".to_string(),
        (Relation::Below | Relation::AtMost, Some(by)) if by < 0.0 => {
            format!("at most {}\u{a0}% above", shown(-100.0 * by))
        }
        (Relation::Above | Relation::AtLeast, Some(by)) if by < 0.0 => {
            format!("at most {}\u{a0}% below", shown(-100.0 * by))
        }
        (Relation::Below | Relation::AtMost, Some(by)) => {
            format!("at least {}\u{a0}% below", shown(100.0 * by))
        }
        (Relation::Above | Relation::AtLeast, Some(by)) => {
            format!("at least {}\u{a0}% above", shown(100.0 * by))
        }
    };
    let mut count = String::new();
    if let Some(probability) = checked.probability() {
        let [low, high] = [probability.low, probability.high].map(|share| short(100.0 * share));
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
        @if is_compared { (percent(&checked.difference)) "; " }
        "required: " (required) (count) ")"
    }
}

fn table(table: &ComparisonTable, results: &Results) -> Result<Markup, String> {
    let rows = table
        .rows
        .iter()
        .map(|r| row(r, !table.beside.is_empty(), results))
        .collect::<Result<Vec<_>, _>>()?;
    Ok(html! {
        h3 { (table.title) }
        table.numbers {
            thead {
                tr {
                    th { "Quantity" } th { (table.against) } th { (table.ours) } th { "Difference" }
                    @if !table.beside.is_empty() { th { (table.beside) } }
                    th { "" }
                }
            }
            tbody { @for row in rows { (row) } }
        }
        @if !table.note.is_empty() { p.note { (table.note) } }
    })
}

fn row(row: &ComparisonRow, has_beside: bool, results: &Results) -> Result<Markup, String> {
    let ours = results.numbers(&row.ours)?;
    let beside = row.beside.as_ref().map(|beside| results.numbers(beside)).transpose()?;
    let paper = row.paper.as_ref().map(|paper| results.study.values.number(paper)).transpose()?;
    let origin = match &row.paper {
        Some(Quantity::Named(id)) => {
            results.study.values.find(id).map(|value| value.source.as_str())
        }
        _ => None,
    };
    let difference = paper.map(|paper| {
        let absolute = ours.mean() - paper;
        // A difference that stems from the rounding of a mean counts as none.
        if absolute.abs() <= 1e-12 * paper.abs() {
            return "0".to_string();
        }
        format!("{} ({})", signed(absolute), percent(&Numbers(vec![ours.mean() / paper - 1.0])))
    });
    Ok(html! {
        tr {
            td { (row.label) }
            td title=[origin] { @match paper { Some(paper) => (shown(paper)), None => "–" } }
            td { (several(&ours)) }
            td { (difference.as_deref().unwrap_or("–")) }
            @if has_beside { td { (beside.as_ref().map_or("–".into(), several)) } }
            td.remark { (row.note) }
        }
    })
}

fn overview(overview: &Overview, results: &Results) -> Markup {
    let mut rows = Vec::new();
    for id in &overview.runs {
        let Some(run) = results.study.run(id.get_ref()) else { continue };
        let numbers = overview.metrics.iter().map(|column| {
            let reference = format!("{}.{}", id.get_ref(), column.metric);
            let numbers =
                results.numbers(&reference).map_or_else(|_| Vec::new(), |numbers| numbers.0);
            Numbers(numbers.into_iter().map(|number| number * column.factor).collect())
        });
        rows.push((run, numbers.collect::<Vec<_>>()));
    }
    html! {
        h3 { (overview.title) }
        table.numbers.overview {
            thead { tr { th { "" } @for column in &overview.metrics { th { (column.label) } } } }
            tbody {
                @for (place, (run, numbers)) in rows.iter().enumerate() {
                    @if !run.group.is_empty() && (place == 0 || rows[place - 1].0.group != run.group) {
                        tr.group { th colspan=(overview.metrics.len() + 1) { (run.group) } }
                    }
                    tr {
                        td { span.swatch style=(format!("background:{}", run.color)) {} " " (run.label) }
                        @for numbers in numbers { td { (several(numbers)) } }
                    }
                }
            }
        }
        @if !overview.note.is_empty() { p.note { (overview.note) } }
    }
}

fn all_runs(results: &Results) -> Markup {
    html! {
        table {
            thead { tr { th { "Run" } th { "Experiment" } th { "Changes to it" } th { "Number of runs" } } }
            tbody {
                @for (run, result) in results.study.runs.iter().zip(&results.runs) {
                    tr {
                        td {
                            span.swatch style=(format!("background:{}", run.color)) {} " " (run.label)
                            @if !run.group.is_empty() { ", " (run.group) }
                        }
                        td { code { (run.experiment.display()) } }
                        td {
                            @for (name, fmu) in &run.fmu { code { (name) " = " (fmu) } " " }
                            @for (name, value) in &run.set { code { (name) " = " (value) } " " }
                            @for varied in run.varied() { code { (varied) " varies" } " " }
                        }
                        td { (result.cases()) }
                    }
                }
            }
        }
    }
}

fn all_values(results: &Results) -> Markup {
    let kind = |kind| match kind {
        ValueKind::Table => "table",
        ValueKind::Text => "text",
        ValueKind::Figure => "figure, read off",
        ValueKind::Computed => "not printed, computed",
    };
    html! {
        table {
            thead { tr { th { "Id" } th { "Value" } th { "Printed in" } th { "Source" } } }
            tbody {
                @for value in &results.study.values.0 {
                    tr {
                        td { code { (value.id) } }
                        td { (shown(value.value)) " " (value.unit) }
                        td { (kind(value.kind)) }
                        td { (value.source) }
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_of_a_figure_cannot_end_the_script_element() {
        let picture = figure::Figure {
            title: String::new(),
            columns: 1,
            legend: figure::Legend::Above,
            panels: vec![figure::Panel {
                title: "</script><b>".into(),
                x_label: String::new(),
                y_label: String::new(),
                log_x: false,
                x_range: None,
                curves: Vec::new(),
            }],
        };
        let text = plot("x", &picture).into_string();
        assert_eq!(text.matches("</").count(), 1, "{text}");
    }
}
