//! The settings with which CRMPC flies in the experiments, studies and campaigns of a folder.

use crate::given::Given;
use campaign::definition::Campaign;
use control::crmpc::Settings;
use cosim::document::Source;
use cosim::error::Error;
use cosim::experiment::{Component, Experiment};
use std::path::{Path, PathBuf};
use study::definition::Study;
use sweep::vary::Vary;
use toml::Table;

/// Settings of one CRMPC in one file.
#[derive(Clone, Debug)]
pub struct Shipped {
    /// File that the settings stand in.
    pub file: PathBuf,
    /// Run of the study, if the file is one, and name of the component.
    pub place: String,
    /// The settings.
    pub settings: Settings,
}

/// Result of reading all files of a folder.
#[derive(Clone, Debug, Default)]
pub struct Scan {
    /// Settings of every CRMPC in the files, file by file.
    pub shipped: Vec<Shipped>,
    /// Number of experiments, studies and campaigns that were read.
    pub read: [usize; 3],
    /// Files that are none of these, or have no title because they only serve to be extended, with
    /// the reason.
    pub left_out: Vec<(PathBuf, String)>,
}

/// Name of the archive of the controller.
const ARCHIVE: &str = "CRMPC.fmu";

impl Scan {
    /// Reads every TOML file below `folder`.
    ///
    /// # Errors
    /// Names the file that cannot be read, and what is wrong with it or with a parameter of CRMPC
    /// in it.
    pub fn new(folder: &Path) -> Result<Self, String> {
        let mut scan = Self::default();
        for file in files(folder)? {
            let outcome = scan.read(&file);
            outcome.map_err(|error| format!("{}: {error}", file.display()))?;
        }
        Ok(scan)
    }

    fn read(&mut self, file: &Path) -> Result<(), String> {
        let text = std::fs::read_to_string(file).map_err(|error| error.to_string())?;
        let kind = text.lines().next().and_then(|line| line.strip_prefix("#:schema "));
        let kind = kind.and_then(|schema| schema.rsplit('/').next()).unwrap_or("no schema");
        let place = match kind {
            "experiment.json" => 0,
            "study.json" => 1,
            "campaign.json" => 2,
            other => {
                self.left_out.push((file.to_path_buf(), other.into()));
                return Ok(());
            }
        };
        let fault = |error: Error| error.to_string();
        let whole: Table = Source::load(file).and_then(|source| source.read()).map_err(fault)?;
        if !whole.contains_key("title") {
            self.left_out.push((file.to_path_buf(), "no title, only for other files".into()));
            return Ok(());
        }
        self.read[place] += 1;
        match place {
            0 => self.experiment(file, "", &Experiment::load(file).map_err(fault)?),
            1 => self.study(file, &Study::load(file).map_err(|error| error.to_string())?),
            _ => self.campaign(file, &Campaign::load(file).map_err(fault)?),
        }
    }

    fn experiment(
        &mut self,
        file: &Path,
        run: &str,
        experiment: &Experiment,
    ) -> Result<(), String> {
        for (name, component) in &experiment.components {
            if component.fmu.get_ref() == ARCHIVE {
                let settings =
                    settings(component).map_err(|error| format!("{run} {name}: {error}"))?;
                let place = format!("{run} {name}").trim().to_owned();
                self.shipped.push(Shipped { file: file.to_path_buf(), place, settings });
            }
        }
        Ok(())
    }

    fn study(&mut self, file: &Path, study: &Study) -> Result<(), String> {
        for run in &study.runs {
            let experiment = study.experiment(run).map_err(|error| error.to_string())?;
            refuse_varied(&experiment, run.seeds.iter().map(toml::Spanned::get_ref))?;
            self.experiment(file, run.id.get_ref(), &experiment)?;
        }
        Ok(())
    }

    fn campaign(&mut self, file: &Path, campaign: &Campaign) -> Result<(), String> {
        let path = campaign.source.beside(campaign.experiment.get_ref());
        let mut experiment = Experiment::load(&path).map_err(|error| error.to_string())?;
        for (target, value) in &campaign.set {
            experiment.set(target, value.get_ref().clone())?;
        }
        let varied = campaign.vary.iter().flat_map(Vary::names);
        refuse_varied(&experiment, varied)?;
        self.experiment(file, "", &experiment)
    }
}

/// Refuses a parameter of CRMPC that takes several values, as all of them would have to be checked.
fn refuse_varied<'a>(
    experiment: &Experiment,
    mut names: impl Iterator<Item = &'a String>,
) -> Result<(), String> {
    let of_crmpc = |name: &&String| {
        let component = name.split_once('.').and_then(|(name, _)| experiment.components.get(name));
        component.is_some_and(|component| component.fmu.get_ref() == ARCHIVE)
    };
    names.find(of_crmpc).map_or(Ok(()), |name| Err(format!("{name} of CRMPC varies")))
}

/// All TOML files below a folder, in order of their names.
fn files(folder: &Path) -> Result<Vec<PathBuf>, String> {
    let fault = |error: std::io::Error| format!("{}: {error}", folder.display());
    let mut paths = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(fault)? {
        let path = entry.map_err(fault)?.path();
        if path.is_dir() {
            paths.extend(files(&path)?);
        } else if path.extension().is_some_and(|extension| extension == "toml") {
            paths.push(path);
        }
    }
    paths.sort();
    Ok(paths)
}

/// Beginnings of the names of parameters on which no bound depends.
const FREE: [&str; 10] = [
    "reference.",
    "weight.",
    "tube.",
    "bound.",
    "observer.",
    "solver",
    "plan.",
    "saturation",
    "achievedMoment.used",
    "trajectory.earthRate",
];

/// Settings of a component, from the defaults of the FMU and the parameters that the file sets.
fn settings(component: &Component) -> Result<Settings, String> {
    let mut given = Given::default();
    for (name, value) in &component.parameters {
        if !FREE.iter().any(|beginning| name.starts_with(beginning)) {
            given.set(name, value.get_ref())?;
        }
    }
    given.settings()
}
