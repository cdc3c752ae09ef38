//! Runs an experiment from its file to its results.

use crate::clock::Clock;
use crate::delay::{self, FeedbackLoop};
use crate::error::Error;
use crate::experiment::{Coupling, Experiment};
use crate::folder::Folder;
use crate::interrupt::Interrupt;
use crate::live::scene::Scene;
use crate::live::{self, Live};
use crate::master::{Master, Member, Observer};
use crate::metrics::{self, Limits, Merit, Metrics, Places, Probes};
use crate::plot::Curves;
use crate::progress::Progress;
use crate::realtime;
use crate::realtime::priority::{Priority, Scheduling};
use crate::realtime::timer::{self, Monotonic};
use crate::recorder::{self, Format, Recorder};
use crate::search;
use crate::seeds;
use crate::settings::{self, Setting};
use crate::sidecar;
use crate::watch::Watched;
use crate::wiring::{self, Column, Part, Port, Wire};
use fmu_import::description::{Kind, ModelDescription};
use fmu_import::faults;
use fmu_import::fmu::Fmu;
use fmu_import::names;
use fmu_import::unit::CoSimulationUnit;
use fmu_import::warnings;
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::rc::Rc;
use std::time::Instant;

/// Which files a run writes, and how.
#[derive(Clone, Copy, Debug, Default, clap::Args)]
pub struct Files {
    /// Write no results.csv.
    #[arg(long)]
    pub no_csv: bool,
    /// The file of the recorded variables.
    #[arg(long, value_enum, value_name = "FORMAT", default_value_t, conflicts_with = "no_csv")]
    pub format: Format,
    /// Draw no plot.svg.
    #[arg(long)]
    pub no_plot: bool,
    /// Head the columns of results.csv with name [unit], and write items of enumerations by name. Without it the header holds
    /// the names alone and every cell is a number, as FMPy and NumPy read it; results.json has units and items.
    #[arg(long, conflicts_with = "no_csv")]
    pub labels: bool,
}

impl Files {
    /// Rejects options that would have no effect.
    fn check(self) -> Result<(), Error> {
        if self.labels && self.format != Format::Csv {
            let problem =
                "--labels is about results.csv: results.parquet has units and items in its metadata";
            return Err(Error::experiment(problem));
        }
        Ok(())
    }
}

/// Options of a run: where its results go, how it is paced, and what is shown.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// Folder for the results; `out/<experiment>` if it is not given.
    pub out: Option<PathBuf>,
    /// Whether the progress display is suppressed.
    pub quiet: bool,
    /// Settings of a run that is paced by the wall clock; `None` runs as fast as possible.
    pub real_time: Option<realtime::Settings>,
    /// Whether the run is shown on the terminal while it goes on.
    pub live: bool,
    /// Choice of the files that the run writes.
    pub files: Files,
    /// Whether the results of an earlier run may be replaced.
    pub force: bool,
    /// Interrupt through which the run can be ended from outside.
    pub interrupt: Interrupt,
}

/// The outcome of a run: its figures of merit and where its results are.
#[derive(Debug)]
pub struct Report {
    /// Title of the experiment.
    pub title: String,
    /// Start time, stop time and communication step of the run.
    pub clock: Clock,
    /// Coupling of the components at communication points.
    pub coupling: Coupling,
    /// Names of the components, in the order in which their inputs are set.
    pub order: Vec<String>,
    /// Figures of merit of the run.
    pub metrics: Metrics,
    /// Feedback loops with their delays; components are indices into `order`.
    pub loops: Vec<FeedbackLoop>,
    /// Folder that holds the results.
    pub out: PathBuf,
    /// Names of the files that were written to the folder.
    pub files: Vec<&'static str>,
    /// Reason why the run ended before its stop time, for example a request or a missed deadline;
    /// `None` if it did not.
    pub ended: Option<Error>,
}

/// The FMUs that have been opened, by path. Plans that share this map unpack each archive only
/// once.
pub type Opened = BTreeMap<PathBuf, Rc<Fmu>>;

