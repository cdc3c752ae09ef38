//! Estimate of the delay of a controller's own loop, from its commands and the measured rates.
//!
//! In many tools nobody knows how long a loop takes from a measurement to the moment that results
//! from it. The vehicle shows it: its angular acceleration over a period is I⁻¹ (m − ω × I ω) with
//! the moment m that acts then, and a disturbance. For a delay of (j + f) τ, m is the mean
//! (1 − f) m_{k−1−j} + f m_{k−2−j} of two commands. The estimate is the delay that leaves least
//! unexplained, by least squares: of the acceleration, if the disturbance is like noise, or of its
//! change from period to period, if it seldom changes. Periods that no delay explains, such as those
//! in which the disturbance jumps, count less.
//!
//! This is a prediction-error method (L. Ljung, System Identification, 1999, section 13.4), which
//! may be used in a closed loop: at the right delay, what is left is new, and no earlier command is
//! related to it.

use crate::controller::Measurement;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use vehicle::dynamics::RigidBody;
use vehicle::math::exp;

/// Number of periods by which a delay may differ from the one that was told to be found.
const FURTHER: usize = 4;
/// Time after which a period counts by 1/e, s.
const FORGETTING: f64 = 15.0;
/// Smallest evidence for an estimate: what another delay leaves unexplained beyond what the
/// estimated one does, relative to the mean square of a component.
const EVIDENCE: f64 = 20.0;
/// Smallest number of periods for an estimate.
const PERIODS: f64 = 20.0;
/// Size of what the best delay leaves of a period, relative to the root mean square, beyond which
/// the period counts less.
const USUAL: f64 = 3.0;

/// Estimate of the delay, with the sums from which it follows.
#[derive(Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct LoopDelay {
    /// Accelerations I⁻¹ m of the commands, the newest first, rad/s².
    commands: Vec<Vector3<f64>>,
    /// Measured rates at the last tick, rad/s, and acceleration over the period before it, rad/s².
    rates: Option<Vector3<f64>>,
    acceleration: Option<Vector3<f64>>,
    /// What is left of the acceleration, and of its change.
    of_acceleration: Fit,
    of_change: Fit,
    /// Estimated delay, s, if the motion tells it.
    pub estimate: Option<f64>,
    /// Whether it differs from the delay that was told by more than half a period.
    pub is_other: bool,
}

/// Sums over the periods of what each whole number of periods of delay leaves unexplained.
#[derive(Debug, Default, PartialEq, Serialize, Deserialize)]
struct Fit {
    sums: Vec<Sums>,
    /// Sum of the periods' weights.
    count: f64,
    /// Least mean square of a component, (rad/s²)²; zero before the first estimate.
    scale: f64,
}

/// Sums of products of r, which a delay of a whole number of periods leaves, and r⁺, which one
/// period more leaves, (rad/s²)².
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
struct Sums {
    /// Sum of r · r.
    square: f64,
    /// Sum of r · r⁺.
    product: f64,
}

/// What the estimate is made with.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LoopDelaySettings {
    /// Model of the vehicle.
    pub body: RigidBody,
    /// Time between two ticks, s.
    pub period: f64,
    /// Delay that was told, s.
    pub told: f64,
}

impl LoopDelaySettings {
    /// Returns the least delay that is compared with the one that was told, in periods.
    fn first(&self) -> usize {
        ((self.told / self.period) as usize).saturating_sub(FURTHER)
    }

    /// Returns the number of delays of whole periods that are compared.
    fn candidates(&self) -> usize {
        (self.told / self.period).ceil() as usize + FURTHER - self.first()
    }

    /// Returns the number of commands that are remembered.
    fn remembered(&self) -> usize {
        self.first() + self.candidates() + 1
    }

    /// Returns the memory for the first tick.
    pub fn memory(&self) -> LoopDelay {
        let candidates = self.candidates();
        LoopDelay {
            commands: Vec::with_capacity(self.remembered()),
            of_acceleration: Fit::new(candidates),
            of_change: Fit::new(candidates),
            ..LoopDelay::default()
        }
    }

    /// Returns whether a restored memory has the right shape.
    pub fn fits(&self, memory: &LoopDelay) -> bool {
        let candidates = self.candidates();
        memory.commands.len() <= self.remembered()
            && [&memory.of_acceleration, &memory.of_change]
                .iter()
                .all(|fit| fit.sums.len() == candidates)
    }

    /// Takes the measured rates of a tick, before its command is known.
    pub fn observe(&self, memory: &mut LoopDelay, measured: &Measurement) {
        if measured.stale || measured.achieved_moment.is_some() {
            (memory.rates, memory.acceleration) = (None, None);
            return;
        }
        let before = memory.rates.replace(measured.rates);
        let acceleration = before.map(|before| {
            let Self { body, period, .. } = self;
            let mean = (before + measured.rates) * 0.5;
            (measured.rates - before) / *period + body.inverse * mean.cross(&(body.inertia * mean))
        });
        let last = std::mem::replace(&mut memory.acceleration, acceleration);
        // Before the first commands, importers differ in what acts.
        let is_full = memory.commands.len() == self.remembered();
        if let (true, Some(now), Some(last)) = (is_full, acceleration, last) {
            self.weigh(memory, &now, &last);
        }
    }

