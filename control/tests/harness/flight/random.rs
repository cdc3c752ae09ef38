//! Random numbers that repeat for the same seed.

use nalgebra::Vector3;
use vehicle::noise::uniform;

/// Random numbers that repeat for the same seed.
#[derive(Clone, Debug)]
pub struct Random {
    seed: u64,
    drawn: i64,
}

impl Random {
    /// Returns the sequence of this seed.
    pub fn new(seed: u64) -> Self {
        Self { seed, drawn: 0 }
    }

    /// Draws a number uniformly from [low, high).
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        self.drawn += 1;
        let [value] = uniform(self.seed, self.drawn);
        low + (high - low) * 0.5 * (value + 1.0)
    }

    /// Draws a whole number below `count`.
    pub fn below(&mut self, count: usize) -> usize {
        (self.between(0.0, count as f64) as usize).min(count - 1)
    }

    /// Draws each component uniformly from [−1, 1).
    pub fn vector(&mut self) -> Vector3<f64> {
        Vector3::from_fn(|_, _| self.between(-1.0, 1.0))
    }

    /// Draws a corner of the box [−1, 1]³.
    pub fn corner(&mut self) -> Vector3<f64> {
        signs(&self.vector())
    }

    /// Draws a vector of this length in any direction.
    pub fn direction(&mut self, length: f64) -> Vector3<f64> {
        self.vector().try_normalize(1e-6).unwrap_or_else(Vector3::x) * length
    }
}

/// Returns the corner of the box [−1, 1]³ in the direction of `vector`.
pub(super) fn signs(vector: &Vector3<f64>) -> Vector3<f64> {
    vector.map(|component| if component < 0.0 { -1.0 } else { 1.0 })
}