/// An experiment whose names are all resolved and checked: only the units themselves can still
/// fail.
pub struct Plan {
    /// The experiment that the plan was made from.
    pub experiment: Experiment,
    /// Start time, stop time and communication step.
    pub clock: Clock,
    /// Names of the components, in the order in which their inputs are set.
    pub order: Vec<String>,
    /// FMU of each component, in the same order.
    pub fmus: Vec<Rc<Fmu>>,
    /// Settings of each component, in the same order.
    pub settings: Vec<Vec<Setting>>,
    /// Connections between outputs and inputs.
    pub wires: Vec<Wire>,
    /// Variables to be recorded, one per column.
    pub columns: Vec<Column>,
    /// Feedback loops with their delays, in ticks.
    pub loops: Vec<FeedbackLoop>,
    probes: Probes,
    pub(crate) places: Places,
    limits: [Option<Port>; 2],
}

impl Plan {
    /// Resolves the names of an experiment and checks it.
    ///
    /// # Errors
    /// If anything is wrong with the experiment or with the archive of an FMU.
    pub fn new(experiment: Experiment, fmu_dirs: &[PathBuf]) -> Result<Self, Error> {
        Self::with(experiment, fmu_dirs, &mut Opened::default())
    }

    /// Resolves an experiment; archives that are already in `opened` are not opened again.
    ///
    /// # Errors
    /// The errors are those of [`Self::new`].
    pub fn with(experiment: Experiment, fmu_dirs: &[PathBuf], opened: &mut Opened) -> Result<Self, Error> {
        let simulation = &experiment.simulation;
        let clock = Clock::new(simulation.start, simulation.stop, simulation.step)
            .map_err(|message| experiment.source.error(&(0..0), format!("[simulation] {message}")))?;
        let order = order(&experiment)?;

        let mut fmus = Vec::new();
        for name in &order {
            let path = find_fmu(&experiment, name, fmu_dirs)?;
            let fmu = match opened.get(&path) {
                Some(fmu) => Rc::clone(fmu),
                None => Rc::new(open(&path)?),
            };
            opened.insert(path, Rc::clone(&fmu));
            fmus.push(fmu);
        }
        let parts = parts(&order, &fmus);
        if let Some(target) = experiment.unplaced.first() {
            return Err(Error::experiment(format!("--set {target}: {}", whereabouts(target, &parts))));
        }
        check_single_instances(&experiment, &order, &fmus)?;

        let wires = wiring::wires(&experiment, &parts)?;
        let settings = (0..parts.len())
            .map(|index| settings::resolve(&experiment, &parts, index, &wires))
            .collect::<Result<Vec<_>, _>>()?;
        let columns = wiring::columns(&experiment, &parts)?;
        check_size(&experiment, &clock, columns.len())?;
        let mut probes = Probes::default();
        let (places, limits) = metrics::places(&experiment.metrics, &parts, &mut probes)?;
        for column in &columns {
            probes.place(column.port);
        }
        if let Some(names) = delay::algebraic_loop(&parts, &wires) {
            let message = format!(
                "algebraic loop: each of these inputs depends on the next at the same instant: {}. \
                 Put a unit with a state or a delay between them",
                names.join(" <- ")
            );
            return Err(experiment.source.error(&(0..0), message));
        }
        let every = periods(&experiment, &order);
        let loops = delay::feedback_loops(&parts, &every, &wires, simulation.coupling);
        Ok(Self { experiment, clock, order, fmus, settings, wires, columns, loops, probes, places, limits })
    }

