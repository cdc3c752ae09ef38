//! The tightening of the robust set, tick by tick.

use super::deviation::Deviation;
use super::losses::{MomentLoss, RateLoss};
use super::observable::{MEANS, Observable};
use crate::controller::Explained;

/// Tightening of the robust set, by feedback ticks since the nominal trajectory began at the
/// measured state.
#[derive(Clone, Debug, PartialEq)]
pub struct Tightening {
    /// Reserves at each tick; the last ones apply to all later ticks.
    pub(super) ticks: Vec<AtTick>,
    /// Largest ‖I W s‖ over the corners s of the unit box at any attitude of the domain, kg m².
    pub bearing: f64,
    /// Largest means of an observed disturbance that the assumptions explain.
    pub(in crate::crmpc) observable: [Observable; MEANS],
    /// Largest mean acceleration over a period that the assumptions explain.
    pub explained: Explained,
}

/// Parts of the limits that are reserved for the deviation at a feedback tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::crmpc) struct AtTick {
    /// Deviation at the tick.
    pub deviation: Deviation,
    /// Bulge of the angles' deviation: the largest amount by which it exceeds the straight line
    /// between its values at both ends of the optimisation period that begins at the tick, rad.
    pub bulge: f64,
    /// Loss of moment by the largest deviation at the ticks of that optimisation period.
    pub moment_loss: MomentLoss,
    /// Loss of rate by the deviation at the tick, and in the intervals of the plan before and after
    /// it.
    pub rate_loss: RateLoss,
}

impl Tightening {
    /// Returns the reserves `tick` feedback ticks after the nominal trajectory began.
    pub(in crate::crmpc) fn tick(&self, tick: usize) -> &AtTick {
        &self.ticks[tick.min(self.ticks.len() - 1)]
    }

    /// Returns the deviation `tick` feedback ticks after the nominal trajectory began.
    pub fn at(&self, tick: usize) -> &Deviation {
        &self.tick(tick).deviation
    }

    /// Returns the deviation that is never exceeded.
    pub fn forever(&self) -> &Deviation {
        self.at(usize::MAX)
    }
}
