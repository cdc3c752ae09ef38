//! Runs an experiment and writes its results. Observers of the system record, measure and
//! draw it.

use crate::failure::Failure;
use crate::flight::{self, Flown, Heard};
use crate::summary::{self, RunReport};
use cosim::check::check;
use cosim::error::Error;
use cosim::experiment::{Experiment, Overrides};
use cosim::files;
use cosim::interrupt::Interrupt;
use cosim::metadata;
use cosim::pacing::{Factor, RealTime};
use cosim::recorder::{FILE, Recorder};
use cosim::run::{Observer, Sample};
use cosim::ssp;
use cosim::system::{Opened, Parameters, System};
use cosim_metrics::folder::Folder;
use cosim_metrics::metrics::{Meters, Metrics};
use cosim_metrics::progress::Progress;
use cosim_report::panels::Panel;
use cosim_report::recording::asked;
use cosim_report::recording::watch::Watch;
use cosim_report::run_page;
use linear::measures::Measured;
use std::io::Write;
use std::path::{Path, PathBuf};

/// Choice of the pictures that a run draws.
#[derive(Clone, Copy, Debug, Default, clap::Args)]
#[command(next_help_heading = "Results")]
struct Pictures {
    /// Draw no plot.svg.
    #[arg(long)]
    no_plot: bool,
    /// Also write page.html, which works without a network: curves with a common cursor, the
    /// vehicle in motion, summary and parameters.
    #[arg(long)]
    page: bool,
}

/// Choice of the files that a run writes.
#[derive(Clone, Copy, Debug, Default, clap::Args)]
#[command(next_help_heading = "Results")]
pub(crate) struct Files {
    /// Write no results.csv.
    #[arg(long)]
    no_csv: bool,
    #[command(flatten)]
    pictures: Pictures,
    /// Write the header of results.csv as name [unit], and items of enumerations by their names.
    /// Without this option the header holds the names alone and every cell is a number, as FMPy and
    /// NumPy expect; results.json holds the units and items.
    #[arg(long, conflicts_with = "no_csv")]
    labels: bool,
}

/// Options of a run: where its results go, how it is paced, and what is shown.
#[derive(Clone, Debug, Default)]
pub(crate) struct Options {
    /// Folder for the results; `out/<experiment>` if it is not given.
    pub(crate) out: Option<PathBuf>,
    /// Whether the progress display is suppressed.
    pub(crate) quiet: bool,
    /// Factor of a run that is paced by the wall clock; `None` runs as fast as possible.
    pub(crate) real_time: Option<Factor>,
    /// Choice of the files that the run writes.
    pub(crate) files: Files,
    /// Whether the results of an earlier run may be replaced.
    pub(crate) force: bool,
    /// Interrupt through which the run can be ended from outside.
    pub(crate) interrupt: Interrupt,
}

/// Runs an experiment, or the system of an SSP archive, and prints the summary.
///
/// # Errors
/// Returns an error if the experiment is faulty, if an instance fails, or if a file cannot be
/// written.
pub(crate) fn run(
    path: &Path,
    overrides: &Overrides,
    fmu_dirs: &[PathBuf],
    options: &Options,
    out: &mut impl Write,
) -> Result<(), Failure> {
    let (mut system, entries) = system(path, overrides, fmu_dirs)?;
    let report = record(&mut system, options).map_err(|error| match (error, &entries) {
        (Failure::Single(error), Some(entries)) => entries.named(error).into(),
        (error, _) => error,
    })?;
    if !options.quiet {
        summary::summary(&system, &report, out)?;
        out.flush()?;
    }
    ended(report.ended, options.quiet)?;
    // The results are complete, but an instance failed when it was freed.
    report.late.map_or(Ok(()), |error| Err(error.into()))
}

