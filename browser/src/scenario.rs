//! The experiments that the page flies. Controllers, scenario, connections and order come from the
//! files that the orchestrator runs; none of them is repeated here.

use crate::error::Error;
use crate::fmu::Fmu;
use crate::own_law::OwnLaw;
use crate::signals;
use controller_export::{ControllerFmu, Law};
use fmi_export::Export;
use fmu_controller::{
    Btvsmc, BtvsmcDo, Crmpc, Dlmpc, EntryGuidance, Fbl, Lqr, SotvsmcDo, TwoLoopSmc,
};
use fmu_plant::ReentryPlant;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use toml::{Table, Value};

/// A flight for any controller.
#[derive(Debug)]
pub struct Scenario {
    /// Short name for addresses.
    pub id: &'static str,
    /// Experiment that its flights extend.
    file: &'static str,
    /// Recorded columns; the guarantee comes last.
    pub columns: &'static [&'static str],
    /// Number of communication steps from one recorded row to the next.
    pub every: u32,
    /// Whether the plans of the controller are shown.
    pub shows_plans: bool,
}

/// The flights. The first one is flown unless a request says otherwise.
pub static SCENARIOS: [Scenario; 2] = [
    Scenario {
        id: "attitude",
        file: "exchange/crmpc-2022.toml",
        columns: signals::ATTITUDE,
        every: 1,
        shows_plans: true,
    },
    Scenario {
        id: "entry",
        file: "entry/from-120km.toml",
        columns: signals::ENTRY,
        every: 10,
        shows_plans: false,
    },
];

/// File with the list of all controllers.
const CONTROLLERS: &str = include_str!("../../orchestrator/experiments/base/studies.toml");

macro_rules! embedded {
    ($($name:literal),+) => {
        &[$(($name, include_str!(concat!("../../orchestrator/experiments/", $name)))),+]
    };
}

/// The files that the experiment consists of.
const FILES: &[(&str, &str)] = embedded!(
    "exchange/crmpc-2022.toml",
    "exchange/any.toml",
    "base/direct.toml",
    "base/attitude.toml",
    "base/crmpc-2022.toml",
    "base/entry.toml",
    "entry/from-120km.toml"
);

static FMUS: [Fmu; 11] = [
    Fmu::new("ReentryPlant", Export::new::<ReentryPlant>()),
    Fmu::new("EntryGuidance", Export::new::<EntryGuidance>()),
    Fmu::new("CRMPC", Export::new::<Crmpc>()),
    Fmu::new("DLMPC", Export::new::<Dlmpc>()),
    Fmu::new("LQR", Export::new::<Lqr>()),
    Fmu::new("FBL", Export::new::<Fbl>()),
    Fmu::new("BTVSMC", Export::new::<Btvsmc>()),
    Fmu::new("BTVSMC_DO", Export::new::<BtvsmcDo>()),
    Fmu::new("SOTVSMC_DO", Export::new::<SotvsmcDo>()),
    Fmu::new("TwoLoopSMC", Export::new::<TwoLoopSmc>()),
    Fmu::new(OwnLaw::NAME, Export::new::<ControllerFmu<OwnLaw>>()),
];

/// Finds an FMU by its name.
///
/// # Errors
/// Says that it is not linked into the module.
pub fn fmu(name: &str) -> Result<&'static Fmu, Error> {
    let fmu = FMUS.iter().find(|fmu| fmu.name == name);
    fmu.ok_or_else(|| problem(name, "the FMU is not built in"))
}

/// A controller that can be chosen: an FMU with settings of its own.
#[derive(Clone, Debug, Serialize)]
pub struct Choice {
    /// Short name for addresses and files.
    pub id: String,
    /// Name for readers.
    pub name: String,
    /// Name of the FMU.
    pub fmu: String,
    /// Parameters of the controller that differ from its start values.
    pub set: Table,
}

/// The part of the list of controllers that is used here.
#[derive(Deserialize)]
struct Listed {
    lists: Lists,
}

