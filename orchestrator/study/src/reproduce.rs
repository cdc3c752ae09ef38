//! Runs a study on all cores, stores the finished parts, and writes the report.
//!
//! The work is divided into parts. The results of a finished part are written to a file at once,
//! together with a hash of everything that they depend on. A part whose file exists with the same
//! hash is not run again. An interruption therefore costs only the parts that were being worked on.

use crate::claims;
use crate::definition::Study;
use crate::output::{Judgement, Report, notes};
use crate::part::{Bench, Part, Preparation};
use crate::results::{Results, RunResult};
use crate::runs::Run;
use cosim::error::Error as Single;
use cosim::experiment::Overrides;
use cosim::interrupt::Interrupt;
use cosim::system::Opened;
use cosim_metrics::folder::Folder;
use cosim_metrics::progress::Parts;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::Instant;
use sweep::error::Error;
use sweep::parts::{self, PartResult, Remarks, Store};
use sweep::work::{self, Worked};
use toml::Spanned;

/// Number of cases of a run that make up one part.
const CASES_PER_PART: u64 = 25;

/// Options for the reproduction of a study.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// Folder for the results; `out/<folder of the study>` if it is not given.
    pub out: Option<PathBuf>,
    /// Further folders in which FMUs are looked for.
    pub fmu_dirs: Vec<PathBuf>,
    /// Changes of the command line to all experiments.
    pub overrides: Overrides,
    /// Number of threads; 0 means one for each core.
    pub jobs: usize,
    /// Whether parts that are complete already are run again.
    pub fresh: bool,
    /// Whether the progress display is suppressed.
    pub quiet: bool,
    /// Interrupt through which the work can be ended from outside.
    pub interrupt: Interrupt,
}

/// Report on a study that was reproduced.
#[derive(Debug)]
pub struct StudyReport {
    /// Title of the study.
    pub title: String,
    /// Path of the report page.
    pub page: PathBuf,
    /// Number of parts that were run, and number of parts that were complete already.
    pub parts: (usize, usize),
    /// Number of simulations in all parts.
    pub runs: usize,
    /// Elapsed time of the reproduction, s.
    pub elapsed: f64,
    /// Remarks on runs whose parameter has no effect or that lose the attitude.
    pub notes: Vec<String>,
    /// Claims of the study, each with its verdict.
    pub verdicts: Vec<Judgement>,
    /// Names of all files that were written, relative to the folder.
    pub files: Vec<String>,
}

/// Runs those parts of a study that are not finished yet, and writes its report.
///
/// # Errors
/// Returns an error before anything is run if the study is faulty. It also returns one if an FMU
/// fails, if a file cannot be written, or if the work was asked to end; the parts that are finished
/// by then are kept.
pub fn reproduce(study: &Study, options: &Options) -> Result<StudyReport, Error> {
    let begin = Instant::now();
    let out = options.out.clone().unwrap_or_else(|| Path::new("out").join(name(study)));
    let mut opened = Opened::default();
    let Options { fmu_dirs, overrides, .. } = options;
    let prepare = |run| Preparation::new(study, run, fmu_dirs, overrides, &mut opened);
    let preparations = study.runs.iter().map(prepare).collect::<Result<Vec<_>, _>>()?;
    check(study).map_err(|message| study.fault(message))?;
    let locked = Folder::take_for_many(&out)?;
    let all_parts = all_parts(study);
    let store = |part: &Part| Store {
        folder: out.join("runs").join(study.runs[part.run].id.get_ref()),
        keys: &preparations[part.run].sweep.keys,
    };
    let Found { mut done, missing, remarks } = look(&all_parts, &store, options.fresh);
    if !missing.is_empty() {
        // An earlier report is removed, because it would not fit the new results if the work is
        // ended early.
        locked.remove(&["report.html", "results.json"])?;
    }

    let interrupt = &options.interrupt;
    let (total, before) = (all_parts.len(), done.len());
    let progress = Parts::new("parts", &study.title, total as u64, before as u64, options.quiet);
    let is_timed = |part: &Part| study.runs[part.run].timed && part.range.start == 0;
    let (timed, others): (Vec<Part>, Vec<Part>) = missing.into_iter().partition(is_timed);
    let sweeps = preparations.iter().map(|preparation| &preparation.sweep);
    let threads = work::threads(options.jobs, sweeps);
    // Timed parts have the machine for themselves.
    for (parts, threads) in [(timed, 1), (others, threads)] {
        let worked = work::on_parts(
            &parts,
            threads,
            || Ok(Bench::default()),
            |bench, part| {
                let run = &study.runs[part.run];
                let preparation = &preparations[part.run];
                let result = bench.fly(part, preparation, interrupt);
                let result = result.map_err(|error| run.failed(error))?;
                store(part).write(&part.range, result.clone())?;
                progress.finished(&run.label);
                Ok(result)
            },
            // An FMU that failed does not concern the other runs, which are kept.
            |error| matches!(error, Error::Run { source: Single::Call { .. }, .. }),
        );
        done.extend(finished(&parts, worked)?);
        if let Some(request) = interrupt.asked() {
            progress.finish();
            let (done, total) = (done.len() as u64, total as u64);
            let what = "parts are finished";
            return Err(Error::Unfinished { what, done, total, out, request });
        }
    }
    progress.finish();

    let mut runs = vec![RunResult::default(); study.runs.len()];
    for ((run, _), result) in done {
        runs[run].push(result).map_err(|error| study.fault(error.to_string()))?;
    }
    let results = Results { study, runs };
    let report = Report::new(&results).map_err(|message| study.fault(message))?;
    let files = report.write(&results, &out)?;
    let judged = study.claims.iter().zip(report.judged);
    Ok(StudyReport {
        title: study.title.clone(),
        page: out.join("report.html"),
        parts: (total - before, before),
        runs: results.runs.iter().map(RunResult::cases).sum(),
        elapsed: begin.elapsed().as_secs_f64(),
        notes: remarks.texts().into_iter().chain(notes(&results)).collect(),
        verdicts: judged.map(|(claim, judged)| (claim.says.clone(), judged.verdict)).collect(),
        files,
    })
}

