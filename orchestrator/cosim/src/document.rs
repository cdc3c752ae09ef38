//! A TOML file together with the files that it extends, read as one table. Every place in this
//! table still refers to its own file and line.
//!
//! ```toml
//! extends = "base.toml"               # a file beside this one, or ["a.toml", "b.toml"]
//! unset = ["controller.gain.p"]       # parameters that a base sets, left at the FMU's start value
//! ```
//!
//! Of several extended files, a later one has precedence. Tables are merged key by key; a list or a
//! single value replaces that of the base. A base may extend other files in turn. A file that is
//! extended in several ways counts once, where it is named first.

use crate::error::Error;
use fmi_master::names;
use fmu_import::folder::from_start;
use serde::de::DeserializeOwned;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::{fs, iter};
use toml::de::{DeTable, DeValue, Deserializer};
use toml::{Spanned, Value};

/// A TOML file together with the files that it extends.
///
/// A place in the document is a range of bytes. It lies in the text of the file itself, or behind
/// that in the texts of the other files, one after the other.
#[derive(Clone, Debug, Default)]
pub struct Source {
    /// Path of the file.
    pub path: PathBuf,
    /// Text of the file itself.
    pub text: String,
    /// Files that are extended, with their texts; the first one has precedence.
    bases: Vec<(PathBuf, String)>,
    /// Text of all files merged, if the file extends others.
    merged: Option<String>,
}

impl Source {
    /// Reads a file and all files that it extends.
    ///
    /// # Errors
    /// Returns an error if a file cannot be read or is not TOML, or if files extend each other in a
    /// circle.
    pub fn load(path: &Path) -> Result<Self, Error> {
        let text = fs::read_to_string(path)
            .map_err(|error| Error::experiment(format!("{}: {error}", path.display())))?;
        Self::new(path, text)
    }

    /// Reads a file whose text is already known, and all files that it extends.
    ///
    /// # Errors
    /// The errors are those of [`Self::load`].
    pub fn new(path: &Path, text: String) -> Result<Self, Error> {
        let mut files = Vec::new();
        collect(path, text, &mut Vec::new(), &mut files)?;
        let (path, text) = files.pop().unwrap_or_default();
        files.reverse();
        let mut source = Self { path, text, bases: files, merged: None };
        if !source.bases.is_empty() {
            let text = toml::to_string(&source.read::<toml::Table>()?);
            source.merged = Some(text.map_err(|error| source.error(&(0..0), error.to_string()))?);
        }
        Ok(source)
    }

    /// Creates a document from a text that is not read from a file and extends nothing. The `path`
    /// is for messages.
    pub fn plain(path: &Path, text: String) -> Self {
        Self { path: path.to_path_buf(), text, ..Self::default() }
    }

    /// Returns the whole document as one text: that of the file itself or, if it extends others,
    /// that of all files merged, without comments.
    pub fn whole(&self) -> &str {
        self.merged.as_deref().unwrap_or(&self.text)
    }

    /// Returns the folders of the file and of the files that it extends.
    pub fn folders(&self) -> impl Iterator<Item = &Path> {
        self.files().map(|(path, _)| {
            path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."))
        })
    }

    /// Returns the whole document with the absolute paths of the files beside it, so that it can be
    /// written to another folder.
    pub fn movable(&self) -> String {
        let mut values: Vec<Value> =
            toml::from_str(self.whole()).map(Value::Table).into_iter().collect();
        let mut text = self.whole().to_owned();
        while let Some(value) = values.pop() {
            match value {
                Value::Table(table) => values.extend(table.into_iter().map(|(_, value)| value)),
                Value::Array(array) => values.extend(array),
                Value::String(file) if file.contains('.') && !file.contains('\n') => {
                    let path = std::path::absolute(self.beside(Path::new(&file)));
                    if let Some(path) = path.ok().filter(|path| path.is_file()) {
                        // On Windows a path holds backslashes.
                        let path = path.display().to_string().replace('\\', "/");
                        text = text.replace(&format!("\"{file}\""), &format!("\"{path}\""));
                    }
                }
                _ => {}
            }
        }
        text
    }

    fn files(&self) -> impl Iterator<Item = (&Path, &str)> {
        let bases = self.bases.iter().map(|(path, text)| (path.as_path(), text.as_str()));
        iter::once((self.path.as_path(), self.text.as_str())).chain(bases)
    }

