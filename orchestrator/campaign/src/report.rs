//! The report of a campaign: one self-contained page with verdicts, distributions, sensitivities
//! and the worst cases.

mod figures;

use crate::findings::{Findings, LimitFinding, Measured, worst};
use crate::plan::Plan;
use crate::sensitivity::Sensitivity;
use cosim::error::Error;
use cosim::files;
use cosim_report::figure::{Figure, with_unit};
use cosim_report::page::{Page, Section, figure, paragraphs, table, verdict};
use maud::{Markup, html};
use std::path::Path;
use sweep::statistics::{Probability, Summary};
use sweep::table::CaseTable;
use sweep::texts::{percent, shown};
use sweep::varied::Varied;
use sweep::vary::DesignKind;

/// Number of the worst cases that the page shows.
const SHOWN: usize = 5;

/// Writes `report.html`.
///
/// # Errors
/// Returns an error if the file cannot be written.
pub(crate) fn write(
    plan: &Plan,
    findings: &Findings,
    cases: &CaseTable,
    out: &Path,
) -> Result<(), Error> {
    let ranked = ranking(plan).map(|name| (name, worst(&cases.numbers(name), SHOWN)));
    let histograms = figures::distributions(plan, cases);
    let mut pictures: Vec<Figure> = histograms.into_iter().collect();
    pictures.extend(figures::scatters(plan, cases));
    let page = page(plan, findings, &pictures, ranked);
    files::write(&out.join("report.html"), page)
}

/// Returns the measure that orders the cases: that of the first limit, or the first one.
fn ranking(plan: &Plan) -> Option<&str> {
    let limited = plan.campaign.limits.first().map(|limit| limit.measure.get_ref());
    limited.or(plan.recorded.first().map(|recorded| &recorded.name)).map(String::as_str)
}

fn page(
    plan: &Plan,
    findings: &Findings,
    figures: &[Figure],
    ranked: Option<(&str, Vec<u64>)>,
) -> String {
    let campaign = &plan.campaign;
    let experiment = &plan.sweep.experiment().title;
    let figures = html! { @for drawn in figures { (figure(drawn, &html! {})) } };
    let sensitivity = html! {
        @for measure in &findings.measures { (tornado(measure)) }
        (sensitivity_note(plan))
    };
    let page = Page {
        title: campaign.title.clone(),
        about: format!("{} of the experiment {experiment}", cases(findings.cases)),
        answer: String::new(),
        sections: vec![
            Section { content: paragraphs(&campaign.description), ..Section::default() },
            Section::new("limits", "Limits", limits(plan, findings)),
            Section::new("measures", "Measures", measures(&findings.measures)),
            Section::new("figures", "Figures", figures).headed(""),
            Section::new("sensitivity", "Sensitivity", sensitivity),
            Section::new("worst", "Worst cases", worst_cases(plan, ranked)),
            Section::new("varied", "Varied parameters", varied(plan)),
        ],
    };
    page.text()
}

fn worst_cases(plan: &Plan, ranked: Option<(&str, Vec<u64>)>) -> Markup {
    html! {
        @if let Some((name, cases)) = ranked {
            p { "These cases have the largest values of " code { (name) } ", in descending order. Each command runs a case again and records all of its variables:" }
            ul { @for case in cases { li { code { (plan.changes.command.replace("CASE", &case.to_string())) } } } }
        }
    }
}

fn varied(plan: &Plan) -> Markup {
    let design = serde_json::json!(plan.campaign.design);
    let rows = plan.sweep.varied.iter().map(|varied| {
        let Varied { name, unit, distribution, .. } = varied;
        vec![html! { code { (name) } }, html! { (unit) }, html! { (distribution.in_words()) }]
    });
    html! {
        (table(&["Parameter", "Unit", "Distribution"], rows))
        p.note {
            "Design: " (design.as_str().unwrap_or_default()) ", seed " (plan.campaign.seed)
            ". A case depends on the seed and its number alone. "
            code { "cases.parquet" } " holds all cases, and " code { "summary.json" } " the numbers of this page. "
            "Written by orchestrator " (env!("CARGO_PKG_VERSION")) "."
        }
    }
}

fn limits(plan: &Plan, findings: &Findings) -> Markup {
    let ended = |name: &str| findings.status.get(name).copied().unwrap_or(0);
    html! {
        p {
            (cases(ended("completed"))) " completed"
            @for (status, words) in [("ended", "ended early by an FMU"), ("lost", "lost"), ("failed", "failed")] {
                @if ended(status) > 0 { ", " (ended(status)) " " (words) }
            }
            "."
        }
        @if findings.limits.is_empty() { p { "The campaign defines no limits." } }
        @else { (limit_table(&findings.limits, plan.campaign.design)) }
    }
}