/// Parts that are finished, and those that are not.
struct Found {
    done: Done,
    missing: Vec<Part>,
    remarks: Remarks,
}

fn look<'a>(parts: &[Part], store: &dyn Fn(&Part) -> Store<'a>, fresh: bool) -> Found {
    let mut found = Found { done: Done::new(), missing: Vec::new(), remarks: Remarks::default() };
    for part in parts {
        let state = store(part).find(&part.range);
        if let Some(result) = found.remarks.take(state).filter(|_| !fresh) {
            found.done.insert((part.run, part.range.start), result);
        } else {
            found.missing.push(part.clone());
        }
    }
    found
}

/// Returns the name of a study, which is that of its folder.
fn name(study: &Study) -> String {
    let path = &study.source.path;
    let folder = path.parent().and_then(Path::file_name);
    folder.or(path.file_stem()).map_or("study".into(), |name| name.to_string_lossy().into_owned())
}

/// Checks everything that can be checked before anything is run.
fn check(study: &Study) -> Result<(), String> {
    let results = Results::empty(study);
    Report::new(&results)?;
    claims::check_pairs(study)?;
    for overview in &study.overviews {
        for column in &overview.metrics {
            // One run with this metric is enough; the other rows stay empty.
            let numbers = |run: &Spanned<String>| {
                results.numbers(&format!("{}.{}", run.get_ref(), column.metric))
            };
            let mut numbers = overview.runs.iter().map(numbers);
            if let Some(first) = numbers.next()
                && !numbers.any(|number| number.is_ok())
            {
                first?;
            }
        }
    }
    Ok(())
}

/// Returns the parts of all runs, in order. The first case of a timed run is a part of its own.
fn all_parts(study: &Study) -> Vec<Part> {
    let of_run = |(run, description): (usize, &Run)| {
        let first = u64::from(description.timed);
        let others = parts::parts(description.count() - first, CASES_PER_PART);
        let others = others.map(move |part| part.start + first..part.end + first);
        let timed = description.timed.then_some(0..1);
        timed.into_iter().chain(others).map(move |range| Part { run, range })
    };
    study.runs.iter().enumerate().flat_map(of_run).collect()
}

/// Number of failures that are reported besides the first one, which ends the study.
const FAILURES_REPORTED: usize = 9;

/// Results of parts, by the position of the run and the number of the part's first case.
type Done = BTreeMap<(usize, u64), PartResult>;

/// Returns the results of parts, unless one has failed.
fn finished(parts: &[Part], worked: Worked<PartResult, Error>) -> Result<Done, Error> {
    let Worked { results, mut failures } = worked;
    failures.retain(|_, error| !matches!(error, Error::Single(Single::Interrupted { .. })));
    let mut failures = failures.into_values();
    let Some(first) = failures.next() else {
        let place = |place: usize| (parts[place].run, parts[place].range.start);
        return Ok(results.into_iter().map(|(at, result)| (place(at), result)).collect());
    };
    for error in failures.by_ref().take(FAILURES_REPORTED) {
        tracing::error!("{error}");
    }
    if failures.len() > 0 {
        tracing::error!("{} further parts failed", failures.len());
    }
    Err(first)
}
