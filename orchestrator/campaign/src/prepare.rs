//! Looks up what a campaign names: its experiment, its metrics and measures, and the varied
//! parameters.

use crate::changes::Changes;
use crate::definition::{Campaign, DesignKind, Vary};
use crate::distribution::Distribution;
use cosim::document::Source;
use cosim::error::Error;
use cosim::experiment::{self, Experiment, Observe, Overrides, Protection};
use cosim::files;
use cosim::search;
use cosim::system::{CheckedComponent, System};
use cosim::variation::Target;
use cosim_report::metrics::{Meters, Metrics};
use fmu_import::description::VariableKind as Type;
use fmu_import::names;
use std::collections::BTreeMap;
use std::fs;
use std::ops::Range;
use std::path::{Path, PathBuf};
use toml::Spanned;

/// Version of the files of parts, which must be raised when their content changes.
const FORMAT: u32 = 1;
/// Metrics of every run that depend on the machine, not on the case.
const OF_THE_MACHINE: [&str; 2] = ["real_time_factor", "wall_s"];

/// A parameter that varies, or several that always have the same value.
#[derive(Clone, Debug)]
pub struct Varied {
    /// Name of the first parameter, `component.parameter`, which is that of the column.
    pub name: String,
    /// Unit of the values, or an empty text.
    pub unit: String,
    /// Type of the values.
    pub kind: Type,
    /// Distribution of the values.
    pub distribution: Distribution,
    /// Number of entries, from this one on, whose values are put into ascending order; 0 except in
    /// the first of them.
    pub(crate) sorted: usize,
    pub(crate) targets: Vec<Target>,
    pub(crate) paths: Vec<String>,
    /// Place of the name in the campaign's file.
    pub(crate) span: Range<usize>,
}

/// A number that is recorded of each case.
#[derive(Clone, Debug, PartialEq)]
pub struct Recorded {
    /// Name of the metric or measure.
    pub name: String,
    /// Unit of the number, or an empty text.
    pub unit: String,
    /// Whether a missing value means that something never happened, as with a settling time.
    pub is_never: bool,
}

/// Reads the experiment of a campaign, with the settings of the campaign and the command line.
pub(crate) fn read_experiment(campaign: &Campaign, changes: &Changes) -> Result<Experiment, Error> {
    let source = &campaign.source;
    let span = campaign.experiment.span();
    let beside = source.beside(campaign.experiment.get_ref());
    let path = match &changes.experiment {
        Some(name) => search::experiment(name)?,
        None if beside.is_file() => beside,
        None => search::experiment(campaign.experiment.get_ref())
            .map_err(|error| source.error(&span, error.to_string()))?,
    };
    let mut experiment = Experiment::load(&path)?;
    let mut overrides = Overrides::default();
    for (component, fmu) in &campaign.fmu {
        let beside = source.beside(fmu);
        let file = if beside.is_file() { beside } else { fmu.clone() };
        overrides.fmu.push(format!("{component}={}", file.display()));
    }
    experiment.apply(&overrides)?;
    for (name, value) in &campaign.set {
        let outcome = experiment.set(name, value.get_ref().clone());
        outcome.map_err(|problem| source.error(&value.span(), format!("[set] {problem}")))?;
    }
    experiment.apply(&changes.overrides)?;
    Ok(experiment)
}

/// Returns the observations of each case: the metrics that the campaign names and its measures.
pub(crate) fn observe(campaign: &Campaign, experiment: &Observe) -> Result<Observe, Error> {
    let source = &campaign.source;
    let mut signals = experiment.signals.clone();
    signals.extend(campaign.signals.clone());
    let names = Metrics::names(experiment);
    let names = || names.iter().map(String::as_str).filter(|name| !OF_THE_MACHINE.contains(name));
    source.check_names(&campaign.metrics, "metric of the experiment", names())?;
    let mut metrics = BTreeMap::new();
    for name in &campaign.metrics {
        let Some(measure) = experiment.metrics.get(name.get_ref()) else { continue };
        if measure.timing {
            let message = format!(
                "metrics: \"{}\" is a computing time, which differs from run to run",
                name.get_ref()
            );
            return Err(source.error(&name.span(), message));
        }
        metrics.insert(name.get_ref().clone(), measure.clone());
    }
    for measure in &campaign.measures {
        source.check_names(
            [&measure.signals],
            "list of signals",
            signals.keys().map(String::as_str),
        )?;
        let mut measure = measure.clone();
        let id = std::mem::take(&mut measure.id);
        if metrics.contains_key(&id) || names().any(|name| name == id) {
            let message = format!("[[measure]] {id}: the experiment has a metric of this name");
            return Err(source.error(&measure.signals.span(), message));
        }
        metrics.insert(id, measure);
    }
    for measure in metrics.values_mut() {
        measure.limit = None;
    }
    let asks_guarantee =
        campaign.metrics.iter().any(|name| !experiment.metrics.contains_key(name.get_ref()));
    Ok(Observe {
        signals,
        metrics,
        summary: Vec::new(),
        guarantee: experiment.guarantee.clone().filter(|_| asks_guarantee),
        loss: experiment.loss.clone(),
        panels: experiment.panels.clone(),
        readings: BTreeMap::new(),
    })
}

