//! Sampled error dynamics under the feedback law: the effect of a bounded disturbance.
//!
//! Per axis the deviation o = (angle, rate) of the vehicle from the nominal trajectory obeys ö = K
//! o + Δ (Chai 2022, (22)), with K o computed every `period` and held. The bounds here are exact:
//! they are sums of absolute impulse responses (L1 norms) under zero-order hold. The paper's c̄ is
//! the peak of the step response instead, which holds for a constant Δ only.

use nalgebra::{Matrix2, RowVector2, Vector2};
use serde::{Deserialize, Serialize};
use settings::Declared;
use vehicle::math::ln;

/// Feedback gain of one axis with the paper's signs: u = k1 · angle + k2 · rate, both negative
/// (1/s², 1/s).
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Declared)]
pub struct Gain {
    /// Factor on the angle; negative.
    #[setting(part, unit = "1/s2", max = 0.0, nominal = 5.0)]
    pub k1: f64,
    /// Factor on the rate; negative.
    #[setting(part, unit = "1/s", max = 0.0, nominal = 5.0)]
    pub k2: f64,
}

impl Gain {
    /// Returns the gain as a row vector.
    pub fn row(&self) -> RowVector2<f64> {
        RowVector2::new(self.k1, self.k2)
    }

    /// Returns the eigenvalues (slower, faster) of the continuous error dynamics if they are real,
    /// distinct and stable, as Lemma 3 of Chai 2022 requires: k1 < 0, k2 < 0, k2² + 4 k1 > 0.
    pub fn eigenvalues(&self) -> Option<(f64, f64)> {
        let discriminant = self.k2 * self.k2 + 4.0 * self.k1;
        (self.k1 < 0.0 && self.k2 < 0.0 && discriminant > 0.0).then(|| {
            let root = discriminant.sqrt();
            (f64::midpoint(self.k2, root), f64::midpoint(self.k2, -root))
        })
    }
}

/// Returns the state transition of the double integrator over `h`.
pub fn transition(h: f64) -> Matrix2<f64> {
    Matrix2::new(1.0, h, 0.0, 1.0)
}

/// Returns the largest |c₀ + c₁ u| over `within`.
fn largest_size(c0: f64, c1: f64, within: (f64, f64)) -> f64 {
    (c0 + c1 * within.0).abs().max((c0 + c1 * within.1).abs())
}

/// Returns ∫ |c₀ + c₁ u| du over `within`.
fn integral_of_size(c0: f64, c1: f64, within: (f64, f64)) -> f64 {
    let primitive = |u: f64| c0 * u + 0.5 * c1 * u * u;
    let (low, high) = within;
    let zero = -c0 / c1;
    if low < zero && zero < high {
        (primitive(zero) - primitive(low)).abs() + (primitive(high) - primitive(zero)).abs()
    } else {
        (primitive(high) - primitive(low)).abs()
    }
}

/// Returns the response of the double integrator to a unit acceleration held over `h`.
pub fn response(h: f64) -> Vector2<f64> {
    Vector2::new(0.5 * h * h, h)
}

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
    /// Largest change of K o from one tick to the next, dimensionless.
    pub change: f64,
}

impl Reach {
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
            change: combine(self.change, other.change),
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

/// Error dynamics of one axis with the feedback sampled every `period` seconds. The law acts
/// `latency` seconds after its measurement, on the state predicted for that instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SampledError {
    gain: Gain,
    period: f64,
    latency: f64,
    /// Matrices of o⁺ = Φ o + Γ Δ for a held Δ.
    phi: Matrix2<f64>,
    gamma: Vector2<f64>,
    /// Transition under the feedback from the beginning of a period to its middle.
    to_middle: Matrix2<f64>,
}

/// The first ticks of a nominal trajectory, before which the prediction has begun, and the share by
/// which an effect is larger there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Early {
    /// Number of these ticks.
    pub ticks: usize,
    /// Share by which the effect is larger.
    pub excess: f64,
}

impl Early {
    /// Counts the larger effects in sums over 0, 1, … ticks, of which the first ticks are the
    /// oldest parts.
    #[must_use]
    pub fn count(&self, sums: &[Reach]) -> Vec<Reach> {
        let oldest = |n: usize| sums[n].minus(&sums[n - n.min(self.ticks)]);
        (0..sums.len()).map(|n| sums[n].plus(&oldest(n).times(self.excess))).collect()
    }
}

