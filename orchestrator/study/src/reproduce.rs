//! Runs a study on all cores, stores the finished parts, and writes the report.
//!
//! The work is divided into parts. The results of a finished part are written to a file at once,
//! together with a hash of everything that they depend on. A part whose file exists with the same
//! hash is not run again. An interruption therefore costs only the parts that were being worked on.

use crate::claims;
use crate::definition::Study;
use crate::output::{Judgement, Report, notes};
use crate::part::{Bench, Preparation};
use crate::results::{Results, RunResult};
use crate::runs::Run;
use cosim::experiment::Overrides;
use cosim::system::Opened;
use cosim_metrics::folder::Folder;
use std::path::{Path, PathBuf};
use std::time::Instant;
use sweep::error::Error;
use sweep::parts::{self, Store};
use sweep::runner::{self, Options, Part, Work};
use toml::Spanned;

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
    /// Runs with cases that an instance refused, and why; nothing if there are none.
    pub failures: Option<String>,
    /// Claims of the study, each with its verdict.
    pub verdicts: Vec<Judgement>,
}

/// Runs those parts of a study that are not finished yet, and writes its report. FMUs are also
/// looked for in `fmu_dirs`; `overrides` change all experiments.
///
/// # Errors
/// Returns an error before anything is run if the study is faulty. It also returns one if a library
/// fails, if a file cannot be written, or if the work was asked to end; the parts that are finished
/// by then are kept.
pub fn reproduce(
    study: &Study,
    fmu_dirs: &[PathBuf],
    overrides: &Overrides,
    options: &Options,
) -> Result<StudyReport, Error> {
    let begin = Instant::now();
    let out = options.out.clone().unwrap_or_else(|| Path::new("out").join(name(study)));
    let mut opened = Opened::default();
    let prepare = |run| Preparation::new(study, run, fmu_dirs, overrides, &mut opened);
    let preparations = study.runs.iter().map(prepare).collect::<Result<Vec<_>, _>>()?;
    check(study).map_err(|message| study.fault(message))?;
    let locked = Folder::take_for_many(&out)?;
    let stores = study.runs.iter().zip(&preparations).map(|(run, preparation)| Store {
        folder: out.join("runs").join(run.id.get_ref()),
        keys: &preparation.sweep.keys,
    });
    let mut work = Work::new(&study.title, &out, stores.collect());
    let all_parts = all_parts(study);
    let missing = if options.fresh { all_parts.clone() } else { work.missing(all_parts.clone()) };
    if !missing.is_empty() {
        // An earlier report is removed, because it would not fit the new results if the work is
        // ended early.
        locked.remove(&["report.html", "results.json"])?;
    }

    let cases = study.runs.iter().map(Run::count).sum();
    let flown = missing.len();
    let is_timed = |part: &Part| study.runs[part.sweep].timed && part.cases.start == 0;
    let (timed, others): (Vec<Part>, Vec<Part>) = missing.into_iter().partition(is_timed);
    let sweeps = preparations.iter().map(|preparation| &preparation.sweep);
    let threads = runner::threads(options.jobs, sweeps);
    let system = |preparation: &Preparation| preparation.sweep.system(&mut opened);
    let systems = preparations.iter().map(system).collect::<Result<Vec<_>, _>>()?;
    // Timed parts have the machine for themselves.
    for (parts, threads) in [(timed, 1), (others, threads)] {
        work.fly(
            &parts,
            (threads, cases),
            (&systems, options),
            || Ok(Bench::default()),
            |bench, part, progress| {
                let result = bench.fly(part, &preparations[part.sweep], &options.interrupt);
                progress.advance(part.cases.end - part.cases.start);
                result.map_err(|error| study.runs[part.sweep].failed(error))
            },
            |part, _, error| study.runs[part.sweep].failed(error),
        )?;
    }

    let mut runs = vec![RunResult::default(); study.runs.len()];
    for Part { sweep, cases } in &all_parts {
        let result = work.stores[*sweep].read(cases)?;
        runs[*sweep].push(result).map_err(|error| study.fault(error.to_string()))?;
    }
    let results = Results { study, runs };
    let report = Report::new(&results).map_err(|message| study.fault(message))?;
    report.write(&results, &out)?;
    let judged = study.claims.iter().zip(report.judged);
    Ok(StudyReport {
        title: study.title.clone(),
        page: out.join("report.html"),
        parts: (flown, all_parts.len() - flown),
        runs: results.runs.iter().map(RunResult::cases).sum(),
        elapsed: begin.elapsed().as_secs_f64(),
        notes: std::mem::take(&mut work.notes).into_iter().chain(notes(&results)).collect(),
        failures: results.failures(),
        verdicts: judged.map(|(claim, judged)| (claim.says.clone(), judged.verdict)).collect(),
    })
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
                results.numbers(&format!("{}.{}", run.get_ref(), column.of.metric))
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
        let others = parts::parts(description.count() - first);
        let others = others.map(move |part| part.start + first..part.end + first);
        let timed = description.timed.then_some(0..1);
        timed.into_iter().chain(others).map(move |cases| Part { sweep: run, cases })
    };
    study.runs.iter().enumerate().flat_map(of_run).collect()
}
