//! A set of deviations that the error dynamics never leave.

use super::{Reach, SampledError, transition};
use nalgebra::{Matrix2, Vector2};

/// Number of impulse responses that an invariant set holds one by one; the remaining ones are
/// bounded along the eigenvectors.
pub(super) const EXPLICIT: usize = 30;

/// A zonotope {Σ c_i g_i : |c_i| ≤ 1}. Its generators are the impulse responses Φⁱ Γ for i < n, and
/// the sum of all later ones bounded along the two eigenvectors. One step of the error dynamics
/// leads exactly from the set into itself: the first of the later responses takes the place that
/// the step vacates.
#[derive(Clone, Debug, PartialEq)]
pub struct InvariantSet {
    generators: Vec<Vector2<f64>>,
    dynamics: SampledError,
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
        let SampledError { gain, latency, to_middle, .. } = &self.dynamics;
        let middle = |i: usize| self.support(&to_middle.row(i).transpose());
        Reach {
            angle: angle + 0.5 * latency * latency,
            rate: rate + latency,
            seen_angle: angle,
            seen_rate: rate,
            middle_angle: middle(0),
            middle_rate: middle(1),
            feedback: self.support(&gain.row().transpose()),
            // This field is not used.
            feedback_age: 0.0,
        }
    }
}

impl SampledError {
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
        Some(InvariantSet { generators, dynamics: *self })
    }
}