/// Number of impulse responses that an invariant set holds one by one; the remaining ones are
/// bounded along the eigenvectors.
const EXPLICIT: usize = 30;

/// A zonotope {Σ c_i g_i : |c_i| ≤ 1}. Its generators are the impulse responses Φⁱ Γ for i < n, and
/// the sum of all later ones bounded along the two eigenvectors. One step of the error dynamics
/// leads exactly from the set into itself: the first of the later responses takes the place that
/// the step vacates.
#[derive(Clone, Debug, PartialEq)]
pub struct InvariantSet {
    generators: Vec<Vector2<f64>>,
    gain: Gain,
    latency: f64,
    to_middle: Matrix2<f64>,
}

impl InvariantSet {
    /// Returns the support max nᵀo over the set.
    pub fn support(&self, normal: &Vector2<f64>) -> f64 {
        self.generators.iter().map(|g| normal.dot(g).abs()).sum()
    }

    /// Returns normals n with which the set is {o : |nᵀo| ≤ 1 for each n}.
    pub fn normals(&self) -> Vec<Vector2<f64>> {
        let across = self.generators.iter().map(|g| Vector2::new(-g.y, g.x));
        across.map(|normal| normal / self.support(&normal)).collect()
    }

    /// Returns the largest angle, rate and feedback of the set, including the effects while a
    /// command is under way.
    pub fn reach(&self) -> Reach {
        let (angle, rate) = (self.support(&Vector2::x()), self.support(&Vector2::y()));
        let middle = |i: usize| self.support(&self.to_middle.row(i).transpose());
        Reach {
            angle: angle + 0.5 * self.latency * self.latency,
            rate: rate + self.latency,
            seen_angle: angle,
            seen_rate: rate,
            middle_angle: middle(0),
            middle_rate: middle(1),
            feedback: self.support(&self.gain.row().transpose()),
            // These fields are not used.
            feedback_age: 0.0,
            change: 0.0,
        }
    }
}

/// Largest spectral radius of sampled dynamics that count as stable: a decay slower than 10⁴
/// periods cannot be distinguished from none.
const LARGEST_RADIUS: f64 = 1.0 - 1e-4;

impl SampledError {
    /// Returns the error dynamics under `gain` sampled every `period` s, acting at once.
    pub fn new(gain: Gain, period: f64) -> Self {
        let held = |time: f64| transition(time) + response(time) * gain.row();
        Self {
            gain,
            period,
            latency: 0.0,
            phi: held(period),
            gamma: response(period),
            to_middle: held(0.5 * period),
        }
    }

    /// Returns the error dynamics under `gain` sampled every `period` s, acting `latency` s after
    /// the measurement.
    pub fn delayed(gain: Gain, period: f64, latency: f64) -> Self {
        Self { latency, ..Self::new(gain, period) }
    }

    /// Returns the largest magnitude of the closed-loop eigenvalues; the dynamics are stable if it
    /// is below 1.
    pub fn spectral_radius(&self) -> f64 {
        let (trace, det) = (self.phi.trace(), self.phi.determinant());
        let discriminant = 0.25 * trace * trace - det;
        if discriminant < 0.0 { det.sqrt() } else { 0.5 * trace.abs() + discriminant.sqrt() }
    }

    /// Returns the largest effect of any measurable |Δ| ≤ 1 within 0, 1, …, `steps` periods from
    /// o = 0.
    ///
    /// A pulse at time v moves the vehicle freely, to [u; 1] after u seconds, until the first tick
    /// whose measurement was taken after v; then `latency` ≤ u < `latency` + `period`. From there
    /// on it fades by Φ. The bounds are the integrals of the absolute responses.
    pub fn reach(&self, steps: usize) -> Vec<Reach> {
        let unseen = Reach {
            angle: 0.5 * self.latency * self.latency,
            rate: self.latency,
            ..Reach::default()
        };
        self.sums(steps, unseen, integral_of_size)
    }

