//! Navigation of an entry flight: strapdown of the inertial sensors, and a Kalman filter that
//! corrects it by fixes of satellite navigation and star tracker, finds the wind by the side force,
//! and keeps the altitude by the drag while there are no fixes.
//!
//! The shown state follows the filter's in a smooth way: a correction is blended in over seconds,
//! so that controllers see an error that drifts instead of one that jumps.

mod air;
mod device;
mod filter;
mod line;
mod running;
mod settings;
mod shown;
mod strapdown;

pub use device::Navigation;
pub use filter::{Covariance, Error, STATES};
pub use line::{Health, Line};
pub use settings::{Alignment, Drag, Errors, Fix, Initial, Settings, Trust, Wind};
pub use shown::{Deviations, Shown};
pub use strapdown::State;

use nalgebra::Vector3;
use running::Running;
use serde::{Deserialize, Serialize};
use strapdown::Felt;
use vehicle::frames::Place;
use vehicle::math::exp;

/// Time without a sample from which the navigation is lost, s.
const LOST_AFTER: f64 = 0.5;
/// Average of the squares of the normalised innovations from which the filter is inconsistent.
const INCONSISTENT: f64 = 3.0;

/// State that is carried from tick to tick.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Memory {
    running: Option<Running>,
    /// What is shown.
    pub shown: Shown,
    /// Health of the navigation.
    pub health: Health,
    /// Number of samples that never arrived.
    pub missed: u32,
}

impl Navigation {
    /// Returns the memory before the first sample, which shows the initial state.
    pub fn memory(&self) -> Memory {
        let Settings { planet, initial, .. } = &self.settings;
        let place = Place::of(planet, &initial.start.motion(), &initial.angles, 0.0);
        let state = State::at(planet, &place, 0.0);
        let mut memory = Memory::default();
        memory.shown.angles = initial.angles;
        self.show(&mut memory.shown, (0.0, &state), &Felt::default(), [0.0; 2]);
        memory
    }

    /// Takes what has arrived at `time` (s), and shows the state then. Samples without numbers are
    /// taken as those of the instant.
    pub fn update(&self, memory: &mut Memory, time: f64, line: &Line) {
        let mut line = *line;
        let is_counted = line.sample > 0;
        if !is_counted {
            if line.rate == Vector3::zeros() && line.force == Vector3::zeros() {
                return;
            }
            line.time = time;
        }
        let running = match &mut memory.running {
            None => memory.running.insert(self.begin(&line)),
            Some(running) => {
                if !is_counted || line.sample > running.last.sample {
                    let passed = line.sample.saturating_sub(running.last.sample);
                    memory.missed += u32::try_from(passed - 1).unwrap_or(0);
                    self.take(running, &line);
                }
                running
            }
        };
        let felt = running.felt(&running.last);
        let (state, wind, unbiased) = running.blended();
        let age = (time - running.last.time).max(0.0);
        let (state, _) = state.after(&self.settings.planet, age, &felt, &felt);
        memory.shown.deviations = running.deviations;
        memory.shown.innovations = running.innovations;
        memory.shown.biases = running.biases;
        memory.shown.drag_ratio = exp(running.drag);
        memory.shown.rejected = running.rejected;
        let felt = Felt { rate: felt.rate + unbiased[0], force: felt.force + unbiased[1] };
        self.show(&mut memory.shown, (time, &state), &felt, wind);
        memory.health = self.health(running, time);
    }

    fn health(&self, running: &Running, time: f64) -> Health {
        let Trust { deviation, after } = self.settings.health;
        if time - running.last.time > LOST_AFTER {
            Health::Lost
        } else if running.average > INCONSISTENT {
            Health::Inconsistent
        } else if running.deviations.angles.max() > deviation {
            Health::Degraded
        } else if time - running.fixed > after {
            Health::Bridging
        } else {
            Health::Aided
        }
    }

    /// Returns the covariance of the filter's error, and the error itself, given the true place at
    /// the time of the last sample and the true wind (m/s); for studies and tests.
    pub fn error(
        &self,
        memory: &Memory,
        truth: &Place,
        wind: [f64; 2],
    ) -> Option<(Error, Covariance)> {
        let running = memory.running.as_ref()?;
        Some((self.error_of(running, truth, wind), running.covariance))
    }
}
