//! Sums over all sampling instants, which bound how far disturbances and errors can drive the
//! deviation, and the terminal weight.
//!
//! Φⁿ is computed as Φʳ (Φᵇ)ᵐ with n = m b + r and ‖Φᵇ‖ ≤ ½ in the norm of the largest row sum. The
//! width of the intervals therefore fades with the power, and a geometric series bounds the
//! remainder after n periods.

use crate::interval::Interval;
use control::crmpc::{Settings, held_terminal_weight, terminal_weight};
use control::error_dynamics::{Gain, InitialTicks, SampledError};
use nalgebra::{Matrix2, Vector2};

/// Matrix of one axis, by rows.
pub(crate) type Matrix = [[Interval; 2]; 2];
/// Row or column of one axis: angle and rate.
pub(crate) type Pair = [Interval; 2];

pub(crate) fn product(a: &Matrix, b: &Matrix) -> Matrix {
    std::array::from_fn(|i| std::array::from_fn(|j| a[i][0] * b[0][j] + a[i][1] * b[1][j]))
}

pub(crate) fn applied(a: &Matrix, x: &Pair) -> Pair {
    a.map(|row| along(&row, x))
}

pub(crate) fn along(row: &Pair, x: &Pair) -> Interval {
    row[0] * x[0] + row[1] * x[1]
}

fn transposed(a: &Matrix) -> Matrix {
    [[a[0][0], a[1][0]], [a[0][1], a[1][1]]]
}

/// Largest row sum of the absolute values.
pub(crate) fn norm(a: &Matrix) -> Interval {
    (a[0][0].abs() + a[0][1].abs()).max(a[1][0].abs() + a[1][1].abs())
}

/// Integral ∫ |c₀ + c₁ u| du from `low` over `width`. Where the sign changes, the two triangles
/// have the area (a² + b²)/(|a| + |b|) times half the width.
pub(crate) fn integral_of_size([c1, c0]: &Pair, low: Interval, width: Interval) -> Interval {
    let (a, b) = (*c0 + *c1 * low, *c0 + *c1 * (low + width));
    let half = Interval::from(0.5) * width;
    let area = (a.abs() + b.abs()) * half;
    if (a.low >= 0.0 && b.low >= 0.0) || (a.high <= 0.0 && b.high <= 0.0) {
        area
    } else if (a.low > 0.0 && b.high < 0.0) || (a.high < 0.0 && b.low > 0.0) {
        (a.square() + b.square()) / (a.abs() + b.abs()) * half
    } else {
        Interval::new(((a + b).abs() * half).low, area.high)
    }
}

/// Sampled error dynamics of one axis.
pub struct Axis {
    gain: Pair,
    period: Interval,
    latency: Interval,
    /// Powers Φⁿ for n < b.
    powers: Vec<Matrix>,
    /// Power Φᵇ, which at least halves every vector.
    block: Matrix,
    /// Transition from the beginning of a period to its middle, with the feedback held.
    to_middle: Matrix,
}

/// Bounds on the effect of a drive by the end of some period: angle, rate, both as the law sees
/// them, both as it predicts them for the middle of the period, feedback, and the feedback times
/// its age.
pub type Bounds = [Interval; 8];

/// Largest b that is allowed: stable dynamics that fade more slowly are refused.
const LONGEST_BLOCK: usize = 4000;

fn step(gain: Gain, period: f64) -> Matrix {
    let (h, k1, k2) = (Interval::from(period), Interval::from(gain.k1), Interval::from(gain.k2));
    let half = Interval::from(0.5) * h.square();
    [[Interval::ONE + half * k1, h + half * k2], [h * k1, Interval::ONE + h * k2]]
}

impl Axis {
    /// Makes the dynamics of an axis, or `None` if no power of Φ is certain to halve every vector.
    pub fn new(gain: Gain, period: f64, latency: f64) -> Option<Self> {
        let phi = step(gain, period);
        let unit = [[Interval::ONE, Interval::ZERO], [Interval::ZERO, Interval::ONE]];
        let (mut powers, mut next) = (vec![unit], phi);
        while norm(&next).high > 0.5 {
            if powers.len() >= LONGEST_BLOCK {
                return None;
            }
            powers.push(next);
            next = product(&next, &phi);
        }
        Some(Self {
            gain: [gain.k1, gain.k2].map(Interval::from),
            period: Interval::from(period),
            latency: Interval::from(latency),
            powers,
            block: next,
            to_middle: step(gain, 0.5 * period),
        })
    }

