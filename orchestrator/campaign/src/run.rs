//! Flies a campaign on all cores, merges its parts, and writes tables and the report.

use crate::findings::{Answer, Findings, findings};
use crate::flight::{CaseStatus, Flight};
use crate::options::Options;
use crate::parts;
use crate::plan::Plan;
use crate::prepare::Recorded;
use crate::report;
use cosim::error::Error as Single;
use cosim::files;
use cosim::interrupt::Interrupt;
use cosim::system::Opened;
use cosim_metrics::folder::Folder;
use cosim_metrics::progress::Parts;
use serde::Serialize;
use std::collections::BTreeMap;
use std::fs;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::time::Instant;
use sweep::error::Error;
use sweep::flight::can_reset;
use sweep::parts::Remarks;
use sweep::statistics::{Probability, looks};
use sweep::table::{CaseTable, Reader, Values, Writer};
use sweep::work::{self, Worked};

/// Names of the files of a campaign's results.
pub const FILES: [&str; 4] = ["cases.parquet", "cases.csv", "summary.json", "report.html"];

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
pub struct Work {
    /// Number of cases that are needed, as far as the finished parts show.
    pub cases: u64,
    /// First and last-plus-one case of each part that is missing.
    pub missing: Vec<[u64; 2]>,
}

/// Returns the folder of a campaign's results.
pub fn folder(plan: &Plan, out: Option<&Path>) -> PathBuf {
    out.map_or_else(|| Path::new("out").join(plan.name()), Path::to_path_buf)
}

/// Parts that are found in the folder of the results.
struct State<'a> {
    plan: &'a Plan,
    out: &'a Path,
    /// Number of cases that broke each limit, by the first case of each part.
    broken_counts: BTreeMap<u64, Vec<u64>>,
    notes: Vec<String>,
    /// Whether instances can be reset, once this is known.
    resets: Option<bool>,
}

impl<'a> State<'a> {
    fn new(plan: &'a Plan, out: &'a Path) -> Self {
        Self { plan, out, broken_counts: BTreeMap::new(), notes: Vec::new(), resets: None }
    }

    /// Looks for the parts of the first `cases` cases, and returns those that are missing.
    fn missing(&mut self, cases: u64) -> Vec<Range<u64>> {
        let store = parts::store(self.plan, self.out);
        let mut missing = Vec::new();
        let mut remarks = Remarks::default();
        for part in parts::parts(self.plan.sweep.cases()).take_while(|part| part.start < cases) {
            if self.broken_counts.contains_key(&part.start) {
                continue;
            }
            if let Some(found) = remarks.take(store.find(&part)) {
                self.broken_counts.insert(part.start, parts::broken(self.plan, &found.rows));
            } else {
                missing.push(part);
            }
        }
        self.notes.extend(remarks.texts());
        missing
    }

    /// Returns the number of cases whose results are there.
    fn done(&self) -> u64 {
        let parts = parts::parts(self.plan.sweep.cases());
        let found = parts.filter(|part| self.broken_counts.contains_key(&part.start));
        found.map(|part| part.end - part.start).sum()
    }

    fn broken(&self, limit: usize, cases: u64) -> u64 {
        self.broken_counts.range(..cases).filter_map(|(_, broken)| broken.get(limit)).sum()
    }

    /// Returns whether instances can be reset. This is tried once.
    fn resets(&mut self, interrupt: &Interrupt) -> Result<bool, Single> {
        if let Some(resets) = self.resets {
            return Ok(resets);
        }
        let resets = can_reset(&self.plan.sweep, &mut Opened::default(), interrupt)?;
        if !resets {
            tracing::warn!(
                "a case gave another result after fmi2Reset than with a new instance: each case gets new instances"
            );
        }
        self.resets = Some(resets);
        Ok(resets)
    }

