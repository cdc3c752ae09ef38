//! Detection of measurements that have stopped changing.

use crate::controller::Measurement;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

/// Number of ticks with the same measurement after which it counts as frozen.
const TICKS: u32 = 3;
/// Rates below which a measurement may repeat, because the vehicle is at rest, rad/s.
const AT_REST: f64 = 1e-5;
/// Largest difference between equal rates, which may have passed through other axes, rad/s.
const ROUNDING: f64 = 1e-14;

/// The last measurement, and how often it has repeated.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Frozen {
    last: Option<[Vector3<f64>; 2]>,
    ticks: u32,
}

impl Frozen {
    /// Takes the measurement of a tick. Returns whether angles and rates have been the same at
    /// three ticks, although the vehicle moves. Sensors do not give the same six numbers again.
    pub(crate) fn observe(&mut self, measured: &Measurement) -> bool {
        if measured.stale {
            return false;
        }
        let rates = measured.rates - measured.turn;
        let now = [measured.angles, rates];
        let is_same = self.last.is_some_and(|[angles, before]| {
            angles == measured.angles && (rates - before).amax() <= ROUNDING
        });
        self.ticks = if is_same { self.ticks.saturating_add(1) } else { 1 };
        self.last = Some(now);
        self.ticks >= TICKS && measured.rates.amax() > AT_REST
    }
}
