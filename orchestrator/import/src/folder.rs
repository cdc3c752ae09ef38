//! Temporary folders that are removed when the process ends. If it was killed, the next run removes
//! them.

use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Once;
use std::time::{Duration, SystemTime};
use tempfile::TempDir;

/// Beginning of the names of these folders.
const PREFIX: &str = "unpacked-fmu-";
/// Age from which a folder that nobody holds is removed, because a new one is not held for a
/// moment.
const AGE: Duration = Duration::from_secs(60);

/// A temporary folder that is removed when this value is dropped.
#[derive(Debug)]
pub struct TemporaryFolder {
    /// Tells other processes that the folder is in use. It is dropped first, because some systems
    /// do not remove a folder as long as a file in it is open.
    _hold: Option<File>,
    folder: TempDir,
}

impl TemporaryFolder {
    /// Makes a folder. The first call of a process removes the folders that killed processes have
    /// left.
    pub(crate) fn new() -> io::Result<Self> {
        static ONCE: Once = Once::new();
        ONCE.call_once(|| remove_orphans(&std::env::temp_dir(), AGE));
        let folder = tempfile::Builder::new().prefix(PREFIX).tempdir()?;
        // Without a lock, another process may take the folder for an orphan once it is old enough.
        let hold = hold(folder.path()).ok().filter(|hold| hold.try_lock().is_ok());
        Ok(Self { _hold: hold, folder })
    }

    /// Returns the path of the folder.
    pub fn path(&self) -> &Path {
        self.folder.path()
    }
}

/// Opens the file that is locked in place of a folder: the folder itself, or a file in it.
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
        let changed = changed.and_then(|metadata| metadata.modified().ok());
        changed.is_some_and(|at| SystemTime::now().duration_since(at).is_ok_and(|old| old >= age))
    };
    let entries = fs::read_dir(within).into_iter().flatten().flatten();
    let folders = entries.filter(|entry| entry.file_name().to_string_lossy().starts_with(PREFIX));
    for path in folders.map(|entry| entry.path()).filter(is_old) {
        if hold(&path).is_ok_and(|hold| hold.try_lock().is_ok()) {
            // A folder of another user stays.
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
