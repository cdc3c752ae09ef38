//! Experiments, studies, campaigns and FMUs by their names.
//!
//! A name is the path of a file, or the end of the path of one that is installed, both without the
//! extension: `lqr`, or `reversal/allocated` where several experiments are called `allocated`. A
//! study is called by its folder.

use super::{files, folders, has_extension};
use crate::document::Source;
use crate::error::Error;
use fmi_master::names;
use std::ffi::OsString;
use std::fs;
use std::path::{Path, PathBuf};

/// File that makes its folder a study.
const STUDY: &str = "study.toml";

/// Kind of a file by its content.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Kind {
    /// The file describes an experiment, or it is an SSP archive.
    Experiment,
    /// The file describes a study.
    Study,
    /// The file describes a campaign.
    Campaign,
    /// The file is an FMU.
    Fmu,
}

impl Kind {
    /// All kinds, in the order in which they are listed.
    pub const ALL: [Self; 4] = [Self::Experiment, Self::Study, Self::Campaign, Self::Fmu];

    /// Returns the word for a file of this kind with its article, that for several, and the command
    /// that is usually called with one.
    fn words(self) -> [&'static str; 3] {
        match self {
            Self::Experiment => ["an experiment", "experiments", "run"],
            Self::Study => ["a study", "studies", "reproduce"],
            Self::Campaign => ["a campaign", "campaigns", "campaign"],
            Self::Fmu => ["an FMU", "FMUs", "inspect"],
        }
    }

    /// Returns the word for a file of this kind.
    pub fn word(self) -> &'static str {
        let [word, ..] = self.words();
        word.split_once(' ').map_or(word, |(_, word)| word)
    }

    /// Returns the word for several files of this kind.
    pub fn plural(self) -> &'static str {
        self.words()[1]
    }

    /// Returns the command that is usually called with a file of this kind.
    pub fn command(self) -> &'static str {
        self.words()[2]
    }

    /// Returns the kind of a file; `None` if it is of no kind, as a file that others extend.
    pub fn of(path: &Path) -> Option<Self> {
        if has_extension(path, "fmu") {
            return Some(Self::Fmu);
        }
        if has_extension(path, "ssp") {
            return Some(Self::Experiment);
        }
        if path.ends_with(STUDY) {
            return Some(Self::Study);
        }
        if !has_extension(path, "toml") {
            return None;
        }
        let text = fs::read_to_string(path).ok()?;
        let kind = Self::of_text(&text)?;
        // A file that extends a campaign is a campaign, too.
        let whole = (kind == Self::Experiment && text.contains("extends"))
            .then(|| Source::new(path, text).ok())
            .flatten();
        whole.map_or(Some(kind), |source| Self::of_text(source.whole()))
    }

    /// Returns the kind of a TOML file with this text. A file without a title only serves to be
    /// extended, a file that names a paper is part of a study, and one in which something varies,
    /// or that names the experiment that varies, is a campaign.
    fn of_text(text: &str) -> Option<Self> {
        let keys: toml::Table = text.parse().ok()?;
        let has = |key: &str| keys.contains_key(key);
        if has("vary") || has("title") && has("experiment") {
            return Some(Self::Campaign);
        }
        let is_experiment = has("title") && !has("paper") && (has("components") || has("extends"));
        is_experiment.then_some(Self::Experiment)
    }

    /// Returns the end of the path of a file of this kind that has this name.
    pub fn file(self, name: &Path) -> PathBuf {
        match self {
            Self::Experiment if has_extension(name, "ssp") => name.to_path_buf(),
            Self::Experiment | Self::Campaign => with_extension(name, "toml"),
            Self::Study if name.ends_with(STUDY) => name.to_path_buf(),
            Self::Study => name.join(STUDY),
            Self::Fmu => with_extension(name, "fmu"),
        }
    }

    /// Returns the shortest end of a file's path that no other one has, without the extension.
    pub fn shortest(self, path: &Path, all: &[PathBuf]) -> String {
        let name = self.name(path);
        let parts: Vec<_> = name.components().collect();
        let ends = (0..parts.len()).rev().map(|from| parts[from..].iter().collect::<PathBuf>());
        let is_unique = |end: &PathBuf| {
            let file = self.file(end);
            all.iter().filter(|other| other.ends_with(&file)).count() == 1
        };
        let mut unique = ends.filter(is_unique);
        unique.next().unwrap_or(name.clone()).display().to_string()
    }

    /// Returns the name of a file of this kind by its whole path.
    pub fn name(self, path: &Path) -> PathBuf {
        match self {
            Self::Study => path.parent().unwrap_or(path).to_path_buf(),
            _ => path.with_extension(""),
        }
    }

    /// Lists the files of this kind below a folder whose paths fit.
    pub fn below(self, folder: &Path, fits: impl Fn(&Path) -> bool) -> Vec<PathBuf> {
        let extension = if self == Self::Fmu { "fmu" } else { "toml" };
        let mut paths = files(folder, extension);
        paths.retain(|path| fits(path) && Self::of(path) == Some(self));
        paths
    }

    /// Lists the files of this kind that are found from any folder.
    pub fn installed(self) -> Vec<PathBuf> {
        let mut paths: Vec<PathBuf> =
            folders().iter().flat_map(|folder| self.below(folder, |_| true)).collect();
        paths.sort();
        paths.dedup();
        paths
    }
}

