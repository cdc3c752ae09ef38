//! The basis of the robust set's guarantee: how far the vehicle can be from the plan, and whether
//! enough of the limits is then left.
//!
//! The theorem and its assumptions are in docs/guarantee.md, its proof is in docs/proof.md. The
//! comments beside the code explain the numbers of its lemmas.

mod assessment;
mod derivatives;
mod deviation;
mod dynamics;
mod geometry;
mod lemmas;
mod losses;
mod mismatch;
mod observable;
mod parts;
mod sequence;
mod tightening;

pub use assessment::Assessment;
pub(super) use assessment::{HorizonEnd, braking, terminal_rate};
pub use deviation::Deviation;
pub(super) use dynamics::Dynamics;
pub use geometry::{BRAKING, CURVATURE, DRIFT_BY_ANGLES_TWICE, DRIFT_MIXED, Domain, FOURTH, TURN};
pub use lemmas::Lemmas;
pub(super) use losses::{End, Held};
pub(super) use observable::Observable;
pub use tightening::Tightening;
pub(super) use tightening::with_share;

use super::settings::Settings;
use crate::error::DesignError;

/// Computes tightening and assessment of `settings`.
///
/// # Errors
/// Returns an error that names the gain that does not stabilise, with its spectral radius.
pub(super) fn tighten(settings: &Settings) -> Result<(Tightening, Assessment), DesignError> {
    let (tightening, dynamics) = tightening::tighten(settings)?;
    let assessment = assessment::assess(settings, &dynamics, &tightening);
    Ok((tightening, assessment))
}
