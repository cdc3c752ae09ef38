//! Bounds on the deviation from a nominal trajectory at one tick.

use crate::interval::Interval;

/// Bound on a vector with three components: the half width of the box that contains one part of it,
/// and the norm of the other part.
#[derive(Clone, Copy, Debug)]
pub(super) struct Extent {
    pub(super) half: Interval,
    pub(super) norm: Interval,
}

impl Extent {
    pub(super) fn max(self, other: Self) -> Self {
        Self { half: self.half.max(other.half), norm: self.norm.max(other.norm) }
    }

    /// Bound on one component.
    pub(super) fn component(self) -> Interval {
        self.half + self.norm
    }
}

/// Deviations at one tick: of the vehicle when the command begins to act, and of the quantities
/// that the law computes from the predicted state.
#[derive(Clone, Copy, Debug)]
pub(super) struct Deviation {
    /// Angles (rad) and rates (rad/s) of the vehicle.
    pub(super) angle: Extent,
    pub(super) rate: Extent,
    /// Angles (rad) and rates (rad/s) at the predicted middle of the period.
    pub(super) law_angle: Extent,
    pub(super) law_rate: Extent,
    /// Acceleration K ô, rad/s², without the part that compensates ν.
    pub(super) feedback: Extent,
    /// Moment that this part requires, N m.
    pub(super) inertia: Interval,
    /// Largest distance of an angle from the chord to the next tick, rad.
    pub(super) bulge: Interval,
}

impl Deviation {
    pub(super) fn max(&self, other: &Self) -> Self {
        Self {
            angle: self.angle.max(other.angle),
            rate: self.rate.max(other.rate),
            law_angle: self.law_angle.max(other.law_angle),
            law_rate: self.law_rate.max(other.law_rate),
            feedback: self.feedback.max(other.feedback),
            inertia: self.inertia.max(other.inertia),
            bulge: self.bulge.max(other.bulge),
        }
    }
}
