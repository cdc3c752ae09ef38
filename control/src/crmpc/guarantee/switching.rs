//! Commands that begin to act at a time which is known only within an interval.
//!
//! If a loop has the delay d + s with an unknown constant s, |s| ≤ δ, the moment that acts differs
//! from the one assumed only between the assumed and the true beginning of each command. This is a
//! pulse: it makes the rates jump by at most δ times the change of the commanded acceleration. The
//! changes of K ô are bounded for all times in [`super::pulse`]. The changes of the plan's own
//! acceleration are known. The deviation that they leave is propagated from stage to stage here,
//! since a bound on all of them would take too much of the limits.

use super::deviation::Deviation;
use super::parts::{Parts, PulseFactors};
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

/// Propagation of the deviation that the pulses leave.
#[derive(Clone, Debug, PartialEq)]
pub struct Switching {
    /// Pulse per change of the commanded acceleration, s.
    by_change: f64,
    /// Change of acceleration at every tick while the vehicle turns, rad/s².
    pub turn: f64,
    transitions: Transitions,
    modes: [Mode; 2],
    /// Feedback period τ, s.
    period: f64,
    /// Uncertainty δ of the delay, s.
    delay_error: f64,
    /// Optimisation period h, s.
    h: f64,
}

/// Size of one eigenvector of Φ in the quantities that are bounded.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Mode {
    angle: f64,
    rate: f64,
    middle_angle: f64,
    middle_rate: f64,
    /// Its size κ in K ô.
    feedback: f64,
    /// Size g along it of a pulse of the rates, until it has been seen.
    first: f64,
}

/// Transitions of [`Carried`].
#[derive(Clone, Copy, Debug, PartialEq)]
struct Transitions {
    /// Over an optimisation period.
    stage: Matrix3<f64>,
    /// Largest entries of those to the ticks of an optimisation period.
    within: Matrix3<f64>,
    /// Largest entries of those to any later tick.
    ever: Matrix3<f64>,
    /// Limit of the deviation by changes of acceleration of 1 rad/s² at each optimisation.
    limit: Carried,
}

/// Size of a transition that has faded to rounding.
const FADED: f64 = 1e-14;

/// Number of earlier commands whose pulses a measurement may not contain, although they act before
/// the command that is computed from it: ⌈(d + δ)/τ⌉ − 1.
pub(in crate::crmpc) fn unseen(s: &Settings) -> usize {
    if s.delay_error == 0.0 {
        return 0;
    }
    ticks(s.delay + s.delay_error, s.period_feedback).saturating_sub(1)
}

impl Mode {
    fn new(s: &Settings, v: &Vector2<f64>, first: f64) -> Self {
        let tau = s.period_feedback;
        let half = transition(0.5 * tau) + response(0.5 * tau) * s.feedback.row();
        let middle = half * v;
        Self {
            angle: v.x.abs(),
            rate: v.y.abs(),
            middle_angle: middle.x.abs(),
            middle_rate: middle.y.abs(),
            feedback: (s.feedback.row() * v).x.abs(),
            first,
        }
    }
}

impl Transitions {
    /// Computes the transitions from the one over a `tick`, with `ratio` ticks in an optimisation
    /// period and a pulse of `by_change` (s) per change of acceleration.
    fn new(tick: &Matrix3<f64>, ratio: usize, by_change: f64) -> Self {
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
        let inverse = (Matrix3::identity() - stage).try_inverse();
        let limit = inverse
            .filter(|_| power.amax() <= FADED)
            .map_or(Vector3::repeat(f64::INFINITY), |inverse| {
                within * inverse.column(2) * by_change
            });
        Self { stage, within, ever, limit }
    }
}

