//! The folder of a run's results. Only one process uses it at a time, and it never holds the
//! results of two runs side by side.

use cosim::error::Error;
use std::fs::{self, File, TryLockError};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Names of the files that a run may write.
pub const RESULTS: [&str; 5] =
    ["results.csv", "results.json", "metrics.json", "plot.svg", "page.html"];

/// Time for which a folder that is taken is waited for.
const PATIENCE: Duration = Duration::from_millis(300);

/// A folder that belongs to this process as long as this value lives.
pub struct Folder {
    path: PathBuf,
    _lock: File,
}

impl Folder {
    /// Checks that the results of a run may be written to this path.
    ///
    /// # Errors
    /// Returns an error if the path is not a folder, or if the folder holds results that may not be
    /// replaced.
    pub fn check(path: &Path, replaces: bool) -> Result<(), Error> {
        if path.exists() && !path.is_dir() {
            return Err(Error::experiment(format!(
                "--out {} is a file, but results go into a folder",
                path.display()
            )));
        }
        match RESULTS.into_iter().find(|name| path.join(name).exists()) {
            Some(name) if !replaces => Err(Error::experiment(format!(
                "{} holds results of an earlier run ({name}): --force replaces them, --out takes another folder",
                path.display()
            ))),
            _ => Ok(()),
        }
    }

    /// Creates and locks a folder for the results of many runs.
    ///
    /// # Errors
    /// The errors are those of [`Self::take`]; a folder with the results of a single run is
    /// refused, too.
    pub fn take_for_many(path: &Path) -> Result<Self, Error> {
        if path.join("metrics.json").exists() || (path.exists() && !path.is_dir()) {
            return Err(Error::experiment(format!(
                "{} holds other results: take another folder by --out",
                path.display()
            )));
        }
        Self::take(path)
    }

    /// Creates the folder and locks it. Files that it already holds are left alone.
    ///
    /// # Errors
    /// Returns an error if another process has locked the folder, or if it cannot be created.
    pub fn take(path: &Path) -> Result<Self, Error> {
        fs::create_dir_all(path).map_err(Error::file(path))?;
        let lock = open(path).map_err(Error::file(path))?;
        let begin = Instant::now();
        loop {
            match lock.try_lock() {
                // Some network drives have no locks; the folder is used without one then.
                Ok(()) | Err(TryLockError::Error(_)) => {
                    return Ok(Self { path: path.to_path_buf(), _lock: lock });
                }
                // A process that was killed while it was starting another one holds it for a
                // moment.
                Err(TryLockError::WouldBlock) if begin.elapsed() < PATIENCE => {
                    std::thread::sleep(Duration::from_millis(10));
                }
                Err(TryLockError::WouldBlock) => {
                    return Err(Error::experiment(format!(
                        "another process is writing its results to {}: wait for it, or take another folder by --out",
                        path.display()
                    )));
                }
            }
        }
    }

    /// Removes the results of an earlier run.
    ///
    /// # Errors
    /// Returns an error if a file cannot be removed.
    pub fn clear(&self) -> Result<(), Error> {
        self.remove(&RESULTS)
    }

    /// Removes files of this folder, as far as they exist.
    ///
    /// # Errors
    /// Returns an error if a file cannot be removed.
    pub fn remove(&self, names: &[&str]) -> Result<(), Error> {
        for path in names.iter().map(|name| self.path.join(name)) {
            if path.exists() {
                fs::remove_file(&path).map_err(Error::file(&path))?;
            }
        }
        Ok(())
    }
}

/// Opens the folder itself to lock it, so that no lock file is left in it.
#[cfg(unix)]
fn open(path: &Path) -> std::io::Result<File> {
    File::open(path)
}

#[cfg(not(unix))]
fn open(path: &Path) -> std::io::Result<File> {
    File::options().create(true).truncate(false).write(true).open(path.join(".lock"))
}
