//! Deviation by commands that begin to act earlier or later than assumed.
//!
//! If the command of tick k acts from T_k + s on, |s| ≤ δ, then between T_k and T_k + s the moment
//! differs from the assumed one by the change of the command. That is a pulse of the rates at T_k +
//! v, |v| ≤ δ, of at most the size c_k = δ ‖R I_v⁻¹ (m_k − m_k−1)‖. The vehicle follows it freely
//! until the first tick k + q whose measurement comes after it, q τ ≥ d + v, where it has become [q
//! τ − v; 1], and under Φ from then on.
//!
//! The law gives R I⁻¹ (m_k − m_k−1) = a_k − a_k−1 + K (ô_k − ô_k−1) + F(y_k−1, m_k−1) − F(y_k,
//! m_k−1) at the predicted middle y_k of the period. The pulses change ô in turn, so that their
//! sizes follow one from another. All sums here have only positive parts.

use super::causes::{BRAKING, Switched};
use crate::interval::Interval;
use crate::sums::{Axis, Matrix, Pair, along, applied};
use control::crmpc::{Plan, Settings};
use nalgebra::Vector3;

/// Sizes along the five rows of the deviation, and that of the change of K ô.
type Sizes = [f64; 6];

/// Index of the change of K ô in [`Sizes`].
const CHANGE: usize = 5;
/// More than the relative rounding error of a sum of 10⁵ positive numbers.
const ROUNDING: f64 = 1e-10;

/// The commands and the plan before a plan, as far as pulses of theirs may still have an effect.
#[derive(Clone, Debug, Default)]
pub struct Past {
    /// Sizes of R I⁻¹ (m_k − m_k−1) for the last commands up to the first one of the nominal
    /// trajectory, the oldest first, rad/s².
    pub changes: Vec<f64>,
    /// Accelerations of the nominal trajectory from its beginning to that of the plan, one for each
    /// optimisation, rad/s².
    pub accelerations: Vec<Vector3<f64>>,
}

/// Responses to a pulse of size 1 at each tick.
pub(super) struct Pulses {
    pub(super) switched: Switched,
    /// Responses after l ticks, by the number q of ticks until a measurement comes after the pulse.
    sides: Vec<(usize, Vec<Sizes>)>,
    /// Largest of them, and the largest from each tick on.
    weights: Vec<Sizes>,
    later: Vec<Sizes>,
    /// Sums of the largest responses over 0, 1, … ticks; the last one is for ever.
    sums: Vec<Sizes>,
}

fn number(value: f64) -> Interval {
    Interval::from(value)
}

fn with(a: &Sizes, b: &Sizes, of: impl Fn(f64, f64) -> f64) -> Sizes {
    std::array::from_fn(|i| of(a[i], b[i]))
}

fn add(sum: &mut Sizes, weight: &Sizes, size: f64) {
    *sum = with(sum, weight, |sum, weight| sum + weight * size);
}

impl Pulses {
    /// `None` if the pulses may grow, or if the delay is exact.
    pub(super) fn new(
        s: &Settings,
        axis: &Axis,
        rows: &[Pair; 5],
        switched: Switched,
        steps: usize,
    ) -> Option<Self> {
        let [d, tau, error] = [s.delay, s.period_feedback, s.delay_error];
        // Times that differ by rounding are the same.
        let first = ((d - error) / tau + 1e-9).floor() as usize + 1;
        let last = ((d + error) / tau - 1e-9).ceil() as usize;
        let side = |q: usize| {
            let from = ((q - 1) as f64 * tau - d).max(-error);
            let to = (q as f64 * tau - d).min(error);
            let times = [from, to, (q - 1) as f64 * tau - d, q as f64 * tau].map(number);
            (q, responses(axis, rows, steps, (q, times, number(tau)), switched.share))
        };
        let sides: Vec<(usize, Vec<Sizes>)> = (first..=last.max(first)).map(side).collect();
        let longest = number(d + error + tau).max(Interval::ONE);
        let tail = axis.tails(steps).0 * longest * (Interval::ONE + switched.share);
        let size = |row: &Pair| ((row[0].abs() + row[1].abs()) * tail).high;
        let rest: Sizes =
            std::array::from_fn(
                |i| {
                    if i == CHANGE { 2.0 * size(&rows[4]) } else { size(&rows[i]) }
                },
            );
        let largest = |l: usize| {
            sides.iter().fold([0.0; 6], |most, (_, side)| with(&most, &side[l], f64::max))
        };
        let weights: Vec<Sizes> = (0..steps).map(largest).collect();
        let (mut sums, mut sum) = (vec![[0.0; 6]], [0.0; 6]);
        for weight in weights.iter().chain([&rest]) {
            add(&mut sum, weight, 1.0 + ROUNDING);
            sums.push(sum);
        }
        let mut later = vec![rest];
        for weight in weights.iter().rev() {
            later.push(with(weight, later.last()?, f64::max));
        }
        later.reverse();
        let found = Self { switched, sides, weights, later, sums };
        (found.again() < 0.9).then_some(found)
    }

