//! Error dynamics under the feedback law, sampled: what a bounded disturbance can do to them.
//!
//! Per axis the deviation o = (angle, rate) of the vehicle from the nominal motion obeys ö = K o + Δ (Chai 2022, (22)),
//! with K o computed every `period` and held. The bounds here are exact: sums of absolute impulse responses (L1 norms)
//! under zero-order hold, not the peak of the step response that the paper's c̄ is (that one holds for a constant Δ only).

use nalgebra::{Matrix2, RowVector2, Vector2};
use serde::{Deserialize, Serialize};

/// Feedback gain of one axis with the paper's signs: u = k1 · angle + k2 · rate, both negative (1/s², 1/s).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Gain {
    /// Gain on the angle, 1/s².
    pub k1: f64,
    /// Gain on the rate, 1/s.
    pub k2: f64,
}

impl Gain {
    /// The gain as a row.
    pub fn row(&self) -> RowVector2<f64> {
        RowVector2::new(self.k1, self.k2)
    }

    /// Eigenvalues (slower, faster) of the continuous error dynamics, if they are real, distinct and stable, as
    /// Lemma 3 of Chai 2022 demands: k1 < 0, k2 < 0, k2² + 4 k1 > 0.
    pub fn eigenvalues(&self) -> Option<(f64, f64)> {
        let discriminant = self.k2 * self.k2 + 4.0 * self.k1;
        (self.k1 < 0.0 && self.k2 < 0.0 && discriminant > 0.0).then(|| {
            let root = discriminant.sqrt();
            (f64::midpoint(self.k2, root), f64::midpoint(self.k2, -root))
        })
    }
}

/// State transition of the double integrator over `h`.
pub fn transition(h: f64) -> Matrix2<f64> {
    Matrix2::new(1.0, h, 0.0, 1.0)
}

/// Response of the double integrator to a unit acceleration held over `h`.
pub fn response(h: f64) -> Vector2<f64> {
    Vector2::new(0.5 * h * h, h)
}

/// Bounds per unit of disturbance bound: |o_angle| ≤ `angle`·Δ̄, |o_rate| ≤ `rate`·Δ̄, |K o| ≤ `feedback`·Δ̄.
#[derive(Clone, Copy, Debug, PartialEq, Default, Serialize, Deserialize)]
pub struct Reach {
    /// s².
    pub angle: f64,
    /// s.
    pub rate: f64,
    /// Dimensionless.
    pub feedback: f64,
}

/// Error dynamics of one axis with the feedback sampled every `period` seconds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SampledError {
    gain: Gain,
    period: f64,
    /// o⁺ = Φ o + Γ Δ.
    phi: Matrix2<f64>,
    gamma: Vector2<f64>,
}

/// Impulse responses that an invariant set holds one by one; the rest of them is bounded along the eigenvectors.
const EXPLICIT: usize = 30;

/// A zonotope {Σ c_i g_i : |c_i| ≤ 1}: the impulse responses Φⁱ Γ for i < n, and the sum of all later ones bounded along the two
/// eigenvectors. One step of the error dynamics leads from it into itself, exactly: the first of the later responses
/// moves into the place that the step makes free.
#[derive(Clone, Debug, PartialEq)]
pub struct InvariantSet {
    generators: Vec<Vector2<f64>>,
    gain: Gain,
}

impl InvariantSet {
    /// max nᵀo over the set.
    pub fn support(&self, normal: &Vector2<f64>) -> f64 {
        self.generators.iter().map(|g| normal.dot(g).abs()).sum()
    }

    /// The set as {o : |nᵀo| ≤ 1 for each n}.
    pub fn normals(&self) -> Vec<Vector2<f64>> {
        let across = self.generators.iter().map(|g| Vector2::new(-g.y, g.x));
        across.map(|normal| normal / self.support(&normal)).collect()
    }

    /// Its largest angle, rate and feedback.
    pub fn reach(&self) -> Reach {
        Reach {
            angle: self.support(&Vector2::x()),
            rate: self.support(&Vector2::y()),
            feedback: self.support(&self.gain.row().transpose()),
        }
    }
}

