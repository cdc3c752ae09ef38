//! The commands `campaign` and `falsify`.

use crate::arguments;
use crate::failure::Failure;
use campaign::changes::Changes;
use campaign::definition::Campaign;
use campaign::findings::Findings;
use campaign::options::Options;
use campaign::plan::Plan;
use campaign::run;
use campaign::search;
use clap::Args;
use cosim::error::Error;
use cosim::experiment::Overrides;
use cosim::files;
use cosim::interrupt::Interrupt;
use cosim::search::named::{Kind, find};
use fmu_import::law;
use std::io::Write;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::time::Duration;
use sweep::statistics::CONFIDENCE;

/// Options that the commands `campaign` and `falsify` share.
#[derive(Args)]
pub(crate) struct Common {
    /// Campaign: a file, or the name of one that `list` shows.
    campaign: PathBuf,
    /// Experiment that replaces that of the campaign: a file, or the name of an experiment.
    #[arg(long, value_name = "EXPERIMENT")]
    experiment: Option<PathBuf>,
    /// Folder for the results [default: out/CAMPAIGN].
    #[arg(long, value_name = "DIR", help_heading = "Results")]
    out: Option<PathBuf>,
    /// Also look for FMUs in this folder, besides those of the experiment and the program. The
    /// option may be given several times.
    #[arg(long, value_name = "DIR")]
    fmu_dir: Vec<PathBuf>,
    /// Number of threads [default: one for each core].
    #[arg(long, value_name = "N", default_value_t = 0, hide_default_value = true)]
    jobs: usize,
    /// Show neither progress nor summary.
    #[arg(long)]
    quiet: bool,
    // Its heading would apply to all arguments that follow.
    #[command(flatten)]
    pub(crate) overrides: arguments::Overrides,
}

/// Options of `campaign`.
#[derive(Args)]
pub(crate) struct Fly {
    /// Write the experiment of one case to a file that `orchestrator run` takes, and run it with
    /// everything recorded.
    #[arg(long, value_name = "K", help_heading = "Part of the campaign", conflicts_with_all = ["cases", "work", "fresh", "csv"])]
    case: Option<u64>,
    /// Fly only the cases from FIRST up to, but not including, LAST. A later command for the whole
    /// campaign merges them. Several processes may work in the same folder at once.
    #[arg(long, value_name = "FIRST..LAST", help_heading = "Part of the campaign", value_parser = range, allow_hyphen_values = true, conflicts_with_all = ["work", "csv"])]
    cases: Option<Range<u64>>,
    /// Print which parts of the campaign are not flown yet, as JSON, and fly no case.
    #[arg(long, help_heading = "Part of the campaign", conflicts_with_all = ["fresh", "csv"])]
    work: bool,
    /// Fly all cases again, including those that are finished.
    #[arg(long, visible_alias = "force", help_heading = "Results")]
    fresh: bool,
    /// Also write the results table as cases.csv.
    #[arg(long, help_heading = "Results")]
    csv: bool,
    #[command(flatten)]
    pub(crate) common: Common,
}

/// Options of `falsify`.
#[derive(Args)]
pub(crate) struct Falsify {
    /// Begin no further cases after this time, s.
    #[arg(long, value_name = "SECONDS", value_parser = clap::value_parser!(u64).range(1..))]
    time: Option<u64>,
    /// Replace the results of an earlier search in the folder.
    #[arg(long, help_heading = "Results")]
    force: bool,
    #[command(flatten)]
    pub(crate) common: Common,
}

fn range(text: &str) -> Result<Range<u64>, String> {
    let number = |text: &str| text.trim().parse::<u64>().ok();
    let ends = text.split_once("..").and_then(|(a, b)| Some((number(a)?, number(b)?)));
    let (first, last) = ends.ok_or("expected two whole numbers, for example 0..250")?;
    Ok(first..last)
}

fn prepare(common: &Common) -> Result<Plan, Error> {
    let campaign = Campaign::load(&find(&common.campaign, Kind::Campaign)?)?;
    let overrides = common.overrides.clone().into();
    let experiment = common.experiment.clone();
    let changes = Changes { experiment, overrides };
    Plan::new(campaign, &changes, &common.fmu_dir)
}