    /// Largest ratio of the sizes of all pulses to those that cause them.
    fn again(&self) -> f64 {
        self.per_change() * self.sums.last().map_or(f64::INFINITY, |sum| sum[CHANGE])
    }

    /// Size of a pulse per change of the acceleration, s.
    pub(super) fn per_change(&self) -> f64 {
        (self.switched.error * self.switched.factor).high
    }

    /// Returns the sizes of a pulse by changes of K ô within a box of this half width and by others
    /// with this norm (rad/s²), also of the form of a box and a norm (rad/s).
    pub(super) fn sizes(&self, half: Interval, norm: Interval) -> [Interval; 2] {
        let Switched { error, factor, straight, turn, .. } = self.switched;
        let again = self.sums.last().map_or(Interval::ALL, |sum| number(sum[CHANGE]));
        let one = Interval::ONE;
        let half = half / (one - error * straight * again);
        let mixed = (factor - straight) * number(3.0).sqrt() * half;
        let norm = (factor * (norm + turn) + mixed) / (one - error * factor * again);
        [error * straight * half, error * norm]
    }

    /// Returns the sums of the responses over the last `n` ticks.
    pub(super) fn sums(&self, n: usize) -> &Sizes {
        &self.sums[n.min(self.sums.len() - 1)]
    }

    /// Response after `l` ticks to a pulse that is not seen for `q` ticks at least.
    fn weight(&self, l: usize, q: usize) -> Sizes {
        match self.weights.get(l) {
            None => self.later[self.weights.len()],
            Some(weight) if q == 0 => *weight,
            Some(_) => {
                let sides = self.sides.iter().filter(|(seen, _)| *seen >= q);
                sides.fold([0.0; 6], |most, (_, side)| with(&most, &side[l], f64::max))
            }
        }
    }
}

/// Responses after l ticks to a pulse at T_k + v that tick k + q sees, with a `share` of it at any
/// time until then. The limits of both times are `times`.
fn responses(
    axis: &Axis,
    rows: &[Pair; 5],
    steps: usize,
    (q, times, tau): (usize, [Interval; 4], Interval),
    share: Interval,
) -> Vec<Sizes> {
    let unseen = (0..q).map(|l| {
        // The rate may jump anywhere about the tick.
        let angle = (number(l as f64) * tau - times[0]).max(Interval::ZERO);
        let more = Interval::ONE + share;
        [(angle * more).high, more.high, 0.0, 0.0, 0.0, 0.0]
    });
    let mut before: Matrix = [[Interval::ZERO; 2]; 2];
    let seen = axis.transitions(steps.saturating_sub(q)).map(|power| {
        let response = |i: usize, v: Interval| {
            let pulse = [number(q as f64) * tau - v, Interval::ONE];
            let (now, old) = (applied(&power, &pulse), applied(&before, &pulse));
            let change = [now[0] - old[0], now[1] - old[1]];
            (if i == CHANGE { along(&rows[4], &change) } else { along(&rows[i], &now) }).abs()
        };
        let sizes = std::array::from_fn(|i| {
            let [itself, [first, last]] =
                [[0, 1], [2, 3]].map(|pair| pair.map(|j| response(i, times[j])));
            (itself[0].max(itself[1]) + share * first.max(last)).high
        });
        before = power;
        sizes
    });
    unseen.chain(seen).collect()
}

