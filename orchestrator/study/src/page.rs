//! The report as one self-contained HTML page. The first screen has the main results: how many
//! claims hold, one picture and one small table. Everything else is folded.

mod evidence;
mod numbers;

use crate::claims::{Judged, Verdict};
use crate::comparisons::Overview;
use crate::definition::Study;
use crate::drawings::Figure;
use crate::results::{Results, RunResult};
use cosim_report::figure::{self, svg};
use cosim_report::page::{Page, Section, folded, paragraphs, table};
use evidence::claim;
use maud::{Markup, PreEscaped, html};
use numbers::{all_values, overview, small};

pub(crate) use numbers::comparison;

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
    let with_counts = |o| html! { (overview(o, results)) (counts(results, o)) };
    let overviews = study.overviews.iter().map(|o| (&o.title, with_counts(o)));
    let tables = study.tables.iter().map(|table| &table.title).zip(tables.iter().cloned());
    let tables = html! {
        @for (title, table) in tables.chain(overviews) {
            details { summary { h3 { (title) } } (table) }
        }
    };
    let about = paragraphs(&study.summary);
    let quickly = quickly(study).map(|quickly| format!(" This is {quickly}."));
    let failed = results.failures().map(|told| format!(" {told}."));
    let told = answer(judged) + &quickly.unwrap_or_default() + &failed.unwrap_or_default();
    let claims = Section {
        class: Some("claims"),
        ..Section::new("claims", "Claims", claims(study, judged))
    };
    let lead = Section {
        id: "answer",
        class: Some("lead"),
        content: lead(results, drawn),
        ..Section::default()
    };
    let page = Page {
        title: study.title.clone(),
        about: study.paper.clone(),
        answer: told,
        sections: vec![
            lead,
            claims.headed("Claims, and whether they hold here"),
            Section::new("about", "Compared quantities", about),
            Section::new("figures", "Figures", figures(results, drawn)),
            Section::new("tables", "Numbers", tables),
            Section::new("assumptions", "Assumptions", assumed(study))
                .headed("Assumptions where the paper is incomplete or in error")
                .folded(),
            Section::new("origin", "Origin", origins(results, origin))
                .headed("Origin: how the numbers were computed")
                .folded(),
        ],
    };
    page.text()
}

/// Returns the claims with their verdicts and the evidence behind them.
fn claims(study: &Study, judged: &[Judged]) -> Markup {
    html! {
        @for (described, judged) in study.claims.iter().zip(judged) { (claim(described, judged)) }
        @if !judged.is_empty() {
            p.note {
                "A claim opens to its evidence. Differences are taken between runs with the same disturbance. Where a relation was "
                "tried in several runs, the percentages say how often it holds, with 95\u{a0}% confidence (Clopper and Pearson)."
            }
        }
    }
}

/// Says that verdicts rest on a part of the cases, if they do.
pub(crate) fn quickly(study: &Study) -> Option<String> {
    let most = study.most_cases?;
    let s = if most == 1 { "" } else { "s" };
    Some(format!("a quick look at {most} case{s} of each run at most, not the whole study"))
}

/// Returns how many cases the runs of an overview had, in a note; nothing if each had one.
fn counts(results: &Results, overview: &Overview) -> Markup {
    let shown = results.pairs().filter(|(run, _)| overview.runs.contains(&run.id));
    let counts: Vec<_> = shown.map(|(_, result)| result.cases()).collect();
    let ends = counts.iter().min().zip(counts.iter().max());
    html! { @if let Some((least, most)) = ends && *most > 1 {
        p.note {
            @if least == most { (most) " cases of each run." } @else { (least) " to " (most) " cases of a run." }
        }
    } }
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
        (0, _) => String::new(),
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
                (counts(results, first))
                p.note {
                    @for (term, meaning) in study.terms.iter().filter(|(term, _)| uses(term)) { b { (term) } ": " (meaning) ". " }
                    "Numbers are means over the cases, the largest where there is a limit; further down, brackets hold the smallest "
                    "and the largest."
                }
            }
        }
    }
}

fn caption(figure: &Figure) -> Markup {
    html! {
        figcaption {
            (figure.caption) " "
            a href=(svg_file(figure)) { "SVG" }
        }
    }
}

/// Returns the path of a figure's file beside the page.
fn svg_file(figure: &Figure) -> String {
    format!("figures/{}.svg", figure.id)
}

/// Returns the figures besides the first one, folded.
fn figures(results: &Results, drawn: &[figure::Figure]) -> Markup {
    let others = || results.study.figures.iter().zip(drawn).skip(1);
    html! {
        @if others().next().is_some() {
            p.note {
                "A pointer shows values, a dragged rectangle is enlarged, a double-click returns to the whole view, and a click on a name in a "
                "legend hides its curve. The folder " code { "figures" } " beside this page holds each figure as SVG."
            }
        }
        @for (figure, picture) in others() {
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

/// Returns a table of the assumptions, or nothing if there are none.
fn assumed(study: &Study) -> Markup {
    let rows = study.assumptions.iter();
    let rows = rows.map(|assumed| vec![html! { (assumed.silent) }, html! { (assumed.taken) }]);
    let headings = ["Gap or error in the paper", "Assumption made here"];
    html! { @if !study.assumptions.is_empty() { (table(&headings, rows)) } }
}

/// Returns where the numbers come from.
fn origins(results: &Results, origin: &[(String, String)]) -> Markup {
    let runs: usize = results.runs.iter().map(RunResult::cases).sum();
    let known =
        origin.iter().map(|(what, value)| vec![html! { (what) }, html! { code { (value) } }]);
    html! {
        p {
            "Orchestrator " (env!("CARGO_PKG_VERSION")) " made " (runs) " simulation runs. All numbers of this page are in "
            code { "results.json" } ", and the folder " code { "runs" } " keeps what a repetition need not fly again. "
            "A repetition gives the same bits, except for computing times."
        }
        (table(&[], known))
        (all_runs(results))
        @if !results.study.values.0.is_empty() {
            h3 { "Reference values" }
            (all_values(results))
        }
    }
}

fn all_runs(results: &Results) -> Markup {
    let rows = results.pairs().map(|(run, result)| {
        let name = html! { (run.label) @if !run.group.is_empty() { ", " (run.group) } };
        let changes = html! {
            @for (name, fmu) in &run.fmu { code { (name) " = " (fmu) } " " }
            @for (name, value) in &run.set { code { (name) " = " (value) } " " }
            @for varied in &run.seeds { code { (varied.get_ref()) " varies" } " " }
        };
        let experiment = html! { code { (run.experiment.display()) } };
        vec![name, experiment, changes, html! { (result.cases()) }]
    });
    table(&["Run", "Experiment", "Changes to it", "Number of runs"], rows)
}
