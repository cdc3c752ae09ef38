//! What every controller is: a function of memory, tick and measurement.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize, de::DeserializeOwned};
use vehicle::reference::Reference;

/// What a controller is told about the vehicle.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Measurement {
    /// Θ = [α, β, σ], rad.
    pub angles: Vector3<f64>,
    /// ω = [p, q, r], rad/s.
    pub rates: Vector3<f64>,
    /// The moment that acted since the last tick, N m, if it is measured; else a controller takes its own command for it.
    pub achieved_moment: Option<Vector3<f64>>,
}

/// The reference as a function of time (s): a controller with preview asks for the future too.
pub type ReferenceAt<'a> = &'a dyn Fn(f64) -> Reference;

/// A sampled attitude controller. `update` changes nothing but `memory` that a later call could notice, so that a tick can be
/// evaluated again with other inputs from the same memory, and a saved memory continues bit for bit.
pub trait Controller {
    /// What is carried from tick to tick.
    type Memory: Clone + Default + Serialize + DeserializeOwned + Send;

    /// Time between ticks, s.
    fn period(&self) -> f64;

    /// What is carried into the first tick, with room for all that later ticks put into it.
    fn memory(&self) -> Self::Memory {
        Self::Memory::default()
    }

    /// Whether `memory` can be one of this controller's, or has another shape: one that was restored may be forged.
    fn fits(&self, _memory: &Self::Memory) -> bool {
        true
    }

    /// The tick with number `tick` at `time` (s): the moment to hold until the next one, N m.
    fn update(
        &mut self,
        memory: &mut Self::Memory,
        tick: u64,
        time: f64,
        measured: &Measurement,
        reference: ReferenceAt,
    ) -> Vector3<f64>;
}
