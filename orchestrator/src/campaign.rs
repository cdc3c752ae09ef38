//! The command `campaign`.

use crate::arguments::{Many, Subject};
use crate::failure::Failure;
use crate::run::{self, Run};
use campaign::definition::Campaign;
use campaign::findings::Findings;
use campaign::plan::{Changes, Plan};
use campaign::run as flights;
use campaign::search::{self, SearchOutcome};
use clap::Args;
use cosim::error::Error;
use cosim::experiment::{Overrides, name_of};
use cosim::interrupt::Interrupt;
use cosim::search::named::{Kind, find};
use cosim_metrics::progress;
use fmu_import::law;
use std::env;
use std::io::Write;
use std::ops::Range;
use std::path::PathBuf;
use sweep::statistics::CONFIDENCE;

/// Options of `campaign`.
#[derive(Args)]
pub(crate) struct Fly {
    /// Campaign: a file, or the name of one that `list` shows.
    campaign: PathBuf,
    /// Experiment that replaces that of the campaign: a file, or the name of an experiment.
    #[arg(long, value_name = "EXPERIMENT")]
    experiment: Option<PathBuf>,
    /// Look for the worst case instead, as [search] of the campaign says, and write it as an
    /// experiment and report.html.
    #[arg(long, help_heading = "Search")]
    worst: bool,
    #[command(flatten)]
    many: Many,
    // The headings of these would apply to all arguments that follow.
    #[command(flatten)]
    part: Part,
    #[command(flatten)]
    pub(crate) overrides: Overrides,
}

/// Options that fly a part of a campaign.
#[derive(Args)]
#[command(next_help_heading = "Part of the campaign")]
struct Part {
    /// Write the experiment of one case to a file that `orchestrator run` takes, and run it with
    /// everything recorded.
    #[arg(long, value_name = "K", conflicts_with_all = ["cases", "work", "worst", "fresh"])]
    case: Option<u64>,
    /// Fly only the parts that begin at a case from FIRST up to, but not including, LAST. A later
    /// command for the whole campaign merges them. Several processes may work in the same folder at
    /// once.
    #[arg(long, value_name = "FIRST..LAST", value_parser = range, allow_hyphen_values = true, conflicts_with_all = ["work", "worst"])]
    cases: Option<Range<u64>>,
    /// Print which parts of the campaign are not flown yet, as JSON, and fly no case.
    #[arg(long, conflicts_with_all = ["worst", "fresh"])]
    work: bool,
}

fn range(text: &str) -> Result<Range<u64>, String> {
    let number = |text: &str| text.trim().parse::<u64>().ok();
    let ends = text.split_once("..").and_then(|(a, b)| Some((number(a)?, number(b)?)));
    let (first, last) = ends.ok_or("expected two whole numbers, for example 0..250")?;
    Ok(first..last)
}

/// Flies a campaign, a part of it, or one case, or looks for its worst case.
///
/// # Errors
/// Returns an error if the campaign is faulty, or if a file cannot be written.
pub(crate) fn fly(asked: &Fly, out: &mut impl Write, interrupt: &Interrupt) -> Result<(), Failure> {
    let campaign = Campaign::load(&find(&asked.campaign, Kind::Campaign)?)?;
    let overrides = asked.overrides.clone();
    let command = match overrides.law.as_deref().map(name_of) {
        Some(law) => {
            format!("campaign(\"{}\", law={law}).case(CASE)", campaign.source.path.display())
        }
        None => command_of_case(),
    };
    let experiment = asked.experiment.clone();
    let changes = Changes { experiment, overrides: overrides.clone(), command };
    let plan = Plan::new(campaign, changes, &asked.many.fmu_dir)?;
    let folder = flights::folder(&plan, asked.many.out.as_deref());
    if asked.part.work {
        let work = serde_json::to_string(&flights::remaining(&plan, &folder))
            .map_err(std::io::Error::from)?;
        writeln!(out, "{work}")?;
        return Ok(());
    }
    if let Some(case) = asked.part.case {
        return fly_case(&plan, case, asked, overrides, out, interrupt);
    }
    let options = asked.many.options(interrupt);
    if asked.worst {
        let outcome = search::search(&plan, &options)?;
        if !asked.many.quiet {
            worst(&outcome, out)?;
        }
    } else if let Some(cases) = &asked.part.cases {
        let flown = flights::fly_range(&plan, cases, &options)?;
        if !asked.many.quiet {
            writeln!(out, "{flown} cases flown, kept in {}", folder.join("parts").display())?;
        }
    } else {
        let report = flights::fly(&plan, &options)?;
        if !asked.many.quiet {
            summary(&report, out)?;
        }
    }
    Ok(())
}

