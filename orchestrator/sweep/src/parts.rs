//! Parts of a sweep: consecutive cases, whose results share a file. A part with a valid file is not
//! flown again, whether this thread, an earlier run or another machine flew it.

use crate::table::CaseTable;
use cosim::error::Error;
use cosim::files;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use std::collections::BTreeMap;
use std::fs;
use std::ops::Range;
use std::path::PathBuf;

/// Returns the number of cases in the part that begins at a case: few, so that little work occupies
/// all cores and loses little when it ends early. Where cases are slow there are few of them.
fn length(start: u64) -> u64 {
    if start < 100 { 5 } else { 25 }
}

/// Returns the parts of so many cases. Those of fewer cases are the first of them, except for the
/// last.
pub fn parts(cases: u64) -> impl Iterator<Item = Range<u64>> {
    std::iter::successors(Some(0), |start| Some(start + length(*start)))
        .take_while(move |start| *start < cases)
        .map(move |start| start..cases.min(start + length(start)))
}

/// Folder of the parts that are made from inputs with these hashes.
pub struct Store<'a> {
    /// Folder of the files.
    pub folder: PathBuf,
    /// Hashes of all inputs, by their names.
    pub keys: &'a BTreeMap<String, String>,
}

/// Results of a part.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PartResult {
    /// A row for each case.
    pub rows: CaseTable,
    /// Curves and other results that are no rows, as JSON; an empty text if there are none.
    pub curves: String,
}

impl Store<'_> {
    /// Returns the path of a part's file.
    fn path(&self, part: &Range<u64>) -> PathBuf {
        self.folder.join(format!("{:010}-{:010}.cases", part.start, part.end))
    }

    /// Looks for a part.
    ///
    /// # Errors
    /// Returns why the part is to be flown, in words if its file is of no use; `None` if there is no
    /// such file.
    pub fn find(&self, part: &Range<u64>) -> Result<PartResult, Option<String>> {
        let path = self.path(part);
        if !path.exists() {
            return Err(None);
        }
        let damaged = || Some("their files are damaged".to_string());
        let decoded = fs::read(&path).ok().and_then(|bytes| decoded(&bytes));
        let (stored, result) = decoded.ok_or_else(damaged)?;
        let differing = self.keys.iter().filter(|(name, key)| stored.get(*name) != Some(key));
        let superfluous = stored.iter().filter(|(name, _)| !self.keys.contains_key(*name));
        let others: Vec<&str> = differing.chain(superfluous).map(|(name, _)| &**name).collect();
        if !others.is_empty() {
            return Err(Some(format!("this has changed: {}", others.join(", "))));
        }
        // A file may have been renamed.
        if result.rows.has_cases(part) { Ok(result) } else { Err(damaged()) }
    }

    /// Reads a part that was found to be whole.
    ///
    /// # Errors
    /// Returns an error if the file has been removed, damaged or replaced by another one since.
    pub fn read(&self, part: &Range<u64>) -> Result<PartResult, Error> {
        self.find(part).map_err(|_| {
            Error::experiment(format!(
                "{} was changed while it was in use: the same command flies its cases again",
                self.path(part).display()
            ))
        })
    }

    /// Keeps the results of a part, with the hashes of all its inputs.
    ///
    /// # Errors
    /// Returns an error if the file cannot be written.
    pub fn write(&self, part: &Range<u64>, result: &PartResult) -> Result<(), Error> {
        let path = self.path(part);
        if !result.rows.has_cases(part) {
            let problem = "does not hold each of its cases once";
            return Err(Error::experiment(format!("{} {problem}", path.display())));
        }
        let content = postcard::to_stdvec(&(self.keys, result));
        let content = content.map_err(|error| Error::experiment(error.to_string()))?;
        files::write(&path, [&Sha256::digest(&content)[..], &content].concat())
    }
}

/// Decodes a part's file: a hash of the content, so that no number is used that was changed later,
/// then the hashes of the inputs and the results.
fn decoded(bytes: &[u8]) -> Option<(BTreeMap<String, String>, PartResult)> {
    let (hash, content) = bytes.split_first_chunk::<32>()?;
    if Sha256::digest(content)[..] != *hash {
        return None;
    }
    postcard::from_bytes(content).ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::table::{Column, Values};

    #[test]
    fn parts_follow_one_another_and_do_not_change_when_cases_are_added() {
        for cases in [1, 25, 1100, 2500, 2510, 10_000] {
            let some: Vec<_> = parts(cases).collect();
            let more: Vec<_> = parts(20_000).take(some.len()).collect();
            assert_eq!((some[0].start, some[some.len() - 1].end), (0, cases));
            assert!(some.windows(2).all(|pair| pair[0].end == pair[1].start));
            assert_eq!(some[..some.len() - 1], more[..some.len() - 1]);
        }
    }

    #[test]
    fn no_changed_byte_goes_unseen() {
        let columns = vec![
            Column { name: "case".into(), values: Values::Integer(vec![0, 1]) },
            Column { name: "largest".into(), values: Values::Real(vec![Some(0.1), None]) },
            Column { name: "status".into(), values: Values::Text(vec!["x".into(), "y".into()]) },
        ];
        let result = PartResult { rows: CaseTable { columns }, curves: "{\"time\":[0.1]}".into() };
        let keys = BTreeMap::from([("experiment".to_string(), "abc".to_string())]);
        let folder = tempfile::tempdir().unwrap();
        let part = 0..2;
        let store = Store { folder: folder.path().to_path_buf(), keys: &keys };
        store.write(&part, &result).unwrap();
        let path = store.path(&part);
        let sound = fs::read(&path).unwrap();
        let damaged = || Err(Some("their files are damaged".into()));
        assert_eq!(store.find(&part), Ok(result.clone()));
        for byte in 0..sound.len() {
            let mut broken = sound.clone();
            broken[byte] ^= 0x10;
            fs::write(&path, &broken).unwrap();
            assert_eq!(store.find(&part), damaged(), "byte {byte}");
            fs::write(&path, &sound[..byte]).unwrap();
            assert_eq!(store.find(&part), damaged(), "{byte} bytes");
        }
        // The same bytes are not those of another part of this length.
        fs::write(store.path(&(2..4)), &sound).unwrap();
        assert_eq!(store.find(&(2..4)), damaged());
        let twice = Values::Integer(vec![0, 0]);
        let mut doubled = result.clone();
        doubled.rows.columns[0].values = twice;
        let error = store.write(&part, &doubled).unwrap_err().to_string();
        assert!(error.contains("each of its cases once"), "{error}");
        let other = BTreeMap::from([("experiment".to_string(), "abd".to_string())]);
        fs::write(&path, &sound).unwrap();
        let changed = Store { folder: folder.path().to_path_buf(), keys: &other };
        assert_eq!(changed.find(&part), Err(Some("this has changed: experiment".into())));
    }
}
