//! A campaign that is ready to be flown: all names are looked up, and every parameter that varies
//! has its distribution.

use crate::changes::Changes;
use crate::correlation::{Correlated, correlation};
use crate::definition::{Campaign, Kind, Limit, Vary};
use crate::design::{Design, Place};
use crate::law::Law;
use crate::table::hex;
use cosim::check::check;
use cosim::document::Source;
use cosim::error::Error;
use cosim::experiment::{self, Experiment, Observe, Overrides};
use cosim::search;
use cosim::system::{Opened, System};
use cosim::variation::{SettingValue, Target};
use cosim_report::metrics::{Meters, Metrics};
use fmu_import::description::Kind as Type;
use fmu_import::names;
use serde_json::{Map, Value, json};
use sha2::{Digest, Sha256};
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

/// Version of the files of parts, which must be raised when their content changes.
const FORMAT: u32 = 1;
/// Metrics of every run that are those of the machine, not of the case.
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
    pub law: Law,
    targets: Vec<Target>,
    paths: Vec<String>,
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

/// A campaign that is ready to be flown.
pub struct Plan {
    /// The campaign as its file describes it.
    pub campaign: Campaign,
    /// What varies, in the order of the design's dimensions.
    pub varied: Vec<Varied>,
    /// Numbers that are recorded of each case.
    pub recorded: Vec<Recorded>,
    /// Places of the cases.
    pub design: Design,
    /// Hashes of all that the cases depend on, by what it is.
    pub keys: BTreeMap<String, String>,
    /// Simulated time at which the cases start and stop, s.
    pub span: [f64; 2],
    /// Arguments of the program that name the campaign and the changes to it.
    pub command: String,
    experiment: Experiment,
    /// Paths of the archives, by component.
    archives: BTreeMap<String, PathBuf>,
    /// Experiment that the command line names.
    replaced: Option<PathBuf>,
    fmu_dirs: Vec<PathBuf>,
    correlation: Option<Correlated>,
}

impl Plan {
    /// Prepares a campaign, with what the command line changes.
    ///
    /// # Errors
    /// Returns an error that names the key at fault, with its line and the nearest right name.
    pub fn new(campaign: Campaign, changes: &Changes, fmu_dirs: &[PathBuf]) -> Result<Self, Error> {
        let mut experiment = experiment(&campaign, changes)?;
        experiment.observe = observe(&campaign, &experiment.observe)?;
        let fmu_dirs = fmu_dirs.to_vec();
        let mut opened = Opened::default();
        let mut system = check(experiment.clone(), &fmu_dirs, &mut opened)?;
        let mut varied = Vec::new();
        for vary in &campaign.vary {
            varied.extend(laws(vary, &campaign.source, &system)?);
        }
        for (i, own) in varied.iter().enumerate() {
            let twice = own.paths.iter().find(|path| {
                varied[..i].iter().any(|other: &Varied| other.paths.contains(path))
                    || own.paths.iter().filter(|other| other == path).count() > 1
            });
            if let Some(path) = twice {
                let message = format!("[[vary]] \"{path}\" varies twice");
                return Err(campaign.source.error(&(0..0), message));
            }
        }
        let laws: Vec<_> = varied.iter().map(|own| (own.name.as_str(), &own.law)).collect();
        let correlation = correlation(&campaign, &laws)?;
        let levels = varied.iter().map(|own| {
            let fault = |problem| {
                campaign.source.error(&(0..0), format!("[[vary]] \"{}\": {problem}", own.name))
            };
            match campaign.design {
                Kind::Factorial => own.law.levels().map_err(fault),
                Kind::Corners => own.law.check_ends().map(|()| 0).map_err(fault),
                Kind::Sensitivity if !own.law.is_ordered() && !own.law.is_counted() => Ok(0),
                _ => Ok(0),
            }
        });
        let levels = levels.collect::<Result<Vec<_>, _>>()?;
        let design = Design::new(campaign.design, campaign.seed, campaign.cases, levels)
            .map_err(|problem| campaign.source.error(&(0..0), problem))?;
        let meters = Meters::new(&mut system)?;
        let recorded = recorded(&campaign, &system.experiment.observe, &meters);
        let keys = keys(&campaign, changes, &system)?;
        let span = [system.clock.start(), system.clock.stop()];
        let command = changes.command(&campaign);
        let plan = Self {
            command,
            archives: system
                .order
                .iter()
                .cloned()
                .zip(system.fmus.iter().map(|fmu| fmu.path.clone()))
                .collect(),
            replaced: changes.experiment.clone(),
            campaign,
            varied,
            recorded,
            design,
            keys,
            span,
            experiment,
            fmu_dirs,
            correlation,
        };
        plan.check_limits()?;
        Ok(plan)
    }

