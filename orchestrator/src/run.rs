//! Runs an experiment and writes its results. Observers of the system record, measure and
//! draw it.

use crate::arguments::Subject;
use crate::failure::Failure;
use crate::flight::{self, Flown, Heard};
use crate::summary::{self, RunReport};
use clap::Args;
use cosim::error::Error;
use cosim::files;
use cosim::interrupt::Interrupt;
use cosim::metadata;
use cosim::pacing::{Factor, RealTime};
use cosim::recorder::{FILE, Recorder};
use cosim::run::{Observer, Sample};
use cosim::system::{Parameters, System};
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

/// Options of `run`.
#[derive(Args, Default)]
#[expect(clippy::struct_excessive_bools, reason = "they are switches of the command line")]
pub(crate) struct Run {
    /// Folder for the results [default: out/EXPERIMENT].
    #[arg(long, value_name = "DIR", help_heading = "Results")]
    pub(crate) out: Option<PathBuf>,
    /// Replace the results of an earlier run in the folder. Without this option they are left
    /// alone and nothing is run.
    #[arg(long, help_heading = "Results")]
    pub(crate) force: bool,
    /// Draw no plot.svg.
    #[arg(long, help_heading = "Results")]
    pub(crate) no_plot: bool,
    /// Also write page.html, which works without a network: curves with a common cursor, the
    /// vehicle in motion, summary and parameters.
    #[arg(long, help_heading = "Results")]
    pub(crate) page: bool,
    /// Show neither progress nor summary.
    #[arg(long)]
    pub(crate) quiet: bool,
    /// Keep the run in step with the wall clock, FACTOR times as fast as real time. FACTOR is 1
    /// if it is left out. A late run continues at once, and missed deadlines are counted.
    #[arg(long, value_name = "FACTOR", num_args = 0..=1, default_missing_value = "1")]
    pub(crate) real_time: Option<Factor>,
    #[command(flatten)]
    pub(crate) subject: Subject,
}

/// Runs an experiment, or the system of an SSP archive, and prints the summary.
///
/// # Errors
/// Returns an error if the experiment is faulty, if an instance fails, or if a file cannot be
/// written.
pub(crate) fn run(
    options: &Run,
    out: &mut impl Write,
    interrupt: &Interrupt,
) -> Result<(), Failure> {
    let (mut system, entries) = options.subject.system(&options.subject.path()?)?;
    let report = record(&mut system, options, interrupt);
    let report = report.map_err(|error| match (error, &entries) {
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

/// Returns why a run ended early, if its results are those of a run.
///
/// # Errors
/// Returns the failure of a run; its results so far are in the folder `out`.
fn early(outcome: Result<(), Error>, out: &Path) -> Result<Option<Error>, Error> {
    match outcome {
        Ok(()) => Ok(None),
        Err(
            error
            @ (Error::Interrupted { .. } | Error::EndedByInstance { .. } | Error::Lost { .. }),
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
fn record(system: &mut System, options: &Run, interrupt: &Interrupt) -> Result<RunReport, Failure> {
    let mut outputs = Outputs::new(system, options, interrupt)?;
    let flown = flight::fly(outputs.system, options.real_time, interrupt, &mut outputs)?;
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
    options: &'a Run,
    interrupt: &'a Interrupt,
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
    fn new(
        system: &'a mut System,
        options: &'a Run,
        interrupt: &'a Interrupt,
    ) -> Result<Self, Failure> {
        let meters = Meters::new(system)?.ending_when_lost();
        // A panel of a wrong signal is refused before the run, whether it is drawn or not.
        Panel::resolve_all(system)?;
        let watch = (options.page || !options.no_plot).then(|| Watch::new(system)).transpose()?;
        for doubt in system.doubts(&[]) {
            tracing::warn!("{}", doubt.text);
        }
        let stem = system.experiment.source.path.file_stem();
        let name = stem.map_or("run".into(), |stem| stem.to_string_lossy().into_owned());
        let out = options.out.clone().unwrap_or_else(|| Path::new("out").join(&name));
        Folder::check(&out, options.force)?;
        Ok(Self {
            system,
            options,
            interrupt,
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
        let Some(watch) = self.watch else { return Ok((metrics, files)) };
        if !options.no_plot && watch.draw(&self.out.join("plot.svg"), &system.experiment.title)? {
            files.push("plot.svg");
        }
        if options.page {
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
        let Run { force, quiet, real_time, .. } = self.options;
        let clock = self.system.clock;
        if let Some(request) = self.interrupt.asked() {
            return Err(Error::Interrupted { time: clock.start(), request });
        }
        let folder = Folder::take(&self.out)?;
        // Another process may have written to the folder in the meantime.
        Folder::check(&self.out, *force)?;
        folder.clear()?;
        self.recorder = Some(self.system.recorder(&self.out)?);
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
