//! The page of a run, or of several: curves with a common cursor, the vehicle in motion, the
//! summary and the parameters. One file without a network.

mod data;
pub mod figure;
mod numbers;
mod plans;
pub(crate) mod thin;

use crate::figure::{Figure, Legend, svg};
use crate::page::document;
use crate::recording::panels::Panel;
use crate::recording::{Parameter, Recording, SummaryLine, trajectory};
use cosim::error::Error;
use cosim::files;
use maud::{Markup, PreEscaped, html};
use std::collections::BTreeMap;
use std::path::Path;

const STYLES: [&str; 2] = [include_str!("../shared.css"), include_str!("page.css")];
const GUARANTEE: &str = include_str!("../guarantee.js");
const VEHICLE: &str = include_str!("../vehicle3d.js");
const CHARTS: &str = include_str!("../chart.js");
const INSTRUMENTS: &str = include_str!("instruments.js");
const PLAYER: &str = include_str!("../player.js");
const PAGE: &str = include_str!("page.js");

/// Largest number of runs whose vehicles are shown.
const VEHICLES: usize = 2;

/// Writes the page of these runs with these panels.
///
/// # Errors
/// Returns an error if the file cannot be written.
pub fn write(runs: &[Recording], panels: &[Panel], path: &Path) -> Result<(), Error> {
    files::write(path, page(runs, panels))
}

fn page(runs: &[Recording], panels: &[Panel]) -> String {
    let title = runs.first().map_or("", |run| run.title.as_str());
    let heading = match runs.len() {
        0 | 1 => title.to_string(),
        _ => runs.iter().map(|run| run.name.as_str()).collect::<Vec<_>>().join(" · "),
    };
    let vehicles: Vec<usize> =
        (0..runs.len()).filter(|run| data::has_vehicle(&runs[*run])).collect();
    let vehicles = if vehicles.len() > VEHICLES { &[] } else { &vehicles[..] };
    // A script element ends at its closing tag, wherever that stands.
    let json = data::page(runs, panels, vehicles).to_string().replace("</", "<\\/");
    let layout = match vehicles.len() {
        0 => "plain",
        1 => "single",
        _ => "pair",
    };
    let body = html! {
        header {
            h1 { (heading) }
            @if runs.len() > 1 { ul { @for run in runs { li { b { (run.name) } ": " (run.title) } } } }
            @for run in runs { (verdict(run, runs.len() > 1)) }
        }
        (player())
        main class=(layout) {
            @if !vehicles.is_empty() {
                section id="vehicles" aria-label="Vehicle" {
                    @for run in vehicles { (vehicle(*run, &runs[*run], runs.len() > 1)) }
                    p.note { "Drag to turn the view, double click to turn it back." }
                }
            }
            div id="pictures" {
                (flight(runs))
                @if vehicles.iter().any(|run| plans::of(&runs[*run]).is_some()) { (guarantee()) }
                section id="curves" aria-label="Curves" {
                    p.note { "Drag over curves to look closer, and click twice to see all." }
                }
            }
            section id="summary" { h2 { "Summary" } (summary(runs)) }
            section id="parameters" { h2 { "Parameters" } (parameters(runs)) }
            section id="origin" { h2 { "Origin" } (origin(runs)) }
        }
        script type="application/json" id="run-data" { (PreEscaped(json)) }
        @for script in [VEHICLE, CHARTS, GUARANTEE, PLAYER, INSTRUMENTS, PAGE] { script { (PreEscaped(script)) } }
    };
    document(&heading, &STYLES, &body)
}

/// Returns the outcome of a run in one line: the comparisons with limits, and how the run ended.
fn verdict(run: &Recording, named: bool) -> Markup {
    let of = |verdict| {
        let lines = run.summary.iter().filter(move |line| line.is_within == Some(verdict));
        lines.map(|line| line.heading.as_str()).collect::<Vec<_>>().join(", ")
    };
    let (exceeded, kept) = (of(false), of(true));
    let completed = run.status == "completed" || run.status.is_empty();
    html! {
        p.verdict {
            @if named { (run.name) ": " }
            @if !exceeded.is_empty() {
                span.light.bad {} "Beyond a limit: " (exceeded) ". "
            } @else if !kept.is_empty() && completed {
                span.light.good {}
            }
            @if !kept.is_empty() { "Within the limit: " (kept) "." }
            @if !completed { " " (run.status) "." }
        }
    }
}

fn player() -> Markup {
    html! {
        section id="player" aria-label="Playback" {
            button id="play" type="button" aria-label="Play" title="Space" { "▶" }
            input id="seek" type="range" aria-label="Time";
            output id="time" for="seek" {}
            label { span { "speed " } select id="speed" aria-label="Speed" {} }
            div id="guarantees" {}
        }
    }
}