    /// Returns the name of the results' folder: that of the campaign, and that of the experiment if
    /// the command line names one.
    pub fn name(&self) -> String {
        let campaign = self.campaign.name();
        let stem = self.replaced.as_ref().and_then(|path| path.file_stem());
        stem.map_or(campaign.clone(), |stem| format!("{campaign}-{}", stem.to_string_lossy()))
    }

    /// Returns the number of cases.
    pub fn cases(&self) -> u64 {
        self.design.cases()
    }

    /// Returns the experiment of all cases, in which nothing varies.
    pub fn experiment(&self) -> &Experiment {
        &self.experiment
    }

    /// Makes a system of the experiment. Archives that are already in `opened` are not opened again.
    ///
    /// # Errors
    /// Returns an error if the experiment or an archive is faulty.
    pub fn system(&self, opened: &mut Opened) -> Result<System, Error> {
        check(self.experiment.clone(), &self.fmu_dirs, opened)
    }

    /// Returns the values of a case, one for each entry of [`Self::varied`].
    ///
    /// # Errors
    /// Returns an error if a value cannot be that of its parameter.
    pub fn values(&self, case: u64) -> Result<Vec<SettingValue>, Error> {
        self.values_at(&self.design.place(case), case)
    }

    /// Returns the values at a place for the case with this number.
    ///
    /// # Errors
    /// Returns an error if a value cannot be that of its parameter.
    pub fn values_at(&self, places: &[Place], case: u64) -> Result<Vec<SettingValue>, Error> {
        let mut places = places.to_vec();
        if let Some(correlated) = &self.correlation {
            correlated.apply(&mut places);
        }
        let values = self.varied.iter().zip(places).map(|(own, place)| {
            own.law.value(place, case).map_err(|problem| {
                let message = format!("[[vary]] \"{}\", case {case}: {problem}", own.name);
                self.campaign.source.error(&(0..0), message)
            })
        });
        values.collect()
    }

    /// Returns the changes that these values make to the system.
    pub fn changes(&self, values: &[SettingValue]) -> Vec<(Target, SettingValue)> {
        let each = self.varied.iter().zip(values);
        each.flat_map(|(own, value)| own.targets.iter().map(|target| (*target, value.clone())))
            .collect()
    }

    /// Writes a case as the text of an experiment that extends the one of the campaign.
    ///
    /// # Errors
    /// Returns an error if the text cannot be written as TOML.
    pub fn experiment_of(&self, title: &str, values: &[SettingValue]) -> Result<String, Error> {
        let mut table: toml::Table = toml::from_str(self.experiment.source.whole())
            .map_err(|error| Error::experiment(error.to_string()))?;
        table.remove("extends");
        table.remove("unset");
        table.insert("title".into(), title.into());
        let components = table.entry("components").or_insert_with(|| toml::Table::new().into());
        for (name, component) in &self.experiment.components {
            let own = components.as_table_mut().and_then(|all| all.get_mut(name));
            let Some(own) = own.and_then(toml::Value::as_table_mut) else { continue };
            own.insert("fmu".into(), self.archive(name).into());
            let parameters = component.parameters.iter();
            let mut parameters: toml::Table =
                parameters.map(|(name, value)| (name.clone(), value.get_ref().clone())).collect();
            for (varied, value) in self.varied.iter().zip(values) {
                for path in &varied.paths {
                    if let Some((_, rest)) = names::split(path).filter(|(of, _)| of == name) {
                        parameters.insert(rest.into(), written(value));
                    }
                }
            }
            own.insert("parameters".into(), parameters.into());
        }
        toml::to_string(&table).map_err(|error| Error::experiment(error.to_string()))
    }