/// Returns the command that flies one case: this one, without what concerns all cases.
fn command_of_case() -> String {
    let mut kept = vec!["orchestrator".to_string()];
    let mut words = env::args().skip(1);
    while let Some(word) = words.next() {
        match &*word {
            "--quiet" | "--fresh" | "--force" => {}
            "--jobs" | "--out" => drop(words.next()),
            _ if word.starts_with("--jobs=") || word.starts_with("--out=") => {}
            _ if word.chars().all(|c| c.is_alphanumeric() || "-_./=+:".contains(c)) => {
                kept.push(word);
            }
            _ => kept.push(format!("'{word}'")),
        }
    }
    kept.join(" ") + " --case CASE"
}

/// Runs one case with everything recorded.
fn fly_case(
    plan: &Plan,
    case: u64,
    asked: &Fly,
    overrides: Overrides,
    out: &mut impl Write,
    interrupt: &Interrupt,
) -> Result<(), Failure> {
    let cases = plan.sweep.cases();
    if case >= cases {
        let message = format!("--case {case}: the campaign has {cases} cases, counted from 0");
        return Err(Error::experiment(message).into());
    }
    let folder = asked.many.out.clone();
    let folder =
        folder.unwrap_or_else(|| flights::folder(plan, None).join("cases").join(case.to_string()));
    let experiment = plan.write_case(case, &folder)?;
    let Overrides { law, process, .. } = overrides;
    let overrides = Overrides { law, process, ..Overrides::default() };
    law::in_case(Some(case));
    let subject = Subject { experiment, fmu_dir: asked.many.fmu_dir.clone(), overrides };
    let quiet = asked.many.quiet;
    let run = Run { subject, out: Some(folder), quiet, force: true, ..Run::default() };
    run::run(&run, out, interrupt)
}

fn summary(report: &flights::CampaignReport, out: &mut impl Write) -> std::io::Result<()> {
    let Findings { title, cases, status, limits, measures } = &report.findings;
    let rate = progress::rate(report.flown as f64 / report.elapsed);
    writeln!(out, "{title}")?;
    let several = if *cases == 1 { "case" } else { "cases" };
    writeln!(
        out,
        "  {cases} {several}, {} flown now in {:.1} s ({rate})",
        report.flown, report.elapsed
    )?;
    for note in &report.notes {
        writeln!(out, "  {note}")?;
    }
    let others = status.iter().filter(|(name, count)| **name != "completed" && **count > 0);
    for (name, count) in others {
        writeln!(out, "  {name}: {count}")?;
    }
    for limit in limits {
        let broken = limit.broken;
        let bound = if broken.events == 0 {
            format!("probability at most {:.3e}", broken.high)
        } else {
            format!("probability {:.3e} to {:.3e}", broken.low, broken.high)
        };
        writeln!(
            out,
            "  {}: broken by {} of {}, {bound} ({:.0} %)",
            limit.says,
            broken.events,
            broken.cases,
            100.0 * CONFIDENCE
        )?;
    }
    for measure in measures {
        let Some(summary) = &measure.summary else { continue };
        let quantile = |probability: f64| {
            let mut quantiles = summary.quantiles.iter();
            let quantile = quantiles.find(|quantile| quantile.probability == probability);
            quantile.map_or(f64::NAN, |quantile| quantile.value)
        };
        writeln!(
            out,
            "  {}: mean {:.4}, 99 % {:.4}, largest {:.4} {} (case {})",
            measure.name,
            summary.mean,
            quantile(0.99),
            quantile(1.0),
            measure.unit,
            summary.worst
        )?;
    }
    writeln!(out, "  {}", report.out.join("report.html").display())
}

fn worst(outcome: &SearchOutcome, out: &mut impl Write) -> std::io::Result<()> {
    let SearchOutcome { title, measure, largest, unit, cases, elapsed, searches, ended, .. } =
        outcome;
    writeln!(out, "{title}")?;
    writeln!(
        out,
        "  largest {measure}: {largest:.6} {unit} ({cases} cases in {elapsed:.0} s, {searches} searches; {ended})"
    )?;
    if !outcome.broken.is_empty() {
        writeln!(out, "  breaks {}", outcome.broken.join(", "))?;
    }
    writeln!(out, "  orchestrator run {}", outcome.out.join("worst.toml").display())?;
    writeln!(out, "  {}", outcome.out.join("report.html").display())
}