/// Checks an experiment or the system of an SSP archive. The entries of an archive are needed for
/// the names of its FMUs in errors.
///
/// # Errors
/// Returns an error if anything is wrong with the experiment or the archive.
pub(crate) fn system(
    path: &Path,
    overrides: &Overrides,
    fmu_dirs: &[PathBuf],
) -> Result<(System, Option<ssp::Entries>), Failure> {
    if path.extension().is_some_and(|extension| extension == "ssp") {
        let ssp::Loaded { experiment, mut opened, entries } = ssp::load(path, overrides)?;
        let system = check(experiment, fmu_dirs, &mut opened);
        return Ok((system.map_err(|error| entries.named(error))?, Some(entries)));
    }
    let mut experiment = Experiment::load(path)?;
    experiment.apply(overrides)?;
    Ok((check(experiment, fmu_dirs, &mut Opened::default())?, None))
}

/// Returns why a run ended early, if its results are those of a run.
///
/// # Errors
/// Returns the failure of a run; its results so far are in the folder `out`.
fn early(outcome: Result<(), Error>, out: &Path) -> Result<Option<Error>, Error> {
    match outcome {
        Ok(()) => Ok(None),
        Err(
            error @ (Error::Interrupted { .. }
            | Error::EndedByInstance { .. }
            | Error::Lost { .. }),
        ) => Ok(Some(error)),
        Err(error) => {
            tracing::warn!("the results up to this failure are in {}", out.display());
            Err(error)
        }
    }
}

/// Returns an error if a run ended early for a reason that is a failure.
fn ended(reason: Option<Error>, quiet: bool) -> Result<(), Failure> {
    match reason {
        None => Ok(()),
        Some(error @ Error::EndedByInstance { .. }) => {
            // The summary has already said so.
            if quiet {
                tracing::warn!("{error}");
            }
            Ok(())
        }
        Some(error) => Err(error.into()),
    }
}

/// Runs a system and writes its results. If an instance fails or the run is ended early, the
/// results up to then are written as well.
///
/// # Errors
/// Returns an error if an FMU fails, or if a file cannot be written.
fn record(system: &mut System, options: &Options) -> Result<RunReport, Failure> {
    let mut outputs = Outputs::new(system, options)?;
    let flown = flight::fly(outputs.system, options.real_time, &options.interrupt, &mut outputs)?;
    let Flown { outcome, wall, end, real_time, margins, late } = flown;
    let out = outputs.out.clone();
    let written = outputs.write(outcome.as_ref().err(), wall, real_time, margins);
    // The reason why the run ended comes first: a disk filled by its results has no room for more.
    let ended = early(outcome, &out)?;
    let (metrics, files) = written?;
    Ok(RunReport { metrics, out, files, ended, end, late })
}

/// What a run writes and shows. It observes the run.
struct Outputs<'a> {
    system: &'a System,
    options: &'a Options,
    parameters: Parameters,
    /// The folder of the results, which is taken as long as this value lives.
    folder: Option<Folder>,
    /// Folder of the results.
    out: PathBuf,
    /// Name of the experiment's file.
    name: String,
    progress: Option<Progress>,
    recorder: Option<Recorder>,
    watch: Option<Watch>,
    meters: Meters,
}

impl<'a> Outputs<'a> {
    /// Resolves what is to be written and drawn. Nothing is written yet.
    ///
    /// # Errors
    /// Returns an error if a signal is unknown, or if there are results that may not be replaced.
    fn new(system: &'a mut System, options: &'a Options) -> Result<Self, Failure> {
        let meters = Meters::new(system)?.ending_when_lost();
        // A panel of a wrong signal is refused before the run, whether it is drawn or not.
        Panel::resolve_all(system)?;
        let Pictures { no_plot, page } = options.files.pictures;
        let watch = (page || !no_plot).then(|| Watch::new(system)).transpose()?;
        for doubt in system.doubts() {
            tracing::warn!("{doubt}");
        }
        let stem = system.experiment.source.path.file_stem();
        let name = stem.map_or("run".into(), |stem| stem.to_string_lossy().into_owned());
        let out = options.out.clone().unwrap_or_else(|| Path::new("out").join(&name));
        Folder::check(&out, options.force)?;
        Ok(Self {
            system,
            options,
            parameters: Parameters::new(),
            folder: None,
            out,
            name,
            progress: None,
            recorder: None,
            watch,
            meters,
        })
    }