    /// Returns the largest effect of pulses of Δ, by which the rate jumps by at most 1 in any time
    /// as long as a period, within 0, 1, …, `steps` periods from o = 0. The units are those for a
    /// jump of the rate in rad/s: s for an angle, 1 for a rate, and 1/s for K o. A pulse may also
    /// act later, through the mismatch, so that it counts with its largest response over the whole
    /// time until it is seen.
    pub fn pulses(&self, steps: usize) -> Vec<Reach> {
        // A latency that is a whole number of periods may be inexact by rounding.
        let unseen = (self.latency / self.period - 1e-9).ceil().max(0.0);
        let unseen = Reach { angle: unseen * self.latency, rate: unseen, ..Reach::default() };
        self.sums(steps, unseen, |c0, c1, (_, end)| largest_size(c0, c1, (0.0, end)))
    }

    /// Returns the sums of the responses to what acted in each period. `size` takes the size of a
    /// response c₀ + c₁ u over the times u at which it is seen first.
    fn sums(
        &self,
        steps: usize,
        unseen: Reach,
        size: fn(f64, f64, (f64, f64)) -> f64,
    ) -> Vec<Reach> {
        let within = (self.latency, self.latency + self.period);
        let mut reach = unseen;
        let mut reaches = Vec::with_capacity(steps + 1);
        reaches.push(reach);
        let (mut power, mut before) = (Matrix2::identity(), Matrix2::zeros());
        for n in 0..steps {
            // By now [u; 1] has become Φⁿ [u; 1].
            let size = |row: RowVector2<f64>| size(row.y, row.x, within);
            let (angle, rate) = (size(power.row(0).into()), size(power.row(1).into()));
            let feedback = size(self.gain.row() * power);
            let middle = self.to_middle * power;
            reach = Reach {
                angle: reach.angle + angle,
                rate: reach.rate + rate,
                seen_angle: reach.seen_angle + angle,
                seen_rate: reach.seen_rate + rate,
                middle_angle: reach.middle_angle + size(middle.row(0).into()),
                middle_rate: reach.middle_rate + size(middle.row(1).into()),
                feedback: reach.feedback + feedback,
                feedback_age: reach.feedback_age + feedback * (within.1 + n as f64 * self.period),
                change: reach.change + size(self.gain.row() * (power - before)),
            };
            reaches.push(reach);
            before = power;
            power = self.phi * power;
        }
        reaches
    }

    /// Returns the limit of [`Self::reach`] for infinitely many periods; `None` if the dynamics are
    /// not stable.
    pub fn reach_forever(&self) -> Option<Reach> {
        self.reach(self.settling()?).pop()
    }

    /// Returns the number of periods after which a response has fallen below rounding; `None` if
    /// the dynamics are not stable.
    pub fn settling(&self) -> Option<usize> {
        let radius = self.spectral_radius();
        // The response falls at least as fast as n·radiusⁿ.
        (radius <= LARGEST_RADIUS).then(|| (60.0 / -ln(radius.max(0.5))).ceil() as usize)
    }

    /// Returns the largest effect of errors of the measured angle and of the measured rate within
    /// 0, 1, …, `steps` periods, per unit of their bound. The errors may take any value within the
    /// bound at every tick. The nominal trajectory begins at the measured state.
    pub fn errors(&self, steps: usize) -> [Vec<Reach>; 2] {
        let always = Early { ticks: 0, excess: 0.0 };
        [Vector2::new(1.0, 0.0), Vector2::new(self.latency, 1.0)]
            .map(|newest| self.errors_along(newest, steps, always))
    }

    /// Returns the largest effect, within 0, 1, …, `steps` periods, of changes of the predicted
    /// rate, which the vehicle does not make, by up to 1 in all at any time between each
    /// measurement and its command, in s, 1 and 1/s.
    pub fn mispredictions(&self, steps: usize, early: Early) -> Vec<Reach> {
        // The sums are convex in the direction, so that the largest one belongs to an end.
        let [last, first] =
            [0.0, self.latency].map(|u| self.errors_along(Vector2::new(u, 1.0), steps, early));
        last.iter().zip(&first).map(|(a, b)| a.or(b)).collect()
    }

