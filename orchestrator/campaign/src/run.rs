//! Flies a campaign on all cores, merges its parts, and writes tables and the report.

use crate::findings::{Findings, findings};
use crate::flight::{CaseStatus, Flight, table};
use crate::plan::Plan;
use crate::prepare::Recorded;
use crate::report;
use cosim::error::Error as Single;
use cosim::files;
use cosim::system::Opened;
use cosim_metrics::folder::Folder;
use serde::Serialize;
use std::fs;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::time::Instant;
use sweep::error::Error;
use sweep::flight::can_reset;
use sweep::parts::{self, PartResult, Store};
use sweep::runner::{self, Options, Part, Work};
use sweep::table::CaseTable;

/// Folder of the parts among the results.
const PARTS: &str = "parts";

/// Names of the files of a campaign's results.
pub const FILES: [&str; 3] = ["cases.parquet", "summary.json", "report.html"];

/// Report on a campaign that was flown.
#[derive(Debug)]
pub struct CampaignReport {
    /// Findings over all cases.
    pub findings: Findings,
    /// Folder of the results.
    pub out: PathBuf,
    /// Number of cases that were flown now.
    pub flown: u64,
    /// Elapsed time, s.
    pub elapsed: f64,
    /// Remarks, for example why cases were flown again.
    pub notes: Vec<String>,
}

/// Remaining work of a campaign, for programs that share it among machines.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Remaining {
    /// Number of all cases.
    pub cases: u64,
    /// First and last-plus-one case of each part that is missing.
    pub missing: Vec<[u64; 2]>,
}

/// Returns the folder of a campaign's results.
pub fn folder(plan: &Plan, out: Option<&Path>) -> PathBuf {
    out.map_or_else(|| Path::new("out").join(plan.name()), Path::to_path_buf)
}

fn work<'a>(plan: &'a Plan, out: &'a Path) -> Work<'a> {
    let store = Store { folder: out.join(PARTS), keys: &plan.sweep.keys };
    Work::new(&plan.campaign.title, out, vec![store])
}

/// Returns the parts of a campaign.
fn all_parts(plan: &Plan) -> impl Iterator<Item = Part> {
    parts::parts(plan.sweep.cases()).map(|cases| Part { sweep: 0, cases })
}

/// Returns the remaining work of a campaign.
pub fn remaining(plan: &Plan, out: &Path) -> Remaining {
    let missing = work(plan, out).missing(all_parts(plan));
    let missing = missing.into_iter().map(|Part { cases, .. }| [cases.start, cases.end]);
    Remaining { cases: plan.sweep.cases(), missing: missing.collect() }
}

/// Flies the parts that begin in a range of cases and are not there yet, and writes nothing else.
/// Several processes may do this at once in the same folder.
///
/// # Errors
/// Returns an error if there are no such cases, or if a file cannot be written.
pub fn fly_range(plan: &Plan, range: &Range<u64>, options: &Options) -> Result<u64, Error> {
    let total = plan.sweep.cases();
    if range.start >= range.end || range.end > total {
        let (start, end) = (range.start, range.end);
        let message = format!("--cases {start}..{end}: the range must lie within 0..{total}");
        return Err(Single::experiment(message).into());
    }
    let out = folder(plan, options.out.as_deref());
    let mut work = work(plan, &out);
    let requested = all_parts(plan).filter(|part| range.contains(&part.cases.start));
    let requested = if options.fresh { requested.collect() } else { work.missing(requested) };
    let flown = requested.iter().map(Part::count).sum();
    fly_parts(plan, &requested, options, &mut work)?;
    Ok(flown)
}