    /// Creates an error at a place. The place `0..0` denotes the whole file.
    pub fn error(&self, span: &Range<usize>, message: impl Into<String>) -> Error {
        let mut at = format!("{}: ", self.path.display());
        let mut start = 0;
        for (path, text) in self.files().take_while(|_| !span.is_empty()) {
            if let Some(before) = span.start.checked_sub(start).and_then(|end| text.get(..end)) {
                at = format!("{}:{}: ", path.display(), 1 + before.matches('\n').count());
            }
            start += text.len() + 1;
        }
        Error::Experiment { at, message: message.into() }
    }

    /// Returns the path of a file beside this one, or beside one that it extends, which may have
    /// named it.
    pub fn beside(&self, file: &Path) -> PathBuf {
        let mut places = self.folders().map(|folder| folder.join(file));
        let own = places.next().unwrap_or_default();
        let is_there = |path: &PathBuf| from_start(path).exists();
        if is_there(&own) { own } else { places.find(is_there).unwrap_or(own) }
    }

    /// Checks that all names are among the `available` ones. The message calls such a name a
    /// `what`.
    ///
    /// # Errors
    /// Returns an error that names the first unknown name.
    pub fn check_names<'a>(
        &self,
        names: impl IntoIterator<Item = &'a Spanned<String>>,
        what: &str,
        available: impl Iterator<Item = &'a str> + Clone,
    ) -> Result<(), Error> {
        match names.into_iter().find(|name| available.clone().all(|other| other != name.get_ref()))
        {
            None => Ok(()),
            Some(name) => {
                let hint = names::hint(name.get_ref(), available);
                Err(self.error(
                    &name.span(),
                    format!("there is no {what} \"{}\"{hint}", name.get_ref()),
                ))
            }
        }
    }

    /// Reads the whole document as a `T`.
    ///
    /// # Errors
    /// Returns an error if the document is not TOML, or holds an unknown key.
    pub fn read<T: DeserializeOwned>(&self) -> Result<T, Error> {
        self.read_with(|table| self.take(table))
    }

    /// Reads the whole document and converts its table with `take`.
    ///
    /// # Errors
    /// Returns an error if the document is not TOML, or if `take` fails.
    pub fn read_with<T>(
        &self,
        take: impl FnOnce(Spanned<DeTable>) -> Result<T, Error>,
    ) -> Result<T, Error> {
        // Each text is indented by the length of the texts before it, so that its places lie behind
        // theirs.
        let mut start = 0;
        let texts: Vec<String> = self
            .files()
            .map(|(_, text)| {
                let inset = " ".repeat(start) + text;
                start = inset.len() + 1;
                inset
            })
            .collect();
        let mut whole: Option<Spanned<DeTable>> = None;
        for text in texts.iter().rev() {
            let mut table = DeTable::parse(text).map_err(|error| self.refusal(&error))?;
            let unset = table.get_mut().remove("unset");
            table.get_mut().remove("extends");
            if let Some(below) = &mut whole {
                self.unset(below.get_mut(), unset)?;
                overlay(table.get_mut(), below.get_ref());
            } else if let Some(unset) = unset {
                return Err(self.error(&unset.span(), "unset: this file extends no other file"));
            }
            whole = Some(table);
        }
        take(whole.unwrap_or_else(|| Spanned::new(0..0, DeTable::new())))
    }

    /// Converts a table of this document to a `T`.
    ///
    /// # Errors
    /// Returns an error if the table holds an unknown key or a value of the wrong type, or if a
    /// value is missing.
    pub fn take<T: DeserializeOwned>(&self, table: Spanned<DeTable>) -> Result<T, Error> {
        T::deserialize(Deserializer::from(table)).map_err(|error| self.refusal(&error))
    }

    fn refusal(&self, error: &toml::de::Error) -> Error {
        let message = with_nearest(&error.message().replace('\n', " "));
        self.error(&error.span().map_or(0..0, |s| s.start..s.end.max(s.start + 1)), message)
    }

    /// Removes the parameters that `unset` names from the table.
    fn unset(&self, table: &mut DeTable, unset: Option<Spanned<DeValue>>) -> Result<(), Error> {
        let Some(unset) = unset else { return Ok(()) };
        for (target, place) in texts(&unset).map_err(|place| {
            self.error(
                &place,
                "unset: expected a list of texts, for example [\"controller.gain.p\"]",
            )
        })? {
            let refuse = |message: String| self.error(&place, format!("unset: {message}"));
            let (component, parameter) = names::split(target).ok_or_else(|| {
                refuse(format!("\"{target}\" is not of the form component.parameter"))
            })?;
            let parameters = ["components", component, "parameters"].iter().try_fold(
                &mut *table,
                |table, key| match table.get_mut(*key)?.get_mut() {
                    DeValue::Table(inner) => Some(inner),
                    _ => None,
                },
            );
            let set_names: Vec<String> = parameters
                .iter()
                .flat_map(|table| table.keys())
                .map(|key| key.get_ref().to_string())
                .collect();
            if parameters.and_then(|table| table.remove(parameter)).is_none() {
                let hint = names::hint(parameter, set_names.iter().map(String::as_str));
                return Err(refuse(format!("no extended file sets \"{target}\"{hint}")));
            }
        }
        Ok(())
    }
}