    /// Names and model descriptions of the components.
    pub fn parts(&self) -> Vec<Part<'_>> {
        parts(&self.order, &self.fmus)
    }

    /// Runs the experiment and writes its results. If a unit fails or the run is ended early, the
    /// results up to then are written as well.
    ///
    /// # Errors
    /// If a unit fails, or if a file cannot be written.
    pub fn run(&self, options: &Options) -> Result<Report, Error> {
        if options.live {
            live::check_terminal()?;
        }
        self.warn(&options.interrupt)?;
        let experiment = &self.experiment;
        options.files.check()?;
        let stem = experiment.source.path.file_stem().map_or("run".into(), |stem| stem.to_string_lossy());
        let out = options.out.clone().unwrap_or_else(|| Path::new("out").join(stem.as_ref()));

        Folder::check(&out, options.force)?;

        let warnings = warnings::collect();
        warnings::at(self.clock.start());
        let mut probes = self.probes.clone();
        let factor = options.real_time.map(|settings| settings.factor.get());
        let scene = options.live.then(|| Scene::new(self, self.places, factor, &mut probes));
        let (mut master, limits) = self.initialized_with(&probes)?;
        let parameters = self.parameters(&mut master)?;

        master.heed(&options.interrupt);
        if let Some(request) = options.interrupt.asked() {
            return Err(Error::Interrupted { time: self.clock.start(), request });
        }
        let folder = Folder::take(&out)?;
        // Another process may have written to the folder in the meantime.
        Folder::check(&out, options.force)?;
        folder.clear()?;
        let mut recorder =
            if options.files.no_csv { None } else { Some(self.recorder(&out, options.files)?) };
        let mut merit = self.merit(limits).ending_when_lost();
        let mut curves = Curves::new(self.places, limits, self.clock.ticks());
        let silent = options.quiet || options.live;
        let mut progress =
            Progress::new(&experiment.title, self.clock.ticks(), silent, options.real_time.is_some());

        let tally = options.real_time.map(|settings| {
            timer::wake_up_sharply();
            master.pace(settings, Rc::new(Monotonic)).tally()
        });
        let live = scene.map(|scene| {
            Live::start(Scene { limits, ..scene }, probes.ports.len(), tally, options.interrupt.clone())
        });
        let mut live = live.transpose()?;
        // Requested after the drawing threads have started, because later threads would inherit the
        // scheduling.
        let scheduling = Scheduling::request(options.real_time.and_then(|settings| settings.priority));

        let begin = Instant::now();
        let mut observers: Vec<&mut dyn Observer> = vec![&mut curves, &mut progress];
        observers.extend(recorder.as_mut().map(|recorder| recorder as &mut dyn Observer));
        observers.extend(live.as_mut().map(|live| live as &mut dyn Observer));
        // The figures of merit come last, because their observer may end the run.
        observers.push(&mut merit);
        let outcome = master.run(&mut observers);
        let wall = begin.elapsed().as_secs_f64();
        let priority = scheduling.priority.clone();
        drop((scheduling, live, progress, warnings));

        if let Some(recorder) = &mut recorder {
            recorder.finish()?;
        }
        let reached = self.clock.step() * merit.metrics(0.0, 0.0, None).samples.saturating_sub(1) as f64;
        let loop_delay =
            self.loops.iter().map(|l| l.ticks).max().map(|ticks| ticks as f64 * self.clock.step());
        let mut metrics = merit.metrics(wall, reached, loop_delay);
        let mut files = vec!["results.json", "metrics.json"];
        if recorder.is_some() {
            files.insert(0, options.files.format.file());
        }
        let sidecar = sidecar::sidecar(self, &parameters, options.real_time, outcome.as_ref().err());
        write_json(&out.join("results.json"), &sidecar)?;
        if let Some(pacer) = master.take_pacer() {
            let (mut real_time, wake_ups, steps) = pacer.report();
            real_time.priority = priority;
            warn(&real_time, options.quiet);
            realtime::plot::draw(&out.join("realtime.svg"), &experiment.title, &real_time, wake_ups, steps)?;
            files.push("realtime.svg");
            metrics.real_time = Some(real_time);
        }
        write_json(&out.join("metrics.json"), &metrics)?;
        if !options.files.no_plot && curves.draw(&out.join("plot.svg"), &experiment.title)? {
            files.push("plot.svg");
        }
        let ended = match outcome {
            Ok(()) => None,
            Err(
                error @ (Error::Deadline { .. }
                | Error::Interrupted { .. }
                | Error::EndedByUnit { .. }
                | Error::Lost { .. }),
            ) => Some(error),
            Err(error) => {
                tracing::warn!("the results until then are in {}", out.display());
                return Err(error);
            }
        };
        Ok(Report {
            title: experiment.title.clone(),
            clock: self.clock,
            coupling: experiment.simulation.coupling,
            order: self.order.clone(),
            metrics,
            loops: self.loops.clone(),
            out,
            files,
            ended,
        })
    }

    /// Warns of settings that are doubtful although the experiment can be run.
    fn warn(&self, interrupt: &Interrupt) -> Result<(), Error> {
        for warning in delay::warnings(&self.parts(), &self.settings, &self.loops, self.clock.step()) {
            tracing::warn!("{warning}");
        }
        for seed in seeds::without_effect(self, interrupt)? {
            tracing::warn!("--set {seed}: changes nothing, another seed comes to the same");
        }
        Ok(())
    }

    /// Creates the recorder, which writes the file of the recorded variables.
    fn recorder(&self, out: &Path, files: Files) -> Result<Recorder, Error> {
        let column = |column: &Column| {
            let place = self.place(column.port)?;
            let kind = &self.fmus[column.port.component].description.variables[column.port.variable].kind;
            let unit = match kind {
                Kind::Real { unit, .. } => unit.clone(),
                _ => None,
            };
            let (name, carrier) = (column.name.clone(), column.port.carrier);
            Some(recorder::Column { name, place, carrier, unit, items: self.items(place) })
        };
        let columns: Vec<_> = self.columns.iter().filter_map(column).collect();
        let path = out.join(files.format.file());
        Recorder::create(&path, files.format, &columns, self.experiment.record.every, files.labels)
    }

    /// Returns the initialized units, and the limits that the experiment states.
    ///
    /// # Errors
    /// If a unit cannot be instantiated or initialized.
    pub fn initialized(&self) -> Result<(Master, Limits), Error> {
        self.initialized_with(&self.probes)
    }

    /// Returns the units initialized with `settings` in place of the plan's own settings.
    ///
    /// # Errors
    /// If a unit cannot be instantiated or initialized.
    pub fn ready(&self, settings: &[Vec<Setting>], interrupt: &Interrupt) -> Result<Master, Error> {
        let mut master = self.master(&self.probes, settings)?;
        master.heed(interrupt);
        master.initialize()?;
        Ok(master)
    }

    fn initialized_with(&self, probes: &Probes) -> Result<(Master, Limits), Error> {
        let mut master = self.master(probes, &self.settings)?;
        master.initialize()?;
        let limit = |port: Option<Port>, master: &mut Master| {
            port.map(|port| master.read(&[port]).map(|values| values[0])).transpose()
        };
        let limits =
            Limits { rate: limit(self.limits[0], &mut master)?, moment: limit(self.limits[1], &mut master)? };
        Ok((master, limits))
    }

    /// Index of a recorded variable among a sample's values.
    pub fn place(&self, port: Port) -> Option<usize> {
        self.probes.ports.iter().position(|known| *known == port)
    }

    /// Items of the enumeration at this index among a sample's values; empty if the variable has
    /// another type.
    fn items(&self, place: usize) -> Vec<(String, i32)> {
        let port = self.probes.ports[place];
        match &self.fmus[port.component].description.variables[port.variable].kind {
            Kind::Enumeration { items } => items.clone(),
            _ => Vec::new(),
        }
    }

    /// Creates an observer for the figures of merit that has seen no sample yet.
    pub fn merit(&self, limits: Limits) -> Merit {
        let statuses =
            self.places.guarantee.and_then(|signals| signals.status).map(|place| self.items(place));
        Merit::new(self.places, limits, self.clock.ticks() + 1)
            .with_statuses(statuses.unwrap_or_default())
            .with_loss(self.experiment.metrics.lost_deg)
    }

    /// Instantiates the units and sets their parameters.
    fn master(&self, probes: &Probes, settings: &[Vec<Setting>]) -> Result<Master, Error> {
        let every = periods(&self.experiment, &self.order);
        let mut members = Vec::new();
        for (index, name) in self.order.iter().enumerate() {
            let fmu = &self.fmus[index];
            let unit: Box<dyn CoSimulationUnit> = Box::new(fmu.instantiate(name)?);
            let on_invalid = self.experiment.simulation.on_invalid;
            let mut unit = Watched::around(unit, name, fmu, on_invalid);
            settings::apply(&settings[index], unit.as_mut()).map_err(|failure| Error::Unit {
                component: name.clone(),
                time: self.clock.start(),
                failure,
            })?;
            members.push(Member { name: name.clone(), every: every[index], unit });
        }
        let coupling = self.experiment.simulation.coupling;
        Ok(Master::new(self.clock, coupling, members, &self.wires, &probes.ports))
    }

    /// Reads the values of all parameters after initialization, except those of type String.
    ///
    /// # Errors
    /// If a unit cannot be read.
    pub fn parameters(&self, master: &mut Master) -> Result<sidecar::Parameters, Error> {
        let parts = self.parts();
        let mut all = sidecar::Parameters::new();
        for part in &parts {
            let mut own = BTreeMap::new();
            for name in part.description.names("parameter") {
                let Some(port) = wiring::find(&format!("{}.{name}", part.name), &parts) else { continue };
                let value = master.read(&[port])?[0];
                own.insert(name.to_string(), plain_value(part.description, port, value));
            }
            all.insert(part.name.to_string(), own);
        }
        Ok(all)
    }
}

