//! Changes that the command line makes to a campaign.

use crate::definition::Campaign;
use clap::ValueEnum;
use clap::builder::PossibleValue;
use cosim::experiment::Overrides;
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
    /// Returns the arguments that name a campaign and these changes.
    pub(crate) fn command(&self, campaign: &Campaign) -> String {
        let mut words = vec![campaign.source.path.display().to_string()];
        let mut add = |key: &str, value: String| words.extend([format!("--{key}"), value]);
        let Overrides { set, fmu, stop, step, coupling, on_invalid } = &self.overrides;
        if let Some(path) = &self.experiment {
            add("experiment", path.display().to_string());
        }
        set.iter().for_each(|value| add("set", value.clone()));
        fmu.iter().for_each(|value| add("fmu", value.clone()));
        stop.iter().for_each(|value| add("stop", value.to_string()));
        step.iter().for_each(|value| add("step", value.to_string()));
        let word = |value: Option<PossibleValue>| value.map(|value| value.get_name().to_string());
        let coupling = coupling.as_ref().map(ValueEnum::to_possible_value);
        coupling.and_then(word).into_iter().for_each(|value| add("coupling", value));
        let on_invalid = on_invalid.as_ref().map(ValueEnum::to_possible_value);
        on_invalid.and_then(word).into_iter().for_each(|value| add("on-invalid", value));
        let quoted = |word: String| {
            let is_plain = word.chars().all(|c| c.is_alphanumeric() || "-_./=+:".contains(c));
            if is_plain { word } else { format!("'{word}'") }
        };
        words.into_iter().map(quoted).collect::<Vec<_>>().join(" ")
    }
}