    /// Takes the command of the tick that was observed last, N m.
    pub fn remember(&self, memory: &mut LoopDelay, command: &Vector3<f64>) {
        let commands = &mut memory.commands;
        if commands.len() < self.remembered() {
            commands.push(Vector3::zeros());
        }
        commands.rotate_right(1);
        commands[0] = self.body.inverse * command;
    }

    /// Replaces the newest command by the moment that a limit leaves of it, N m.
    pub fn limit(&self, memory: &mut LoopDelay, applied: &Vector3<f64>) {
        if let Some(newest) = memory.commands.first_mut() {
            *newest = self.body.inverse * applied;
        }
    }

    /// Adds the period with the acceleration `now`, after one with the acceleration `last`, rad/s².
    fn weigh(&self, memory: &mut LoopDelay, now: &Vector3<f64>, last: &Vector3<f64>) {
        let kept = exp(-self.period / FORGETTING);
        let LoopDelay { commands, of_acceleration, of_change, .. } = memory;
        let (commands, change) = (&commands[self.first()..], now - last);
        of_acceleration.add(kept, |j| now - commands[j]);
        of_change.add(kept, |j| change - (commands[j] - commands[j + 1]));
        let (best, best_of_change) = (of_acceleration.least(), of_change.least());
        let (fit, (place, _)) = if best.1 <= best_of_change.1 {
            (of_acceleration, best)
        } else {
            (of_change, best_of_change)
        };
        let told = self.told / self.period - self.first() as f64;
        let delay = (self.first() as f64 + place) * self.period;
        memory.estimate = fit.tells(place, told).then_some(delay);
        memory.is_other = memory.estimate.is_some() && (place - told).abs() > 0.5;
    }
}

impl Fit {
    fn new(candidates: usize) -> Self {
        Self { sums: vec![Sums::default(); candidates], ..Self::default() }
    }

    /// Adds a period; `left` returns what `j` periods of delay leave of it. Earlier periods are
    /// `kept` by this share.
    fn add(&mut self, kept: f64, left: impl Fn(usize) -> Vector3<f64>) {
        let last = self.sums.len() - 1;
        let least = (0..=last).map(|j| left(j).norm_squared()).fold(f64::INFINITY, f64::min);
        let usual = USUAL * USUAL * 3.0 * self.scale;
        let weight = if self.scale > 0.0 && least > usual { usual / least } else { 1.0 };
        let mut here = left(0);
        for (j, sums) in self.sums.iter_mut().enumerate() {
            let next = left((j + 1).min(last));
            sums.square = kept * sums.square + weight * here.norm_squared();
            sums.product = kept * sums.product + weight * here.dot(&next);
            here = next;
        }
        self.count = kept * self.count + weight;
    }

    /// Returns the number of periods of delay, from the first on, that leaves least, and the mean square of a component
    /// of what it leaves, (rad/s²)².
    fn least(&mut self) -> (f64, f64) {
        let (mut place, mut least) = (0.0, f64::INFINITY);
        for (j, pair) in self.sums.windows(2).enumerate() {
            let (here, both, next) = (pair[0].square, pair[0].product, pair[1].square);
            let curvature = here - 2.0 * both + next;
            let f = if curvature > 0.0 { ((here - both) / curvature).clamp(0.0, 1.0) } else { 0.0 };
            let left = self.unexplained(j as f64 + f);
            if left < least {
                (place, least) = (j as f64 + f, left);
            }
        }
        let mean = least / (3.0 * self.count);
        if self.count >= PERIODS {
            self.scale = mean;
        }
        (place, mean)
    }

    /// Returns whether the evidence suffices to prefer `place`, which leaves least, to the delay
    /// that was `told`, or to any other by a period; all in periods.
    fn tells(&self, place: f64, told: f64) -> bool {
        let least = self.unexplained(place);
        let against =
            |other: f64| (self.unexplained(other) - least) * 3.0 * self.count > EVIDENCE * least;
        if self.count < PERIODS {
            return false;
        }
        if (place - told).abs() > 0.5 {
            return against(told);
        }
        against(place + 1.0) && (place < 1.0 || against(place - 1.0))
    }

    /// Returns the sum of the squares that a delay of this many periods leaves, (rad/s²)².
    fn unexplained(&self, place: f64) -> f64 {
        let j = (place as usize).min(self.sums.len() - 2);
        let f = (place - j as f64).min(1.0);
        let (here, next) = (&self.sums[j], &self.sums[j + 1]);
        (1.0 - f) * (1.0 - f) * here.square
            + 2.0 * f * (1.0 - f) * here.product
            + f * f * next.square
    }
}

impl Clone for Fit {
    fn clone(&self) -> Self {
        Self { sums: self.sums.clone(), ..*self }
    }

    fn clone_from(&mut self, source: &Self) {
        self.sums.clone_from(&source.sums);
        (self.count, self.scale) = (source.count, source.scale);
    }
}

impl Clone for LoopDelay {
    fn clone(&self) -> Self {
        let mut clone = Self::default();
        clone.clone_from(self);
        clone
    }

    // The derived version would allocate at every tick.
    fn clone_from(&mut self, source: &Self) {
        let Self { commands, rates, acceleration, of_acceleration, of_change, estimate, is_other } =
            source;
        self.commands.clone_from(commands);
        self.of_acceleration.clone_from(of_acceleration);
        self.of_change.clone_from(of_change);
        (self.rates, self.acceleration) = (*rates, *acceleration);
        (self.estimate, self.is_other) = (*estimate, *is_other);
    }
}