/// Adds an extension to a name that does not have it.
fn with_extension(name: &Path, extension: &str) -> PathBuf {
    if has_extension(name, extension) {
        return name.to_path_buf();
    }
    let mut text = OsString::from(name);
    text.push(".");
    text.push(extension);
    PathBuf::from(text)
}

/// Finds the file that this name denotes: a path, or an installed file of this kind by its name or
/// the end of its path.
///
/// # Errors
/// Returns an error if there is nothing of this kind with this name, if there are several, or if
/// the name is that of something else. It says then which command takes that.
pub fn find(name: &Path, kind: Kind) -> Result<PathBuf, Error> {
    find_any(name, &[kind])
}

/// Finds the file that this name denotes, of the first of these kinds that has such a name.
///
/// # Errors
/// Returns an error as [`find`] does.
pub fn find_any(name: &Path, kinds: &[Kind]) -> Result<PathBuf, Error> {
    for kind in kinds {
        if let Some(path) = look(name, *kind)? {
            return Ok(path);
        }
    }
    let mut others = Kind::ALL.to_vec();
    others.retain(|kind| !kinds.contains(kind) && !matches!(look(name, *kind), Ok(None)));
    let shown = name.display();
    Err(Error::experiment(if others.is_empty() {
        unknown(name, kinds)
    } else {
        let what: Vec<&str> = others.iter().map(|kind| kind.words()[0]).collect();
        let call = |kind: &Kind| format!("orchestrator {} {shown}", kind.command());
        let calls: Vec<String> = others.iter().map(call).collect();
        format!("{shown} is {}: {}", what.join(" and "), calls.join(", or "))
    }))
}

/// Looks for a name among the files of one kind.
fn look(name: &Path, kind: Kind) -> Result<Option<PathBuf>, Error> {
    let file = kind.file(name);
    // A file of no kind is accepted as one of the expected kind, and its reader reports its faults.
    let fits = |path: &Path| path.is_file() && Kind::of(path).is_none_or(|other| other == kind);
    if let Some(path) = [name, &file].into_iter().find(|path| fits(path)) {
        return Ok(Some(path.to_path_buf()));
    }
    for folder in folders() {
        let below = kind.below(&folder, |path| path.ends_with(&file));
        if let [first, others @ ..] = &below[..] {
            if others.is_empty() {
                return Ok(Some(first.clone()));
            }
            let paths: Vec<String> = below.iter().map(|path| path.display().to_string()).collect();
            let (several, name) = (kind.plural(), name.display());
            let message = format!("several {several} are called {name}: {}", paths.join(", "));
            return Err(Error::experiment(message));
        }
    }
    Ok(None)
}

/// Describes the fault that nothing has this name, with the nearest one that is installed or in the
/// folder of the path.
fn unknown(name: &Path, kinds: &[Kind]) -> String {
    let folder = name.parent().filter(|folder| *folder != Path::new("")).unwrap_or(Path::new("."));
    let beside: Vec<PathBuf> =
        fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path()).collect();
    let mut there = Vec::new();
    for kind in kinds {
        let installed = kind.installed();
        there.extend(installed.iter().map(|path| kind.shortest(path, &installed)));
        let own = beside.iter().map(|path| kind.file(path)).filter(|path| path.is_file());
        there.extend(own.filter_map(|path| stem(&kind.name(&path))));
    }
    let wrong = kinds.first().and_then(|kind| stem(&kind.name(&kind.file(name))));
    let hint = names::hint(&wrong.unwrap_or_default(), there.iter().map(String::as_str));
    let words: Vec<&str> = kinds.iter().map(|kind| kind.word()).collect();
    format!(
        "there is no {} \"{}\", neither as a file nor among those that `orchestrator list` shows{hint}",
        words.join(" or "),
        name.display()
    )
}

fn stem(path: &Path) -> Option<String> {
    Some(path.file_name()?.to_string_lossy().into_owned())
}
