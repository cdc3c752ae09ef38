//! Changes that the command line makes to a campaign.

use crate::definition::Campaign;
use cosim::experiment::{Overrides, name_of};
use serde::Serialize;
use std::path::PathBuf;

/// Changes that the command line makes to a campaign.
#[derive(Clone, Debug, Default)]
pub struct Changes {
    /// Experiment in place of that of the campaign.
    pub experiment: Option<PathBuf>,
    /// Changes to the experiment.
    pub overrides: Overrides,
}

impl Changes {
    /// Returns the command that runs a case of a campaign with these changes.
    pub(crate) fn command(&self, campaign: &Campaign) -> Command {
        if let Some(name) = self.overrides.law.as_deref().map(name_of) {
            let path = campaign.source.path.display();
            return Command::Python(format!("campaign(\"{path}\", law={name})"));
        }
        Command::Program(self.arguments(campaign))
    }

    /// Returns the arguments that name a campaign and these changes.
    fn arguments(&self, campaign: &Campaign) -> String {
        let mut words = vec![campaign.source.path.display().to_string()];
        // A case is the same in whichever process its instances run.
        let Overrides { set, fmu, stop, step, coupling, on_invalid, isolation: _, law: _ } =
            &self.overrides;
        let experiment = self.experiment.as_ref().map(|path| path.display().to_string());
        let single = [
            ("experiment", experiment),
            ("stop", stop.map(|value| value.to_string())),
            ("step", step.map(|value| value.to_string())),
            ("coupling", coupling.and_then(name)),
            ("on-invalid", on_invalid.and_then(name)),
        ];
        let several = set.iter().map(|value| ("set", Some(value.clone())));
        let several = several.chain(fmu.iter().map(|value| ("fmu", Some(value.clone()))));
        for (key, value) in single.into_iter().chain(several) {
            words.extend(value.into_iter().flat_map(|value| [format!("--{key}"), value]));
        }
        let quoted = |word: String| {
            let is_plain = word.chars().all(|c| c.is_alphanumeric() || "-_./=+:".contains(c));
            if is_plain { word } else { format!("'{word}'") }
        };
        words.into_iter().map(quoted).collect::<Vec<_>>().join(" ")
    }
}

/// Command that flies a campaign.
#[derive(Clone, Debug)]
pub enum Command {
    /// Arguments of the program that name the campaign and the changes to it.
    Program(String),
    /// Expression of the Python package for a campaign with a law in Python.
    Python(String),
}

impl Command {
    /// Returns the command that runs one case with everything recorded.
    pub fn of_case(&self, case: u64) -> String {
        match self {
            Self::Program(arguments) => format!("orchestrator campaign {arguments} --case {case}"),
            Self::Python(campaign) => format!("{campaign}.case({case})"),
        }
    }
}

/// Returns the name of an item in files and on the command line.
fn name(item: impl Serialize) -> Option<String> {
    serde_json::to_value(item).ok()?.as_str().map(str::to_string)
}