    /// With an error e of the measurement the predicted state is wrong by `newest` = A_d e, where
    /// A_d is the transition over `latency`. Then ô_n = A_d e_n + Σ_{0<j<n} Φ^{n−1−j} Γ K A_d e_j −
    /// Φ^{n−1} A A_d e_0, and the vehicle itself deviates by o_n = ô_n − A_d e_n.
    fn errors_along(&self, newest: Vector2<f64>, steps: usize, early: Early) -> Vec<Reach> {
        let Self { gain, period, phi, gamma, to_middle, .. } = *self;
        // Angle, rate, both in the middle of the period, and feedback.
        let sizes = |x: &Vector2<f64>| {
            let middle = to_middle * x;
            [x.x, x.y, middle.x, middle.y, (gain.row() * x).x].map(f64::abs)
        };
        let sum_of = |a: [f64; 5], b: [f64; 5]| std::array::from_fn(|i| a[i] + b[i]);
        let mut older = gamma * (gain.row() * newest).x;
        let mut first = -(transition(period) * newest);
        let weight = |j: usize| if j < early.ticks { 1.0 + early.excess } else { 1.0 };
        // Sums of the sizes of the older responses.
        let mut sums = vec![[0.0; 5]];
        let mut reaches = Vec::with_capacity(steps + 1);
        let begin = newest.abs() * weight(0);
        reaches.push(Reach { angle: begin.x, rate: begin.y, ..Reach::default() });
        for n in 1..=steps {
            if n > 1 {
                let next = sum_of(sums[n - 2], sizes(&older));
                sums.push(next);
                older = phi * older;
            }
            // The errors j = 1, …, `early.ticks` − 1 have become the oldest of these responses.
            let oldest = sums[(n - 1) - (n - 1).min(early.ticks.saturating_sub(1))];
            let sum: [f64; 5] = std::array::from_fn(|i| {
                let sum = sums[n - 1][i];
                sum + early.excess * (sum - oldest[i])
            });
            let actual = sum_of(sum, sizes(&first).map(|size| weight(0) * size));
            let seen = sum_of(actual, sizes(&newest).map(|size| weight(n) * size));
            reaches.push(Reach {
                angle: actual[0],
                rate: actual[1],
                seen_angle: seen[0],
                seen_rate: seen[1],
                middle_angle: seen[2],
                middle_rate: seen[3],
                feedback: seen[4],
                feedback_age: 0.0,
                change: 2.0 * seen[4],
            });
            first = phi * first;
        }
        reaches
    }

    /// Returns the largest effect, within 0, 1, …, `steps` periods, of changes of the rate by up
    /// to the period in all before each tick, at any time since the measurement before that of the
    /// tick's command. The units are those of [`Self::reach`].
    pub fn changes(&self, steps: usize) -> Vec<Reach> {
        let Self { gain, period, latency, phi, to_middle, .. } = *self;
        let mut sum = Reach::default();
        let (mut power, mut before) = (Matrix2::identity(), Matrix2::zeros());
        let mut reaches = vec![sum];
        for _ in 0..steps {
            // A change at the time u before the tick has become Φⁿ [u; 1].
            let most =
                |row: RowVector2<f64>| period * largest_size(row.y, row.x, (0.0, latency + period));
            let middle = to_middle * power;
            let (angle, rate) = (most(power.row(0).into()), most(power.row(1).into()));
            sum = sum.plus(&Reach {
                angle,
                rate,
                seen_angle: angle,
                seen_rate: rate,
                middle_angle: most(middle.row(0).into()),
                middle_rate: most(middle.row(1).into()),
                feedback: most(gain.row() * power),
                feedback_age: 0.0,
                change: most(gain.row() * (power - before)),
            });
            before = power;
            reaches.push(sum);
            power = phi * power;
        }
        reaches
    }