fn vehicle(place: usize, run: &Recording, named: bool) -> Markup {
    html! {
        div.vehicle data-run=(place) {
            @if named { h2 { (run.name) } }
            canvas.view aria-label=(format!("Attitude of the vehicle, {}", run.name)) role="img" {}
            div.surfaces {}
            div.jets {}
        }
    }
}

/// Returns the place of the picture of plan, tube and bound.
fn guarantee() -> Markup {
    html! {
        section id="guarantee" aria-label="Guarantee" {
            p.note {
                "At each optimisation the law plans (thin line) and knows how far it can be pushed off \
                 its plan (blue tube). It accepts a plan only if the whole tube stays under the limit, \
                 that is, if the plan stays under its bound (edge of the grey area). Flown: thick." span id="ghost" {}
            }
            canvas id="plan" role="img" aria-label="Norms of body rates and moment as they were flown and planned at the chosen time, with tube, bound and limit" {}
        }
    }
}

/// Returns altitude over speed and the ground track, if they are recorded.
fn flight(runs: &[Recording]) -> Markup {
    let names: Vec<String> = runs.iter().map(|run| run.name.clone()).collect();
    let panels = trajectory::panels(runs, &names);
    let drawn = |panel: crate::figure::Panel| {
        let title = panel.title.clone();
        let (panels, legend) = (vec![panel], Legend::Each);
        svg::half(&Figure { title, columns: 1, legend, panels })
    };
    html! {
        @if !panels.is_empty() {
            section id="flight" aria-label="Flight" {
                @for panel in panels { figure.plot { (PreEscaped(drawn(panel))) } }
            }
        }
    }
}

/// Returns the headings of all summaries with the texts of each run.
fn summary(runs: &[Recording]) -> Markup {
    let mut lines: Vec<(&str, Vec<Option<&SummaryLine>>)> = Vec::new();
    for (place, run) in runs.iter().enumerate() {
        for line in &run.summary {
            let there = lines.iter().position(|(other, _)| *other == line.heading);
            let position = there.unwrap_or(lines.len());
            if position == lines.len() {
                lines.push((&line.heading, vec![None; runs.len()]));
            }
            lines[position].1[place] = Some(line);
        }
    }
    html! {
        @if lines.is_empty() { p.note { "The experiment defines no metrics." } }
        div.scroll tabindex="0" role="region" aria-label="Summary" { table {
            @if runs.len() > 1 { thead { tr { td {} @for run in runs { th { (run.name) } } } } }
            tbody { @for (heading, told) in &lines { tr {
                th scope="row" {
                    (heading)
                    @if let Some(meaning) = told.iter().flatten().map(|line| &line.meaning).find(|m| !m.is_empty()) {
                        small { (meaning) }
                    }
                }
                @for line in told { td class=[line.filter(|line| line.is_within == Some(false)).map(|_| "bad")] {
                    (line.map_or(String::new(), |line| line.text.replace(" %", "\u{a0}%")))
                } }
            } } }
        } }
    }
}

fn parameters(runs: &[Recording]) -> Markup {
    let mut rows: BTreeMap<&str, Vec<Option<&Parameter>>> = BTreeMap::new();
    for (place, run) in runs.iter().enumerate() {
        for parameter in &run.parameters {
            rows.entry(&parameter.name).or_insert_with(|| vec![None; runs.len()])[place] =
                Some(parameter);
        }
    }
    let differs = |values: &[Option<&Parameter>]| {
        values.iter().any(|value| value.map(|v| &v.text) != values[0].map(|v| &v.text))
    };
    let is_set = |values: &[Option<&Parameter>]| values.iter().flatten().any(|value| value.is_set);
    html! {
        div.search {
            input id="search" type="search" placeholder="Search name or value" aria-label="Search parameters";
            label { input id="set-only" type="checkbox" checked; " set by the experiment" }
            @if runs.len() > 1 { label { input id="different-only" type="checkbox"; " that differ" } }
            output id="found" for="search" {}
        }
        div.scroll tabindex="0" role="region" aria-label="Parameters" { table id="parameter-table" {
            @if runs.len() > 1 { thead { tr { td {} @for run in runs { th { (run.name) } } } } }
            tbody { @for (name, values) in &rows {
                tr data-set[is_set(values)] data-differs[differs(values)] {
                    th scope="row" { code { (name) } }
                    @for value in values { td { (value.map_or("", |value| value.text.as_str())) } }
                }
            } }
        } }
    }
}

fn origin(runs: &[Recording]) -> Markup {
    html! { details {
        summary { "Where these values come from" }
        @for run in runs {
            @if runs.len() > 1 { h3 { (run.name) } }
            dl { @for (heading, text) in &run.origin { dt { (heading) } dd { (text) } } }
        }
    } }
}