    /// Returns what an experiment in another folder calls the archive of a component: its file name if
    /// it is found by that from any folder, and else its path.
    fn archive(&self, component: &str) -> String {
        let written = self.experiment.components[component].fmu.get_ref();
        let is_there = |folder: &PathBuf| folder.join(written).is_file();
        match self.archives.get(component).and_then(|path| std::path::absolute(path).ok()) {
            Some(path) if !search::units().iter().any(is_there) => path.display().to_string(),
            _ => written.clone(),
        }
    }

    /// Returns the limits with the position of their measure in [`Self::recorded`].
    pub fn limits(&self) -> impl Iterator<Item = (&Limit, usize)> {
        let place = |limit: &Limit| {
            self.recorded.iter().position(|own| own.name == *limit.measure.get_ref())
        };
        self.campaign.limits.iter().filter_map(move |limit| Some((limit, place(limit)?)))
    }

    /// Returns units by column, as JSON for the metadata of a table.
    pub fn units(&self) -> String {
        let varied = self.varied.iter().map(|own| (&own.name, &own.unit));
        let recorded = self.recorded.iter().map(|own| (&own.name, &own.unit));
        let units = varied.chain(recorded).filter(|(_, unit)| !unit.is_empty());
        let mut units: Map<String, Value> =
            units.map(|(name, unit)| (name.clone(), json!(unit))).collect();
        units.insert("time".into(), json!("s"));
        Value::Object(units).to_string()
    }

    fn check_limits(&self) -> Result<(), Error> {
        let names = || self.recorded.iter().map(|own| own.name.as_str());
        let source = &self.campaign.source;
        let referred = self
            .campaign
            .limits
            .iter()
            .map(|limit| &limit.measure)
            .chain(&self.campaign.keep.by)
            .chain(self.campaign.search.as_ref().map(|search| &search.largest));
        source.known(referred, "metric or measure", names())?;
        for limit in self.campaign.limits.iter().filter(|limit| limit.ends) {
            let measure = self.experiment.observe.metrics.get(limit.measure.get_ref());
            if measure.is_none_or(|measure| measure.kind != experiment::Kind::Largest) {
                let message = format!(
                    "[[limit]] {}: ends needs a measure of the kind largest, which only grows",
                    limit.id
                );
                return Err(source.error(&limit.measure.span(), message));
            }
        }
        Ok(())
    }
}

/// Reads the experiment of a campaign, with what the campaign and the command line set in it.
fn experiment(campaign: &Campaign, changes: &Changes) -> Result<Experiment, Error> {
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
    for name in &campaign.unset {
        let outcome = experiment.unset(name.get_ref());
        outcome.map_err(|problem| source.error(&name.span(), format!("unset: {problem}")))?;
    }
    for (name, value) in &campaign.set {
        let outcome = experiment.set(name, value.get_ref().clone());
        outcome.map_err(|problem| source.error(&value.span(), format!("[set] {problem}")))?;
    }
    experiment.apply(&changes.overrides)?;
    Ok(experiment)
}

/// Returns what is observed of each case: the metrics that the campaign names and its measures.
fn observe(campaign: &Campaign, own: &Observe) -> Result<Observe, Error> {
    let source = &campaign.source;
    let mut signals = own.signals.clone();
    signals.extend(campaign.signals.clone());
    let known = Metrics::names(own);
    let known = || known.iter().map(String::as_str).filter(|name| !OF_THE_MACHINE.contains(name));
    source.known(&campaign.metrics, "metric of the experiment", known())?;
    let mut metrics = BTreeMap::new();
    for name in &campaign.metrics {
        let Some(measure) = own.metrics.get(name.get_ref()) else { continue };
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
        source.known([&measure.signals], "list of signals", signals.keys().map(String::as_str))?;
        let mut measure = measure.clone();
        let id = std::mem::take(&mut measure.id);
        if metrics.contains_key(&id) || known().any(|name| name == id) {
            let message = format!("[[measure]] {id}: the experiment has a metric of this name");
            return Err(source.error(&measure.signals.span(), message));
        }
        metrics.insert(id, measure);
    }
    for measure in metrics.values_mut() {
        measure.limit = None;
    }
    let asks_guarantee =
        campaign.metrics.iter().any(|name| !own.metrics.contains_key(name.get_ref()));
    Ok(Observe {
        signals,
        metrics,
        summary: Vec::new(),
        guarantee: own.guarantee.clone().filter(|_| asks_guarantee),
        loss: own.loss.clone(),
        panels: own.panels.clone(),
        readings: BTreeMap::new(),
    })
}

