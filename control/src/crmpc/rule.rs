//! The gain K of the feedback law where none is set: only as stiff as the declared bounds need.

use super::guarantee::{self, Assessment, Tightening};
use super::settings::{Settings, rule};
use crate::error::DesignError;
use crate::error_dynamics::Gain;

/// Settings whose gain K is set, with the tightening and the remainder of the limits.
pub(super) struct Tightened {
    pub settings: Settings,
    pub tightening: Tightening,
    pub assessment: Assessment,
}

impl Tightened {
    pub(super) fn new(settings: &Settings) -> Result<Self, DesignError> {
        let (tightening, assessment) = guarantee::tighten(settings)?;
        Ok(Self { settings: *settings, tightening, assessment })
    }

    /// Returns whether no stiffer gain is needed.
    fn suffices(&self) -> bool {
        self.assessment.holds() && self.assessment.moment_left >= rule().reserve
    }

    /// Returns whether the guarantee can be given, and the share that is left of the limit that is
    /// short.
    fn merit(&self) -> (bool, f64) {
        let Assessment { moment_left, rate_left, .. } = self.assessment;
        (self.assessment.holds(), moment_left.min(rate_left))
    }
}

/// Returns the gains that may be taken, in the order in which they are tried: the one that is set,
/// those of the rule if both of its parts are zero, and none if one of them is.
pub(super) fn candidates(s: &Settings) -> &[Gain] {
    match s.feedback {
        Gain { k1: 0.0, k2: 0.0 } => rule().candidates(s.constraints),
        Gain { k1, k2 } if k1 == 0.0 || k2 == 0.0 => &[],
        _ => std::slice::from_ref(&s.feedback),
    }
}

/// Returns the settings with the first candidate that leaves enough of the moment, or else with the
/// one that leaves most. If none is accepted, the one that comes closest is taken.
///
/// # Errors
/// Returns an error if no candidate stabilises the error dynamics, or if only one part of the gain
/// is set.
pub(super) fn chosen(s: &Settings) -> Result<Tightened, DesignError> {
    let Gain { k1, k2 } = s.feedback;
    let mut best: Result<Tightened, _> = Err(DesignError::HalfGain { k1, k2 });
    for &feedback in candidates(s) {
        let tried = Tightened::new(&Settings { feedback, ..*s });
        if tried.as_ref().is_ok_and(Tightened::suffices) {
            return tried;
        }
        let is_better = match (&tried, &best) {
            (Ok(tried), Ok(best)) => tried.merit() > best.merit(),
            (_, best) => best.is_err(),
        };
        if is_better {
            best = tried;
        }
    }
    best
}
