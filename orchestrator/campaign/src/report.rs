//! The report of a campaign: one self-contained page with verdicts, distributions, sensitivities
//! and the worst cases.

mod cloud;
mod figures;

use crate::findings::{Answer, Findings, LimitFinding, Measured, chosen, worst};
use crate::flight::Flight;
use crate::options::Options;
use crate::plan::Plan;
use crate::sensitivity::{Estimate, Sensitivity};
use cosim::error::Error;
use cosim::files;
use cosim_report::figure::{Figure, svg, with_unit};
use cosim_report::page::{head, script};
use maud::{DOCTYPE, Markup, PreEscaped, html};
use std::collections::BTreeSet;
use std::path::Path;
use sweep::statistics::{Probability, Summary};
use sweep::table::Reader;
use sweep::texts::{percent, short};
use sweep::vary::DesignKind;

/// Number of the worst cases that the page shows.
const SHOWN: usize = 5;

/// Writes `report.html`, and the full results of the cases that are kept.
///
/// # Errors
/// Returns an error if a file cannot be read or written, or if the work was asked to end.
pub fn write(plan: &Plan, findings: &Findings, out: &Path, options: &Options) -> Result<(), Error> {
    let table = Reader::open(&out.join("cases.parquet"))?;
    let mut flight = Flight::new(plan, false, &options.interrupt)?;
    let kept_cases = chosen(plan, &table)?;
    keep(plan, &mut flight, &kept_cases, out)?;
    let ranking = ranking(plan);
    let ranked = match &ranking {
        Some(name) => worst(&table.column(name)?.numbers(), SHOWN),
        None => Vec::new(),
    };
    let mut pictures = figures::distributions(plan, findings, &table)?;
    pictures.extend(figures::scatters(plan, &table)?);
    if let Some(worst) = ranked.first() {
        pictures.extend(cloud::draw(plan, *worst, table.rows(), options)?);
    }
    let page = page(plan, findings, &pictures, &kept_cases, ranking.zip(Some(ranked)).as_ref());
    files::write(&out.join("report.html"), page)
}

/// Returns the measure that orders the cases: the one that is asked for, or that of the first
/// limit.
fn ranking(plan: &Plan) -> Option<String> {
    let by = plan.campaign.keep.by.as_ref().map(|by| by.get_ref().clone());
    let limited = || plan.campaign.limits.first().map(|limit| limit.measure.get_ref().clone());
    by.or_else(limited).or_else(|| plan.recorded.first().map(|recorded| recorded.name.clone()))
}

/// Flies cases again and writes their full results.
fn keep(plan: &Plan, flight: &mut Flight, cases: &BTreeSet<u64>, out: &Path) -> Result<(), Error> {
    for case in cases {
        let folder = out.join("cases").join(case.to_string());
        let title = format!("{}, case {case}", plan.campaign.title);
        let values = plan.sweep.values(*case);
        let text = plan.sweep.experiment_of(&title, &values)?;
        files::write(&folder.join("case.toml"), text)?;
        flight.keep(*case, values, &folder, &title)?;
    }
    Ok(())
}

fn page(
    plan: &Plan,
    findings: &Findings,
    figures: &[Figure],
    kept_cases: &BTreeSet<u64>,
    ranked: Option<&(String, Vec<u64>)>,
) -> String {
    let campaign = &plan.campaign;
    let markup = html! {
        (DOCTYPE)
        html lang="en" {
            (head(&campaign.title))
            body {
                header {
                    h1 { (campaign.title) }
                    p.paper { (cases(findings.cases)) " of the experiment " (plan.sweep.experiment().title) }
                    nav {
                        a href="#limits" { "Limits" } " "
                        a href="#measures" { "Measures" } " "
                        a href="#figures" { "Figures" } " "
                        a href="#sensitivity" { "Sensitivity" } " "
                        a href="#worst" { "Worst cases" } " "
                        a href="#varied" { "Varied parameters" }
                    }
                }
                main {
                    @for paragraph in campaign.description.split("\n\n").filter(|text| !text.trim().is_empty()) {
                        p { (paragraph) }
                    }
                    (limits(plan, findings))
                    section id="measures" {
                        h2 { "Measures" }
                        (measures(&findings.measures))
                    }
                    div id="figures" {
                        @for figure in figures {
                            figure { h3 { (figure.title) } div.plot { (PreEscaped(svg::element(figure))) } }
                        }
                    }
                    section id="sensitivity" {
                        h2 { "Sensitivity" }
                        @for measure in &findings.measures { (tornado(measure)) }
                        (sensitivity_note(plan))
                    }
                    (worst_cases(plan, kept_cases, ranked))
                    (varied(plan))
                }
                (script())
            }
        }
    };
    markup.into_string()
}

