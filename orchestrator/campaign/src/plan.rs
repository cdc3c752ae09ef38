//! A campaign that is ready to be flown: all names are looked up, and every parameter that varies
//! has its distribution.

use crate::changes::Changes;
use crate::correlation::{Correlated, correlation};
use crate::definition::{Campaign, DesignKind, Limit};
use crate::design::{Design, Place};
use crate::prepare::{Recorded, Varied, distributions, keys, observe, read_experiment, recorded};
use cosim::check::check;
use cosim::error::Error;
use cosim::experiment::{self, Experiment};
use cosim::search;
use cosim::system::{Opened, System};
use cosim::variation::{SettingValue, Target};
use cosim_report::metrics::Meters;
use fmu_import::names;
use serde_json::{Map, Value, json};
use std::cmp::Ordering;
use std::collections::BTreeMap;
use std::path::PathBuf;

/// A campaign that is ready to be flown.
pub struct Plan {
    /// The campaign as its file describes it.
    pub campaign: Campaign,
    /// Varied parameters, in the order of the design's dimensions.
    pub varied: Vec<Varied>,
    /// Numbers that are recorded of each case.
    pub recorded: Vec<Recorded>,
    /// Places of the cases.
    pub design: Design,
    /// Hashes of all inputs of the cases, by their names.
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
    /// Archive of an FMU that can be instantiated only once per process, if there is one.
    pub(crate) single: Option<PathBuf>,
}