/// Adds the nearest right name to the message about an unknown key, which lists all of them.
fn with_nearest(message: &str) -> String {
    let mut names = message.split('`').skip(1).step_by(2);
    let wrong = names.next().filter(|_| message.starts_with("unknown "));
    match wrong.and_then(|wrong| names::nearest(wrong, names)) {
        Some(near) => format!("{message}; did you mean \"{near}\"?"),
        None => message.to_string(),
    }
}

/// Reads a text or a list of texts, each with its place.
///
/// # Errors
/// The error is the place of an item that is not a text.
fn texts<'a>(value: &'a Spanned<DeValue>) -> Result<Vec<(&'a str, Range<usize>)>, Range<usize>> {
    let items = match value.get_ref() {
        DeValue::Array(items) => &items[..],
        _ => std::slice::from_ref(value),
    };
    items
        .iter()
        .map(|item| item.get_ref().as_str().map(|text| (text, item.span())).ok_or(item.span()))
        .collect()
}

/// Adds all keys of `below` that are missing in `table`, table by table.
pub fn overlay<'i>(table: &mut DeTable<'i>, below: &DeTable<'i>) {
    for (key, value) in below {
        match (table.get_mut(key.get_ref().as_ref()).map(Spanned::get_mut), value.get_ref()) {
            (None, _) => drop(table.insert(key.clone(), value.clone())),
            (Some(DeValue::Table(inner)), DeValue::Table(below)) => overlay(inner, below),
            _ => {}
        }
    }
}

/// Adds the files that this one extends, and then this one, to `files`. The `chain` holds the files
/// that led to this one.
fn collect(
    path: &Path,
    text: String,
    chain: &mut Vec<PathBuf>,
    files: &mut Vec<(PathBuf, String)>,
) -> Result<(), Error> {
    let source = Source::plain(path, text);
    let table = DeTable::parse(&source.text).map_err(|error| source.refusal(&error))?;
    let bases = table.get_ref().get("extends").map_or(Ok(Vec::new()), texts).map_err(|place| {
        source.error(
            &place,
            "extends: expected the name of a file or a list of names, for example \"base.toml\"",
        )
    })?;
    chain.push(identity(path));
    for (name, place) in bases {
        let refuse =
            |message: String| source.error(&place, format!("extends = \"{name}\": {message}"));
        let base = path.parent().unwrap_or(Path::new("")).join(name);
        let base_identity = identity(&base);
        if chain.contains(&base_identity) {
            return Err(refuse("extends this file in turn, which is a circle".into()));
        }
        if files.iter().any(|(path, _)| identity(path) == base_identity) {
            continue;
        }
        let text = fs::read_to_string(&base)
            .map_err(|error| refuse(format!("{}: {error}", base.display())))?;
        collect(&base, text, chain, files)?;
    }
    chain.pop();
    drop(table);
    files.push((source.path, source.text));
    Ok(())
}

/// Identifies a file independently of the path that leads to it.
fn identity(path: &Path) -> PathBuf {
    fs::canonicalize(path).unwrap_or_else(|_| path.to_path_buf())
}

#[cfg(test)]
mod tests;
