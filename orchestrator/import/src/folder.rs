//! Temporary folders that are removed when the process ends. If it was killed, the next run removes
//! them.

use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Once;
use std::time::{Duration, SystemTime};
use tempfile::TempDir;

/// Beginning of the names of these folders, which the number of the process follows.
const PREFIX: &str = "unpacked-fmu-";
/// Age from which a folder that nobody holds is removed although its process may live, because a
/// new one is not held for a moment.
const AGE: Duration = Duration::from_secs(60);

/// A temporary folder that is removed when this value is dropped.
#[derive(Debug)]
pub struct TemporaryFolder {
    /// Tells other processes that the folder is in use. It is dropped first, because some systems
    /// do not remove a folder as long as a file in it is open.
    _hold: Option<File>,
    folder: TempDir,
}

/// Removes the folders that killed processes have left. A process does so with its first folder; it
/// may do so again at its end, because a process that was just starting another one when it was
/// killed seems to hold its folders for a moment.
pub fn remove_left() {
    remove_orphans(&std::env::temp_dir(), AGE);
}

impl TemporaryFolder {
    /// Makes a folder. The first call of a process removes the folders that killed processes have
    /// left.
    pub(crate) fn new() -> io::Result<Self> {
        static ONCE: Once = Once::new();
        ONCE.call_once(remove_left);
        let prefix = format!("{PREFIX}{}-", std::process::id());
        let folder = tempfile::Builder::new().prefix(&prefix).tempdir()?;
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

/// Returns whether the process that made a folder has ended, as far as this can be seen.
fn is_of_the_dead(folder: &Path) -> bool {
    let name = folder.file_name().unwrap_or_default().to_string_lossy();
    let number = name.strip_prefix(PREFIX).and_then(|rest| rest.split('-').next());
    let number = number.and_then(|number| number.parse::<u32>().ok());
    let processes = Path::new("/proc");
    processes.join("self").exists()
        && number.is_some_and(|number| !processes.join(number.to_string()).exists())
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
    for path in
        folders.map(|entry| entry.path()).filter(|path| is_of_the_dead(path) || is_old(path))
    {
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
        let living = |name: &str| make(&format!("unpacked-fmu-{}-{name}", std::process::id()));
        let (orphan, held) = (living("1"), living("2"));
        // The numbers of processes do not become so large.
        let dead = make("unpacked-fmu-4294967295-3");
        let other = make("somebody");
        let holds = hold(&held).unwrap();
        holds.try_lock().unwrap();
        remove_orphans(outer.path(), AGE);
        assert!(orphan.exists());
        assert!(!dead.exists() || !Path::new("/proc/self").exists());
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
