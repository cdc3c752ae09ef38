//! The report as one self-contained HTML page. The first screen has the main results: how many
//! claims hold, one picture and one small table. Everything else is folded.

mod evidence;
mod numbers;

use crate::claims::{Judged, Verdict};
use crate::definition::Study;
use crate::drawings::Figure;
use crate::results::{Results, RunResult};
use cosim_report::figure::{self, svg};
use cosim_report::page::{folded, head, script};
use evidence::claim;
use maud::{DOCTYPE, Markup, PreEscaped, html};
use numbers::{all_values, overview, small};

pub(crate) use numbers::table;

/// Returns the text of the page. `judged` belongs to the study's claims in order, `drawn` to its
/// figures, and `tables` to its tables; `origin` says where and how the runs were made.
pub(crate) fn page(
    results: &Results,
    judged: &[Judged],
    drawn: &[figure::Figure],
    tables: &[Markup],
    origin: &[(String, String)],
) -> String {
    let study = results.study;
    let claims: Vec<_> = study.claims.iter().zip(judged).map(|(c, j)| claim(c, j)).collect();
    let overviews = study.overviews.iter().map(|o| (&o.title, overview(o, results)));
    let tables = study.tables.iter().map(|table| &table.title).zip(tables.iter().cloned());
    let tables = tables.chain(overviews);
    let markup = html! {
        (DOCTYPE)
        html lang="en" {
            (head(&study.title))
            body {
                header {
                    h1 { (study.title) }
                    p.paper { (study.paper) }
                    @if !judged.is_empty() { p.answer { (answer(judged)) } }
                    nav {
                        @for (id, name) in sections(results) { a href=(format!("#{id}")) { (name) } " " }
                    }
                }
                main {
                    (lead(results, drawn))
                    @if !claims.is_empty() {
                    section.claims id="claims" {
                        h2 { "Claims, and whether they hold here" }
                        @for claim in &claims { (claim) }
                        p.note {
                            "A claim opens to its evidence. Differences are taken between runs with the same disturbance. Where a relation was "
                            "tried in several runs, the percentages say how often it holds, with 95\u{a0}% confidence (Clopper and Pearson)."
                        }
                    }
                    }
                    section id="about" {
                        h2 { "Compared quantities" }
                        @for paragraph in paragraphs(&study.summary) { p { (paragraph) } }
                        @if let Some(most) = study.most_cases {
                            p.note { "A quick look: of each run, at most " (most) " cases were flown. Texts name the full numbers." }
                        }
                    }
                    @if has_more_figures(results) { (figures(results, drawn)) }
                    section id="tables" {
                        h2 { "Numbers" }
                        @for (title, table) in tables { details { summary { h3 { (title) } } div.scroll { (table) } } }
                    }
                    (scenario(study))
                    (origins(results, origin))
                }
                (script())
            }
        }
    };
    markup.into_string()
}

/// Returns how many claims hold, in a sentence.
fn answer(judged: &[Judged]) -> String {
    let count = |verdict| judged.iter().filter(|judged| judged.verdict == verdict).count();
    let parts = [
        (Verdict::Holds, "hold", "holds"),
        (Verdict::HoldsPartly, "hold in part", "holds in part"),
        (Verdict::DoesNotHold, "do not hold", "does not hold"),
        (Verdict::NotJudged, "are not judged", "is not judged"),
    ];
    let parts = parts.into_iter().map(|(verdict, several, one)| (count(verdict), several, one));
    let texts: Vec<String> = parts
        .filter(|(count, ..)| *count > 0)
        .map(|(count, several, one)| format!("{count} {}", if count == 1 { one } else { several }))
        .collect();
    let (claims, of) = (judged.len(), texts.join(", "));
    match (claims, texts.len()) {
        (1, _) => format!("The claim {}.", of.trim_start_matches("1 ")),
        (_, 1) => {
            format!("All {claims} claims {}.", of.split_once(' ').map_or("", |(_, rest)| rest))
        }
        _ => format!("Of {claims} claims, {of}."),
    }
}

/// Returns the figure and the table that stand on the first screen, with the abbreviations that
/// they use.
fn lead(results: &Results, drawn: &[figure::Figure]) -> Markup {
    let study = results.study;
    let pictured = study.figures.first().zip(drawn.first());
    let first = study.overviews.first();
    let uses = |term: &str| {
        let titles = study.overviews.iter().flat_map(|o| o.metrics.iter().map(|m| &m.label));
        titles.chain(pictured.iter().map(|(_, picture)| &picture.panels[0].y_label)).any(|label| {
            label.split(|letter: char| !letter.is_alphanumeric()).any(|word| word == term)
        })
    };
    html! {
        section.lead id="answer" {
            @if let Some((figure, picture)) = pictured {
                figure id=(figure.id) {
                    h2 { (figure.title) }
                    div.plot { (PreEscaped(svg::element(picture))) }
                    (caption(figure))
                }
            }
            @if let Some(first) = first {
                div {
                    h2 { (first.title) }
                    (small(first, results))
                    p.note {
                        @for (term, meaning) in study.terms.iter().filter(|(term, _)| uses(term)) { b { (term) } ": " (meaning) ". " }
                        "Numbers are means over the runs; further down, brackets hold the smallest and the largest."
                    }
                }
            }
        }
    }
}

