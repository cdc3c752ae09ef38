//! Files that are written completely or not at all, and their digests.

use crate::error::Error;
use serde::Serialize;
use sha2::{Digest, Sha256};
use std::fmt::Write as _;
use std::fs::{self, File};
use std::io::Write as _;
use std::path::{Path, PathBuf};

/// A file that is being written. It appears under its name when it is complete and on the disk; a
/// file that was there stays until then.
#[derive(Debug)]
pub struct PartialFile {
    path: PathBuf,
    partial: PathBuf,
    file: File,
}

impl PartialFile {
    /// Begins a file, whose folder is made if it is missing. Parts of this file that killed
    /// processes have left are removed.
    ///
    /// # Errors
    /// Returns an error if the file cannot be created.
    pub fn create(path: &Path) -> Result<Self, Error> {
        if let Some(folder) = path.parent() {
            fs::create_dir_all(folder).map_err(Error::file(folder))?;
        }
        remove_abandoned(path);
        let mut partial = path.as_os_str().to_owned();
        partial.push(format!(".{}.part", std::process::id()));
        let partial = PathBuf::from(partial);
        let file = File::create(&partial).map_err(Error::file(path))?;
        // Some network drives have no locks; there nothing is removed.
        let _ = file.try_lock();
        Ok(Self { path: path.to_path_buf(), partial, file })
    }

    /// Returns the file that is written.
    pub fn file(&mut self) -> &mut File {
        &mut self.file
    }

    /// Gives the complete file its name.
    ///
    /// # Errors
    /// Returns an error if the content does not reach the disk, or if the name belongs to a folder.
    pub fn finish(self) -> Result<(), Error> {
        self.file.sync_all().map_err(Error::file(&self.path))?;
        fs::rename(&self.partial, &self.path).map_err(Error::file(&self.path))
    }
}

impl Drop for PartialFile {
    fn drop(&mut self) {
        // An incomplete file is of no use, and it may be what fills the disk. A complete one has
        // another name by now.
        let _ = fs::remove_file(&self.partial);
    }
}

/// Removes incomplete files of this name that no process is writing any more.
fn remove_abandoned(path: &Path) {
    let (Some(folder), Some(name)) = (path.parent(), path.file_name()) else { return };
    let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    let begin = format!("{}.", name.to_string_lossy());
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let other = entry.file_name().to_string_lossy().into_owned();
        let number = other.strip_prefix(&begin).and_then(|rest| rest.strip_suffix(".part"));
        let is_partial = number.is_some_and(|number| number.parse::<u32>().is_ok());
        if is_partial && File::open(entry.path()).is_ok_and(|file| file.try_lock().is_ok()) {
            let _ = fs::remove_file(entry.path());
        }
    }
}

/// Writes a file in the manner of [`PartialFile`].
///
/// # Errors
/// Returns an error if the file cannot be written.
pub fn write(path: &Path, content: impl AsRef<[u8]>) -> Result<(), Error> {
    let mut partial = PartialFile::create(path)?;
    partial.file().write_all(content.as_ref()).map_err(Error::file(path))?;
    partial.finish()
}

/// Writes a value as JSON, in the manner of [`write()`].
///
/// # Errors
/// Returns an error if the file cannot be written.
pub fn write_json(path: &Path, value: &impl Serialize) -> Result<(), Error> {
    let text = serde_json::to_string_pretty(value);
    write(path, text.map_err(|error| Error::file(path)(error.into()))? + "\n")
}

/// Returns the SHA-256 of bytes as hexadecimal digits.
pub fn digest(bytes: impl AsRef<[u8]>) -> String {
    hexadecimal(&Sha256::digest(bytes))
}

/// Formats bytes as hexadecimal digits.
pub fn hexadecimal(bytes: &[u8]) -> String {
    bytes.iter().fold(String::new(), |mut text, byte| {
        // Writing to a string cannot fail.
        let _ = write!(text, "{byte:02x}");
        text
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_that_cannot_be_replaced_stays_and_nothing_is_left_beside_it() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("made/for it/a.txt");
        write(&path, "one").unwrap();
        write(&path, "two").unwrap();
        assert_eq!(fs::read_to_string(&path).unwrap(), "two");
        // A folder cannot be replaced by a file.
        let error = write(path.parent().unwrap(), "three").unwrap_err();
        assert!(error.to_string().contains("for it"), "{error}");
        let beside = |path: &Path| fs::read_dir(path).unwrap().count();
        assert_eq!((beside(folder.path()), beside(path.parent().unwrap())), (1, 1));
        assert_eq!(beside(&folder.path().join("made")), 1);
    }

    #[test]
    fn what_a_killed_process_has_left_of_a_file_is_removed() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.txt");
        let (left, other) =
            (folder.path().join("a.txt.1.part"), folder.path().join("b.txt.1.part"));
        fs::write(&left, "half").unwrap();
        fs::write(&other, "half").unwrap();
        let mut written = folder.path().join("a.txt.2.part");
        fs::write(&written, "half").unwrap();
        let held = File::open(&written).unwrap();
        held.try_lock().unwrap();
        write(&path, "whole").unwrap();
        assert!(!left.exists() && other.exists() && written.exists());
        drop(held);
        write(&path, "whole").unwrap();
        assert!(!written.exists());
        written.pop();
        assert_eq!(fs::read_dir(written).unwrap().count(), 2);
    }

    #[test]
    fn published_digest_of_abc() {
        // FIPS 180-2, appendix B.1.
        let expected = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";
        assert_eq!(digest("abc"), expected);
    }
}
