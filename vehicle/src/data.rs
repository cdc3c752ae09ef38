//! Files that are part of the program: the papers' numbers.

use serde::de::DeserializeOwned;
use settings::Declared;
use toml::Table;

/// Reads the text of a TOML file that is part of the program; `file` is its name.
///
/// The text is parsed as a table first. `toml::from_str` would make a parser for each type, and
/// these parsers took a fifth of the FMUs' libraries.
///
/// # Panics
/// Panics if the text does not describe a value of this type. Tests read every file.
pub fn embedded<T: DeserializeOwned>(file: &str, text: &str) -> T {
    parsed(file, text).try_into().unwrap_or_else(|error| panic!("{file}: {error}"))
}

#[inline(never)]
fn parsed(file: &str, text: &str) -> Table {
    toml::from_str(text).unwrap_or_else(|error| panic!("{file}: {error}"))
}

/// Sets the settings that a table of such a file names; `file` is its name.
///
/// # Panics
/// Panics if the table names no setting, or a value that the setting cannot have.
pub fn set<S: Declared>(settings: &mut S, file: &str, values: &Table) {
    settings::read(settings, values).unwrap_or_else(|error| panic!("{file}: {error}"));
}