    /// Writes the files. Returns the metrics and the files' names.
    ///
    /// # Errors
    /// Returns an error if a file cannot be written.
    fn write(
        mut self,
        failure: Option<&Error>,
        wall: f64,
        real_time: Option<RealTime>,
        margins: Result<Measured, Error>,
    ) -> Result<(Metrics, Vec<&'static str>), Failure> {
        let Self { system, options, .. } = self;
        let metadata = metadata::metadata(system, &self.parameters, options.real_time, failure);
        let mut files = vec!["results.json", "metrics.json"];
        if let Some(recorder) = &mut self.recorder {
            recorder.finish()?;
            files.insert(0, FILE);
        }
        files::write_json(&self.out.join("results.json"), &metadata)?;
        let mut metrics = self.measured(wall);
        metrics.asked.extend(margins?);
        if let Some(real_time) = real_time {
            if options.quiet && real_time.worst_miss.is_some() {
                tracing::warn!("real time: {real_time}");
            }
            metrics.real_time = Some(real_time);
        }
        files::write_json(&self.out.join("metrics.json"), &metrics)?;
        let Pictures { no_plot, page } = self.options.files.pictures;
        let Some(watch) = self.watch else { return Ok((metrics, files)) };
        if !no_plot && watch.draw(&self.out.join("plot.svg"), &system.experiment.title)? {
            files.push("plot.svg");
        }
        if page {
            let mut recording = watch.recording(&self.name, &metadata);
            recording.summary = summary::lines(&system.experiment.observe, &metrics);
            let recordings = [recording];
            let drawn = asked::of_experiments(&recordings).map_err(Error::experiment)?;
            run_page::write(&recordings, &drawn, &self.out.join("page.html"))?;
            files.push("page.html");
        }
        Ok((metrics, files))
    }

    /// Returns the metrics of a run that took this time by the wall clock, s.
    fn measured(&self, wall: f64) -> Metrics {
        let reached = self.system.clock.step() * self.meters.seen().saturating_sub(1) as f64;
        Metrics {
            real_time_factor: (wall > 0.0).then(|| reached / wall),
            wall_s: wall,
            loop_delay_s: self.system.loop_delay(),
            ..self.meters.metrics()
        }
    }
}

impl Heard for Outputs<'_> {
    /// Takes the folder and begins the file of recorded variables.
    fn begin(&mut self, parameters: Parameters) -> Result<(), Error> {
        let Options { force, quiet, real_time, files, interrupt, .. } = self.options;
        let clock = self.system.clock;
        if let Some(request) = interrupt.asked() {
            return Err(Error::Interrupted { time: clock.start(), request });
        }
        let folder = Folder::take(&self.out)?;
        // Another process may have written to the folder in the meantime.
        Folder::check(&self.out, *force)?;
        folder.clear()?;
        let recorder = (!files.no_csv).then(|| self.system.recorder(&self.out, files.labels));
        self.recorder = recorder.transpose()?;
        let title = &self.system.experiment.title;
        self.progress = Some(Progress::new(title, clock.ticks(), *quiet, real_time.is_some()));
        (self.parameters, self.folder) = (parameters, Some(folder));
        Ok(())
    }

    fn has_begun(&self) -> bool {
        self.folder.is_some()
    }

    fn stop(&mut self) {
        self.progress = None;
    }
}

impl Observer for Outputs<'_> {
    fn observe(&mut self, sample: &Sample) -> Result<(), Error> {
        let Self { progress, watch, recorder, meters, .. } = self;
        progress.as_mut().map_or(Ok(()), |progress| progress.observe(sample))?;
        watch.as_mut().map_or(Ok(()), |watch| watch.observe(sample))?;
        recorder.as_mut().map_or(Ok(()), |recorder| recorder.observe(sample))?;
        // The meters come last, because they may end the run.
        meters.observe(sample)
    }
}