fn worst_cases(
    plan: &Plan,
    kept_cases: &BTreeSet<u64>,
    ranked: Option<&(String, Vec<u64>)>,
) -> Markup {
    html! {
        section id="worst" {
            h2 { "Worst cases" }
            @if let Some((name, cases)) = ranked {
                p { "These cases have the largest values of " code { (name) } ", in descending order. Each command runs a case again and records all of its variables:" }
                ul { @for case in cases { li { code { (plan.command.of_case(*case)) } } } }
            }
            @if !kept_cases.is_empty() {
                p {
                    "The folder " code { "cases" } " holds the full results of "
                    (if kept_cases.len() == 1 { "case " } else { "the cases " })
                    @for (i, case) in kept_cases.iter().take(200).enumerate() { @if i > 0 { ", " } (case) }
                    @if kept_cases.len() > 200 { ", …" }
                }
            }
        }
    }
}

fn varied(plan: &Plan) -> Markup {
    let design = serde_json::json!(plan.campaign.design);
    html! {
        section id="varied" {
            h2 { "Varied parameters" }
            table {
                thead { tr { th { "Parameter" } th { "Unit" } th { "Distribution" } } }
                tbody { @for varied in &plan.sweep.varied {
                    tr { td { code { (varied.name) } } td { (varied.unit) } td { (varied.distribution.in_words()) } }
                } }
            }
            p.note {
                "Design: " (design.as_str().unwrap_or_default()) ", seed " (plan.campaign.seed)
                ". A case depends on the seed and its number alone. "
                code { "cases.parquet" } " holds all cases, and " code { "summary.json" } " the numbers of this page. "
                "Written by orchestrator " (env!("CARGO_PKG_VERSION")) "."
            }
        }
    }
}

fn answered(answer: &Answer) -> Markup {
    let (class, word) = match answer.holds {
        Some(true) => ("verdict holds", "yes"),
        Some(false) => ("verdict not", "no"),
        None => ("verdict partly", "not decided"),
    };
    html! {
        p {
            "Is the probability of breaking " code { (answer.question.limit) } " below "
            (answer.question.below) ", with " (percent(answer.question.confidence)) " confidence? "
            span class=(class) { (word) }
            " (" (answer.broken.events) " of " (answer.broken.cases) " cases broke it)"
        }
    }
}

fn limits(plan: &Plan, findings: &Findings) -> Markup {
    let ended = |name: &str| findings.status.get(name).copied().unwrap_or(0);
    html! {
        section id="limits" {
            h2 { "Limits" }
            p {
                (cases(ended("completed"))) " completed"
                @for (status, words) in [("ended", "ended early by a limit or an FMU"), ("lost", "lost"), ("failed", "failed")] {
                    @if ended(status) > 0 { ", " (ended(status)) " " (words) }
                }
                "."
            }
            @if let Some(answer) = &findings.answer { (answered(answer)) }
            @if findings.limits.is_empty() { p { "The campaign defines no limits." } }
            @else { (limit_table(&findings.limits, plan.campaign.design)) }
        }
    }
}

fn limit_table(limits: &[LimitFinding], design: DesignKind) -> Markup {
    html! {
        table.numbers {
            thead { tr {
                th { "Limit" } th { "Broken by" } th { "Share" } th { "Probability, 95 % interval" } td {}
            } }
            tbody { @for limit in limits { tr {
                td { (limit.says) }
                td { (limit.broken.events) " of " (limit.broken.cases) }
                td { (percent(limit.broken.share)) }
                td { (interval(&limit.broken)) }
                td { @if limit.broken.events == 0 { span class="verdict holds" { "kept by all" } }
                     @else { span class="verdict not" { "broken" } } }
            } } }
        }
        p.note {
            "A case that was lost, failed or ended early counts as breaking every limit. The intervals are those of Clopper and Pearson. "
            "If no case broke the limit, the number is the upper bound that this many cases prove. "
            @if design != DesignKind::Random {
                "The intervals are exact for independent cases, but this design spreads its cases more evenly. Where cases are not drawn by "
                "probability (corners, levels), their share says nothing about how often a limit is broken."
            }
        }
    }
}

fn interval(probability: &Probability) -> String {
    match probability.events {
        0 => format!("≤ {}", short(probability.high)),
        _ => format!("{} to {}", short(probability.low), short(probability.high)),
    }
}

/// Returns a number of cases in words.
fn cases(count: u64) -> String {
    if count == 1 { "1 case".into() } else { format!("{count} cases") }
}

/// Returns the standard deviation as text. A single case has none.
fn deviation(summary: &Summary) -> String {
    if summary.deviation.is_finite() { short(summary.deviation) } else { "–".into() }
}