    /// Returns the number of cases that are needed as far as the parts show, and the answer to the
    /// campaign's question if it has one and the parts are all there.
    fn needed(&mut self) -> (u64, Vec<Range<u64>>, Option<Answer>) {
        let total = self.plan.sweep.cases();
        let Some(until) = &self.plan.campaign.until else {
            return (total, self.missing(total), None);
        };
        let mut limits = self.plan.campaign.limits.iter();
        let limit = limits.position(|limit| limit.id == until.limit).unwrap_or(0);
        let (counts, each) = looks(until.below, until.confidence, total, parts::LENGTH);
        let mut answer = None;
        for cases in counts {
            let missing = self.missing(cases);
            if !missing.is_empty() {
                return (cases, missing, None);
            }
            let broken = Probability::new(self.broken(limit, cases), cases, each);
            let is_decided = broken.high <= until.below || broken.low > until.below;
            let holds = is_decided.then_some(broken.high <= until.below);
            answer = Some(Answer {
                question: until.clone(),
                holds,
                broken,
                confidence_of_each_look: each,
            });
            if is_decided {
                return (cases, Vec::new(), answer);
            }
        }
        (total, Vec::new(), answer)
    }
}

/// Returns the remaining work of a campaign.
pub fn remaining(plan: &Plan, out: &Path) -> Work {
    let (cases, missing, _) = State::new(plan, out).needed();
    Work { cases, missing: missing.into_iter().map(|part| [part.start, part.end]).collect() }
}

/// Flies the parts that lie in a range of cases and are not there yet, and writes nothing else.
/// Several processes may do this at once in the same folder.
///
/// # Errors
/// Returns an error if the range does not consist of parts, or if a file cannot be written.
pub fn fly_range(plan: &Plan, range: &Range<u64>, options: &Options) -> Result<u64, Error> {
    let total = plan.sweep.cases();
    let is_edge = |case| parts::parts(total).any(|part| [part.start, part.end].contains(&case));
    if range.start >= range.end || !is_edge(range.start) || !is_edge(range.end) {
        let message = format!(
            "--cases {}..{}: the range must lie within 0..{total} and consist of parts, which --work lists",
            range.start, range.end,
        );
        return Err(Single::experiment(message).into());
    }
    let out = folder(plan, options.out.as_deref());
    let mut state = State::new(plan, &out);
    let missing = if options.fresh { Vec::new() } else { state.missing(range.end) };
    let requested = parts::parts(total).filter(|part| range.contains(&part.start));
    let requested: Vec<_> =
        requested.filter(|part| options.fresh || missing.contains(part)).collect();
    let flown = requested.iter().map(|part| part.end - part.start).sum();
    fly_parts(plan, &out, &requested, options, &mut state)?;
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
    let parts = parts::store(plan, &out).folder;
    if options.fresh && parts.is_dir() {
        fs::remove_dir_all(&parts).map_err(Single::file(&parts))?;
    }
    let mut state = State::new(plan, &out);
    let mut flown = 0;
    let (cases, answer) = loop {
        let (cases, missing, answer) = state.needed();
        if missing.is_empty() {
            break (cases, answer);
        }
        if flown == 0 {
            // An earlier report would not fit the new cases if the work is ended early.
            locked.remove(&FILES)?;
        }
        flown += missing.iter().map(|part| part.end - part.start).sum::<u64>();
        fly_parts(plan, &out, &missing, options, &mut state)?;
    };
    let notes = std::mem::take(&mut state.notes);
    let path = out.join("cases.parquet");
    merge(plan, &out, cases, options.csv)?;
    let table = Reader::open(&path)?;
    let findings = findings(plan, &table, answer)?;
    if findings.status[CaseStatus::Failed.name()] == cases {
        // Their common cause may lie outside, so none of them is kept.
        fs::remove_dir_all(&parts).map_err(Single::file(&parts))?;
        let first = match table.column("message")? {
            Values::Text(messages) => messages.into_iter().next().unwrap_or_default(),
            _ => String::new(),
        };
        return Err(Error::Failed(format!(
            "all {cases} cases failed, so there are no statistics: {first} ({} has every message, and the same command flies all cases again)",
            path.display()
        )));
    }
    check_values(plan, &table)?;
    files::write_json(&out.join("summary.json"), &findings)?;
    report::write(plan, &findings, &out, options)?;
    Ok(CampaignReport { findings, out, flown, elapsed: begin.elapsed().as_secs_f64(), notes })
}