/// Opens an archive, and warns if its description has a fault.
fn open(path: &Path) -> Result<Fmu, Error> {
    let fmu = Fmu::open(path)?;
    let faults = faults::faults(&fmu.description);
    if let Some(first) = faults.first() {
        let more = match faults.len() {
            1 => String::new(),
            count => format!(" ({} more: orchestrator inspect --check)", count - 1),
        };
        warnings::warn_once(format!("{}: {first}{more}", path.display()));
    }
    Ok(fmu)
}

/// Warns of missed deadlines and refused priorities if no summary is printed.
fn warn(real_time: &realtime::report::RealTime, quiet: bool) {
    if !quiet {
        return;
    }
    if let Some(done) = real_time.done_about_it() {
        tracing::warn!("{} of {} deadlines missed; {done}", real_time.misses, real_time.deadlines);
    }
    if let Priority::Refused(reason) | Priority::Fifo { unlocked: Some(reason), .. } = &real_time.priority {
        tracing::warn!("--priority: {reason}");
    }
}

/// Explains which component was meant if a parameter is given without one, or with a wrong one.
fn whereabouts(target: &str, parts: &[Part]) -> String {
    let of = |part: &Part| {
        let known = part.description.names("parameter").chain(part.description.names("input"));
        known.map(|name| format!("{}.{name}", part.name)).collect::<Vec<_>>()
    };
    let all: Vec<String> = parts.iter().flat_map(of).collect();
    let meant: Vec<&str> = all
        .iter()
        .filter(|name| names::split(name).is_some_and(|(_, rest)| rest == target))
        .map(String::as_str)
        .collect();
    if !meant.is_empty() {
        return format!("of which component? Write {}", meant.join(" or "));
    }
    let component = names::split(target).map_or(target, |(component, _)| component);
    let hint = match names::nearest(target, all.iter().map(String::as_str)) {
        Some(name) => format!("; did you mean \"{name}\"?"),
        None => names::hint(component, parts.iter().map(|part| part.name)),
    };
    format!("there is no component \"{component}\"{hint}")
}