impl Plan {
    /// Prepares a campaign, with the changes of the command line.
    ///
    /// # Errors
    /// Returns an error that names the key at fault, with its line and the nearest right name.
    pub fn new(campaign: Campaign, changes: &Changes, fmu_dirs: &[PathBuf]) -> Result<Self, Error> {
        let mut experiment = read_experiment(&campaign, changes)?;
        experiment.observe = observe(&campaign, &experiment.observe)?;
        let fmu_dirs = fmu_dirs.to_vec();
        let mut opened = Opened::default();
        let mut system = check(experiment.clone(), &fmu_dirs, &mut opened)?;
        let mut varied = Vec::new();
        for vary in &campaign.vary {
            varied.extend(distributions(vary, &campaign.source, &system)?);
        }
        for (i, entry) in varied.iter().enumerate() {
            let twice = entry.paths.iter().find(|path| {
                varied[..i].iter().any(|other: &Varied| other.paths.contains(path))
                    || entry.paths.iter().filter(|other| other == path).count() > 1
            });
            if let Some(path) = twice {
                let message = format!("[[vary]] \"{path}\" varies twice");
                return Err(campaign.source.error(&entry.span, message));
            }
        }
        let by_name: Vec<_> =
            varied.iter().map(|entry| (entry.name.as_str(), &entry.distribution)).collect();
        let correlation = correlation(&campaign, &by_name)?;
        let levels = varied.iter().map(|entry| {
            let fault = |problem| {
                campaign
                    .source
                    .error(&entry.span, format!("[[vary]] \"{}\": {problem}", entry.name))
            };
            match campaign.design {
                DesignKind::Factorial => entry.distribution.levels().map_err(fault),
                DesignKind::Corners => entry.distribution.check_ends().map(|()| 0).map_err(fault),
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
        let single = system.components.iter().find(|component| {
            let interface = component.fmu.description.co_simulation.as_ref();
            interface.is_some_and(|interface| interface.has("canBeInstantiatedOnlyOncePerProcess"))
                && !component.is_isolated
        });
        let single = single.map(|component| component.fmu.path.clone());
        let plan = Self {
            command,
            archives: system.components.into_iter().map(|c| (c.name, c.fmu.path.clone())).collect(),
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
            single,
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

    /// Makes a system of the experiment. Archives that are already in `opened` are not opened
    /// again.
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
        self.values_at(&self.design.place(case), self.design.sample(case))
    }

    /// Returns the values at a place. Seeds that differ from case to case are those of this sample
    /// of the design.
    ///
    /// # Errors
    /// Returns an error if a value cannot be that of its parameter.
    pub fn values_at(&self, places: &[Place], sample: u64) -> Result<Vec<SettingValue>, Error> {
        let mut places = places.to_vec();
        if let Some(correlated) = &self.correlation {
            correlated.apply(&mut places);
        }
        let values = self.varied.iter().zip(places).map(|(varied, place)| {
            varied.distribution.value(place, sample).map_err(|problem| {
                let message = format!("[[vary]] \"{}\", sample {sample}: {problem}", varied.name);
                self.campaign.source.error(&varied.span, message)
            })
        });
        let mut values = values.collect::<Result<Vec<_>, _>>()?;
        let groups = self.varied.iter().enumerate().filter(|(_, varied)| varied.sorted > 0);
        for (first, varied) in groups {
            values[first..first + varied.sorted].sort_by(|a, b| match (a, b) {
                (SettingValue::Real(a), SettingValue::Real(b)) => a.total_cmp(b),
                _ => Ordering::Equal,
            });
        }
        Ok(values)
    }

    /// Returns the changes that these values make to the system.
    pub fn changes(&self, values: &[SettingValue]) -> Vec<(Target, SettingValue)> {
        let each = self.varied.iter().zip(values);
        each.flat_map(|(varied, value)| {
            varied.targets.iter().map(|target| (*target, value.clone()))
        })
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
        // The command line may have changed it.
        let simulation = toml::Value::try_from(&self.experiment.simulation);
        let simulation = simulation.map_err(|error| Error::experiment(error.to_string()))?;
        table.insert("simulation".into(), simulation);
        let components = table.entry("components").or_insert_with(|| toml::Table::new().into());
        for (name, component) in &self.experiment.components {
            let entry = components.as_table_mut().and_then(|table| table.get_mut(name));
            let Some(entry) = entry.and_then(toml::Value::as_table_mut) else { continue };
            entry.insert("fmu".into(), self.archive(name).into());
            if component.is_exchanged {
                entry.insert("exchanged".into(), true.into());
            }
            let parameters = component.parameters.iter();
            let mut parameters: toml::Table =
                parameters.map(|(name, value)| (name.clone(), value.get_ref().clone())).collect();
            for (varied, value) in self.varied.iter().zip(values) {
                for path in &varied.paths {
                    if let Some((_, rest)) = names::split(path).filter(|(owner, _)| owner == name) {
                        parameters.insert(rest.into(), written(value));
                    }
                }
            }
            entry.insert("parameters".into(), parameters.into());
        }
        toml::to_string(&table).map_err(|error| Error::experiment(error.to_string()))
    }

    /// Returns what an experiment in another folder calls the archive of a component: its file name
    /// if it is found by that from any folder, and else its path.
    fn archive(&self, component: &str) -> String {
        let written = self.experiment.components[component].fmu.get_ref();
        let is_there = |folder: &PathBuf| folder.join(written).is_file();
        match self.archives.get(component).and_then(|path| std::path::absolute(path).ok()) {
            Some(path) if !search::fmu_folders().iter().any(is_there) => path.display().to_string(),
            _ => written.clone(),
        }
    }

    /// Returns the limits with the position of their measure in [`Self::recorded`].
    pub fn limits(&self) -> impl Iterator<Item = (&Limit, usize)> {
        let place = |limit: &Limit| {
            self.recorded.iter().position(|recorded| recorded.name == *limit.measure.get_ref())
        };
        self.campaign.limits.iter().filter_map(move |limit| Some((limit, place(limit)?)))
    }

    /// Returns units by column, as JSON for the metadata of a table.
    pub fn units(&self) -> String {
        let varied = self.varied.iter().map(|entry| (&entry.name, &entry.unit));
        let recorded = self.recorded.iter().map(|entry| (&entry.name, &entry.unit));
        let units = varied.chain(recorded).filter(|(_, unit)| !unit.is_empty());
        let mut units: Map<String, Value> =
            units.map(|(name, unit)| (name.clone(), json!(unit))).collect();
        units.insert("time".into(), json!("s"));
        Value::Object(units).to_string()
    }

    fn check_limits(&self) -> Result<(), Error> {
        let names = || self.recorded.iter().map(|recorded| recorded.name.as_str());
        let source = &self.campaign.source;
        let referred = self
            .campaign
            .limits
            .iter()
            .map(|limit| &limit.measure)
            .chain(&self.campaign.keep.by)
            .chain(self.campaign.search.as_ref().map(|search| &search.largest));
        source.check_names(referred, "metric or measure", names())?;
        for limit in self.campaign.limits.iter().filter(|limit| limit.ends) {
            let measure = self.experiment.observe.metrics.get(limit.measure.get_ref());
            if measure.is_none_or(|measure| measure.kind != experiment::MeasureKind::Largest) {
                let message = format!(
                    "[[limit]] {}: ends needs a measure of the kind largest, because it only grows",
                    limit.id
                );
                return Err(source.error(&limit.measure.span(), message));
            }
        }
        Ok(())
    }
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
