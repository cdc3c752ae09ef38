//! Commands that begin to act at a time which is known only within an interval.
//!
//! If a loop has the delay d + s with an unknown constant s, |s| ≤ δ, the moment that acts differs
//! from the one assumed only between the assumed and the true beginning of each command. This is a
//! pulse: it makes the rates jump by at most δ times the change of the commanded acceleration. The
//! changes of K ô are bounded for all times in [`super::Parts`]. The changes of the plan's own
//! acceleration are known. What they leave is carried along from stage to stage here, since a bound
//! on all of them would take too much of the limits.

use super::deviation::Deviation;
use super::parts::Parts;
use crate::crmpc::settings::Settings;
use crate::delay::ticks;
use crate::error::DesignError;
use crate::error_dynamics::{SampledError, response, transition};
use nalgebra::{Matrix2, Matrix3, Vector2, Vector3};
use serde::{Deserialize, Serialize};
use vehicle::math::powi;

/// Bound on the part of the deviation that the plan's own changes of acceleration cause, at a tick,
/// rad/s: its components along the slower and the faster eigenvector of Φ as the law sees them, and
/// the pulse of the command that begins at the tick.
pub type Carried = Vector3<f64>;

/// History before a plan's beginning, where commands begin to act earlier or later than assumed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Onset {
    /// Deviation that earlier changes of the acceleration have left, see [`Carried`].
    pub carried: Carried,
    /// Acceleration commanded before the plan, rad/s².
    pub before: Vector3<f64>,
    /// Jump of the rates by the plan's first command for which the plan before leaves room, rad/s;
    /// infinite if no plan was in force.
    pub allowed: f64,
}

/// How the deviation by pulses is carried along.
#[derive(Clone, Debug, PartialEq)]
pub struct Switching {
    /// Jump of the rates per change of the commanded acceleration, s.
    by_change: f64,
    /// Change of acceleration at every tick while the vehicle turns, rad/s².
    turn: f64,
    /// Transition over an optimisation period.
    stage: Matrix3<f64>,
    /// Largest entries of the transitions to the ticks of an optimisation period, and to any later
    /// tick.
    within: Matrix3<f64>,
    ever: Matrix3<f64>,
    /// Limit of what changes of acceleration by 1 rad/s² at each optimisation leave.
    limit: Carried,
    modes: [Mode; 2],
    /// Feedback period, s.
    period: f64,
    /// Uncertainty of the delay, s.
    delay_error: f64,
    /// Optimisation period, s.
    h: f64,
}

/// Size of one eigenvector of Φ in what the deviation is judged by.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Mode {
    angle: f64,
    rate: f64,
    middle_angle: f64,
    middle_rate: f64,
    feedback: f64,
    /// Size along it of a pulse of the rates, until it has been seen.
    first: f64,
}

/// Size of a transition that has faded to rounding.
const FADED: f64 = 1e-14;

/// Number of commands that may have begun to act too late for a measurement to show it, when the
/// command that follows from the measurement begins to act.
pub(in crate::crmpc) fn unseen(s: &Settings) -> usize {
    if s.delay_error == 0.0 {
        return 0;
    }
    ticks(s.delay + s.delay_error, s.period_feedback).saturating_sub(1)
}

impl Switching {
    /// Returns `None` if the delay is exact.
    ///
    /// # Errors
    /// Returns an error if the eigenvalues of Φ are not real and distinct.
    pub(super) fn new(
        s: &Settings,
        error: &SampledError,
        parts: &Parts,
    ) -> Result<Option<Self>, DesignError> {
        if s.delay_error == 0.0 {
            return Ok(None);
        }
        let complex = DesignError::NotReal { name: "feedback" };
        let (values, vectors) = error.modes().ok_or(complex)?;
        let across = Matrix2::from_columns(&vectors).try_inverse();
        let across = across.ok_or(DesignError::NotReal { name: "feedback" })?;
        let tau = s.period_feedback;
        let half = transition(0.5 * tau) + response(0.5 * tau) * s.feedback.row();
        // A pulse is seen up to this many ticks later than at the next one.
        let late = unseen(s);
        let longest = s.delay + s.delay_error + tau;
        let modes: [Mode; 2] = std::array::from_fn(|i| {
            let (v, middle) = (vectors[i], half * vectors[i]);
            let along = |time: f64| (across * Vector2::new(time, 1.0))[i].abs();
            Mode {
                angle: v.x.abs(),
                rate: v.y.abs(),
                middle_angle: middle.x.abs(),
                middle_rate: middle.y.abs(),
                feedback: (s.feedback.row() * v).x.abs(),
                first: along(0.0).max(along(longest)) / powi(values[i].abs(), late),
            }
        });
        let (size, fast) = (values.map(f64::abs), values[0].abs().min(values[1].abs()));
        // The mismatch that a pulse causes shows later than the pulse itself.
        let later = parts.pulse.mismatch / powi(fast, late + 1);
        let revised = (1.0 - parts.pulse.revised) / (1.0 - parts.pulse.revised / fast);
        let by_change = s.delay_error * parts.pulse.inertia * revised * (1.0 + later);
        // A change that is seen late changes K ô late.
        let again = by_change / powi(fast, late);
        let [slow_mode, fast_mode] = &modes;
        let change = |mode: &Mode, value: f64| mode.feedback * (1.0 - value).abs();
        let at_once = slow_mode.feedback * slow_mode.first + fast_mode.feedback * fast_mode.first;
        let tick = Matrix3::new(
            size[0],
            0.0,
            slow_mode.first,
            0.0,
            size[1],
            fast_mode.first,
            again * change(slow_mode, values[0]),
            again * change(fast_mode, values[1]),
            again * at_once,
        );
        let ratio = (s.period_optimisation / tau).round().max(1.0) as usize;
        let (mut power, mut within) = (Matrix3::identity(), Matrix3::identity());
        for _ in 1..ratio {
            power *= tick;
            within = within.sup(&power);
        }
        let stage: Matrix3<f64> = power * tick;
        let (mut ever, mut power) = (within, stage);
        while power.amax() > FADED && power.amax() < 1.0 / FADED {
            ever = ever.sup(&(power * within));
            power *= stage;
        }
        let unbounded = Vector3::repeat(f64::INFINITY);
        let limit = if power.amax() <= FADED {
            let inverse = (Matrix3::identity() - stage).try_inverse();
            inverse.map_or(unbounded, |inverse| within * inverse.column(2) * by_change)
        } else {
            unbounded
        };
        let h = s.period_optimisation;
        let (delay_error, turn) = (s.delay_error, parts.pulse.turn);
        Ok(Some(Self {
            by_change,
            turn,
            stage,
            within,
            ever,
            limit,
            modes,
            period: tau,
            delay_error,
            h,
        }))
    }