impl SampledError {
    /// Error dynamics under `gain` sampled every `period` s.
    pub fn new(gain: Gain, period: f64) -> Self {
        let gamma = response(period);
        Self { gain, period, phi: transition(period) + gamma * gain.row(), gamma }
    }

    /// Largest magnitude of the closed-loop eigenvalues; stable if below 1.
    pub fn spectral_radius(&self) -> f64 {
        let (trace, det) = (self.phi.trace(), self.phi.determinant());
        let discriminant = 0.25 * trace * trace - det;
        if discriminant < 0.0 { det.sqrt() } else { 0.5 * trace.abs() + discriminant.sqrt() }
    }

    /// What disturbances held over each period can do within 0, 1, …, `steps` periods, starting from o = 0.
    pub fn reach(&self, steps: usize) -> Vec<Reach> {
        let mut impulse = self.gamma;
        let mut reach = Reach::default();
        let mut all = Vec::with_capacity(steps + 1);
        all.push(reach);
        for _ in 0..steps {
            reach.angle += impulse.x.abs();
            reach.rate += impulse.y.abs();
            reach.feedback += (self.gain.row() * impulse).x.abs();
            all.push(reach);
            impulse = self.phi * impulse;
        }
        all
    }

    /// The limit of [`Self::reach`] for infinitely many periods; `None` if the dynamics are not stable.
    pub fn reach_forever(&self) -> Option<Reach> {
        let radius = self.spectral_radius();
        if radius >= 1.0 - 1e-9 {
            return None;
        }
        // The impulse response falls at least as fast as n·radiusⁿ: carry on until the rest is below rounding.
        let steps = (60.0 / -radius.max(0.5).ln()).ceil() as usize;
        self.reach(steps).pop()
    }

    /// What errors of the measured rate do within 0, 1, …, `steps` periods, the feedback and the first nominal state taken from
    /// the measurement. Independent errors add up by their squares: per unit of the error's standard deviation, or of any
    /// quantile of a normal error, the same of the deviation o and of the measured deviation o + e, with the feedback K (o + e).
    pub fn noise(&self, steps: usize) -> Vec<[Reach; 2]> {
        let feedback = |deviation: &Vector2<f64>| (self.gain.row() * deviation).x;
        // Squares of what the errors at ticks 1, 2, …, n − 1 do at tick n, and what that at tick 0 does.
        let (mut squares, mut squared_feedback) = (Vector2::zeros(), 0.0);
        let mut impulse = self.gamma * self.gain.k2;
        let mut first = -Vector2::y();
        let mut all = Vec::with_capacity(steps + 1);
        for n in 0..=steps {
            let deviation = (squares + first.component_mul(&first)).map(f64::sqrt);
            // The newest error is seen at once; at tick 0 it is the first one.
            let newest = if n == 0 { 0.0 } else { 1.0 };
            let measured_first = if n == 0 { first + Vector2::y() } else { first };
            let angle = (squares.x + measured_first.x.powi(2)).sqrt();
            let rate = (squares.y + measured_first.y.powi(2) + newest).sqrt();
            let by_first = feedback(&measured_first).powi(2);
            let by_newest = newest * self.gain.k2 * self.gain.k2;
            all.push([
                Reach { angle: deviation.x, rate: deviation.y, feedback: 0.0 },
                Reach { angle, rate, feedback: (squared_feedback + by_first + by_newest).sqrt() },
            ]);
            first = self.phi * first;
            if n == 0 {
                first += self.gamma * self.gain.k2;
            } else {
                squares += impulse.component_mul(&impulse);
                squared_feedback += feedback(&impulse).powi(2);
                impulse = self.phi * impulse;
            }
        }
        all
    }

