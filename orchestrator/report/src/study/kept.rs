//! Files in which the finished parts of a study are kept, so that they need not be run again.

use super::part::{Outcome, Part};
use cosim::files::digest;
use serde::{Deserialize, Serialize};
use std::fs;
use std::path::Path;

/// Content of the file of a finished part.
#[derive(Serialize, Deserialize)]
pub(super) struct Kept {
    key: String,
    members: std::ops::Range<u32>,
    /// Hash of all other fields, so that no number is used that was changed later.
    digest: String,
    pub(super) outcome: Outcome,
}

impl Kept {
    pub(super) fn new(
        key: String,
        members: std::ops::Range<u32>,
        outcome: Outcome,
    ) -> serde_json::Result<Self> {
        let digest = Self::digest(&key, &members, &outcome)?;
        Ok(Self { key, members, digest, outcome })
    }

    fn digest(
        key: &str,
        members: &std::ops::Range<u32>,
        outcome: &Outcome,
    ) -> serde_json::Result<String> {
        Ok(digest(serde_json::to_vec(&(key, members, outcome))?))
    }

    fn is_whole(&self) -> bool {
        Self::digest(&self.key, &self.members, &self.outcome)
            .is_ok_and(|digest| digest == self.digest)
    }
}

/// Reads the outcome that a part has kept earlier, if it is still valid.
pub(super) fn kept(path: &Path, key: &str, part: &Part) -> Option<Outcome> {
    let text = fs::read(path).ok()?;
    let kept = serde_json::from_slice::<Kept>(&text).ok().filter(Kept::is_whole);
    let Some(kept) = kept else {
        tracing::error!("{} is damaged: it is run again", path.display());
        return None;
    };
    (kept.key == key && kept.members == part.range).then_some(kept.outcome)
}
