//! Runs a study on all cores, stores the finished parts, and writes the report.
//!
//! The work is divided into parts. The results of a finished part are written to a file at once,
//! together with a hash of everything that they depend on. A part whose file exists with the same
//! hash is not run again. An interruption therefore costs only the parts that were being worked on.

use crate::claims;
use crate::definition::Study;
use crate::output::{Judgement, notes, write};
use crate::part::{Bench, Part, Preparation};
use crate::results::{Results, RunResult, resolve};
use crate::runs::Run;
use cosim::error::Error as Single;
use cosim::experiment::Overrides;
use cosim::interrupt::Interrupt;
use cosim::system::Opened;
use cosim_report::folder::Folder;
use cosim_report::progress::Parts;
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::time::Instant;
use sweep::error::Error;
use sweep::parts::{self, PartResult, PartState, Remarks};
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
    check(study)?;
    if out.join("metrics.json").exists() || (out.exists() && !out.is_dir()) {
        let message =
            format!("{} holds other results: take another folder by --out", out.display());
        return Err(Single::experiment(message).into());
    }
    let _folder = Folder::take(&out)?;
    let all_parts = all_parts(study);
    let folder = |part: &Part| out.join("runs").join(study.runs[part.run].id.get_ref());
    let (mut done, mut missing) = (Done::new(), Vec::new());
    let mut remarks = Remarks::default();
    for part in &all_parts {
        let keys = &preparations[part.run].sweep.keys;
        match parts::find(&folder(part), keys, &part.range) {
            PartState::Whole(result) if !options.fresh => {
                done.insert((part.run, part.range.start), result);
            }
            state => {
                remarks.add(&state);
                missing.push(part.clone());
            }
        }
    }
    if !missing.is_empty() {
        // An earlier report is removed, because it would not fit the new results if the work is
        // ended early.
        for path in [out.join("report.html"), out.join("results.json")] {
            if path.exists() {
                fs::remove_file(&path).map_err(Single::file(&path))?;
            }
        }
    }

    let interrupt = &options.interrupt;
    let (total, before) = (all_parts.len(), done.len());
    let progress = Parts::new("parts", &study.title, total as u64, before as u64, options.quiet);
    let all_work = Work {
        study,
        preparations: &preparations,
        folder: &folder,
        progress: &progress,
        interrupt,
    };
    let is_timed = |part: &Part| study.runs[part.run].timed && part.range.start == 0;
    let (timed, others): (Vec<Part>, Vec<Part>) = missing.into_iter().partition(is_timed);
    let sweeps = preparations.iter().map(|preparation| &preparation.sweep);
    let threads = work::threads(options.jobs, sweeps);
    // Timed parts have the machine for themselves.
    for (parts, threads) in [(timed, 1), (others, threads)] {
        done.extend(all_work.run(&parts, threads)?);
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
        let fault = |error: serde_json::Error| study.source.error(&(0..0), error.to_string());
        runs[run].push(result).map_err(fault)?;
    }
    let results = Results { study, runs };
    let (verdicts, files) = write(&results, &out)?;
    Ok(StudyReport {
        title: study.title.clone(),
        page: out.join("report.html"),
        parts: (total - before, before),
        runs: results.runs.iter().map(RunResult::cases).sum(),
        elapsed: begin.elapsed().as_secs_f64(),
        notes: remarks.texts().into_iter().chain(notes(&results)).collect(),
        verdicts,
        files,
    })
}

/// Returns the name of a study, which is that of its folder.
fn name(study: &Study) -> String {
    let path = &study.source.path;
    let folder = path.parent().and_then(Path::file_name);
    folder.or(path.file_stem()).map_or("study".into(), |name| name.to_string_lossy().into_owned())
}

/// Checks everything that can be checked before anything is run.
fn check(study: &Study) -> Result<(), Error> {
    let fault = |message: String| study.source.error(&(0..0), message);
    claims::check(study).map_err(fault)?;
    for row in study.tables.iter().flat_map(|table| &table.rows) {
        for name in [Some(&row.ours), row.beside.as_ref()].into_iter().flatten() {
            resolve(study, name).map_err(fault)?;
        }
    }
    let number = |run: &Spanned<String>, metric: &str| {
        resolve(study, &format!("{}.{metric}", run.get_ref())).map(drop).map_err(fault)
    };
    for overview in &study.overviews {
        for column in &overview.metrics {
            // One run with this metric is enough; the other rows stay empty.
            let mut numbers = overview.runs.iter().map(|run| number(run, &column.metric));
            if let Some(first) = numbers.next()
                && !numbers.any(|number| number.is_ok())
            {
                first?;
            }
        }
    }
    let panels = study.figures.iter().flat_map(|figure| &figure.panels);
    for across in panels.filter_map(|panel| panel.across.as_ref()) {
        for run in across.lines.iter().flat_map(|line| &line.runs) {
            number(run, &across.x.metric)?;
            number(run, &across.y.metric)?;
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

/// Parts of a study's work, shared by several threads.
struct Work<'a> {
    study: &'a Study,
    preparations: &'a [Preparation<'a>],
    folder: &'a (dyn Fn(&Part) -> PathBuf + Sync),
    progress: &'a Parts,
    interrupt: &'a Interrupt,
}

/// Results of parts, by the position of the run and the number of the part's first case.
type Done = BTreeMap<(usize, u64), PartResult>;

impl<'a> Work<'a> {
    fn run(&self, parts: &[Part], threads: usize) -> Result<Done, Error> {
        let is_of_fmu = |error: &Error| {
            // An FMU that failed does not concern the other runs, which are kept.
            matches!(error, Error::Run { source: Single::Call { .. }, .. })
        };
        let Worked { results, mut failures } = work::on_parts(
            parts,
            threads,
            || Ok(Bench::default()),
            |bench, part| self.part(part, bench),
            is_of_fmu,
        );
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

    fn part(&self, part: &Part, bench: &mut Bench<'a>) -> Result<PartResult, Error> {
        let (run, preparation) = (&self.study.runs[part.run], &self.preparations[part.run]);
        let result = bench.fly(part, preparation, self.interrupt).map_err(|error| match error {
            Single::Interrupted { .. } => Error::Single(error),
            source => Error::Run { run: run.id.get_ref().as_str().into(), source },
        })?;
        let folder = (self.folder)(part);
        parts::write(&folder, &preparation.sweep.keys, &part.range, result.clone())?;
        self.progress.finished(&run.label);
        Ok(result)
    }
}