/// Flies a campaign, a part of it, or one case.
///
/// # Errors
/// Returns an error if the campaign is faulty, or if a file cannot be written.
pub(crate) fn fly(asked: &Fly, out: &mut impl Write, interrupt: &Interrupt) -> Result<(), Failure> {
    let plan = prepare(&asked.common)?;
    let folder = run::folder(&plan, asked.common.out.as_deref());
    if asked.work {
        let work =
            serde_json::to_string(&run::remaining(&plan, &folder)).map_err(std::io::Error::from)?;
        writeln!(out, "{work}")?;
        return Ok(());
    }
    if let Some(case) = asked.case {
        if case >= plan.sweep.cases() {
            let message = format!(
                "--case {case}: the campaign has {} cases, counted from 0",
                plan.sweep.cases()
            );
            return Err(Error::experiment(message).into());
        }
        let folder = match &asked.common.out {
            Some(folder) => folder.clone(),
            None => folder.join("cases").join(case.to_string()),
        };
        let experiment = write_case(&plan, case, &folder)?;
        let options = crate::run::Options {
            out: Some(folder),
            quiet: asked.common.quiet,
            force: true,
            interrupt: interrupt.clone(),
            ..Default::default()
        };
        let fmu_dirs = &asked.common.fmu_dir;
        let law = Overrides::from(asked.common.overrides.clone()).law;
        let overrides = Overrides { law, ..Overrides::default() };
        law::in_case(Some(case));
        return crate::run::run(&experiment, &overrides, fmu_dirs, &options, out);
    }
    let options = Options {
        out: asked.common.out.clone(),
        jobs: asked.common.jobs,
        fresh: asked.fresh,
        quiet: asked.common.quiet,
        csv: asked.csv,
        interrupt: interrupt.clone(),
    };
    if let Some(cases) = &asked.cases {
        let flown = run::fly_range(&plan, cases, &options)?;
        if !asked.common.quiet {
            writeln!(out, "{flown} cases flown, kept in {}", folder.join("parts").display())?;
        }
        return Ok(());
    }
    let report = run::fly(&plan, &options)?;
    if !asked.common.quiet {
        summary(&report, out)?;
    }
    Ok(())
}

/// Writes the experiment of a case.
fn write_case(plan: &Plan, case: u64, folder: &Path) -> Result<PathBuf, Error> {
    let title = format!("{}, case {case}", plan.campaign.title);
    let text = plan.sweep.experiment_of(&title, &plan.sweep.values(case))?;
    let path = folder.join("case.toml");
    files::write(&path, text)?;
    Ok(path)
}

fn summary(report: &run::CampaignReport, out: &mut impl Write) -> std::io::Result<()> {
    let Findings { title, cases, status, limits, measures, answer } = &report.findings;
    let rate = report.flown as f64 / report.elapsed;
    writeln!(out, "{title}")?;
    let several = if *cases == 1 { "case" } else { "cases" };
    writeln!(
        out,
        "  {cases} {several}, {} flown now in {:.1} s ({rate:.0} per second)",
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
    if let Some(answer) = answer {
        let word = match answer.holds {
            Some(true) => "yes",
            Some(false) => "no",
            None => "not decided",
        };
        writeln!(
            out,
            "  P({} broken) < {} with {} %: {word}",
            answer.question.limit,
            answer.question.below,
            100.0 * answer.question.confidence
        )?;
    }
    writeln!(out, "  {}", report.out.join("report.html").display())
}

/// Looks for the worst case of a campaign.
///
/// # Errors
/// Returns an error if the campaign is faulty, or if a file cannot be written.
pub(crate) fn falsify(
    asked: &Falsify,
    out: &mut impl Write,
    interrupt: &Interrupt,
) -> Result<(), Failure> {
    let plan = prepare(&asked.common)?;
    let options = search::Options {
        out: asked.common.out.clone(),
        jobs: asked.common.jobs,
        time: asked.time.map(Duration::from_secs),
        quiet: asked.common.quiet,
        force: asked.force,
        interrupt: interrupt.clone(),
    };
    let outcome = search::search(&plan, &options)?;
    if asked.common.quiet {
        return Ok(());
    }
    let largest = outcome.largest;
    writeln!(out, "{}", outcome.title)?;
    writeln!(
        out,
        "  largest {}: {largest:.6} {} ({} cases in {:.0} s, {} searches; {})",
        outcome.measure,
        outcome.unit,
        outcome.cases,
        outcome.elapsed,
        outcome.searches,
        outcome.ended
    )?;
    if !outcome.broken.is_empty() {
        writeln!(out, "  breaks {}", outcome.broken.join(", "))?;
    }
    writeln!(out, "  orchestrator run {}", outcome.out.join("worst.toml").display())?;
    writeln!(out, "  {}", outcome.out.join("report.html").display())?;
    Ok(())
}