fn caption(figure: &Figure) -> Markup {
    html! {
        figcaption {
            (figure.caption) " "
            a href=(svg_file(figure)) { "SVG" } ", "
            a href=(format!("figures/{}.png", figure.id)) { "PNG" }
        }
    }
}

/// Returns the path of a figure's file beside the page.
fn svg_file(figure: &Figure) -> String {
    format!("figures/{}.svg", figure.id)
}

/// Returns whether there are figures besides the one on the first screen.
fn has_more_figures(results: &Results) -> bool {
    results.study.figures.len() > 1
}

/// Returns the section of the page that holds the other figures, folded.
fn figures(results: &Results, drawn: &[figure::Figure]) -> Markup {
    let others = results.study.figures.iter().zip(drawn).skip(1);
    html! {
        section id="figures" {
            h2 { "Figures" }
            p.note {
                "A pointer shows values, a dragged rectangle is enlarged, a double-click returns to the whole view, and a click on a name in a "
                "legend hides its curve. The folder " code { "figures" } " beside this page holds each figure as SVG and PNG."
            }
            @for (figure, picture) in others {
                details.figure {
                    summary { h3 { (figure.title) } }
                    figure id=(figure.id) {
                        (folded(&svg::element(picture)))
                        // Without scripts nothing unfolds the drawing: its file is shown instead.
                        noscript { img src=(svg_file(figure)) alt=(figure.title) loading="lazy"; }
                        (caption(figure))
                    }
                }
            }
        }
    }
}

/// Returns the parts with the scenario and the assumptions, folded.
fn scenario(study: &Study) -> Markup {
    let facts = study.scenario.iter().map(|fact| vec![&fact.what, &fact.value, &fact.source]);
    let assumed = study.assumptions.iter().map(|assumed| vec![&assumed.silent, &assumed.taken]);
    let title = "Assumptions where the paper is incomplete or in error";
    let heads = ["Gap or error in the paper", "Assumption made here"];
    html! {
        (folded_table("scenario", "Scenario", &["Quantity", "Value", "Source"], facts.collect()))
        (folded_table("assumptions", title, &heads, assumed.collect()))
    }
}

/// Returns a table with its heading, or nothing if it has no rows.
fn folded_table(id: &str, title: &str, heads: &[&str], rows: Vec<Vec<&String>>) -> Markup {
    html! {
        @if !rows.is_empty() { details id=(id) {
            summary { h2 { (title) } }
            div.scroll { table {
                thead { tr { @for head in heads { th { (head) } } } }
                tbody { @for row in rows { tr { @for cell in row { td { (cell) } } } } }
            } }
        } }
    }
}

/// Returns the part that says where the numbers come from, folded.
fn origins(results: &Results, origin: &[(String, String)]) -> Markup {
    let runs: usize = results.runs.iter().map(RunResult::cases).sum();
    html! {
        details id="origin" {
            summary { h2 { "Origin: how the numbers were computed" } }
            p {
                "Orchestrator " (env!("CARGO_PKG_VERSION")) " made " (runs) " simulation runs. All numbers of this page are in "
                code { "results.json" } ". The folder " code { "runs" } " holds the signals of the first run of each row below. "
                "A repetition gives the same bits, except for computing times."
            }
            @if !origin.is_empty() {
                div.scroll { table { tbody {
                    @for (what, value) in origin { tr { th scope="row" { (what) } td { code { (value) } } } }
                } } }
            }
            div.scroll { (all_runs(results)) }
            @if !results.study.values.0.is_empty() {
                h3 { "Reference values" }
                div.scroll { (all_values(results)) }
            }
        }
    }
}

/// Returns the ids and the names of the sections that the page has.
fn sections(results: &Results) -> impl Iterator<Item = (&'static str, &'static str)> {
    let study = results.study;
    let sections = [
        ("claims", "Claims", study.claims.is_empty()),
        ("about", "Compared quantities", study.summary.is_empty()),
        ("figures", "Figures", !has_more_figures(results)),
        ("tables", "Numbers", study.tables.is_empty() && study.overviews.is_empty()),
        ("scenario", "Scenario", study.scenario.is_empty()),
        ("assumptions", "Assumptions", study.assumptions.is_empty()),
        ("origin", "Origin", false),
    ];
    sections.into_iter().filter(|(.., empty)| !empty).map(|(id, name, _)| (id, name))
}

fn paragraphs(text: &str) -> impl Iterator<Item = &str> {
    text.split("\n\n").map(str::trim).filter(|paragraph| !paragraph.is_empty())
}

fn all_runs(results: &Results) -> Markup {
    html! {
        table {
            thead { tr { th { "Run" } th { "Experiment" } th { "Changes to it" } th { "Number of runs" } } }
            tbody {
                @for (run, result) in results.pairs() {
                    tr {
                        td {
                            (run.label)
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

#[cfg(test)]
mod tests;
