//! Bounds on the deviation of one axis.

use serde::{Deserialize, Serialize};

/// Bounds on the deviation of one axis, per unit of the bound on its cause. The units are those for
/// a disturbance in rad/s².
#[derive(Clone, Copy, Debug, PartialEq, Default, Serialize, Deserialize)]
pub struct Reach {
    /// Largest deviation of the angle, s².
    pub angle: f64,
    /// Largest deviation of the rate, s.
    pub rate: f64,
    /// Largest deviation of the angle in the predicted state on which the law acts, s². It excludes
    /// the effects since the measurement.
    pub seen_angle: f64,
    /// Largest deviation of the rate in the predicted state on which the law acts, s.
    pub seen_rate: f64,
    /// Largest deviation of the angle in the state that the law predicts for the middle of the
    /// period, where it evaluates f and R, s².
    pub middle_angle: f64,
    /// Largest deviation of the rate in that state, s.
    pub middle_rate: f64,
    /// Largest |K o| that the law commands, dimensionless.
    pub feedback: f64,
    /// Sum of the parts of the feedback, each multiplied by the time since it was caused, s.
    pub feedback_age: f64,
}

impl Reach {
    /// Returns the bounds of a response on which the law acts, from the sizes of its angle and
    /// rate, of both in the middle of the period, and of the feedback.
    pub(super) fn seen(sizes: [f64; 5]) -> Self {
        let [angle, rate, middle_angle, middle_rate, feedback] = sizes;
        Self {
            angle,
            rate,
            seen_angle: angle,
            seen_rate: rate,
            middle_angle,
            middle_rate,
            feedback,
            ..Self::default()
        }
    }

    /// Returns the sum of each bound and its counterpart.
    #[must_use]
    pub fn plus(&self, other: &Self) -> Self {
        self.with(other, |a, b| a + b)
    }

    fn with(&self, other: &Self, combine: impl Fn(f64, f64) -> f64) -> Self {
        Self {
            angle: combine(self.angle, other.angle),
            rate: combine(self.rate, other.rate),
            seen_angle: combine(self.seen_angle, other.seen_angle),
            seen_rate: combine(self.seen_rate, other.seen_rate),
            middle_angle: combine(self.middle_angle, other.middle_angle),
            middle_rate: combine(self.middle_rate, other.middle_rate),
            feedback: combine(self.feedback, other.feedback),
            feedback_age: combine(self.feedback_age, other.feedback_age),
        }
    }

    /// Returns the difference of each bound and its counterpart.
    #[must_use]
    pub fn minus(&self, other: &Self) -> Self {
        self.with(other, |a, b| a - b)
    }

    /// Returns the larger of each bound and its counterpart.
    #[must_use]
    pub fn or(&self, other: &Self) -> Self {
        self.with(other, f64::max)
    }

    /// Returns every bound multiplied by `size`.
    #[must_use]
    pub fn times(&self, size: f64) -> Self {
        self.with(self, |value, _| value * size)
    }
}

/// The first ticks of a nominal trajectory, before which the prediction has begun, and the share by
/// which an effect is larger there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InitialTicks {
    /// Number of these ticks.
    pub ticks: usize,
    /// Share by which the effect is larger.
    pub excess: f64,
}

impl InitialTicks {
    /// Counts the larger effects in sums over 0, 1, … ticks, of which the first ticks are the
    /// oldest parts.
    pub fn count(&self, sums: &[Reach]) -> Vec<Reach> {
        let oldest = |n: usize| sums[n].minus(&sums[n - n.min(self.ticks)]);
        (0..sums.len()).map(|n| sums[n].plus(&oldest(n).times(self.excess))).collect()
    }
}
