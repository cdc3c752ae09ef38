//! Files that are part of the program: the papers' numbers.

use serde::de::DeserializeOwned;
use settings::Declared;
use toml::{Table, Value};

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

/// A file that is part of the program, whose tables set settings.
pub struct Tables {
    file: &'static str,
    tables: Table,
}

impl Tables {
    /// Reads the text of the file with this name.
    ///
    /// # Panics
    /// Panics if the text is no TOML.
    pub fn new(file: &'static str, text: &str) -> Self {
        Self { file, tables: parsed(file, text) }
    }

    /// Sets the settings that the table with this name holds.
    ///
    /// # Panics
    /// Panics if there is no such table, and like [`set`].
    pub fn set<S: Declared>(&self, table: &str, settings: &mut S) {
        let Some(Value::Table(values)) = self.tables.get(table) else {
            panic!("{}: there is no table {table}", self.file);
        };
        set(settings, self.file, values);
    }
}

/// Sets the settings that a table of such a file names; `file` is its name.
///
/// # Panics
/// Panics if the table names no setting, or a value that the setting cannot have.
pub fn set<S: Declared>(settings: &mut S, file: &str, values: &Table) {
    settings::read(settings, values).unwrap_or_else(|error| panic!("{file}: {error}"));
}