/// Refuses limits on measures of which no completed case has a value.
fn check_values(plan: &Plan, table: &Reader) -> Result<(), Error> {
    let Values::Text(status) = table.column("status")? else { return Ok(()) };
    let completed: Vec<bool> =
        status.iter().map(|name| name == CaseStatus::Completed.name()).collect();
    for (limit, place) in plan.limits() {
        let Recorded { name, missing, .. } = &plan.recorded[place];
        let values = table.column(name)?.numbers();
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
    out: &Path,
    missing: &[Range<u64>],
    options: &Options,
    state: &mut State,
) -> Result<(), Error> {
    if missing.is_empty() {
        return Ok(());
    }
    let interrupt = &options.interrupt;
    let resets = state.resets(interrupt).map_err(|error| parts::of_case(0, error))?;
    let left: u64 = missing.iter().map(|part| part.end - part.start).sum();
    let done = state.done();
    let progress = Parts::new("cases", &plan.campaign.title, done + left, done, options.quiet);
    let Worked { results, failures } = work::on_parts(
        missing,
        work::threads(options.jobs, [&plan.sweep]),
        || Ok(Flight::new(plan, resets, interrupt)?),
        |flight, part| parts::fly(plan, out, part, flight, &progress),
        // The other parts are flown and kept, so that little is left for the next time.
        |error| matches!(error, Error::Case { .. }),
    );
    progress.finish();
    state.broken_counts.extend(results.into_iter().map(|(at, broken)| (missing[at].start, broken)));
    let (cases, mut others): (Vec<Error>, Vec<Error>) =
        failures.into_values().partition(|error| matches!(error, Error::Case { .. }));
    let more = cases.len().saturating_sub(1);
    others.extend(cases);
    match others.into_iter().next() {
        None => Ok(()),
        Some(Error::Single(Single::Interrupted { request, .. })) => {
            let what = "cases are flown";
            let total = plan.sweep.cases();
            Err(Error::Unfinished { what, done: state.done(), total, out: out.into(), request })
        }
        Some(Error::Case { case, source, .. }) => Err(Error::Case { case, more, source }),
        Some(error) => Err(error),
    }
}

/// Merges the parts of the first `cases` cases into one table.
fn merge(plan: &Plan, out: &Path, cases: u64, csv: bool) -> Result<(), Single> {
    let path = out.join("cases.csv");
    let fault = |error: csv::Error| Single::experiment(format!("cases.csv: {error}"));
    let mut text = csv.then(|| csv::Writer::from_path(&path)).transpose().map_err(fault)?;
    let mut writer = Writer::create(&out.join("cases.parquet"), &[("units", plan.units())])?;
    let store = parts::store(plan, out);
    for part in parts::parts(plan.sweep.cases()).take_while(|part| part.start < cases) {
        let rows = store.read(&part)?.rows;
        if let Some(text) = &mut text {
            if part.start == 0 {
                let names = rows.columns.iter().map(|column| column.name.as_str());
                text.write_record(names).map_err(fault)?;
            }
            write_csv(text, &rows).map_err(fault)?;
        }
        writer.add(rows)?;
    }
    if let Some(text) = &mut text {
        text.flush().map_err(Single::file(&path))?;
    }
    writer.finish()
}

fn write_csv(text: &mut csv::Writer<fs::File>, rows: &CaseTable) -> Result<(), csv::Error> {
    for row in 0..rows.rows() {
        let cell = |values: &Values| match values {
            Values::Real(values) => values[row].to_string(),
            Values::Optional(values) => values[row].map(|v| v.to_string()).unwrap_or_default(),
            Values::Count(values) => values[row].to_string(),
            Values::Integer(values) => values[row].to_string(),
            Values::Flag(values) => values[row].to_string(),
            Values::Text(values) => values[row].clone(),
        };
        text.write_record(rows.columns.iter().map(|column| cell(&column.values)))?;
    }
    Ok(())
}
