//! The file with those settings of a model that are no parameters.

use crate::model::{Context, Failure};
use serde::{Deserialize, Serialize};
use settings::Declared;

/// Parameter that names the file.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Declared)]
pub struct SettingsFile {
    /// Path of a TOML file with settings that are no parameters, or name of a file in the resources
    /// of the FMU, whose documentation lists them; empty for none.
    #[setting(name = "settings.file")]
    pub file: String,
}

impl SettingsFile {
    /// Sets the settings that the file names, if the parameter names a file.
    ///
    /// # Errors
    /// Says why the file cannot be read, or which of its settings is at fault.
    pub fn read<S: Declared>(&self, settings: &mut S, context: &Context) -> Result<(), Failure> {
        if self.file.is_empty() {
            return Ok(());
        }
        std::fs::read_to_string(context.file(&self.file))
            .map_err(|error| error.to_string())
            .and_then(|text| settings::read_file(settings, &text))
            .map_err(|problem| Failure::Error(format!("settings.file: {}: {problem}", self.file)))
    }
}