fn parts<'a>(order: &'a [String], fmus: &'a [Rc<Fmu>]) -> Vec<Part<'a>> {
    order.iter().zip(fmus).map(|(name, fmu)| Part { name, description: &fmu.description }).collect()
}

/// Largest number of steps. Beyond it the times of two steps coincide, because units treat instants
/// as equal if they differ by less than 1e-9 of their size.
const MOST_STEPS: u64 = 1_000_000_000;
/// Approximate size of a number in `results.csv`, bytes.
const NUMBER: f64 = 20.0;
/// Lower bound of the computing time of a step of two small units, s.
const QUICK: f64 = 1e-5;

/// Rejects experiments that no machine can run, and warns of results that fill a disk.
fn check_size(experiment: &Experiment, clock: &Clock, columns: usize) -> Result<(), Error> {
    let steps = clock.ticks();
    let rows = steps as f64 / f64::from(experiment.record.every);
    let gigabytes = rows * (columns + 1) as f64 * NUMBER / 1e9;
    if steps > MOST_STEPS {
        let message = format!(
            "[simulation] {steps} steps of {} s: there can be {MOST_STEPS} at most. results.csv would take about \
             {gigabytes:.0} GB and the run {:.0} h or more: take a longer step or an earlier stop",
            clock.step(),
            steps as f64 * QUICK / 3600.0
        );
        return Err(experiment.source.error(&(0..0), message));
    }
    if gigabytes > 10.0 {
        tracing::warn!(
            "results.csv will take about {gigabytes:.0} GB: [record] every = n writes every n-th step only"
        );
    }
    Ok(())
}

/// Checks that an FMU that can be instantiated only once per process is used by one component only.
fn check_single_instances(experiment: &Experiment, order: &[String], fmus: &[Rc<Fmu>]) -> Result<(), Error> {
    for (index, fmu) in fmus.iter().enumerate() {
        let only_once = fmu
            .description
            .co_simulation
            .as_ref()
            .is_some_and(|interface| interface.has("canBeInstantiatedOnlyOncePerProcess"));
        if only_once && let Some(other) = fmus[..index].iter().position(|other| Rc::ptr_eq(other, fmu)) {
            let message = format!(
                "\"{}\" and \"{}\" both use {}, which can be instantiated only once per process",
                order[other],
                order[index],
                fmu.path.display()
            );
            return Err(experiment.source.error(&(0..0), message));
        }
    }
    Ok(())
}