    /// Number of periods after which every vector has been halved `times` times.
    pub(crate) fn halved(&self, times: usize) -> usize {
        times * self.powers.len()
    }

    /// Returns the powers Φⁿ for n < `count`.
    pub(crate) fn transitions(&self, count: usize) -> impl Iterator<Item = Matrix> + '_ {
        let mut block = [[Interval::ONE, Interval::ZERO], [Interval::ZERO, Interval::ONE]];
        (0..count).map(move |n| {
            let within = n % self.powers.len();
            if n > 0 && within == 0 {
                block = product(&block, &self.block);
            }
            product(&self.powers[within], &block)
        })
    }

    /// Upper bounds of Σ ‖Φⁿ‖ and of Σ (n − `from`) ‖Φⁿ‖ over all n ≥ `from`.
    pub(crate) fn tails(&self, from: usize) -> (Interval, Interval) {
        let at = self.transitions(from + 1).last().map_or(Interval::ALL, |power| norm(&power));
        let of_block = self.powers.iter().fold(Interval::ZERO, |sum, power| sum + norm(power));
        let first = at * of_block;
        let rest = Interval::ONE - Interval::from(norm(&self.block).high);
        let length = Interval::from(self.powers.len() as f64);
        (first / rest, first * length / rest.square())
    }

    /// Rows of what the sums bound: angle, rate, both in the middle of the period, and K o.
    pub(crate) fn rows(&self) -> [Pair; 5] {
        let (one, zero) = (Interval::ONE, Interval::ZERO);
        [[one, zero], [zero, one], self.to_middle[0], self.to_middle[1], self.gain]
    }

    /// Bounds on the effect of any |Δ| ≤ 1 within 0, 1, …, `steps` periods, and last for ever.
    pub fn reach(&self, steps: usize) -> Vec<Bounds> {
        let end = self.latency + self.period;
        let bounds = |sums: &[Interval; 5], age: Interval| {
            let mut bounds = spread(sums);
            bounds[0] = bounds[0] + Interval::from(0.5) * self.latency.square();
            bounds[1] = bounds[1] + self.latency;
            bounds[7] = age;
            bounds
        };
        let (mut sums, mut age) = ([Interval::ZERO; 5], Interval::ZERO);
        let mut by_tick = vec![bounds(&sums, age)];
        for (n, power) in self.transitions(steps).enumerate() {
            let sizes = self.rows().map(|row| {
                integral_of_size(&applied(&transposed(&power), &row), self.latency, self.period)
            });
            sums = std::array::from_fn(|i| sums[i] + sizes[i]);
            age = age + sizes[4] * (end + Interval::from(n as f64) * self.period);
            by_tick.push(bounds(&sums, age));
        }
        // The tail uses ‖Φⁿ [u, 1]‖ ≤ ‖Φⁿ‖ max(u, 1).
        let scale = self.period * end.max(Interval::ONE);
        let (tail, moment) = self.tails(steps);
        let old = end + Interval::from(steps as f64) * self.period;
        let more = self.sizes_within(tail * scale);
        let aged = self.sizes_within((tail * old + moment * self.period) * scale)[4];
        let up_to = |value: Interval| Interval::new(0.0, value.high);
        let last = std::array::from_fn(|i| sums[i] + up_to(more[i]));
        by_tick.push(bounds(&last, age + up_to(aged)));
        by_tick
    }

    /// Sizes of the components of x, of those in the middle of the period, and of K x.
    fn sizes(&self, x: &Pair) -> [Interval; 5] {
        self.rows().map(|row| along(&row, x).abs())
    }

    /// Bounds of [`Self::sizes`] for components of at most `largest`.
    fn sizes_within(&self, largest: Interval) -> [Interval; 5] {
        self.rows().map(|row| (row[0].abs() + row[1].abs()) * largest)
    }

    /// Sums of [`Self::sizes`] of Φʲ x over j < 0, 1, …, `steps`, and last over all j.
    fn series(&self, x: &Pair, steps: usize) -> Vec<[Interval; 5]> {
        let mut sum = [Interval::ZERO; 5];
        let mut by_tick = vec![sum];
        for power in self.transitions(steps) {
            let sizes = self.sizes(&applied(&power, x));
            sum = std::array::from_fn(|i| sum[i] + sizes[i]);
            by_tick.push(sum);
        }
        let tails = self.sizes_within(self.tails(steps).0 * x[0].abs().max(x[1].abs()));
        by_tick.push(std::array::from_fn(|i| sum[i] + Interval::new(0.0, tails[i].high)));
        by_tick
    }

    /// Bounds on the effect of errors of up to 1 at every tick, of the angle and of the rate, as in
    /// [`Self::reach`].
    pub fn errors(&self, steps: usize) -> [Vec<Bounds>; 2] {
        [[Interval::ONE, Interval::ZERO], [self.latency, Interval::ONE]]
            .map(|newest| self.errors_along(&newest, steps, NEVER))
    }

    /// Bounds on the effect of parts of the predictions that are wrong by changes of the rate by
    /// up to 1 in all, between each measurement and its tick.
    pub fn mispredictions(&self, steps: usize, initial: InitialTicks) -> Vec<Bounds> {
        let [last, first] = [Interval::ZERO, self.latency]
            .map(|u| self.errors_along(&[u, Interval::ONE], steps, initial));
        let largest = |a: &Bounds, b: &Bounds| std::array::from_fn(|i| a[i].max(b[i]));
        last.iter().zip(&first).map(|(a, b)| largest(a, b)).collect()
    }

    /// Bounds on the effect of errors along one direction: at every tick the predicted state is off
    /// by up to `newest`, and by more at the first ticks.
    fn errors_along(&self, newest: &Pair, steps: usize, initial: InitialTicks) -> Vec<Bounds> {
        let half = Interval::from(0.5) * self.period.square();
        let held = along(&self.gain, newest);
        let sums = self.series(&[half * held, self.period * held], steps);
        let excess = Interval::from(initial.excess);
        let weight =
            |tick: usize| if tick < initial.ticks { Interval::ONE + excess } else { Interval::ONE };
        // The first error contributes −Φⁿ⁻¹ A A_d e₀.
        let first = [newest[0] + self.period * newest[1], newest[1]];
        let newest_sizes = self.sizes(newest);
        let bounds = |tick: usize, first: &[Interval; 5]| {
            // The other initial errors are the oldest parts of the sum.
            let parts = tick - 1;
            let (sum, young) =
                (&sums[parts], &sums[parts - parts.min(initial.ticks.saturating_sub(1))]);
            let actual: [Interval; 5] = std::array::from_fn(|i| {
                sum[i] + excess * (sum[i] - young[i]) + weight(0) * first[i]
            });
            let seen: [Interval; 5] =
                std::array::from_fn(|i| actual[i] + weight(tick) * newest_sizes[i]);
            [actual[0], actual[1], seen[0], seen[1], seen[2], seen[3], seen[4], Interval::ZERO]
        };
        let mut by_tick = Vec::with_capacity(steps + 2);
        let mut begin = [Interval::ZERO; 8];
        [begin[0], begin[1]] = newest.map(|size| weight(0) * size);
        by_tick.push(begin);
        let mut largest = [Interval::ZERO; 5];
        for (n, power) in self.transitions(steps).enumerate() {
            let sizes = self.sizes(&applied(&power, &first));
            by_tick.push(bounds(n + 1, &sizes));
            largest = sizes;
        }
        // After the last period no power of Φ makes the first error larger than this, because
        // ‖Φᵐᵇ⁺ʳ‖ ≤ ‖Φʳ‖.
        let after = self.powers.iter().fold(Interval::ZERO, |most, power| most.max(norm(power)));
        let faded = self.sizes_within(after * largest[0].max(largest[1]));
        by_tick.push(bounds(steps + 2, &faded));
        by_tick
    }

    /// Bounds on the effect of changes of the rate by up to the period in all before each tick, at
    /// any time since the measurement before that of the tick, as in [`Self::reach`].
    pub fn changes(&self, steps: usize, initial: InitialTicks) -> Vec<Bounds> {
        let end = self.latency + self.period;
        // Each part may have another time, so that its largest size counts.
        let mut sum = [Interval::ZERO; 5];
        let mut by_tick = vec![sum];
        for power in self.transitions(steps) {
            let [last, first] = [Interval::ZERO, end]
                .map(|u| self.sizes(&applied(&power, &[u * self.period, self.period])));
            sum = std::array::from_fn(|i| sum[i] + last[i].max(first[i]));
            by_tick.push(sum);
        }
        let tail = self.tails(steps).0 * self.period * end.max(Interval::ONE);
        let more = self.sizes_within(tail);
        by_tick.push(std::array::from_fn(|i| sum[i] + Interval::new(0.0, more[i].high)));
        counted(initial, &by_tick.iter().map(spread).collect::<Vec<Bounds>>())
    }

    /// Bounds on the effect of shifts of the angle by up to the period at every tick, as in
    /// [`Self::reach`].
    pub fn shifts(&self, steps: usize, initial: InitialTicks) -> Vec<Bounds> {
        let sums = self.series(&[self.period, Interval::ZERO], steps);
        counted(initial, &sums.iter().map(spread).collect::<Vec<Bounds>>())
    }
}

