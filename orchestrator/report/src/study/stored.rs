//! Files that hold the finished parts of a study, so that they need not be run again.

use super::outcome::Outcome;
use super::part::Part;
use cosim::files::digest;
use serde::{Deserialize, Serialize};
use std::fs;
use std::path::Path;

/// Content of the file of a finished part.
#[derive(Serialize, Deserialize)]
pub(super) struct StoredOutcome {
    key: String,
    members: std::ops::Range<u32>,
    /// Hash of all other fields, so that no number is used that was changed later.
    digest: String,
    pub(super) outcome: Outcome,
}

impl StoredOutcome {
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

/// Reads the outcome of a part that was finished earlier, if it is still valid.
pub(super) fn load(path: &Path, key: &str, part: &Part) -> Option<Outcome> {
    let text = fs::read(path).ok()?;
    let stored = serde_json::from_slice::<StoredOutcome>(&text).ok();
    let stored = stored.filter(StoredOutcome::is_whole);
    let Some(stored) = stored else {
        tracing::error!("{} is damaged: its runs are repeated", path.display());
        return None;
    };
    (stored.key == key && stored.members == part.range).then_some(stored.outcome)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::metrics::Metrics;
    use crate::study::outcome::Member;
    use cosim::system::Parameters;
    use std::collections::BTreeMap;
    use tracing::subscriber::{NoSubscriber, with_default};

    #[test]
    fn no_changed_bit_goes_unseen() {
        let measures = [("settling", None), ("largest", Some(0.1)), ("mean", Some(-2.5e-7))];
        let member = Member {
            value: Some(3),
            metrics: Metrics::default(),
            within: BTreeMap::new(),
            measures: measures.map(|(id, value)| (id.to_string(), value)).into(),
        };
        let gain = BTreeMap::from([("gain".to_string(), 2.5.into())]);
        let outcome = Outcome {
            members: vec![member],
            parameters: Parameters::from([("controller".to_string(), gain)]),
            ..Outcome::default()
        };
        let part = Part { run: 0, range: 0..1 };
        let stored = StoredOutcome::new("key".into(), part.range.clone(), outcome.clone()).unwrap();
        let sound = serde_json::to_vec(&stored).unwrap();
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("part.json");
        let read = |bytes: &[u8]| {
            fs::write(&path, bytes).unwrap();
            with_default(NoSubscriber::default(), || load(&path, "key", &part))
        };
        assert_eq!(read(&sound), Some(outcome.clone()));
        let mut seen = 0;
        for bit in 0..8 * sound.len() {
            let mut broken = sound.clone();
            broken[bit / 8] ^= 1 << (bit % 8);
            match read(&broken) {
                None => seen += 1,
                outcome_read => assert_eq!(outcome_read.as_ref(), Some(&outcome), "bit {bit}"),
            }
        }
        // The others change how a number is written, or a space.
        assert!(seen > 78 * sound.len() / 10, "{seen} of {}", 8 * sound.len());
    }
}