impl Switching {
    /// Returns `None` if the delay is exact.
    ///
    /// The deviation s along the eigenvectors of Φ with the eigenvalues λ_i, and the pulse p of the
    /// tick, satisfy (docs/proof.md, step 7)
    ///
    /// |s_i⁺| ≤ |λ_i| |s_i| + g_i p,  p⁺ = δ (‖Δa‖ + Σ κ_i (|1 − λ_i| |s_i| + g_i p)).
    ///
    /// g_i is the largest component of [u; 1] along the eigenvector for 0 ≤ u ≤ d + δ + τ. A
    /// measurement may show a pulse up to ⌈(d + δ)/τ⌉ − 1 ticks after the next tick. The recursion
    /// would let it fade by |λ_i| in each of these, although nothing has reacted yet. Therefore g_i
    /// is divided by |λ_i| once for each of them.
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
        let modes = error.modes().and_then(|(values, vectors)| {
            Some((values, vectors, Matrix2::from_columns(&vectors).try_inverse()?))
        });
        let (values, vectors, across) = modes.ok_or(complex)?;
        let (tau, late) = (s.period_feedback, unseen(s));
        let longest = s.delay + s.delay_error + tau;
        let modes: [Mode; 2] = std::array::from_fn(|i| {
            let along = |time: f64| (across * Vector2::new(time, 1.0))[i].abs();
            let first = along(0.0).max(along(longest)) / powi(values[i].abs(), late);
            Mode::new(s, &vectors[i], first)
        });
        let (size, fast) = (values.map(f64::abs), values[0].abs().min(values[1].abs()));
        // The mismatch that a pulse causes shows later than the pulse itself.
        let PulseFactors { inertia, revised, mismatch, turn, .. } = parts.pulse;
        let later = mismatch / powi(fast, late + 1);
        let revised = (1.0 - revised) / (1.0 - revised / fast);
        let by_change = s.delay_error * inertia * revised * (1.0 + later);
        // A change that is seen late changes K ô late.
        let again = by_change / powi(fast, late);
        let [slow_mode, fast_mode] = &modes;
        let change = |mode: &Mode, value: f64| again * (mode.feedback * (1.0 - value).abs());
        let (by_slow, by_fast) = (change(slow_mode, values[0]), change(fast_mode, values[1]));
        let at_once = slow_mode.feedback * slow_mode.first + fast_mode.feedback * fast_mode.first;
        #[rustfmt::skip]
        let tick = Matrix3::new(
            size[0], 0.0, slow_mode.first,
            0.0, size[1], fast_mode.first,
            by_slow, by_fast, again * at_once,
        );
        let ratio = (s.period_optimisation / tau).round().max(1.0) as usize;
        Ok(Some(Self {
            by_change,
            turn,
            transitions: Transitions::new(&tick, ratio, by_change),
            modes,
            period: tau,
            delay_error: s.delay_error,
            h: s.period_optimisation,
        }))
    }

    /// Returns the deviation by commands that began to act too late for the measurement with which
    /// a nominal trajectory begins, from the changes of acceleration at their beginning (rad/s²).
    pub fn unseen(&self, changes: &[f64]) -> Carried {
        let pulse: f64 = changes.iter().map(|change| self.pulse(change + self.turn)).sum();
        Vector3::new(0.0, 0.0, pulse)
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

    /// Returns the deviation that is left at the beginning of the next stage.
    pub fn next(&self, carried: &Carried) -> Carried {
        self.transitions.stage * carried
    }

    /// Returns the deviation at the ticks of the stage that begins with `carried`, and the largest
    /// one of the vehicle between them.
    pub fn deviation(&self, carried: &Carried) -> Deviation {
        self.of(&(self.transitions.within * carried))
    }

    /// Returns the deviation at any later time, while changes of the plan's acceleration are at
    /// most `change` (rad/s²).
    pub fn forever(&self, carried: &Carried, change: f64) -> Deviation {
        let Transitions { ever, limit, .. } = &self.transitions;
        self.of(&(ever * carried + limit * change))
    }

    /// Returns the deviation of the angles and rates at the end of the stage before the one that
    /// begins with `carried`, by a command that begins to act early. In between it lies below the
    /// straight line from zero at the beginning of the stage before.
    pub fn begun_early(&self, carried: &Carried) -> (f64, f64) {
        let pulse = carried.z / (1.0 - self.delay_error / self.h);
        (pulse * self.delay_error, pulse)
    }

    /// Converts the propagated values to a deviation. The law sees s alone. The vehicle also
    /// deviates by the pulse of this tick and, between two ticks, by the excess over the straight
    /// line.
    fn of(&self, carried: &Carried) -> Deviation {
        let [slow, fast] = &self.modes;
        let (seen, pulse, tau) = ([carried.x, carried.y], carried.z, self.period);
        let all = [seen[0] + slow.first * pulse, seen[1] + fast.first * pulse];
        let sum = |of: fn(&Mode) -> f64, [along_slow, along_fast]: [f64; 2]| {
            of(slow) * along_slow + of(fast) * along_fast
        };
        let feedback_norm = sum(|mode| mode.feedback, seen);
        Deviation {
            angle: sum(|mode| mode.angle, all)
                + 0.25 * tau * pulse
                + 0.125 * tau * tau * feedback_norm,
            rate: sum(|mode| mode.rate, all),
            seen_angle: sum(|mode| mode.angle, seen),
            seen_rate: sum(|mode| mode.rate, seen),
            middle_angle: sum(|mode| mode.middle_angle, seen),
            middle_rate: sum(|mode| mode.middle_rate, seen),
            feedback_norm,
            ..Deviation::default()
        }
    }
}