/// Flies the remaining cases of a campaign, and writes its tables and its report.
///
/// # Errors
/// Returns an error if a file cannot be written, or if the work was asked to end; what was flown by
/// then is kept.
pub fn fly(plan: &Plan, options: &Options) -> Result<CampaignReport, Error> {
    let begin = Instant::now();
    let out = folder(plan, options.out.as_deref());
    let locked = Folder::take_for_many(&out)?;
    let parts = out.join(PARTS);
    if options.fresh && parts.is_dir() {
        fs::remove_dir_all(&parts).map_err(Single::file(&parts))?;
    }
    let mut work = work(plan, &out);
    let missing = work.missing(all_parts(plan));
    if !missing.is_empty() {
        // An earlier report would not fit the new cases if the work is ended early.
        locked.remove(&FILES)?;
    }
    let flown = missing.iter().map(Part::count).sum();
    fly_parts(plan, &missing, options, &mut work)?;
    let path = out.join("cases.parquet");
    let mut table = CaseTable::default();
    for part in all_parts(plan) {
        table.append(work.stores[0].read(&part.cases)?.rows);
    }
    table.write(&path, plan.units())?;
    let findings = findings(plan, &table);
    let cases = findings.cases;
    if findings.status[CaseStatus::Failed.name()] == cases {
        // Their common cause may lie outside, so none of them is kept.
        fs::remove_dir_all(&parts).map_err(Single::file(&parts))?;
        let first = table.texts("message").first().map_or("", String::as_str);
        return Err(Error::Failed(format!(
            "all {cases} cases failed, so there are no statistics: {first} ({} has every message, and the same command flies all cases again)",
            path.display()
        )));
    }
    check_values(plan, &table)?;
    files::write_json(&out.join("summary.json"), &findings)?;
    report::write(plan, &findings, &table, &out)?;
    let (elapsed, notes) = (begin.elapsed().as_secs_f64(), std::mem::take(&mut work.notes));
    Ok(CampaignReport { findings, out: out.clone(), flown, elapsed, notes })
}

/// Refuses limits on measures of which no completed case has a value.
fn check_values(plan: &Plan, table: &CaseTable) -> Result<(), Error> {
    let status = table.texts("status").iter();
    let completed: Vec<bool> = status.map(|name| name == CaseStatus::Completed.name()).collect();
    for (limit, place) in plan.limits() {
        let Recorded { name, missing, .. } = &plan.recorded[place];
        let values = table.numbers(name);
        let is_seen = values.iter().zip(&completed).any(|(value, is)| *is && !value.is_nan());
        if missing.is_none() && !is_seen && completed.contains(&true) {
            return Err(Error::Failed(format!(
                "no case has a value of {name}, so the limit {} cannot be judged",
                limit.id
            )));
        }
    }
    Ok(())
}

/// Flies parts on several threads.
fn fly_parts(
    plan: &Plan,
    missing: &[Part],
    options: &Options,
    work: &mut Work,
) -> Result<(), Error> {
    if missing.is_empty() {
        return Ok(());
    }
    let interrupt = &options.interrupt;
    let system = plan.sweep.system(&mut Opened::default())?;
    let try_it = || can_reset(&plan.sweep, &mut Opened::default(), interrupt);
    let resets = system.apart(interrupt, try_it).map_err(|error| of_case(0, error))?;
    let threads = runner::threads(options.jobs, [&plan.sweep]);
    work.fly(
        missing,
        (threads, plan.sweep.cases()),
        (&[system], options),
        || Ok(Flight::new(plan, resets, interrupt)?),
        |flight, part, progress| {
            let rows = part.cases.clone().map(|case| {
                let row = flight.fly(case).map_err(|error| of_case(case, error));
                progress.advance(1);
                row
            });
            let rows = table(plan, &rows.collect::<Result<Vec<_>, _>>()?);
            Ok(PartResult { rows, curves: String::new() })
        },
        |part, case, error| of_case(case.unwrap_or(part.cases.start), error),
    )
}

/// Names the case in which an FMU could not be flown.
fn of_case(case: u64, error: Single) -> Error {
    Error::of_case(format!("case {case}"), error)
}
