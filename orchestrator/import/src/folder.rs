//! Temporary folders that vanish on every exit that the system lets a process see, and are removed
//! by the next run after any other.

use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Once;
use std::time::{Duration, SystemTime};
use tempfile::TempDir;

/// Beginning of the names of these folders.
const PREFIX: &str = "unpacked-fmu-";
/// Age from which a folder that nobody holds is removed: a new one is not yet held for a moment.
const AGE: Duration = Duration::from_secs(60);

/// A temporary folder that is removed when this value is dropped.
#[derive(Debug)]
pub struct TemporaryFolder {
    /// Says to other processes that the folder is in use. It goes first: some systems keep a folder
    /// as long as a file in it is open.
    _hold: Option<File>,
    folder: TempDir,
}

impl TemporaryFolder {
    /// Makes a folder. The first call of a process removes those that killed processes left.
    pub(crate) fn new() -> io::Result<Self> {
        static ONCE: Once = Once::new();
        ONCE.call_once(|| remove_orphans(&std::env::temp_dir(), AGE));
        let folder = tempfile::Builder::new().prefix(PREFIX).tempdir()?;
        // Without a lock the folder is only removed later by a process that cannot know better.
        let hold = hold(folder.path()).ok().filter(|hold| hold.try_lock().is_ok());
        Ok(Self { _hold: hold, folder })
    }

    /// Returns the path of the folder.
    pub fn path(&self) -> &Path {
        self.folder.path()
    }
}

/// Opens what stands for a folder in locks: the folder itself, or a file in it.
fn hold(folder: &Path) -> io::Result<File> {
    if cfg!(unix) {
        File::open(folder)
    } else {
        File::options().create(true).truncate(false).write(true).open(folder.join(".hold"))
    }
}

/// Removes the folders of this kind that nobody holds.
fn remove_orphans(within: &Path, age: Duration) {
    let is_old = |path: &PathBuf| {
        let changed = fs::symlink_metadata(path).ok().filter(fs::Metadata::is_dir);
        let changed = changed.and_then(|found| found.modified().ok());
        changed.is_some_and(|at| SystemTime::now().duration_since(at).is_ok_and(|old| old >= age))
    };
    let all = fs::read_dir(within).into_iter().flatten().flatten();
    let own = all.filter(|entry| entry.file_name().to_string_lossy().starts_with(PREFIX));
    for path in own.map(|entry| entry.path()).filter(is_old) {
        if hold(&path).is_ok_and(|hold| hold.try_lock().is_ok()) {
            // What belongs to somebody else stays.
            let _ = fs::remove_dir_all(&path);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_nobody_holds_is_removed() {
        let outer = tempfile::tempdir().unwrap();
        let make = |name: &str| {
            let path = outer.path().join(name);
            fs::create_dir_all(path.join("binaries")).unwrap();
            path
        };
        let (orphan, held) = (make("unpacked-fmu-1"), make("unpacked-fmu-2"));
        let other = make("somebody");
        let holds = hold(&held).unwrap();
        holds.try_lock().unwrap();
        remove_orphans(outer.path(), AGE);
        assert!(orphan.exists());
        remove_orphans(outer.path(), Duration::ZERO);
        assert!(!orphan.exists() && held.exists() && other.exists());
        drop(holds);
        remove_orphans(outer.path(), Duration::ZERO);
        assert!(!held.exists());

        let folder = TemporaryFolder::new().unwrap();
        let path = folder.path().to_path_buf();
        remove_orphans(&std::env::temp_dir(), AGE);
        assert!(path.is_dir());
        drop(folder);
        assert!(!path.exists());
    }
}
