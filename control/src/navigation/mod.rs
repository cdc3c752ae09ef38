//! Navigation of an entry flight: strapdown of the inertial sensors, and a Kalman filter that
//! corrects it by fixes of satellite navigation and star tracker, finds the wind by the side force,
//! and keeps the altitude by the drag while there are no fixes. Measurements that contradict each
//! other are refused, and where they contradict the filter, it begins anew.
//!
//! The shown state follows the filter's in a smooth way: a correction is blended in over seconds,
//! so that controllers see an error that drifts instead of one that jumps.

mod air;
mod device;
mod filter;
mod history;
mod judge;
mod line;
mod running;
mod settings;
mod shown;
mod strapdown;
mod watch;

pub use device::Navigation;
pub use filter::{Covariance, Error, STATES};
pub use line::{Contradiction, Health, Line};
pub use settings::{Alignment, Drag, Errors, Fix, Guarded, Initial, Settings, Wind};
pub use shown::{Deviations, Protection, Shown};
pub use strapdown::State;

use running::{Running, UNSEEN_AFTER};
use serde::{Deserialize, Serialize};
use strapdown::Felt;
use vehicle::fixes::Fixes;
use vehicle::frames::Place;
use vehicle::math::exp;

/// Longest time over which the motion is shown without a sample, s.
const LONGEST: f64 = 60.0;

/// State that is carried from tick to tick.
#[derive(Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Memory {
    /// Time of the first tick, at which the state is the initial one, s.
    start: Option<f64>,
    /// State once a sample has arrived, apart from the rest because a caller's stack may be small.
    running: Box<Option<Running>>,
    /// What is shown.
    pub shown: Shown,
    /// Health of the navigation.
    pub health: Health,
    /// What contradicts what the navigation expects.
    pub contradiction: Contradiction,
    /// Number of samples that never arrived.
    pub missed: u32,
}

impl Clone for Memory {
    fn clone(&self) -> Self {
        Self { running: self.running.clone(), ..*self }
    }

    /// Copies a memory without allocation, as at every tick.
    fn clone_from(&mut self, source: &Self) {
        let Self { start, running, shown, health, contradiction, missed } = self;
        *start = source.start;
        running.clone_from(&source.running);
        *shown = source.shown;
        (*health, *contradiction, *missed) = (source.health, source.contradiction, source.missed);
    }
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
        memory.shown.protection = self.unprotected();
        memory
    }

    /// Takes what has arrived at `time` (s), and shows the state then. Samples without numbers are
    /// taken as those of the instant.
    pub fn update(&self, memory: &mut Memory, time: f64, line: &Line) {
        let mut line = *line;
        line.time = if line.sample > 0 { line.time.min(time) } else { time };
        let start = *memory.start.get_or_insert(time);
        match &mut *memory.running {
            Some(running) => {
                if let Some(missed) = running.succeeds(&mut line, time, self.settings.period) {
                    memory.missed = memory.missed.saturating_add(missed);
                    self.take(running, &line);
                }
            }
            begun if line.is_plausible() => self.begin_in(begun, start, &line),
            _ => return,
        }
        self.present(memory, time);
    }

    /// Begins at the start with the first line, which may come later. A frame of its own keeps the
    /// stack of an update small.
    #[inline(never)]
    fn begin_in(&self, begun: &mut Option<Running>, start: f64, line: &Line) {
        let is_late = line.time > start;
        let fixes = if is_late { Fixes::default() } else { line.fixes };
        let running = begun.insert(self.begin(&Line { time: start, fixes, ..*line }));
        if is_late {
            self.take(running, line);
        }
    }

    /// Shows the state at `time` (s), in a frame of its own as well.
    #[inline(never)]
    fn present(&self, memory: &mut Memory, time: f64) {
        let Some(running) = &*memory.running else { return };
        let felt = running.felt(&running.last);
        let (state, wind, unbiased) = running.blended();
        let age = (time - running.last.time).clamp(0.0, LONGEST);
        let (state, _) = state.after(&self.settings.planet, age, &felt, &felt);
        let mut shown = memory.shown;
        shown.deviations = self.deviations((time, &state), wind, &running.shown_covariance(age));
        shown.innovations = running.innovations;
        shown.biases = running.biases;
        shown.drag_ratio = exp(running.drag);
        shown.rejected = running.rejected;
        let felt = Felt { rate: felt.rate + unbiased[0], force: felt.force + unbiased[1] };
        self.show(&mut shown, (time, &state), &felt, wind);
        (memory.health, memory.contradiction) = self.health(running, time, &shown.deviations);
        shown.protection = self.protection(&shown.deviations, running.hidden, memory.health);
        if shown.is_finite() {
            memory.shown = shown;
        } else {
            memory.health = Health::Lost;
            memory.shown.protection = self.unprotected();
        }
    }

    fn health(
        &self,
        running: &Running,
        time: f64,
        deviations: &Deviations,
    ) -> (Health, Contradiction) {
        let (contradiction, of_filter) = self.contradiction(running, time);
        let health = if time - running.last.time > UNSEEN_AFTER {
            Health::Lost
        } else if contradiction != Contradiction::None {
            if of_filter { Health::Inconsistent } else { Health::Suspect }
        } else if deviations.angles.max() > self.settings.degraded {
            Health::Degraded
        } else if time - running.fixed > self.settings.bridging {
            Health::Bridging
        } else {
            Health::Aided
        };
        (health, contradiction)
    }

    /// Returns the covariance of the filter's error, and the error itself, given the true place at
    /// the time of the last sample and the true wind (m/s); for studies and tests.
    pub fn error(
        &self,
        memory: &Memory,
        truth: &Place,
        wind: [f64; 2],
    ) -> Option<(Error, Covariance)> {
        let running = memory.running.as_ref().as_ref()?;
        Some((self.error_of(running, truth, wind), running.covariance))
    }
}