/// Deviation by the pulses of the changes of the plan's own acceleration, and of the commands
/// before it.
pub(super) struct Carried {
    /// Sizes along the five rows at the ticks from the beginning of the plan on, and for ever.
    at: Vec<Sizes>,
    forever: Sizes,
    /// Size of the pulse of each tick, rad/s.
    pulses: Vec<f64>,
}

impl Carried {
    /// `ratio` and `period` are the feedback ticks in an optimisation period and its length.
    pub(super) fn new(
        pulses: &Pulses,
        plan: &Plan,
        past: &Past,
        (ratio, period, fades): (usize, f64, [usize; 2]),
    ) -> Self {
        let begin = past.accelerations.len() * ratio;
        let horizon = begin + plan.accelerations.len() * ratio;
        let end = horizon + fades[1];
        let mut stages = [&past.accelerations[..], &plan.accelerations[..]].concat();
        let last = plan.states.last().map_or_else(Vector3::zeros, |x| x.fixed_rows::<3>(3).into());
        let braking = Vector3::new(BRAKING, plan.braking, BRAKING);
        let mut rates: Vector3<f64> = last;
        while stages.len() * ratio <= end + 1 {
            let a = -rates.component_mul(&braking);
            rates += a * period;
            stages.push(a);
        }
        let change = |j: usize| {
            if j.is_multiple_of(ratio) {
                (stages[j / ratio] - stages[j / ratio - 1]).norm()
            } else {
                0.0
            }
        };
        let each = pulses.per_change() * (1.0 + ROUNDING);
        let mut sizes: Vec<f64> = past.changes.iter().map(|change| each * change).collect();
        if sizes.is_empty() {
            sizes.push(0.0);
        }
        let early = sizes.len() - 1;
        // Effect of all pulses so far, of which those before the trajectory were not seen then.
        let effect = |sizes: &[f64], n: usize| {
            let mut sum = [0.0; 6];
            for (i, &size) in sizes.iter().enumerate().filter(|(_, size)| **size > 0.0) {
                let unseen = if i < early { early - i + 1 } else { 0 };
                add(&mut sum, &pulses.weight(n + early - i, unseen), size * (1.0 + ROUNDING));
            }
            sum
        };
        let mut at = Vec::new();
        for n in 0..=end {
            // The pulse of a tick does not change its own command.
            let now = effect(&sizes, n);
            let again = effect(&sizes, n + 1)[CHANGE];
            sizes.push(each * (change(n + 1) + again) * (1.0 + ROUNDING));
            if n >= begin {
                let mut now = now;
                now[1] += sizes[n + 1 + early];
                at.push(now);
            }
        }
        let more = braking.amax() * period * stages.last().map_or(0.0, nalgebra::Matrix::norm);
        let forever = endless(pulses, &sizes, each * more, fades[0]);
        let forever =
            at[horizon - begin..].iter().fold(forever, |most, at| with(&most, at, f64::max));
        Self { at, forever, pulses: sizes.split_off(begin + early) }
    }

    pub(super) fn at(&self, n: usize) -> &Sizes {
        self.at.get(n).unwrap_or(&self.forever)
    }

    /// Size of the pulse `n` ticks after the beginning of the plan.
    pub(super) fn pulse(&self, n: usize) -> f64 {
        self.pulses.get(n).copied().unwrap_or(0.0)
    }

    pub(super) fn forever(&self) -> &Sizes {
        &self.forever
    }
}

/// Bounds the effects after the last of the pulses of these `sizes`, when each further one is `own`
/// and the part that the ones before cause. The `recent` last pulses count with their largest one.
fn endless(pulses: &Pulses, sizes: &[f64], own: f64, recent: usize) -> Sizes {
    let (old, young) = sizes.split_at(sizes.len().saturating_sub(recent));
    let mut faded = [0.0; 6];
    let place = recent.min(pulses.later.len() - 1);
    add(&mut faded, &pulses.later[place], old.iter().sum::<f64>() * (1.0 + ROUNDING));
    let fixed = (own + pulses.per_change() * faded[CHANGE]) / (1.0 - pulses.again());
    let most = young.iter().fold(fixed * (1.0 + ROUNDING), |most, size| most.max(*size));
    add(&mut faded, pulses.sums(usize::MAX), most * (1.0 + ROUNDING));
    faded[1] += most;
    faded
}