    /// Returns what commands leave that began to act late for the measurement with which a nominal
    /// motion begins, from the changes of acceleration at their beginning (rad/s²).
    pub fn unseen(&self, changes: &[f64]) -> Carried {
        let pulse: f64 = changes.iter().map(|change| self.pulse(change + self.turn)).sum();
        Vector3::new(0.0, 0.0, pulse)
    }

    /// Returns the change of acceleration at every tick while the vehicle turns, rad/s².
    pub fn turn(&self) -> f64 {
        self.turn
    }

    /// Returns the jump of the rates by a change of the acceleration (rad/s²), rad/s.
    fn pulse(&self, change: f64) -> f64 {
        self.by_change * change
    }

    /// Returns the jump of the rates at a tick at which the command changes by `change` (rad/s²)
    /// in all, rad/s.
    pub fn pulse_of_command(&self, change: f64) -> f64 {
        self.pulse(change + self.turn)
    }

    /// Adds the change of the plan's acceleration at the beginning of a stage (rad/s²).
    pub fn begin(&self, carried: &Carried, change: f64) -> Carried {
        carried + Vector3::new(0.0, 0.0, self.pulse(change))
    }

    /// Returns what is left at the beginning of the next stage.
    pub fn next(&self, carried: &Carried) -> Carried {
        self.stage * carried
    }

    /// Returns the deviation at the ticks of the stage that begins with `carried`, and the largest
    /// one of the vehicle between them.
    pub fn deviation(&self, carried: &Carried) -> Deviation {
        self.of(&(self.within * carried))
    }

    /// Returns the deviation at any later time, while changes of the plan's acceleration are at
    /// most `change` (rad/s²).
    pub fn forever(&self, carried: &Carried, change: f64) -> Deviation {
        self.of(&(self.ever * carried + self.limit * change))
    }

    /// Returns the deviation of the angles and rates at the end of the stage before the one that
    /// begins with `carried`, by a command that begins to act early. In between it lies below the
    /// straight line from zero at the beginning of the stage before.
    pub fn early(&self, carried: &Carried) -> (f64, f64) {
        let pulse = carried.z / (1.0 - self.delay_error / self.h);
        (pulse * self.delay_error, pulse)
    }

    fn of(&self, carried: &Carried) -> Deviation {
        let seen = [carried.x, carried.y];
        let sum = |of: fn(&Mode) -> f64, sizes: &[f64; 2]| {
            of(&self.modes[0]) * sizes[0] + of(&self.modes[1]) * sizes[1]
        };
        let pulse = carried.z;
        let all = [0, 1].map(|i| seen[i] + self.modes[i].first * pulse);
        let tau = self.period;
        let feedback_norm = sum(|mode| mode.feedback, &seen);
        Deviation {
            angle: sum(|mode| mode.angle, &all)
                + 0.25 * tau * pulse
                + 0.125 * tau * tau * feedback_norm,
            rate: sum(|mode| mode.rate, &all),
            seen_angle: sum(|mode| mode.angle, &seen),
            seen_rate: sum(|mode| mode.rate, &seen),
            middle_angle: sum(|mode| mode.middle_angle, &seen),
            middle_rate: sum(|mode| mode.middle_rate, &seen),
            feedback: 0.0,
            feedback_norm,
            feedback_moment: 0.0,
        }
    }
}
