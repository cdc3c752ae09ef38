//! Consistency of measurements with each other: the angles must move as the measured rates say.
//!
//! Faults of sensors need not show in one measurement. A measurement that is stuck, rates with a
//! bias or in wrong axes, and angles that lag behind contradict each other only after some time.
//! All windows of time that end at present are therefore examined, by cumulative sums (E. S. Page,
//! "Continuous inspection schemes", Biometrika 41 (1954)).

use crate::controller::{Explained, Measurement};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use vehicle::kinematics;

/// Tolerance for rounding, relative, and in rad or rad/s.
const ROUNDING: f64 = 1e-9;
const LEAST: f64 = 1e-12;
/// Number of ticks in a row with the measurement of the tick before that contradict a motion, and
/// rates (rad/s) above which there is one.
const REPEATED: u32 = 2;
const AT_REST: f64 = 1e-5;

/// Largest excess of the sum of steps, over any window that ends at present, beyond what is allowed
/// in it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Excess {
    up: Vector3<f64>,
    down: Vector3<f64>,
}

impl Excess {
    /// Adds a step, of which each component may be as large as `allowed`. Returns whether the sum
    /// of the steps in every window is at most `once` beyond the sum of what was allowed.
    ///
    /// An excess beyond `once` is not forgotten: the next step beyond what is allowed contradicts
    /// again.
    pub(crate) fn add(&mut self, step: &Vector3<f64>, allowed: &Vector3<f64>, once: f64) -> bool {
        let bound = once * (1.0 + ROUNDING) + LEAST;
        let mut keeps = true;
        for (sum, step) in [(&mut self.up, *step), (&mut self.down, -step)] {
            *sum = (*sum + step - allowed).map(|value| value.max(0.0));
            keeps &= sum.max() <= bound;
            sum.apply(|value| *value = value.min(bound));
        }
        keeps
    }
}

/// The last measurement, how often it has repeated, and the excess of the angles' changes beyond
/// those by the rates.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Consistency {
    last: Option<[Vector3<f64>; 2]>,
    repeated: u32,
    excess: Excess,
}

impl Consistency {
    /// Takes the measurement of a tick, one `period` (s) after the last. Returns whether its angles
    /// have moved as the rates say, as far as a law's assumptions explain a difference, and whether
    /// its numbers are not the same again while the vehicle moves.
    pub(crate) fn observe(
        &mut self,
        explained: &Explained,
        period: f64,
        measured: &Measurement,
    ) -> bool {
        if measured.stale || (measured.rates - measured.turn).norm() > explained.rate {
            *self = Self::default();
            return true;
        }
        let rates = kinematics::r(&measured.angles) * measured.rates;
        let Some([angles, before]) = self.last.replace([measured.angles, rates]) else {
            return true;
        };
        let step = measured.angles - angles - (before + rates) * (0.5 * period);
        let [at_rest, by_rates] = explained.motion;
        let allowed = at_rest + by_rates * before.norm().max(rates.norm());
        let is_same = measured.angles == angles && (rates - before).amax() <= LEAST;
        self.repeated = if is_same { self.repeated.saturating_add(1) } else { 0 };
        let is_alive = self.repeated < REPEATED || rates.amax() <= AT_REST;
        self.excess.add(&step, &Vector3::repeat(allowed), explained.angle) && is_alive
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Beyond what one difference may be, each further step beyond what is allowed contradicts, and
    /// only steps below it make up for the excess.
    #[test]
    fn an_excess_is_kept() {
        let step = |x: f64| Vector3::new(0.0, -x, 0.0);
        let mut excess = Excess::default();
        let mut add = |x: f64| excess.add(&step(x), &Vector3::repeat(1.0), 0.5);
        let expected = [(1.4, true), (1.2, false), (1.1, false), (0.9, true), (0.4, true)];
        for (x, keeps) in expected.into_iter().chain([(1.2, true), (1.5, false)]) {
            assert_eq!(add(x), keeps, "{x}");
        }
    }
}