fn measures(measures: &[Measured]) -> Markup {
    html! {
        table.numbers {
            thead { tr {
                th { "Measure" } th { "Cases" } th { "Mean" } th { "Standard deviation" } th { "Smallest" } th { "5 %" } th { "Median" } th { "95 %" }
                th { "99 %" } th { "99.9 %" } th { "Largest" } th { "Case of the largest" }
            } }
            tbody { @for measure in measures { tr {
                td { (with_unit(&measure.words, &measure.unit)) br; code { (measure.name) } }
                @if let Some(summary) = &measure.summary {
                    td { (summary.cases) } td { (short(summary.mean)) } td { (deviation(summary)) }
                    @for quantile in &summary.quantiles {
                        td {
                            (short(quantile.value))
                            @if let (Some(low), Some(high)) = (quantile.low, quantile.high) {
                                br; span.note { (short(low)) " to " (short(high)) }
                            }
                        }
                    }
                    td { (summary.worst) }
                } @else { td colspan="11" { "no case has a value" } }
            } } }
        }
        p.note { "The 95 % interval of a quantile is below it; its ends are values of the sample." }
    }
}

/// Returns a p-value as text. A very small one is not written as 0.
fn chance(p_value: f64) -> String {
    if p_value < 1e-4 { "< 0.0001".into() } else { short(p_value) }
}

/// Width of the scale of a bar, from -1 to 1, rem.
const SCALE: f64 = 12.0;

/// Returns a bar from the middle of a scale to a value from -1 to 1.
fn bar(value: f64) -> Markup {
    let (half, length) = (SCALE / 2.0, SCALE / 2.0 * value.abs());
    let from = if value < 0.0 { half - length } else { half };
    let scale = "display: inline-block; white-space: nowrap; background: linear-gradient(currentColor, currentColor) 50% / 1px 100% no-repeat";
    html! {
        span style=(format!("{scale}; width: {SCALE}rem")) {
            span class=(if value < 0.0 { "bar negative" } else { "bar" })
                style=(format!("margin-left: {from:.2}rem; width: {length:.2}rem")) {}
        }
    }
}

/// Returns a number with its interval below.
fn estimated(estimate: Option<Estimate>) -> Markup {
    let text = |value: f64| format!("{value:.3}").replace('-', "−");
    html! {
        @if let Some(Estimate { value, low, high }) = estimate {
            (text(value)) br; span.note { (text(low)) " to " (text(high)) }
        }
    }
}

/// Returns the parameters in the order of their weight, as bars.
fn tornado(measure: &Measured) -> Markup {
    let weight = |row: &Sensitivity| {
        row.total.or(row.rank_correlation).map_or(0.0, |estimate| estimate.value.abs())
    };
    let mut rows: Vec<&Sensitivity> =
        measure.sensitivities.iter().filter(|row| row.rank_correlation.is_some()).collect();
    rows.sort_by(|a, b| weight(b).total_cmp(&weight(a)));
    let has_indices = measure.noise.is_some() || rows.iter().any(|row| row.total.is_some());
    html! {
        @if !rows.is_empty() || measure.noise.is_some() {
            h3 { (measure.words) }
            table.numbers {
                thead { tr {
                    th { "Parameter" } th { "Rank correlation" } td {} th { "p-value" }
                    @if has_indices { th { "First-order index" } th { "Total index" } }
                } }
                tbody {
                    @for row in rows.iter().take(20) { tr {
                        td { code { (row.parameter) } }
                        td { (estimated(row.rank_correlation)) }
                        td { @if let Some(correlation) = row.rank_correlation { (bar(correlation.value)) } }
                        td { (row.p_value.map_or(String::new(), chance)) }
                        @if has_indices { td { (estimated(row.first_order)) } td { (estimated(row.total)) } }
                    } }
                    @if measure.noise.is_some() { tr {
                        td { "noise of the seeds" } td { } td { } td { }
                        td { (estimated(measure.noise)) } td { }
                    } }
                }
            }
        }
    }
}

/// Says what the numbers of the sensitivities mean.
fn sensitivity_note(plan: &Plan) -> Markup {
    let seeds = plan.sweep.varied.iter().filter(|varied| varied.is_seed());
    let seeds: Vec<&str> = seeds.map(|varied| varied.name.as_str()).collect();
    let has_indices = plan.campaign.design == DesignKind::Sensitivity;
    html! {
        p.note {
            "Spearman's rank correlation is 1 or −1 if the measure only rises or only falls with the parameter. "
            "A small p-value says that a correlation this large would hardly arise by chance. The 95 % interval of a number is below it. "
            @if has_indices {
                "An index is a share of the variance of the measure: the first-order index is that which the parameter explains by itself, "
                "the total index that in which it takes part. The remainder of the sum of all first-order indices is the share of interactions. "
            }
            @if !seeds.is_empty() {
                "The seeds (" (seeds.join(", ")) ") have no sensitivity, because their order has no meaning. "
                @if has_indices { "The share of their noise is the correlation of two points that have only the seeds in common." }
                @else { "Their noise is part of the share that no parameter explains." }
            }
        }
    }
}
