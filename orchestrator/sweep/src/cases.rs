//! A sweep that is ready to be flown: all names are looked up, and every parameter that varies has
//! its distribution.

use crate::design::Design;
use crate::varied::{Varied, distributions};
use crate::vary::{DesignKind, Variation};
use cosim::check::check;
use cosim::document::Source;
use cosim::error::Error;
use cosim::experiment::Experiment;
use cosim::files;
use cosim::search;
use cosim::system::{CheckedComponent, Opened, System};
use cosim::variation::{SettingValue, Target};
use fmi_master::names;
use parking_lot::Mutex;
use std::cmp::Ordering;
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

/// Version of the files of parts, which must be raised when their content changes.
const FORMAT: u32 = 6;

/// Cases of one experiment that differ in the values of parameters, ready to be flown.
pub struct Sweep {
    /// Varied parameters, in the order of the design's dimensions.
    pub varied: Vec<Varied>,
    /// Places of the cases.
    pub design: Design,
    /// Simulated time at which the cases start and stop, s.
    pub span: [f64; 2],
    /// Hashes of the program's version, the experiment and the FMUs, by their names. The caller
    /// adds everything else on which the results depend.
    pub keys: BTreeMap<String, String>,
    /// Archive of an FMU that can be instantiated only once per process, if there is one.
    pub single: Option<PathBuf>,
    experiment: Experiment,
    /// Paths of the archives, by component.
    archives: BTreeMap<String, PathBuf>,
    fmu_dirs: Vec<PathBuf>,
    /// Whether instances can be reset, once this is known.
    pub(crate) resets: Mutex<Option<bool>>,
}