#[derive(Deserialize)]
struct Lists {
    controllers: Vec<Entry>,
}

#[derive(Deserialize)]
struct Entry {
    id: String,
    name: String,
    fmu: String,
    set: Table,
}

/// Returns the controllers, in the order of the studies, and last the law of the page.
///
/// # Errors
/// Says what is wrong with the list.
pub fn choices() -> Result<Vec<Choice>, Error> {
    let file = "base/studies.toml";
    let Listed { lists } =
        toml::from_str(CONTROLLERS).map_err(|error| problem(file, &error.to_string()))?;
    let choice = |entry: Entry| {
        let set = entry.set.into_iter().map(|(name, value)| {
            let name = name.strip_prefix("controller.");
            let name = name.ok_or_else(|| problem(file, "a parameter is of another component"))?;
            Ok((name.to_string(), value))
        });
        let fmu = entry.fmu.trim_end_matches(".fmu").to_string();
        Ok(Choice { id: entry.id, name: entry.name, fmu, set: set.collect::<Result<_, Error>>()? })
    };
    let own = Choice {
        id: "own".into(),
        name: "Your own law".into(),
        fmu: OwnLaw::NAME.into(),
        set: Table::new(),
    };
    lists.controllers.into_iter().map(choice).chain([Ok(own)]).collect()
}

impl Scenario {
    /// Finds a flight by its short name.
    ///
    /// # Errors
    /// Says that there is none of this name.
    pub fn find(id: &str) -> Result<&'static Self, Error> {
        let found = SCENARIOS.iter().find(|scenario| scenario.id == id);
        found.ok_or_else(|| problem(id, "there is no such flight"))
    }

    /// Returns the experiment with all that it extends.
    ///
    /// # Errors
    /// Names a file that is not built in, or is not TOML.
    pub fn experiment(&self) -> Result<Table, Error> {
        merged(self.file)
    }
}

fn merged(file: &str) -> Result<Table, Error> {
    let text = FILES.iter().find(|(name, _)| *name == file);
    let (_, text) = text.ok_or_else(|| problem(file, "the file is not built in"))?;
    let mut own: Table = text.parse().map_err(|error| problem(file, &format!("{error}")))?;
    let bases = match own.remove("extends") {
        Some(Value::Array(files)) => files,
        Some(file) => vec![file],
        None => vec![],
    };
    let mut table = Table::new();
    for base in bases {
        merge(&mut table, merged(&beside(file, base.as_str().unwrap_or_default()))?);
    }
    // A file without a title is meant to be extended, and so are title and description.
    merge(&mut table, own);
    Ok(table)
}

/// Returns the name of a file relative to the folder of another one.
fn beside(file: &str, base: &str) -> String {
    match base.strip_prefix("../") {
        Some(base) => base.to_string(),
        None => format!("{}/{base}", file.split('/').next().unwrap_or_default()),
    }
}

/// Merges tables key by key; any other value replaces the one before.
fn merge(table: &mut Table, over: Table) {
    for (key, value) in over {
        match (table.get_mut(&key), value) {
            (Some(Value::Table(inner)), Value::Table(value)) => merge(inner, value),
            (_, value) => {
                table.insert(key, value);
            }
        }
    }
}

/// Returns the error for a fault of a parameter or a place in an experiment.
pub fn problem(what: &str, problem: &str) -> Error {
    Error::Wrong { what: what.into(), problem: problem.into() }
}

/// Reads a part of an experiment, given the keys that lead to it.
///
/// # Errors
/// Says which part is missing or has another type.
pub fn read<T: DeserializeOwned>(experiment: &Table, keys: &str) -> Result<T, Error> {
    let mut keys_left = keys.split('.');
    let first = keys_left.next().and_then(|key| experiment.get(key));
    let part = keys_left.try_fold(first, |part, key| Some(part?.get(key)));
    let part = part.flatten().ok_or_else(|| problem(keys, "the experiment has no such part"))?;
    part.clone().try_into().map_err(|error| problem(keys, &error.to_string()))
}