/// Makes the distributions of one `[[vary]]`.
pub(crate) fn distributions(
    vary: &Vary,
    source: &Source,
    system: &System,
) -> Result<Vec<Varied>, Error> {
    let mut groups: Vec<(Range<usize>, Vec<String>)> = Vec::new();
    if let Some(parameter) = &vary.parameter {
        groups.push((parameter.span(), parameter.get_ref().names().to_vec()));
    }
    groups.extend(vary.each.iter().map(|name| (name.span(), vec![name.get_ref().clone()])));
    let both = vary.parameter.is_some() && !vary.each.is_empty();
    if groups.is_empty() || both || groups.iter().any(|(_, names)| names.is_empty()) {
        let span = groups.first().map_or(0..0, |(span, _)| span.clone());
        return Err(source.error(&span, "[[vary]] needs either parameter or each"));
    }
    let mut varied = Vec::new();
    for (span, paths) in groups {
        let name = paths[0].clone();
        let fault =
            |problem: String| source.error(&span, format!("[[vary]] \"{name}\": {problem}"));
        let targets = paths.iter().map(|path| {
            system
                .target(path)
                .map_err(|problem| source.error(&span, format!("[[vary]] \"{path}\": {problem}")))
        });
        let targets = targets.collect::<Result<Vec<_>, _>>()?;
        let variable = system.variable(targets[0]);
        for other in &targets[1..] {
            if system.variable(*other).kind.name() != variable.kind.name() {
                return Err(fault("parameters that share a value must be of the same type".into()));
            }
        }
        let distribution = Distribution::new(vary, targets[0], system).map_err(&fault)?;
        let unit = match &variable.kind {
            Type::Real { unit, .. } => unit.clone().unwrap_or_default(),
            _ => String::new(),
        };
        varied.push(Varied {
            name: name.clone(),
            unit,
            kind: variable.kind.clone(),
            distribution,
            sorted: 0,
            targets,
            paths,
            span,
        });
    }
    if vary.sorted {
        let is_real = varied.iter().all(|entry| matches!(entry.kind, Type::Real { .. }));
        let Some(first) = varied.first_mut().filter(|_| is_real && vary.each.len() > 1) else {
            let span = vary.each.first().map_or(0..0, Spanned::span);
            return Err(
                source.error(&span, "[[vary]] sorted is for several real parameters in each")
            );
        };
        first.sorted = vary.each.len();
    }
    Ok(varied)
}

/// Lists the numbers that are recorded: the metrics in the order of the file, then the measures.
pub(crate) fn recorded(campaign: &Campaign, observe: &Observe, meters: &Meters) -> Vec<Recorded> {
    let units = meters.metrics().units;
    let names = campaign.metrics.iter().map(|name| name.get_ref().clone());
    let names = names.chain(campaign.measures.iter().map(|measure| measure.id.clone()));
    names
        .map(|name| Recorded {
            unit: units.get(&name).cloned().unwrap_or_default(),
            is_never: observe.metrics.get(&name).is_some_and(|measure| {
                matches!(
                    measure.kind,
                    experiment::MeasureKind::Settling | experiment::MeasureKind::Leaving
                )
            }),
            name,
        })
        .collect()
}

/// Hashes all inputs of the cases.
pub(crate) fn keys(
    campaign: &Campaign,
    changes: &Changes,
    system: &System,
) -> Result<BTreeMap<String, String>, Error> {
    let mut table: toml::Table = toml::from_str(campaign.source.whole())
        .map_err(|error| campaign.source.error(&(0..0), error.to_string()))?;
    // These change neither the cases nor what is recorded of them. Experiment and FMUs count by
    // their content, wherever they are.
    for key in ["title", "description", "extends", "experiment", "fmu", "until", "keep", "search"] {
        table.remove(key);
    }
    if campaign.design != DesignKind::LatinHypercube && campaign.design != DesignKind::Corners {
        table.remove("cases");
    }
    let text = toml::to_string(&table).map_err(|error| Error::experiment(error.to_string()))?;
    // FMUs count by their content here as well, and it is the same for a case in which processes
    // its instances run.
    let (fmu, isolation) = (Vec::new(), Protection::default());
    let overrides = Overrides { fmu, isolation, ..changes.overrides.clone() };
    let text = format!("{text}{overrides:?}");
    let mut keys = BTreeMap::from([
        ("campaign".to_string(), files::digest(text)),
        ("experiment".to_string(), files::digest(system.experiment.source.whole())),
        ("program".to_string(), format!("{} {FORMAT}", env!("CARGO_PKG_VERSION"))),
    ]);
    for CheckedComponent { name, fmu, .. } in &system.components {
        let bytes = fs::read(&fmu.path).map_err(Error::file(&fmu.path))?;
        keys.insert(format!("FMU of {name}"), files::digest(bytes));
    }
    Ok(keys)
}

/// Finds the campaign with this name: a file, or one below the campaigns of the experiments.
///
/// # Errors
/// Returns an error if there is no such campaign.
pub fn find(name: &Path) -> Result<PathBuf, Error> {
    if name.is_file() {
        return Ok(name.to_path_buf());
    }
    let folders = || search::experiments().into_iter().map(|root| root.join("campaigns"));
    let file = search::with_toml(name);
    if let Some(path) = folders().map(|folder| folder.join(&file)).find(|path| path.is_file()) {
        return Ok(path);
    }
    let there: Vec<String> = folders()
        .flat_map(|folder| fs::read_dir(folder).into_iter().flatten().flatten())
        .filter_map(|entry| Some(entry.path().file_stem()?.to_string_lossy().into_owned()))
        .collect();
    let hint = names::hint(&name.to_string_lossy(), there.iter().map(String::as_str));
    Err(Error::experiment(format!(
        "there is no campaign \"{}\", neither as a file nor among the experiments' campaigns{hint}",
        name.display()
    )))
}