/// Makes the distributions of one entry of what varies.
fn laws(vary: &Vary, source: &Source, system: &System) -> Result<Vec<Varied>, Error> {
    let mut groups: Vec<(std::ops::Range<usize>, Vec<String>)> = Vec::new();
    if let Some(parameter) = &vary.parameter {
        groups.push((parameter.span(), parameter.get_ref().all().to_vec()));
    }
    groups.extend(vary.each.iter().map(|name| (name.span(), vec![name.get_ref().clone()])));
    let both = vary.parameter.is_some() && !vary.each.is_empty();
    if groups.is_empty() || both || groups.iter().any(|(_, names)| names.is_empty()) {
        let span = groups.first().map_or(0..0, |(span, _)| span.clone());
        return Err(source.error(&span, "[[vary]] wants either parameter or each"));
    }
    let mut all = Vec::new();
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
                return Err(fault("parameters with the same value must be of one type".into()));
            }
        }
        let law = Law::new(vary, targets[0], system).map_err(&fault)?;
        let unit = match &variable.kind {
            Type::Real { unit, .. } => unit.clone().unwrap_or_default(),
            _ => String::new(),
        };
        all.push(Varied {
            name: name.clone(),
            unit,
            kind: variable.kind.clone(),
            law,
            targets,
            paths,
        });
    }
    Ok(all)
}

/// Lists the numbers that are recorded: the metrics in the order of the file, then the measures.
fn recorded(campaign: &Campaign, observe: &Observe, meters: &Meters) -> Vec<Recorded> {
    let units = meters.metrics().units;
    let names = campaign.metrics.iter().map(|name| name.get_ref().clone());
    let names = names.chain(campaign.measures.iter().map(|measure| measure.id.clone()));
    names
        .map(|name| Recorded {
            unit: units.get(&name).cloned().unwrap_or_default(),
            is_never: observe.metrics.get(&name).is_some_and(|measure| {
                matches!(measure.kind, experiment::Kind::Settling | experiment::Kind::Leaving)
            }),
            name,
        })
        .collect()
}

/// Hashes what the cases depend on.
fn keys(
    campaign: &Campaign,
    changes: &Changes,
    system: &System,
) -> Result<BTreeMap<String, String>, Error> {
    let digest = |bytes: &[u8]| hex(&Sha256::digest(bytes));
    let mut own: toml::Table = toml::from_str(campaign.source.whole())
        .map_err(|error| campaign.source.error(&(0..0), error.to_string()))?;
    // These change neither the cases nor what is recorded of them.
    for key in ["title", "description", "extends", "until", "keep", "search"] {
        own.remove(key);
    }
    if campaign.design != Kind::LatinHypercube && campaign.design != Kind::Corners {
        own.remove("cases");
    }
    let own = toml::to_string(&own).map_err(|error| Error::experiment(error.to_string()))?;
    let own = format!("{own}{:?}", changes.overrides);
    let mut keys = BTreeMap::from([
        ("campaign".to_string(), digest(own.as_bytes())),
        ("experiment".to_string(), digest(system.experiment.source.whole().as_bytes())),
        ("program".to_string(), format!("{} {FORMAT}", env!("CARGO_PKG_VERSION"))),
    ]);
    for (name, fmu) in system.order.iter().zip(&system.fmus) {
        let bytes = fs::read(&fmu.path).map_err(Error::file(&fmu.path))?;
        keys.insert(format!("FMU of {name}"), digest(&bytes));
    }
    Ok(keys)
}

/// Converts a value to TOML.
fn written(value: &SettingValue) -> toml::Value {
    match value {
        SettingValue::Real(value) => (*value).into(),
        SettingValue::Integer(value) => (*value).into(),
        SettingValue::Boolean(value) => (*value).into(),
        SettingValue::Item(text, _) | SettingValue::Text(text) => text.as_str().into(),
    }
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
    let file = name.with_extension("toml");
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
