//! Runs a study on all cores, stores the finished parts, and writes the report.
//!
//! The work is divided into parts. The results of a finished part are written to a file at once,
//! together with a hash of everything that they depend on. A part whose file exists with the same
//! hash is not run again. An interruption therefore costs only the parts that were being worked on.

use super::claims;
use super::definition::Study;
use super::outcome::Outcome;
use super::output::{Judgement, notes, write};
use super::part::{Part, Preparation};
use super::results::{Results, RunResult, resolve};
use super::stored::{self, StoredOutcome};
use crate::error::Error;
use crate::folder::Folder;
use crate::progress::Parts;
use crate::work::{self, Worked};
use cosim::error::Error as Single;
use cosim::files;
use cosim::interrupt::Interrupt;
use cosim::search;
use cosim::system::{CheckedComponent, Opened};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Number of members of a run that make up one part.
const MEMBERS_PER_PART: u32 = 25;
/// Version of the files of parts, which must be raised when their content changes.
const FORMAT: u32 = 5;

/// Options for the reproduction of a study.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// Folder for the results; `out/<folder of the study>` if it is not given.
    pub out: Option<PathBuf>,
    /// Further folders in which FMUs are looked for.
    pub fmu_dirs: Vec<PathBuf>,
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

/// Finds the study with this name: a file, a folder with a `study.toml`, or such a folder below
/// `orchestrator/experiments`.
///
/// # Errors
/// Returns an error if there is no study with this name.
pub fn find(name: &Path) -> Result<PathBuf, Single> {
    let roots = search::experiments();
    let mut candidates = vec![name.to_path_buf(), name.join("study.toml")];
    candidates.extend(
        roots.iter().flat_map(|root| [root.join(name), root.join(name).join("study.toml")]),
    );
    candidates.iter().find(|path| path.is_file()).cloned().ok_or_else(|| {
        let there: Vec<String> = roots
            .iter()
            .flat_map(|root| fs::read_dir(root).into_iter().flatten().flatten())
            .filter(|entry| entry.path().join("study.toml").is_file())
            .map(|entry| entry.file_name().to_string_lossy().into_owned())
            .collect();
        let hint = fmu_import::names::hint(&name.to_string_lossy(), there.iter().map(String::as_str));
        Single::experiment(format!(
            "there is no study \"{}\", neither as a file nor as a folder with a study.toml, here or among the experiments{hint}",
            name.display()
        ))
    })
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
    let preparations = study
        .runs
        .iter()
        .map(|run| Preparation::new(study, run, &options.fmu_dirs))
        .collect::<Result<Vec<_>, _>>()?;
    let mut opened = Opened::default();
    check(study, &preparations, &mut opened)?;
    let keys = keys(study, &preparations, &mut opened)?;
    if out.join("metrics.json").exists() || (out.exists() && !out.is_dir()) {
        let message =
            format!("{} holds other results: take another folder by --out", out.display());
        return Err(Single::experiment(message).into());
    }
    let _folder = Folder::take(&out)?;
    let all_parts = parts(study);
    let file = |part: &Part| {
        let id = study.runs[part.run].id.get_ref();
        out.join("runs")
            .join(id)
            .join(format!("{:04}-{:04}.json", part.range.start, part.range.end))
    };
    let mut done: BTreeMap<(usize, u32), Outcome> = BTreeMap::new();
    if !options.fresh {
        for part in &all_parts {
            if let Some(outcome) = stored::load(&file(part), &keys[part.run], part) {
                done.insert((part.run, part.range.start), outcome);
            }
        }
    }
    let missing: Vec<Part> = all_parts
        .iter()
        .filter(|part| !done.contains_key(&(part.run, part.range.start)))
        .cloned()
        .collect();
    let progress =
        Parts::new("parts", &study.title, all_parts.len() as u64, done.len() as u64, options.quiet);

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
    let all_work = Work {
        study,
        preparations: &preparations,
        keys: &keys,
        file: &file,
        progress: &progress,
        interrupt,
    };
    let is_timed = |part: &Part| study.runs[part.run].timed && part.range.start == 0;
    let (timed, others): (Vec<Part>, Vec<Part>) = missing.iter().cloned().partition(is_timed);
    let threads = work::threads(options.jobs);
    let computed = (timed.len() + others.len(), done.len());
    // Timed parts have the machine for themselves.
    for (parts, threads) in [(timed, 1), (others, threads)] {
        done.extend(all_work.run(&parts, threads)?);
        if let Some(request) = interrupt.asked() {
            progress.finish();
            return Err(Error::Unfinished {
                done: done.len(),
                total: all_parts.len(),
                out,
                request,
            });
        }
    }
    progress.finish();

    let mut runs = vec![RunResult::default(); study.runs.len()];
    for ((run, _), outcome) in done {
        runs[run].push(outcome);
    }
    let results = Results { study, runs };
    let (verdicts, files) = write(&results, &out)?;
    Ok(StudyReport {
        title: study.title.clone(),
        page: out.join("report.html"),
        parts: computed,
        runs: results.runs.iter().map(|run| run.members.len()).sum(),
        elapsed: begin.elapsed().as_secs_f64(),
        notes: notes(&results),
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
fn check(study: &Study, preparations: &[Preparation], opened: &mut Opened) -> Result<(), Error> {
    let fault = |message: String| study.source.error(&(0..0), message);
    claims::check(study).map_err(fault)?;
    for row in study.tables.iter().flat_map(|table| &table.rows) {
        for name in [Some(&row.ours), row.beside.as_ref()].into_iter().flatten() {
            resolve(study, name).map_err(fault)?;
        }
    }
    for overview in &study.overviews {
        for column in &overview.metrics {
            // One run with this metric is enough; the other rows stay empty.
            let mut tried = overview
                .runs
                .iter()
                .map(|run| {
                    resolve(study, &format!("{}.{}", run.get_ref(), column.metric)).map(drop)
                })
                .collect::<Vec<_>>();
            if let Some(Err(message)) =
                tried.iter().all(Result::is_err).then(|| tried.pop()).flatten()
            {
                return Err(fault(message).into());
            }
        }
    }
    for across in
        study.figures.iter().flat_map(|f| &f.panels).filter_map(|panel| panel.across.as_ref())
    {
        for run in across.lines.iter().flat_map(|line| &line.runs) {
            for axis in [&across.x, &across.y] {
                resolve(study, &format!("{}.{}", run.get_ref(), axis.metric)).map_err(fault)?;
            }
        }
    }
    preparations.iter().try_for_each(|preparation| preparation.check(opened))
}

/// Returns the parts of all runs, in order. The first member of a timed run is a part of its own.
fn parts(study: &Study) -> Vec<Part> {
    let mut parts = Vec::new();
    for (run, description) in study.runs.iter().enumerate() {
        let count = description.vary.as_ref().map_or(1, |vary| vary.count);
        let mut start = 0;
        while start < count {
            let length = if start == 0 && description.timed { 1 } else { MEMBERS_PER_PART };
            let end = count.min(start + length);
            parts.push(Part { run, range: start..end });
            start = end;
        }
    }
    parts
}

/// Returns a hash for each run of everything that its parts depend on: the experiment, the changes
/// that the study makes to it, the signals that the study needs, the FMUs, and this program.
fn keys(
    study: &Study,
    preparations: &[Preparation],
    opened: &mut Opened,
) -> Result<Vec<String>, Error> {
    let digest = |path: &Path| fs::read(path).map(files::digest).map_err(Single::file(path));
    let executable = std::env::current_exe().map_err(Single::file("the path of this program"))?;
    let program = digest(&executable)?;
    let mut archives: BTreeMap<PathBuf, String> = BTreeMap::new();
    let mut keys = Vec::new();
    for (run, preparation) in study.runs.iter().zip(preparations) {
        let system = preparation.system(0, opened)?;
        let mut fmus = BTreeMap::new();
        for CheckedComponent { name, fmu, .. } in &system.components {
            if !archives.contains_key(&fmu.path) {
                archives.insert(fmu.path.clone(), digest(&fmu.path)?);
            }
            fmus.insert(name, archives[&fmu.path].clone());
        }
        let within = study
            .bounds_of(run)
            .map(|(within, signals)| Ok(json!([within.id, signals, study.number(&within.bound)?])))
            .collect::<Result<Vec<_>, Error>>()?;
        let measures: Vec<Value> =
            study.measures_of(run).map(|measure_and_signals| json!(measure_and_signals)).collect();
        let inputs = json!({
            "format": FORMAT,
            "program": program,
            "experiment": system.experiment.source.whole(),
            "set": run.set,
            "unset": run.unset,
            "vary": run.vary.as_ref().map(|vary| (&vary.parameter, vary.first)),
            "within": within,
            "measures": measures,
            "series": preparation.drawn.series,
            "spread": preparation.drawn.spread,
            "timed": run.timed,
            "fmus": fmus,
        });
        keys.push(files::digest(inputs.to_string()));
    }
    Ok(keys)
}

/// Number of failures that are reported besides the first one, which ends the study.
const FAILURES_REPORTED: usize = 9;

/// Parts of a study's work, shared by several threads.
struct Work<'a> {
    study: &'a Study,
    preparations: &'a [Preparation<'a>],
    keys: &'a [String],
    file: &'a (dyn Fn(&Part) -> PathBuf + Sync),
    progress: &'a Parts,
    interrupt: &'a Interrupt,
}

/// Outcomes of parts, by the position of the run and the number of the part's first member.
type Done = BTreeMap<(usize, u32), Outcome>;

impl Work<'_> {
    fn run(&self, parts: &[Part], threads: usize) -> Result<Done, Error> {
        let is_of_fmu = |error: &Error| {
            // An FMU that failed does not concern the other runs, which are kept.
            matches!(error, Error::Run { source: Single::Call { .. }, .. })
        };
        let Worked { results, mut failures } = work::on_parts(
            parts,
            threads,
            || Ok(Opened::default()),
            |opened, part| self.part(part, opened),
            is_of_fmu,
        );
        failures.retain(|_, error| !matches!(error, Error::Single(Single::Interrupted { .. })));
        let mut failures = failures.into_values();
        let Some(first) = failures.next() else {
            let place = |place: usize| (parts[place].run, parts[place].range.start);
            return Ok(results.into_iter().map(|(at, outcome)| (place(at), outcome)).collect());
        };
        for error in failures.by_ref().take(FAILURES_REPORTED) {
            tracing::error!("{error}");
        }
        if failures.len() > 0 {
            tracing::error!("{} further parts failed", failures.len());
        }
        Err(first)
    }

    fn part(&self, part: &Part, opened: &mut Opened) -> Result<Outcome, Error> {
        let run = &self.study.runs[part.run];
        let outcome = self.preparations[part.run]
            .execute(part.range.clone(), opened, self.interrupt)
            .map_err(|error| match error {
                Single::Interrupted { .. } => Error::Single(error),
                source => Error::Run { run: run.id.get_ref().clone(), source },
            })?;
        let path = (self.file)(part);
        let fault = |error: serde_json::Error| Single::file(&path)(error.into());
        let stored = StoredOutcome::new(self.keys[part.run].clone(), part.range.clone(), outcome)
            .map_err(fault)?;
        let text = serde_json::to_vec(&stored).map_err(fault)?;
        files::write(&path, &text)?;
        self.progress.finished(&run.label);
        Ok(stored.outcome)
    }
}
