//! A campaign that is ready to be flown: its cases, and the numbers that are recorded of each.

use crate::definition::{Campaign, Limit, kept_column};
use crate::prepare::{Recorded, keys, observe, read_experiment, recorded};
use cosim::error::Error;
use cosim::files;
use cosim::system::Opened;
use cosim_metrics::metrics::{Meters, Metrics};
use serde_json::json;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use sweep::cases::Sweep;
use sweep::vary::Variation;

pub use crate::prepare::Changes;

/// A campaign that is ready to be flown.
pub struct Plan {
    /// The campaign as its file describes it.
    pub campaign: Campaign,
    /// Cases of the campaign.
    pub sweep: Sweep,
    /// Numbers that are recorded of each case.
    pub recorded: Vec<Recorded>,
    /// Changes of the command line to the campaign.
    pub changes: Changes,
}

impl Plan {
    /// Returns a metric or measure in words.
    pub fn words<'a>(&'a self, name: &'a str) -> &'a str {
        let recorded = self.recorded.iter().find(|recorded| recorded.name == name);
        recorded.map_or(name, |recorded| &recorded.words)
    }

    /// Prepares a campaign, with the changes of the command line.
    ///
    /// # Errors
    /// Returns an error that names the key at fault, with its line and the nearest right name.
    pub fn new(campaign: Campaign, changes: Changes, fmu_dirs: &[PathBuf]) -> Result<Self, Error> {
        let mut experiment = read_experiment(&campaign, &changes)?;
        experiment.observe = observe(&campaign, &experiment.observe)?;
        let variation = Variation {
            vary: &campaign.vary,
            design: campaign.design,
            seed: campaign.seed,
            cases: campaign.cases,
            set: campaign.set.keys().map(String::as_str).collect(),
        };
        let mut opened = Opened::default();
        let mut sweep =
            Sweep::new(experiment, &variation, &campaign.source, fmu_dirs, &mut opened)?;
        let mut system = sweep.system(&mut opened)?;
        let meters = Meters::new(&mut system)?;
        let recorded = recorded(&campaign, &system.experiment.observe, &meters);
        let measured = meters.metrics();
        let key = keys(&campaign, &sweep.experiment().observe, &changes);
        sweep.keys.insert("campaign".into(), key);
        let plan = Self { campaign, sweep, recorded, changes };
        plan.check_columns()?;
        plan.check_limits(&measured)?;
        Ok(plan)
    }

    /// Returns the name of the results' folder: that of the campaign, and that of the experiment if
    /// the command line names one.
    pub fn name(&self) -> String {
        let campaign = self.campaign.name();
        let stem = self.changes.experiment.as_ref().and_then(|path| path.file_stem());
        stem.map_or(campaign.clone(), |stem| format!("{campaign}-{}", stem.to_string_lossy()))
    }

    /// Writes a case as an experiment into a folder, and returns the path of it.
    ///
    /// # Errors
    /// Returns an error if the file cannot be written.
    pub fn write_case(&self, case: u64, folder: &Path) -> Result<PathBuf, Error> {
        let title = format!("{}, case {case}", self.campaign.title);
        let path = folder.join("case.toml");
        files::write(&path, self.sweep.experiment_of(&title, &self.sweep.values(case))?)?;
        Ok(path)
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
        let recorded = self.recorded.iter().map(|entry| (entry.name.as_str(), entry.unit.as_str()));
        let varied =
            self.sweep.varied.iter().map(|entry| (entry.name.as_str(), entry.unit.as_str()));
        let units = varied.chain(recorded).chain([("time", "s")]);
        json!(units.filter(|(_, unit)| !unit.is_empty()).collect::<BTreeMap<_, _>>()).to_string()
    }

    /// Refuses columns of the table of cases that would have the same name.
    fn check_columns(&self) -> Result<(), Error> {
        let kept = self.campaign.limits.iter().map(|limit| kept_column(&limit.id));
        let mut taken: BTreeSet<String> = kept.collect();
        taken.extend(["case", "status", "time", "message"].map(String::from));
        taken.extend(self.sweep.varied.iter().map(|varied| varied.name.clone()));
        match self.recorded.iter().find(|recorded| !taken.insert(recorded.name.clone())) {
            None => Ok(()),
            Some(Recorded { name, .. }) => {
                Err(self.campaign.fault(format!("the table of cases has two columns \"{name}\"")))
            }
        }
    }

    /// Refuses names of measures that are not recorded, and limits on measures that no case can
    /// have, because FMUs that the command line names lack the variables.
    fn check_limits(&self, measured: &Metrics) -> Result<(), Error> {
        let Campaign { limits, search, source, .. } = &self.campaign;
        let referred = limits.iter().map(|limit| &limit.measure);
        let referred = referred.chain(search.as_ref().map(|search| &search.largest));
        let names = self.recorded.iter().map(|recorded| recorded.name.as_str());
        source.check_names(referred, "metric or measure", names)?;
        for limit in limits {
            let name = limit.measure.get_ref();
            let measure = self.sweep.experiment().observe.metrics.get(name);
            if measure.is_some() && !measured.units.contains_key(name) {
                let problem =
                    format!("\"{name}\" has no value, because an FMU lacks its variables");
                return Err(self.campaign.limit_fault(limit, &problem));
            }
        }
        Ok(())
    }
}