/// Bounds of causes that every measurement has seen.
fn spread([angle, rate, of_angle, of_rate, feedback]: &[Interval; 5]) -> Bounds {
    [*angle, *rate, *angle, *rate, *of_angle, *of_rate, *feedback, Interval::ZERO]
}

/// No effect is larger for the first ticks.
pub(crate) const NEVER: InitialTicks = InitialTicks { ticks: 0, excess: 0.0 };

/// Counts effects that are larger for the first ticks of a nominal trajectory.
fn counted(initial: InitialTicks, sums: &[Bounds]) -> Vec<Bounds> {
    let excess = Interval::from(initial.excess);
    let at = |n: usize| -> Bounds {
        let young = &sums[n - n.min(initial.ticks)];
        std::array::from_fn(|i| sums[n][i] + excess * (sums[n][i] - young[i]))
    };
    (0..sums.len()).map(at).collect()
}

/// Largest eigenvalue of Φᵀ G Φ − G + h (P + K̃ᵀ Q K̃) for each axis with the sampled terminal law:
/// (11c) of Chai 2022 demands that it is not positive.
///
/// The first value is that of the robust set's G, the second that of the printed G, which belongs
/// to the continuous law.
pub fn terminal_decrease(s: &Settings) -> [[Interval; 2]; 3] {
    let held = SampledError::new(s.terminal, s.period_optimisation);
    std::array::from_fn(|axis| {
        let p = Vector2::new(s.p[axis], s.p[axis + 3]);
        let q = s.q[axis];
        [held_terminal_weight(&held, s.terminal, p, q), terminal_weight(s.terminal, p, q)]
            .map(|weight| decrease(s, &weight, p, q))
    })
}

fn decrease(s: &Settings, weight: &Matrix2<f64>, p: Vector2<f64>, q: f64) -> Interval {
    let phi = step(s.terminal, s.period_optimisation);
    let gain = [s.terminal.k1, s.terminal.k2].map(Interval::from);
    let g: Matrix =
        std::array::from_fn(|i| std::array::from_fn(|j| Interval::from(weight[(i, j)])));
    let after = product(&transposed(&phi), &product(&g, &phi));
    let h = Interval::from(s.period_optimisation);
    let entry = |i: usize, j: usize| {
        let diagonal = if i == j { Interval::from(p[i]) } else { Interval::ZERO };
        after[i][j] - g[i][j] + h * (diagonal + Interval::from(q) * gain[i] * gain[j])
    };
    let (a, b, d) = (entry(0, 0), entry(0, 1).hull(entry(1, 0)), entry(1, 1));
    let half = Interval::from(0.5);
    half * (a + d) + ((half * (a - d)).square() + b.square()).sqrt()
}