    /// A set that |Δ| ≤ 1, held over each period, can never drive the deviation out of. `None` if the dynamics are not
    /// stable with real, distinct eigenvalues.
    pub fn invariant_set(&self) -> Option<InvariantSet> {
        let (trace, det) = (self.phi.trace(), self.phi.determinant());
        let discriminant = 0.25 * trace * trace - det;
        if discriminant <= 0.0 || self.spectral_radius() >= 1.0 - 1e-9 {
            return None;
        }
        let eigenvalues = [0.5 * trace + discriminant.sqrt(), 0.5 * trace - discriminant.sqrt()];
        let vectors = eigenvalues.map(|lambda| Vector2::new(self.phi.m12, lambda - self.phi.m11));
        let basis = Matrix2::from_columns(&vectors).try_inverse()?;

        let mut generators = Vec::with_capacity(EXPLICIT + 2);
        let mut impulse = self.gamma;
        for _ in 0..EXPLICIT {
            generators.push(impulse);
            impulse = self.phi * impulse;
        }
        let rest = basis * impulse;
        for i in 0..2 {
            generators.push(vectors[i] * (rest[i].abs() / (1.0 - eigenvalues[i].abs())));
        }
        Some(InvariantSet { generators, gain: self.gain })
    }

    /// Sampling period, s.
    pub fn period(&self) -> f64 {
        self.period
    }

    /// One period: o⁺ = Φ o + Γ Δ.
    pub fn advance(&self, deviation: &Vector2<f64>, disturbance: f64) -> Vector2<f64> {
        self.phi * deviation + self.gamma * disturbance
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn oracle_no_step_leads_out_of_the_invariant_set() {
        // Support functions: h(Φᵀn) + |nᵀΓ| ≤ h(n) for every facet of the set.
        for (k, period) in [(-5.0, 0.04), (-5.0, 0.2), (-10.0, 0.04), (-4.5, 0.1)] {
            let error = SampledError::new(Gain { k1: k, k2: k }, period);
            let set = error.invariant_set().unwrap();
            let normals = set.normals();
            assert!(normals.len() > EXPLICIT);
            for normal in normals {
                assert!((set.support(&normal) - 1.0).abs() < 1e-12);
                let after = set.support(&(error.phi.transpose() * normal)) + normal.dot(&error.gamma).abs();
                assert!(after <= 1.0 + 1e-12, "K = {k} at {period} s: {after}");
            }
            let (set, reach) = (set.reach(), error.reach_forever().unwrap());
            for (outer, exact) in
                [(set.angle, reach.angle), (set.rate, reach.rate), (set.feedback, reach.feedback)]
            {
                assert!(outer >= exact * (1.0 - 1e-12) && outer < 1.25 * exact, "{outer} {exact}");
            }
        }
    }

    #[test]
    fn oracle_noise_adds_up_as_in_a_simulation() {
        // By superposition: one error of 1 at each tick in turn, everything else exact.
        let error = SampledError::new(Gain { k1: -5.0, k2: -5.0 }, 0.04);
        let steps = 12;
        let mut squares = vec![[[0.0; 3]; 2]; steps + 1];
        for at in 0..=steps {
            let noise = |n: usize| Vector2::new(0.0, if n == at { 1.0 } else { 0.0 });
            let mut deviation = -noise(0);
            for (n, squares) in squares.iter_mut().enumerate() {
                let measured = deviation + noise(n);
                let feedback = (error.gain.row() * measured).x;
                for (of, value) in
                    [(0, [deviation.x, deviation.y, 0.0]), (1, [measured.x, measured.y, feedback])]
                {
                    for i in 0..3 {
                        squares[of][i] += value[i] * value[i];
                    }
                }
                deviation = transition(error.period) * deviation + error.gamma * feedback;
            }
        }
        for (n, (squares, found)) in squares.iter().zip(error.noise(steps)).enumerate() {
            for (squares, Reach { angle, rate, feedback }) in squares.iter().zip(found) {
                for (square, found) in squares.iter().zip([angle, rate, feedback]) {
                    assert!((square.sqrt() - found).abs() < 1e-12, "tick {n}: {} {found}", square.sqrt());
                }
            }
        }
    }

    #[test]
    fn the_papers_box_is_not_invariant() {
        // From the corner (1/|k1|, 0) of (26), where the rate may still be c̄: the angle leaves the box within one tick.
        let error = SampledError::new(Gain { k1: -5.0, k2: -5.0 }, 0.04);
        let (angle, rate) = (0.2, 0.1525);
        let next = error.advance(&Vector2::new(angle, rate), 1.0);
        assert!(next.x > angle);
    }
}
