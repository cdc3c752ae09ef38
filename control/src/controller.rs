//! What every controller is: a function of memory, tick and measurement.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize, de::DeserializeOwned};
use vehicle::reference::{Profile, Reference};

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

/// What is known of the reference at a tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Preview<'a> {
    /// All of it, which does not change during an experiment.
    Profile(&'a Profile),
    /// The reference that is given from outside, valid until a time (s). Of what follows nothing is known: its angles are taken to stay.
    External(Reference, f64),
}

impl Preview<'_> {
    /// The reference at `time` (s).
    pub fn at(&self, time: f64) -> Reference {
        match self {
            Self::Profile(profile) => profile.at(time),
            Self::External(reference, until) if time <= *until => *reference,
            Self::External(reference, _) => Reference { angles: reference.angles, ..Reference::default() },
        }
    }

    /// The part of it that may change during an experiment.
    pub(crate) fn external(&self) -> Option<Reference> {
        match self {
            Self::Profile(_) => None,
            Self::External(reference, _) => Some(*reference),
        }
    }
}

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
