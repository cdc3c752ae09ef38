//! The tightening of the robust set, tick by tick.

use super::deviation::Deviation;
use super::losses::{MomentLoss, RateLoss};
use super::observable::{MEANS, Observable};
use super::switching::Switching;
use crate::controller::Explained;

/// Tightening of the robust set, by feedback ticks since the nominal motion began at the measured
/// state.
#[derive(Clone, Debug, PartialEq)]
pub struct Tightening {
    /// Deviation at each tick; the last one is never exceeded.
    pub(super) at: Vec<Deviation>,
    /// Largest amount by which the deviation of the angles exceeds the straight line between its
    /// values at both ends of the optimisation period that begins at each tick, rad.
    pub(super) angle_bulge: Vec<f64>,
    /// Loss of moment by the largest deviation within the optimisation period that begins at each
    /// tick.
    pub(super) moment: Vec<MomentLoss>,
    /// Loss of rate by the deviation at each tick, and in the intervals of the plan before and
    /// after it.
    pub(super) rate: Vec<RateLoss>,
    /// Largest ‖I W s‖ over the corners s of the unit box at any attitude of the domain, kg m².
    pub bearing: f64,
    /// Bound on the norm of everything that drives the deviation, rad/s².
    pub norm: f64,
    /// Part of `norm` by which F differs between two ticks from the acceleration that the law
    /// intended, rad/s².
    pub mismatch: f64,
    /// Largest means of an observed disturbance that the assumptions explain.
    pub(in crate::crmpc) observable: [Observable; MEANS],
    /// Largest mean acceleration over a period that the assumptions explain.
    pub explained: Explained,
    /// Addition for an unknown part of the delay; `None` if the delay is exact.
    pub switching: Option<Box<Switching>>,
    /// Largest jump of the rates that a change of K ô causes, rad/s, by feedback ticks.
    pub(super) pulse: Vec<f64>,
}

impl Tightening {
    pub(super) fn place(&self, tick: usize) -> usize {
        tick.min(self.at.len() - 1)
    }

    /// Returns the deviation `tick` feedback ticks after the nominal motion began.
    pub fn at(&self, tick: usize) -> &Deviation {
        &self.at[self.place(tick)]
    }

    /// Returns the loss of moment by the largest deviation at the feedback ticks of the
    /// optimisation period that begins at `tick`.
    pub(in crate::crmpc) fn moment_loss(&self, tick: usize) -> &MomentLoss {
        &self.moment[self.place(tick)]
    }

    /// Returns the loss of rate at `tick` and in the intervals of the plan before and after it.
    pub(in crate::crmpc) fn rate_loss(&self, tick: usize) -> &RateLoss {
        &self.rate[self.place(tick)]
    }

    /// Returns the largest amount by which the deviation of the angles exceeds the straight line
    /// between its values at both ends of the optimisation period that begins at `tick`, rad.
    pub(in crate::crmpc) fn angle_bulge(&self, tick: usize) -> f64 {
        self.angle_bulge[self.place(tick)]
    }

    /// Returns the largest jump of the rates that a change of K ô at `tick` causes if the command
    /// begins to act earlier or later than assumed, rad/s.
    pub(in crate::crmpc) fn pulse(&self, tick: usize) -> f64 {
        self.pulse[self.place(tick)]
    }

    /// Returns the largest deviation at the `ratio` ticks from `tick` on.
    pub(in crate::crmpc) fn within(&self, tick: usize, ratio: usize) -> Deviation {
        (tick..tick + ratio).fold(Deviation::default(), |largest, n| largest.or(self.at(n)))
    }

    /// Returns the deviation that is never exceeded.
    pub fn forever(&self) -> &Deviation {
        self.at(usize::MAX)
    }
}