    /// Returns the largest effect of shifts of the angle alone, by at most the period at each tick,
    /// within 0, 1, …, `steps` periods, in s, 1 and 1/s.
    pub fn shifts(&self, steps: usize) -> Vec<Reach> {
        let mut shift = Vector2::new(self.period, 0.0);
        let mut reach = Reach::default();
        let mut reaches = Vec::with_capacity(steps + 1);
        reaches.push(reach);
        for _ in 0..steps {
            let middle = self.to_middle * shift;
            reach = Reach {
                angle: reach.angle + shift.x.abs(),
                rate: reach.rate + shift.y.abs(),
                seen_angle: reach.seen_angle + shift.x.abs(),
                seen_rate: reach.seen_rate + shift.y.abs(),
                middle_angle: reach.middle_angle + middle.x.abs(),
                middle_rate: reach.middle_rate + middle.y.abs(),
                feedback: reach.feedback + (self.gain.row() * shift).x.abs(),
                feedback_age: 0.0,
                change: 2.0 * (reach.feedback + (self.gain.row() * shift).x.abs()),
            };
            reaches.push(reach);
            shift = self.phi * shift;
        }
        reaches
    }

    /// Returns a set that the deviation never leaves under any |Δ| ≤ 1 that is held over each
    /// period, together with shifts of the angle by up to `lateral` (s²) at each tick. The result
    /// is `None` if the dynamics are not stable with real, distinct eigenvalues.
    ///
    /// A Δ that changes within the period acts as its mean does, and also shifts the angle by no
    /// more than τ²/4.
    pub fn invariant_set(&self, lateral: f64) -> Option<InvariantSet> {
        let (eigenvalues, vectors) = self.modes()?;
        let basis = Matrix2::from_columns(&vectors).try_inverse()?;

        let mut generators = Vec::with_capacity(EXPLICIT + 2);
        // The response is free until a measurement has seen it.
        let mut impulse = transition(self.latency) * self.gamma;
        for _ in 0..EXPLICIT {
            generators.push(impulse);
            impulse = self.phi * impulse;
        }
        let (rest, shift) = (basis * impulse, basis * Vector2::new(lateral, 0.0));
        for i in 0..2 {
            generators.push(
                vectors[i] * ((rest[i].abs() + shift[i].abs()) / (1.0 - eigenvalues[i].abs())),
            );
        }
        let Self { gain, latency, to_middle, .. } = *self;
        Some(InvariantSet { generators, gain, latency, to_middle })
    }

    /// Returns the eigenvalues of Φ and their eigenvectors, if they are real, distinct and stable.
    pub fn modes(&self) -> Option<([f64; 2], [Vector2<f64>; 2])> {
        let (trace, det) = (self.phi.trace(), self.phi.determinant());
        let discriminant = 0.25 * trace * trace - det;
        if discriminant <= 0.0 || self.spectral_radius() > LARGEST_RADIUS {
            return None;
        }
        let values = [0.5 * trace + discriminant.sqrt(), 0.5 * trace - discriminant.sqrt()];
        Some((values, values.map(|lambda| Vector2::new(self.phi.m12, lambda - self.phi.m11))))
    }

    /// Returns the sampling period, s.
    pub fn period(&self) -> f64 {
        self.period
    }

    /// Returns Φ, the transition over one period under the held feedback.
    pub fn transition(&self) -> &Matrix2<f64> {
        &self.phi
    }

