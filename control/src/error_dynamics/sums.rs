//! Sums of the responses of sampled error dynamics to everything that may have acted.

use super::{InitialTicks, Reach, SampledError, transition};
use nalgebra::{Matrix2, RowVector2, Vector2};

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

impl SampledError {
    /// Sizes of a deviation's angle and rate, of both in the middle of the period, and of its
    /// feedback.
    fn sizes(&self, deviation: &Vector2<f64>) -> [f64; 5] {
        let middle = self.to_middle * deviation;
        let feedback = (self.gain.row() * deviation).x;
        [deviation.x, deviation.y, middle.x, middle.y, feedback].map(f64::abs)
    }

    /// Bounds of what Φⁿ = `power` makes of a response whose rows have this `size`.
    fn faded(&self, power: &Matrix2<f64>, size: impl Fn(RowVector2<f64>) -> f64) -> Reach {
        let middle = self.to_middle * power;
        let row = |matrix: &Matrix2<f64>, i: usize| size(matrix.row(i).into());
        let feedback = size(self.gain.row() * power);
        Reach::seen([row(power, 0), row(power, 1), row(&middle, 0), row(&middle, 1), feedback])
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
        let within = (self.latency, self.latency + self.period);
        let mut reach = unseen;
        let mut reaches = Vec::with_capacity(steps + 1);
        reaches.push(reach);
        let mut power = Matrix2::identity();
        for n in 0..steps {
            // By now [u; 1] has become Φⁿ [u; 1].
            let size = |row: RowVector2<f64>| integral_of_size(row.y, row.x, within);
            let faded = self.faded(&power, size);
            reach = reach.plus(&Reach {
                feedback_age: faded.feedback * (within.1 + n as f64 * self.period),
                ..faded
            });
            reaches.push(reach);
            power = self.phi * power;
        }
        reaches
    }

    /// Returns the largest effect of errors of the measured angle and of the measured rate within
    /// 0, 1, …, `steps` periods, per unit of their bound. The errors may take any value within the
    /// bound at every tick. The nominal trajectory begins at the measured state.
    pub fn errors(&self, steps: usize) -> [Vec<Reach>; 2] {
        let always = InitialTicks { ticks: 0, excess: 0.0 };
        [Vector2::new(1.0, 0.0), Vector2::new(self.latency, 1.0)]
            .map(|newest| self.errors_along(newest, steps, always))
    }

    /// Returns the largest effect, within 0, 1, …, `steps` periods, of changes of the predicted
    /// rate, which the vehicle does not make, by up to 1 in all at any time between each
    /// measurement and its command, in s, 1 and 1/s.
    pub fn mispredictions(&self, steps: usize, initial: InitialTicks) -> Vec<Reach> {
        // The sums are convex in the direction, so that the largest one belongs to an end.
        let [last, first] =
            [0.0, self.latency].map(|u| self.errors_along(Vector2::new(u, 1.0), steps, initial));
        last.iter().zip(&first).map(|(a, b)| a.or(b)).collect()
    }

    /// With an error e of the measurement the predicted state is wrong by `newest` = A_d e, where
    /// A_d is the transition over `latency`. Then ô_n = A_d e_n + Σ_{0<j<n} Φ^{n−1−j} Γ K A_d e_j −
    /// Φ^{n−1} A A_d e_0, and the vehicle itself deviates by o_n = ô_n − A_d e_n.
    fn errors_along(
        &self,
        newest: Vector2<f64>,
        steps: usize,
        initial: InitialTicks,
    ) -> Vec<Reach> {
        let Self { gain, period, phi, gamma, .. } = *self;
        let sum_of = |a: [f64; 5], b: [f64; 5]| std::array::from_fn(|i| a[i] + b[i]);
        let mut older = gamma * (gain.row() * newest).x;
        let mut first = -(transition(period) * newest);
        let weight = |j: usize| if j < initial.ticks { 1.0 + initial.excess } else { 1.0 };
        // Sums of the sizes of the older responses.
        let mut sums = vec![[0.0; 5]];
        let mut reaches = Vec::with_capacity(steps + 1);
        let begin = newest.abs() * weight(0);
        reaches.push(Reach { angle: begin.x, rate: begin.y, ..Reach::default() });
        for n in 1..=steps {
            if n > 1 {
                let next = sum_of(sums[n - 2], self.sizes(&older));
                sums.push(next);
                older = phi * older;
            }
            // The errors j = 1, …, `initial.ticks` − 1 have become the oldest of these responses.
            let oldest = sums[(n - 1) - (n - 1).min(initial.ticks.saturating_sub(1))];
            let sum: [f64; 5] = std::array::from_fn(|i| {
                let sum = sums[n - 1][i];
                sum + initial.excess * (sum - oldest[i])
            });
            let actual = sum_of(sum, self.sizes(&first).map(|size| weight(0) * size));
            let seen = sum_of(actual, self.sizes(&newest).map(|size| weight(n) * size));
            reaches.push(Reach { angle: actual[0], rate: actual[1], ..Reach::seen(seen) });
            first = phi * first;
        }
        reaches
    }

    /// Returns the largest effect, within 0, 1, …, `steps` periods, of changes of the rate by up
    /// to the period in all before each tick, at any time since the measurement before that of the
    /// tick's command. The units are those of [`Self::reach`].
    pub fn changes(&self, steps: usize) -> Vec<Reach> {
        let Self { period, latency, phi, .. } = *self;
        let mut sum = Reach::default();
        let mut power = Matrix2::identity();
        let mut reaches = vec![sum];
        for _ in 0..steps {
            // A change at the time u before the tick has become Φⁿ [u; 1].
            let most =
                |row: RowVector2<f64>| period * largest_size(row.y, row.x, (0.0, latency + period));
            sum = sum.plus(&self.faded(&power, most));
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
            reach = reach.plus(&Reach::seen(self.sizes(&shift)));
            reaches.push(reach);
            shift = self.phi * shift;
        }
        reaches
    }
}
