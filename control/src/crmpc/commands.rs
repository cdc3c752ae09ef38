//! Recent changes of the command, for a delay that is known only within an interval.

use super::guarantee::{Switching, unseen};
use super::observer::Observed;
use super::settings::Settings;
use crate::clone_in_place::clone_in_place;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

/// Changes of the commanded acceleration that the newest measurement may not show yet.
#[derive(Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Commands {
    /// Sizes of the changes, the oldest first, rad/s².
    changes: Vec<f64>,
    /// Acceleration commanded before the last tick, rad/s²; `None` before the second tick.
    before: Option<Vector3<f64>>,
}

clone_in_place!([] Commands { changes });

impl Commands {
    pub(super) fn new(s: &Settings) -> Self {
        Self { changes: vec![0.0; unseen(s)], ..Self::default() }
    }

    pub(super) fn fits(&self, s: &Settings) -> bool {
        self.changes.len() == unseen(s)
    }

    /// Returns the changes that the newest measurement may not show, rad/s².
    pub(super) fn changes(&self) -> &[f64] {
        &self.changes
    }

    /// Takes the acceleration that was commanded at the last tick, before the next command. Returns
    /// the mean acceleration over a period by the pulse that its change causes, rad/s².
    pub(super) fn observe(
        &mut self,
        s: &Settings,
        switching: &Switching,
        observed: &Observed,
    ) -> f64 {
        let Some(commanded) = observed.commanded() else { return 0.0 };
        let before = self.before.or_else(|| observed.without_moment(&s.body));
        let change = before.map_or(0.0, |before| (commanded - before).norm());
        self.before = Some(commanded);
        if let Some(oldest) = self.changes.first_mut() {
            *oldest = change;
            self.changes.rotate_left(1);
        }
        switching.pulse_of_command(change) / s.period_feedback
    }
}