    /// Returns the deviation after one period: o⁺ = Φ o + Γ Δ.
    pub fn advance(&self, deviation: &Vector2<f64>, disturbance: f64) -> Vector2<f64> {
        self.phi * deviation + self.gamma * disturbance
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn oracle_no_step_leads_out_of_the_invariant_set() {
        // Condition on the support function h: h(Φᵀn) + |nᵀΓ| ≤ h(n) for every facet of the set.
        for (k, period) in [(-5.0, 0.04), (-5.0, 0.2), (-10.0, 0.04), (-4.5, 0.1)] {
            let error = SampledError::new(Gain { k1: k, k2: k }, period);
            let lateral = 0.25 * period * period;
            let set = error.invariant_set(lateral).unwrap();
            let normals = set.normals();
            assert!(normals.len() > EXPLICIT);
            for normal in normals {
                assert!((set.support(&normal) - 1.0).abs() < 1e-12);
                let driven = normal.dot(&error.gamma).abs() + lateral * normal.x.abs();
                let after = set.support(&(error.phi.transpose() * normal)) + driven;
                assert!(after <= 1.0 + 1e-12, "K = {k} at {period} s: {after}");
            }
            // Without shifts the set is that of held disturbances, which reach no further than
            // disturbances that change at any time.
            let (set, held) = (set.reach(), error.invariant_set(0.0).unwrap().reach());
            let reach = error.reach_forever().unwrap();
            for (outer, held, exact) in [
                (set.angle, held.angle, reach.angle),
                (set.rate, held.rate, reach.rate),
                (set.feedback, held.feedback, reach.feedback),
            ] {
                assert!(
                    outer >= exact * (1.0 - 1e-12) && held < 1.25 * exact,
                    "{outer} {held} {exact}"
                );
            }
        }
    }

    /// Largest |angle|, |rate| and |K ô| at each tick over all signs of the sources' responses
    /// (`respond`): by superposition this is the sum over the sources.
    fn superposed(
        steps: usize,
        sources: usize,
        respond: impl Fn(usize) -> Vec<[f64; 7]>,
    ) -> Vec<[f64; 7]> {
        let mut sums = vec![[0.0; 7]; steps + 1];
        for source in 0..sources {
            for (sum, value) in sums.iter_mut().zip(respond(source)) {
                for (sum, value) in sum.iter_mut().zip(value) {
                    *sum += value.abs();
                }
            }
        }
        sums
    }

    /// Deviation half a period after the law has seen `deviation`, with its feedback held.
    fn in_the_middle(error: &SampledError, deviation: &Vector2<f64>) -> Vector2<f64> {
        let half = 0.5 * error.period;
        transition(half) * deviation + response(half) * (error.gain.row() * deviation).x
    }

    fn assert_agree(computed: &[Reach], expected: &[[f64; 7]], tolerance: f64) {
        for (n, (reach, expected)) in computed.iter().zip(expected).enumerate() {
            let Reach { angle, rate, seen_angle, seen_rate, middle_angle, middle_rate, .. } =
                *reach;
            let values =
                [angle, rate, seen_angle, seen_rate, middle_angle, middle_rate, reach.feedback];
            for (value, expected) in values.iter().zip(expected) {
                assert!(
                    (value - expected).abs() <= tolerance * (1.0 + expected),
                    "tick {n}: {value} {expected}"
                );
            }
        }
    }

    #[test]
    fn oracle_errors_of_measurement_add_up_as_in_a_simulation() {
        for (component, latency) in [(0, 0.0), (0, 0.05), (1, 0.0), (1, 0.05)] {
            let error = SampledError::delayed(Gain { k1: -5.0, k2: -4.0 }, 0.04, latency);
            let steps = 12;
            let expected = superposed(steps, steps + 1, |at| {
                let error_of_state = [Vector2::x(), Vector2::new(latency, 1.0)][component];
                let off = |n: usize| error_of_state * if n == at { 1.0 } else { 0.0 };
                let mut deviation = -off(0);
                (0..=steps)
                    .map(|n| {
                        let seen = deviation + off(n);
                        let feedback = (error.gain.row() * seen).x;
                        let middle = in_the_middle(&error, &seen);
                        let values = [
                            deviation.x,
                            deviation.y,
                            seen.x,
                            seen.y,
                            middle.x,
                            middle.y,
                            feedback,
                        ];
                        deviation = transition(error.period) * deviation + error.gamma * feedback;
                        values
                    })
                    .collect()
            });
            assert_agree(&error.errors(steps)[component], &expected, 1e-12);
        }
    }

    #[test]
    fn oracle_pulses_add_up_as_in_a_simulation() {
        // Each pulse lasts a thousandth of a period. It is seen by the first measurement after it,
        // `latency` before the tick of the resulting command.
        let (period, fine) = (0.04, 1000);
        let pulse = period / f64::from(fine);
        for late in [0, 1000, 2925] {
            let latency = f64::from(late) * pulse;
            let error = SampledError::delayed(Gain { k1: -5.0, k2: -5.0 }, period, latency);
            let steps = 8_u32;
            let sources = usize::try_from(late + steps.cast_signed() * fine).unwrap();
            // Source i acts from −latency + i·pulse on.
            let expected = superposed(steps as usize, sources, |source| {
                let begins = (source as f64 + 0.5) * pulse - latency;
                let mut seen = Vector2::zeros();
                (0..=steps)
                    .map(|n| {
                        let time = f64::from(n) * period;
                        let free = (time - begins).max(0.0);
                        // Before a measurement has seen the pulse, the vehicle moves freely.
                        let fresh = if free > 0.0 && free < latency {
                            Vector2::new(free, 1.0)
                        } else {
                            Vector2::zeros()
                        };
                        if n > 0 {
                            seen = error.phi * seen;
                            if free > 0.0 && (latency..latency + period).contains(&free) {
                                seen = Vector2::new(free, 1.0);
                            }
                        }
                        let actual = seen + fresh;
                        let middle = in_the_middle(&error, &seen);
                        let feedback = (error.gain.row() * seen).x;
                        [actual.x, actual.y, seen.x, seen.y, middle.x, middle.y, feedback]
                            .map(|value| value * pulse)
                    })
                    .collect()
            });
            assert_agree(&error.reach(steps as usize), &expected, 2e-4);
        }
    }

    #[test]
    fn oracle_changes_and_mispredictions_add_up_as_in_a_simulation() {
        let error = SampledError::delayed(Gain { k1: -2.0, k2: -4.0 }, 0.04, 0.117);
        let (steps, tau) = (12_usize, error.period);
        for ticks in [0, 1, 3] {
            let early = Early { ticks, excess: 0.3 };
            let weight = |j: usize| if j < ticks { 1.3 } else { 1.0 };
            let sized = |actual: Vector2<f64>, seen: Vector2<f64>| {
                let (middle, k) = (in_the_middle(&error, &seen), error.gain.row());
                [actual.x, actual.y, seen.x, seen.y, middle.x, middle.y, (k * seen).x]
            };
            // Source j is a change before tick j + 1.
            let [old, new] = [0.117 + tau, 0.0].map(|u| {
                superposed(steps, steps, |j| {
                    let mut seen = Vector2::zeros();
                    (0..=steps)
                        .map(|n| {
                            seen = error.phi * seen;
                            if n == j + 1 {
                                seen = Vector2::new(u, 1.0) * tau * weight(j);
                            }
                            sized(seen, seen)
                        })
                        .collect()
                })
            });
            let changes = early.count(&error.changes(steps));
            for n in 0..=steps {
                for (component, value) in [(1, changes[n].rate), (6, changes[n].feedback)] {
                    let (old, new) = (old[n][component], new[n][component]);
                    let (low, high) = (old.max(new) - 1e-12, old + new + 1e-12);
                    assert!(low <= value && value <= high, "{n}: {old} {new} {value}");
                }
            }
            // Source j is the part of the prediction of tick j that is wrong.
            let [old, new] = [0.117, 0.0].map(|u| {
                superposed(steps, steps + 1, |j| {
                    let off =
                        |n: usize| Vector2::new(u, 1.0) * if n == j { weight(j) } else { 0.0 };
                    let mut deviation = -off(0);
                    (0..=steps)
                        .map(|n| {
                            let seen = deviation + off(n);
                            let values = sized(deviation, seen);
                            deviation = transition(tau) * deviation + error.gamma * values[6];
                            values
                        })
                        .collect()
                })
            });
            let largest: Vec<[f64; 7]> = old
                .iter()
                .zip(&new)
                .map(|(a, b)| std::array::from_fn(|i| f64::max(a[i], b[i])))
                .collect();
            assert_agree(&error.mispredictions(steps, early), &largest, 1e-12);
        }
    }

    #[test]
    fn oracle_a_held_disturbance_reaches_as_far_as_one_that_changes_within_the_period() {
        // Here the response does not change its sign within a period. (26) is for constant
        // disturbances.
        let reach = SampledError::new(Gain { k1: -5.0, k2: -5.0 }, 0.04).reach_forever().unwrap();
        assert!(
            (reach.angle - 0.2).abs() < 1e-4 && (reach.feedback - 1.2473).abs() < 1e-4,
            "{reach:?}"
        );
    }

    #[test]
    fn the_papers_box_is_not_invariant() {
        // The start is the corner (1/|k1|, 0) of (26), where the rate may still be c̄: the angle
        // leaves the box within one tick.
        let error = SampledError::new(Gain { k1: -5.0, k2: -5.0 }, 0.04);
        let (angle, rate) = (0.2, 0.1525);
        let next = error.advance(&Vector2::new(angle, rate), 1.0);
        assert!(next.x > angle);
    }
}