fn limit_table(limits: &[LimitFinding], design: DesignKind) -> Markup {
    let rows = limits.iter().map(|LimitFinding { says, broken, .. }| {
        let is_kept = broken.events == 0;
        vec![
            html! { (says) },
            html! { (broken.events) " of " (broken.cases) },
            html! { (percent(broken.share)) },
            html! { (interval(broken)) },
            verdict(Some(is_kept), if is_kept { "kept by all" } else { "broken" }),
        ]
    });
    html! {
        (table(&["Limit", "Broken by", "Share", "Probability, 95 % interval", ""], rows))
        p.note {
            "A case that was lost, failed or ended early counts as breaking every limit. The intervals are those of Clopper and Pearson. "
            "If no case broke the limit, the number is the upper bound that this many cases prove. "
            @if design != DesignKind::Random {
                "The intervals are exact for independent cases. Where cases are not drawn by probability (corners, levels), their share says "
                "nothing about how often a limit is broken."
            }
        }
    }
}

fn interval(probability: &Probability) -> String {
    match probability.events {
        0 => format!("≤ {}", shown(probability.high)),
        _ => format!("{} to {}", shown(probability.low), shown(probability.high)),
    }
}

/// Returns a number of cases in words.
fn cases(count: u64) -> String {
    if count == 1 { "1 case".into() } else { format!("{count} cases") }
}

/// Returns the standard deviation as text. A single case has none.
fn deviation(summary: &Summary) -> String {
    if summary.deviation.is_finite() { shown(summary.deviation) } else { "–".into() }
}

/// Headings of the table of measures; those from the fourth on are quantiles.
const HEADINGS: [&str; 12] = [
    "Measure",
    "Cases",
    "Mean",
    "Standard deviation",
    "Smallest",
    "5 %",
    "Median",
    "95 %",
    "99 %",
    "99.9 %",
    "Largest",
    "Case of the largest",
];

fn measures(measures: &[Measured]) -> Markup {
    let rows = measures.iter().map(|measure| {
        let mut row = vec![html! {
            (with_unit(&measure.words, &measure.unit)) br; code { (measure.name) }
        }];
        let Some(summary) = &measure.summary else {
            row.push(html! { "no case has a value" });
            return row;
        };
        row.push(html! { (summary.cases) });
        row.push(html! { (shown(summary.mean)) });
        row.push(html! { (deviation(summary)) });
        row.extend(summary.quantiles.iter().map(|quantile| {
            let interval = quantile.low.zip(quantile.high).map(|(low, high)| [low, high]);
            with_interval(&shown(quantile.value), interval.map(|ends| ends.map(shown)))
        }));
        row.push(html! { (summary.worst) });
        row
    });
    html! {
        (table(&HEADINGS, rows))
        p.note { "The 95 % interval of a quantile is below it; its ends are values of the sample." }
    }
}

/// Returns a number with its interval below, if it has one.
fn with_interval(number: &str, interval: Option<[String; 2]>) -> Markup {
    html! {
        (number)
        @if let Some([low, high]) = interval { br; span.note { (low) " to " (high) } }
    }
}

/// Returns a p-value as text. A very small one is not written as 0.
fn chance(p_value: f64) -> String {
    if p_value < 1e-4 { "< 0.0001".into() } else { shown(p_value) }
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

/// Returns the parameters in the order of their weight, as bars.
fn tornado(measure: &Measured) -> Markup {
    let weight = |row: &Sensitivity| row.rank_correlation.map_or(0.0, f64::abs);
    let mut rows: Vec<&Sensitivity> =
        measure.sensitivities.iter().filter(|row| row.rank_correlation.is_some()).collect();
    rows.sort_by(|a, b| weight(b).total_cmp(&weight(a)));
    let cells = rows.iter().take(20).filter_map(|row| {
        let value = row.rank_correlation?;
        Some(vec![
            html! { code { (row.parameter) } },
            html! { (format!("{value:.3}").replace('-', "−")) },
            bar(value),
            html! { (row.p_value.map_or(String::new(), chance)) },
        ])
    });
    html! {
        @if !rows.is_empty() {
            h3 { (measure.words) }
            (table(&["Parameter", "Rank correlation", "", "p-value"], cells))
        }
    }
}

/// Says what the numbers of the sensitivities mean.
fn sensitivity_note(plan: &Plan) -> Markup {
    let seeds = plan.sweep.varied.iter().filter(|varied| varied.is_seed());
    let seeds: Vec<&str> = seeds.map(|varied| varied.name.as_str()).collect();
    html! {
        p.note {
            "Spearman's rank correlation is 1 or −1 if the measure only rises or only falls with the parameter. "
            "A small p-value says that a correlation this large would hardly arise by chance. "
            @if !seeds.is_empty() {
                "The seeds (" (seeds.join(", ")) ") have no sensitivity, because their order has no meaning."
            }
        }
    }
}