fn plain_value(description: &ModelDescription, port: Port, value: f64) -> serde_json::Value {
    match &description.variables[port.variable].kind {
        Kind::Boolean => (value != 0.0).into(),
        Kind::Integer { .. } => (value as i64).into(),
        Kind::Enumeration { items } => items
            .iter()
            .find(|(_, item)| f64::from(*item) == value)
            .map_or_else(|| (value as i64).into(), |(name, _)| name.as_str().into()),
        Kind::Real { .. } | Kind::String => value.into(),
    }
}

fn write_json(path: &Path, value: &impl serde::Serialize) -> Result<(), Error> {
    let mut text = serde_json::to_string_pretty(value).map_err(|error| Error::file(path)(error.into()))?;
    text.push('\n');
    fs::write(path, text).map_err(Error::file(path))
}

fn periods(experiment: &Experiment, order: &[String]) -> Vec<u32> {
    order.iter().map(|name| experiment.components[name].every).collect()
}

/// Names of the components, in the order in which their inputs are set.
fn order(experiment: &Experiment) -> Result<Vec<String>, Error> {
    let refuse = |message: String| Err(experiment.source.error(&(0..0), message));
    let names: Vec<&str> = experiment.components.keys().map(String::as_str).collect();
    if let Some(name) = names.iter().find(|name| name.is_empty() || name.contains('.')) {
        return refuse(format!("the component name \"{name}\" must not be empty or hold a dot"));
    }
    if let Some((name, _)) = experiment.components.iter().find(|(_, component)| component.every == 0) {
        return refuse(format!("[components.{name}] every = 0: must be at least 1"));
    }
    if experiment.record.every == 0 {
        return refuse("[record] every = 0: must be at least 1".into());
    }
    let order = &experiment.simulation.order;
    for name in order {
        if !names.contains(&name.as_str()) {
            let hint = names::hint(name, names.iter().copied());
            return refuse(format!("[simulation] order: there is no component \"{name}\"{hint}"));
        }
        if order.iter().filter(|other| *other == name).count() > 1 {
            return refuse(format!("[simulation] order names \"{name}\" twice"));
        }
    }
    if order.is_empty() && (names.len() == 1 || experiment.simulation.coupling == Coupling::Jacobi) {
        return Ok(names.iter().map(ToString::to_string).collect());
    }
    if order.is_empty() {
        return refuse(format!(
            "[simulation] there is no order: name the components in the order in which they get their inputs, those \
             first that answer at once, for example order = [{}]",
            names.iter().map(|name| format!("\"{name}\"")).collect::<Vec<_>>().join(", ")
        ));
    }
    // Components that the order does not name come last, sorted by name.
    let others = names.iter().filter(|name| !order.iter().any(|other| other == *name));
    Ok(order.iter().cloned().chain(others.map(ToString::to_string)).collect())
}

/// Finds the archive of a component: beside the experiment, in the given folders, or where units
/// are found from any folder.
fn find_fmu(experiment: &Experiment, name: &str, fmu_dirs: &[PathBuf]) -> Result<PathBuf, Error> {
    let written = &experiment.components[name].fmu;
    let mut folders: Vec<PathBuf> = experiment.source.folders().map(Path::to_path_buf).collect();
    folders.dedup();
    folders.extend(fmu_dirs.iter().cloned());
    folders.extend(search::units());
    if let Some(path) =
        folders.iter().map(|folder| folder.join(written.get_ref())).find(|path| path.is_file())
    {
        return Ok(path);
    }
    let there: Vec<String> = folders
        .iter()
        .flat_map(|folder| fs::read_dir(folder).into_iter().flatten().flatten())
        .map(|entry| entry.file_name().to_string_lossy().into_owned())
        .filter(|file| Path::new(file).extension().is_some_and(|extension| extension == "fmu"))
        .collect();
    let hint = names::hint(written.get_ref(), there.iter().map(String::as_str));
    let searched: Vec<String> = folders.iter().map(|folder| folder.display().to_string()).collect();
    let message = format!(
        "[components.{name}] there is no file \"{}\" in {}{hint}",
        written.get_ref(),
        searched.join(", ")
    );
    Err(experiment.source.error(&written.span(), message))
}
