//! A surface or a jet that fails.

use super::{Effectors, JETS};
use crate::time::tolerance;
use serde::{Deserialize, Serialize};
use settings::{Choice, Declared, Invalid};

/// What fails.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Choice)]
#[serde(rename_all = "camelCase")]
#[setting(name = "EffectorFault")]
pub enum EffectorFaultKind {
    /// Nothing fails.
    #[default]
    None,
    /// The surface stays where it is.
    Stuck,
    /// The surface moves to zero and stays there, as without a load on its hinge.
    Floating,
    /// The surface moves at a share of its rate.
    Slow,
    /// The jet stays on.
    JetOn,
    /// The jet stays off.
    JetOff,
}

/// A surface or a jet that fails at a time, for good.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Declared)]
pub struct EffectorFault {
    /// What fails, if anything.
    pub kind: EffectorFaultKind,
    /// Number of the surface or the jet that fails.
    #[setting(min = 1, max = JETS, used_with = "~.kind != none")]
    pub number: usize,
    /// Time at which it fails.
    #[setting(unit = "s", nominal = 100.0, used_with = "~.kind != none")]
    pub start: f64,
    /// Share of its rate at which a slow surface moves.
    #[setting(min = 0.0, max = 1.0, used_with = "~.kind = slow")]
    pub share: f64,
}

impl Default for EffectorFault {
    fn default() -> Self {
        Self { kind: EffectorFaultKind::None, number: 1, start: 0.0, share: 0.2 }
    }
}

impl EffectorFault {
    /// Returns what has failed by `time` (s), and the index of the surface or the jet.
    pub fn at(&self, time: f64) -> (EffectorFaultKind, usize) {
        let has_begun = time + tolerance(time) >= self.start;
        let kind = if has_begun { self.kind } else { EffectorFaultKind::None };
        (kind, self.number.saturating_sub(1))
    }

    /// Returns the time (s) of the failure if it comes after `time`.
    pub(crate) fn next(&self, time: f64) -> Option<f64> {
        let comes = self.kind != EffectorFaultKind::None && self.at(time).0 != self.kind;
        (comes && self.start.is_finite()).then_some(self.start)
    }

    /// Refuses a surface or a jet that is not among the effectors, and values out of range.
    ///
    /// # Errors
    /// Names the setting at fault.
    pub fn check(&self, effectors: &Effectors) -> Result<(), Invalid> {
        use EffectorFaultKind::{Floating, JetOff, JetOn, Slow, Stuck};
        let named =
            |fault: Invalid| Invalid { name: format!("effector.fault.{}", fault.name), ..fault };
        settings::check(self).map_err(named)?;
        let (count, what) = match self.kind {
            EffectorFaultKind::None => return Ok(()),
            Stuck | Floating | Slow => (effectors.surfaces(), "surfaces"),
            JetOn | JetOff => (effectors.jets(), "jets"),
        };
        if self.number <= count {
            return Ok(());
        }
        let problem = format!("must be at most {count}: the vehicle has no more {what}");
        Err(named(Invalid { name: "number".into(), value: self.number as f64, problem }))
    }
}