impl Sweep {
    /// Prepares the cases of an experiment. Archives that are already in `opened` are not opened
    /// again; `source` is the file that describes the variation.
    ///
    /// # Errors
    /// Returns an error that names the key at fault, with its line and the nearest right name.
    pub fn new(
        experiment: Experiment,
        variation: &Variation,
        source: &Source,
        fmu_dirs: &[PathBuf],
        opened: &mut Opened,
    ) -> Result<Self, Error> {
        let system = check(experiment.clone(), fmu_dirs, opened)?;
        let mut varied = Vec::new();
        for vary in variation.vary {
            varied.extend(distributions(vary, source, &system, variation.seed)?);
        }
        check_twice(&varied, variation, source, &system)?;
        let paths = varied.iter().flat_map(|entry| &entry.paths).map(String::as_str);
        system.experiment.warn_of_idle(paths.chain(variation.set.iter().copied()));
        check_design(&varied, variation, source)?;
        let levels = varied.iter().map(|entry| {
            let levels = match variation.design {
                DesignKind::Levels => entry.distribution.levels(),
                DesignKind::Corners => entry.distribution.check_ends().map(|()| 0),
                DesignKind::Random => Ok(0),
            };
            levels.map_err(|problem| entry.refusal(&problem, source))
        });
        let levels = levels.collect::<Result<Vec<_>, _>>()?;
        let design = Design::new(variation.design, variation.seed, variation.cases, levels)
            .map_err(|problem| source.error(&(0..0), problem))?;
        let cases = design.cases();
        for entry in &varied {
            if let Some(seeds) = entry.distribution.seeds().filter(|seeds| *seeds < cases) {
                let problem =
                    format!("case: {cases} cases need a seed each, but it takes {seeds} only");
                return Err(entry.refusal(&problem, source));
            }
        }
        let single = system.components.iter().find(|component| {
            component.has("canBeInstantiatedOnlyOncePerProcess") && !system.is_closed
        });
        Ok(Self {
            design,
            span: [system.clock.start(), system.clock.stop()],
            keys: keys(&system, &varied)?,
            single: single.map(|component| component.fmu.path.clone()),
            varied,
            archives: system.components.into_iter().map(|c| (c.name, c.fmu.path.clone())).collect(),
            experiment,
            fmu_dirs: fmu_dirs.to_vec(),
            resets: Mutex::default(),
        })
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
    pub fn values(&self, case: u64) -> Vec<SettingValue> {
        self.values_at(&self.design.place(case), case)
    }

    /// Returns the values at a place, a probability for each of them. Seeds that differ from case to
    /// case are those of this case.
    pub fn values_at(&self, place: &[f64], case: u64) -> Vec<SettingValue> {
        let value = |(varied, unit): (&Varied, &f64)| varied.distribution.value(*unit, case);
        let mut values: Vec<SettingValue> = self.varied.iter().zip(place).map(value).collect();
        let groups = self.varied.iter().enumerate().filter(|(_, varied)| varied.sorted > 0);
        for (first, varied) in groups {
            values[first..first + varied.sorted].sort_by(|a, b| match (a, b) {
                (SettingValue::Real(a), SettingValue::Real(b)) => a.total_cmp(b),
                _ => Ordering::Equal,
            });
        }
        values
    }

    /// Returns the changes that these values make to the system.
    pub fn changes(&self, values: &[SettingValue]) -> Vec<(Target, SettingValue)> {
        let each = self.varied.iter().zip(values);
        let changes = each.flat_map(|(varied, value)| {
            varied.targets.iter().map(|target| (*target, value.clone()))
        });
        changes.collect()
    }

    /// Writes a case as the text of an experiment that extends the one of the campaign.
    ///
    /// # Errors
    /// Returns an error if the text cannot be written as TOML.
    pub fn experiment_of(&self, title: &str, values: &[SettingValue]) -> Result<String, Error> {
        let fault = |error: toml::ser::Error| Error::experiment(error.to_string());
        let mut table: toml::Table = toml::from_str(self.experiment.source.whole())
            .map_err(|error| Error::experiment(error.to_string()))?;
        table.remove("extends");
        table.remove("unset");
        table.insert("title".into(), title.into());
        // The command line may have changed it.
        let simulation = toml::Value::try_from(&self.experiment.simulation).map_err(fault)?;
        table.insert("simulation".into(), simulation);
        let components = table.entry("components").or_insert_with(|| toml::Table::new().into());
        for (name, component) in &self.experiment.components {
            let entry = components.get_mut(name).and_then(toml::Value::as_table_mut);
            let Some(entry) = entry else { continue };
            entry.insert("fmu".into(), self.archive(name).into());
            if component.is_exchanged {
                entry.insert("exchanged".into(), true.into());
            }
            let set = component.parameters.iter();
            let mut parameters: toml::Table =
                set.map(|(name, value)| (name.clone(), value.get_ref().clone())).collect();
            for (varied, value) in self.varied.iter().zip(values) {
                let paths = varied.paths.iter().filter_map(|path| names::split(path));
                for (_, parameter) in paths.filter(|(owner, _)| owner == name) {
                    let value = toml::Value::try_from(value.to_json()).map_err(fault)?;
                    parameters.insert(parameter.into(), value);
                }
            }
            entry.insert("parameters".into(), parameters.into());
        }
        toml::to_string(&table).map_err(fault)
    }

    /// Returns the name by which an experiment in another folder refers to the archive of a
    /// component: its file name if it is found by that from any folder, and else its path.
    fn archive(&self, component: &str) -> String {
        let written = self.experiment.components[component].fmu.get_ref();
        let is_there = |folder: &PathBuf| folder.join(written).is_file();
        match self.archives.get(component).and_then(|path| std::path::absolute(path).ok()) {
            Some(path) if !search::fmu_folders().iter().any(is_there) => path.display().to_string(),
            _ => written.clone(),
        }
    }
}

/// Refuses a parameter that varies twice, or that the file or the command line sets as well. An
/// alias is the same parameter.
fn check_twice(
    varied: &[Varied],
    variation: &Variation,
    source: &Source,
    system: &System,
) -> Result<(), Error> {
    let referents = |names: &[&str]| {
        names.iter().filter_map(|name| Some(system.referent(system.target(name).ok()?))).collect()
    };
    let by_file: Vec<_> = referents(&variation.set);
    let assigned: Vec<&str> = system.experiment.assigned.iter().map(String::as_str).collect();
    let by_option: Vec<_> = referents(&assigned);
    let mut seen = Vec::new();
    for entry in varied {
        for (path, target) in entry.paths.iter().zip(&entry.targets) {
            let referent = system.referent(*target);
            let problem = if seen.contains(&referent) {
                "varies twice"
            } else if by_option.contains(&referent) {
                "varies, so that --set cannot give it one value"
            } else if by_file.contains(&referent) {
                "varies, but [set] gives it one value"
            } else {
                seen.push(referent);
                continue;
            };
            return Err(source.error(&entry.span, format!("[[vary]] \"{path}\" {problem}")));
        }
    }
    Ok(())
}

/// Refuses settings that have no effect, or no meaning, in the design of a sweep.
fn check_design(varied: &[Varied], variation: &Variation, source: &Source) -> Result<(), Error> {
    for vary in variation.vary.iter().filter(|_| variation.design == DesignKind::Levels) {
        let problem = match (vary.sorted, &vary.weights) {
            (true, _) => "sorted has no meaning in the design levels",
            (false, Some(_)) => "weights have no effect in the design levels",
            (false, None) => continue,
        };
        if let Some(entry) = varied.iter().find(|entry| vary.names().any(|n| *n == entry.name)) {
            return Err(entry.refusal(problem, source));
        }
    }
    Ok(())
}

/// Hashes the inputs of all cases, with the files that text parameters name.
fn keys(system: &System, varied: &[Varied]) -> Result<BTreeMap<String, String>, Error> {
    let mut keys = BTreeMap::from([
        ("experiment".to_string(), files::digest(system.experiment.source.whole())),
        ("program".to_string(), format!("{} {FORMAT}", env!("CARGO_PKG_VERSION"))),
    ]);
    for CheckedComponent { name, fmu, .. } in &system.components {
        let bytes = fs::read(&fmu.path).map_err(Error::file(&fmu.path))?;
        keys.insert(format!("FMU of {name}"), files::digest(bytes));
    }
    if let Some(law) = &system.experiment.law {
        keys.insert("law".into(), law.clone());
    }
    let set = system.texts();
    let listed = varied.iter().flat_map(|entry| entry.distribution.texts());
    for text in set.iter().map(String::as_str).chain(listed) {
        let path = Path::new(text);
        if path.is_file() {
            let bytes = fs::read(path).map_err(Error::file(path))?;
            keys.insert(format!("file {text}"), files::digest(bytes));
        }
    }
    Ok(keys)
}
