//! Estimate of the delay of the loop that a controller closes, from its commands and the measured
//! rates.
//!
//! With many importers nobody knows how long a loop takes from a measurement to the moment that
//! results from it. The measured rates show it: the angular acceleration over a period is I⁻¹ (m −
//! ω × I ω) with the moment m that acts then, plus a disturbance. For a delay of (j + f) τ, m is
//! the mean (1 − f) m_{k−1−j} + f m_{k−2−j} of two commands. The estimate is the delay with the
//! smallest residual in the least-squares sense: of the acceleration, if the disturbance is like
//! noise; of its first difference from period to period, if the disturbance seldom changes; or of
//! its second difference, if it changes smoothly. A common factor of the inertia error is estimated
//! with it. Periods that no delay explains, such as those in which the disturbance jumps, have a
//! smaller weight.
//!
//! This is a prediction-error method (L. Ljung, System Identification, 1999, section 13.4), which
//! may be used in a closed loop: at the right delay the residual is not correlated with any earlier
//! command. That is not so for noise of the measurements, to which the next command responds while
//! the noise itself looks like an acceleration, nor for a periodic disturbance. Where a law states
//! the acceleration that its assumptions explain, another delay is therefore reported only if the
//! measurements exceed it with the declared delay.

use crate::clone_in_place::clone_in_place;
use crate::controller::{Explained, Measurement};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use vehicle::dynamics::RigidBody;
use vehicle::kinematics;
use vehicle::math::exp;

/// Largest difference from the declared delay that can be found, in periods.
const FURTHER: usize = 4;
/// Time after which a period counts by 1/e, s.
const FORGETTING: f64 = 15.0;
/// Smallest evidence for an estimate: the residual of another delay beyond that of the estimated
/// one, relative to the mean square of a component.
const EVIDENCE: f64 = 20.0;
/// Shortest record for an estimate, s, and in periods; number of periods from one estimate to the
/// next.
const SHORTEST_RECORD: f64 = 1.0;
const PERIODS: u32 = 20;
const PAUSE: u32 = 5;
/// Parts of a period to which a delay is estimated.
const PARTS: usize = 4;
/// Difference from the declared delay up to which an estimate agrees with it, in periods.
const SLACK: f64 = 0.5;
/// Residual of a period with the best delay, relative to the root mean square, above which the
/// period has a smaller weight.
const USUAL: f64 = 3.0;
/// Acceleration that is too small to be evidence, because the model is not exact, rad/s².
const FLOOR: f64 = 1e-3;
/// Largest factor between the actual and the assumed inertia.
const GAIN: f64 = 1.25;

/// Estimate of the delay, with the sums from which it follows.
#[derive(Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct LoopDelay {
    /// Accelerations I⁻¹ m of the commands, the newest first, rad/s².
    commands: Vec<Vector3<f64>>,
    /// Measured rates at the last tick, rad/s.
    rates: Option<Vector3<f64>>,
    /// Accelerations over the last periods, the newest first, rad/s², and their number.
    accelerations: [Vector3<f64>; ORDERS],
    #[serde(rename = "known")]
    available: usize,
    /// Fits of the acceleration, and of its first and second differences.
    fits: [Fit; ORDERS],
    /// Number of periods in the fits.
    periods: u32,
    /// Number of further periods for which an unexplained acceleration is remembered.
    unexplained: u32,
    /// Whether the law's assumptions do not explain the acceleration over the last period.
    pub is_unexplained: bool,
    /// Estimated delay, s, if the measurements suffice for an estimate.
    pub estimate: Option<f64>,
    /// Whether it differs from the declared delay by more than half a period, and the law's
    /// assumptions do not explain the measurements with the declared delay.
    pub is_other: bool,
}

clone_in_place!([] LoopDelay { commands, fits });

/// Number of fits: of differences of order 0, 1 and 2.
const ORDERS: usize = 3;

/// Sums over the periods from which the residual of a delay follows; y is the acceleration or a
/// difference of it.
#[derive(Debug, Default, PartialEq, Serialize, Deserialize)]
struct Fit {
    /// Sum of y · y, (rad/s²)².
    square: f64,
    /// Sums for each whole number of periods of delay.
    sums: Vec<Sums>,
    /// Sum of the periods' weights.
    count: f64,
    /// Least mean square of a component, (rad/s²)²; zero before the first estimate.
    scale: f64,
}

clone_in_place!([] Fit { sums });

/// Sums of products of y, of the same u of the command after a whole number of periods of delay,
/// and of u⁺ after one period more, (rad/s²)².
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
struct Sums {
    /// Sum of y · u.
    explained: f64,
    /// Sum of u · u.
    square: f64,
    /// Sum of u · u⁺.
    product: f64,
}

/// Settings of the estimate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LoopDelaySettings {
    /// Model of the vehicle.
    pub body: RigidBody,
    /// Time between two ticks, s.
    pub period: f64,
    /// Declared delay, s.
    pub declared: f64,
    /// Acceleration that the law's assumptions explain with that delay, if it has any.
    pub explained: Option<Explained>,
    /// Whether measurements are old when they arrive. They come through a filter then, and their
    /// noise would be taken for a response: no estimate is made. The law's assumptions are checked
    /// nevertheless.
    pub is_filtered: bool,
}

impl LoopDelaySettings {
    /// Returns the smallest delay that is examined, in periods.
    fn first(&self) -> usize {
        ((self.declared / self.period) as usize).saturating_sub(FURTHER)
    }

    /// Returns the number of delays of whole periods that are examined.
    fn candidates(&self) -> usize {
        (self.declared / self.period).ceil() as usize + FURTHER + 1 - self.first()
    }

    /// Returns the declared delay beyond the smallest one that is examined, in periods.
    fn place(&self) -> f64 {
        self.declared / self.period - self.first() as f64
    }

    /// Returns the number of commands that are remembered.
    fn remembered(&self) -> usize {
        self.first() + self.candidates() + ORDERS - 1
    }

    /// Returns the memory for the first tick.
    pub fn memory(&self) -> LoopDelay {
        LoopDelay {
            commands: Vec::with_capacity(self.remembered()),
            fits: std::array::from_fn(|_| Fit::new(self.candidates())),
            ..LoopDelay::default()
        }
    }

    /// Returns whether a restored memory has the right shape.
    pub fn fits(&self, memory: &LoopDelay) -> bool {
        memory.commands.len() <= self.remembered()
            && memory.available <= ORDERS
            && memory.fits.iter().all(|fit| fit.sums.len() == self.candidates())
    }

    /// Takes the measured rates of a tick, before its command is known.
    pub fn observe(&self, memory: &mut LoopDelay, measured: &Measurement) {
        memory.is_unexplained = false;
        if measured.stale || measured.achieved_moment.is_some() {
            (memory.rates, memory.available) = (None, 0);
            return;
        }
        let Some(before) = memory.rates.replace(measured.rates) else { return };
        let Self { body, period, .. } = self;
        let mean = (before + measured.rates) * 0.5;
        memory.accelerations.rotate_right(1);
        memory.accelerations[0] =
            (measured.rates - before) / *period + body.inverse * mean.cross(&(body.inertia * mean));
        memory.available = ORDERS.min(memory.available + 1);
        // Before the first commands, the acting moment depends on the importer.
        if memory.available == ORDERS && memory.commands.len() == self.remembered() {
            memory.is_unexplained = self
                .explained
                .is_some_and(|explained| !self.explains(explained, memory, &measured.angles));
            memory.unexplained = if memory.is_unexplained {
                (FORGETTING / period) as u32
            } else {
                memory.unexplained.saturating_sub(1)
            };
            if !self.is_filtered {
                self.weigh(memory);
            }
        }
    }

    /// Returns whether the law's assumptions explain the acceleration over the last period with the
    /// declared delay.
    fn explains(&self, explained: Explained, memory: &LoopDelay, angles: &Vector3<f64>) -> bool {
        let Explained { disturbance, share, .. } = explained;
        let r = kinematics::r(angles);
        let command = self.command(memory);
        let (left, command) = (r * (memory.accelerations[0] - command), (r * command).abs());
        (0..3).all(|i| left[i].abs() <= disturbance + command[i] * share + FLOOR)
    }

    /// Returns the acceleration by the moment that acts over the last period with the declared
    /// delay, rad/s².
    fn command(&self, memory: &LoopDelay) -> Vector3<f64> {
        let commands = &memory.commands[self.first()..];
        let place = self.place();
        let j = (place as usize).min(self.candidates() - 2);
        let f = place - j as f64;
        commands[j] * (1.0 - f) + commands[j + 1] * f
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

    /// Replaces the newest command by the moment to which a limit reduces it, N m.
    pub fn limit(&self, memory: &mut LoopDelay, applied: &Vector3<f64>) {
        if let Some(newest) = memory.commands.first_mut() {
            *newest = self.body.inverse * applied;
        }
    }

    /// Adds the last period to the fits, and updates the estimate from time to time.
    fn weigh(&self, memory: &mut LoopDelay) {
        let retained = exp(-self.period / FORGETTING);
        let commands = &memory.commands[self.first()..];
        let best = memory.fits.iter().map(|fit| fit.scale).fold(f64::INFINITY, f64::min);
        for (order, fit) in memory.fits.iter_mut().enumerate() {
            // A memory that begins as the default one has no sums yet.
            fit.sums.resize(self.candidates(), Sums::default());
            let y = difference(order, &memory.accelerations);
            let weight = fit.add(retained, &y, |j| difference(order, &commands[j..]));
            if weight < 1.0 && fit.scale <= best {
                // A jump within a period shows in the next one too, when the law responds to it.
                memory.available = 0;
            }
        }
        memory.periods = memory.periods.saturating_add(1);
        let suffices =
            memory.periods >= PERIODS && f64::from(memory.periods) * self.period >= SHORTEST_RECORD;
        if suffices && memory.periods.is_multiple_of(PAUSE) {
            self.estimate(memory);
        }
    }

    fn estimate(&self, memory: &mut LoopDelay) {
        let places = memory.fits.each_mut().map(Fit::least);
        let declared = self.place();
        // Among fits with nearly the same residual, a smooth disturbance misleads that of the
        // highest difference least.
        let best = memory.fits.iter().zip(places).rev();
        let best = best.min_by(|(a, _), (b, _)| a.scale.total_cmp(&b.scale));
        let Some((fit, place)) = best else { return };
        let delay = (self.first() as f64 + place) * self.period;
        memory.estimate = fit.suffices(place, declared).then_some(delay);
        let is_other = memory.estimate.is_some() && (place - declared).abs() > SLACK;
        memory.is_other = is_other && (self.explained.is_none() || memory.unexplained > 0);
    }
}

/// Returns the difference of this order of the values, the newest of which come first.
fn difference(order: usize, values: &[Vector3<f64>]) -> Vector3<f64> {
    match order {
        0 => values[0],
        1 => values[0] - values[1],
        _ => values[0] - values[1] * 2.0 + values[2],
    }
}

impl Fit {
    fn new(candidates: usize) -> Self {
        Self { sums: vec![Sums::default(); candidates], ..Self::default() }
    }

    /// Adds a period with `y`; `command` returns u for a number of periods of delay. Earlier
    /// periods keep the weight `retained`. Returns the weight of the period, which is below 1 if no
    /// delay explains it.
    fn add(
        &mut self,
        retained: f64,
        y: &Vector3<f64>,
        command: impl Fn(usize) -> Vector3<f64>,
    ) -> f64 {
        let last = self.sums.len() - 1;
        let left = |j| (y - command(j)).norm_squared();
        let least = (0..=last).map(left).fold(f64::INFINITY, f64::min);
        let usual = USUAL * USUAL * 3.0 * self.scale;
        let weight = if self.scale > 0.0 && least > usual { usual / least } else { 1.0 };
        let mut present = command(0);
        for (j, sums) in self.sums.iter_mut().enumerate() {
            let next = command((j + 1).min(last));
            sums.explained = retained * sums.explained + weight * y.dot(&present);
            sums.square = retained * sums.square + weight * present.norm_squared();
            sums.product = retained * sums.product + weight * present.dot(&next);
            present = next;
        }
        self.square = retained * self.square + weight * y.norm_squared();
        self.count = retained * self.count + weight;
        weight
    }

    /// Returns the delay with the smallest residual, in periods from the first on.
    fn least(&mut self) -> f64 {
        let places = (0..=(self.sums.len() - 1) * PARTS).map(|part| part as f64 / PARTS as f64);
        let candidates = places.map(|place| (place, self.unexplained(place)));
        let (place, least) = candidates
            .fold((0.0, f64::INFINITY), |least, one| if one.1 < least.1 { one } else { least });
        self.scale = (least / (3.0 * self.count)).max(FLOOR * FLOOR);
        place
    }

    /// Returns whether the evidence suffices to prefer `place`, which has the smallest residual, to
    /// the `declared` delay, or to a delay that differs by a period; all in periods. The commands
    /// must also explain a part of y, which they do not while the vehicle is at rest.
    fn suffices(&self, place: f64, declared: f64) -> bool {
        let least = self.unexplained(place);
        let is_evidence = |left: f64| left - least > EVIDENCE * self.scale;
        let against = |other: f64| is_evidence(self.unexplained(other));
        if !is_evidence(self.square) {
            return false;
        }
        if (place - declared).abs() > SLACK {
            return against(declared);
        }
        against(place + 1.0) && (place < 1.0 || against(place - 1.0))
    }

    /// Returns the sum of the squared residuals for a delay of this many periods, with the factor
    /// of the inertia that fits best, (rad/s²)².
    fn unexplained(&self, place: f64) -> f64 {
        let j = (place as usize).min(self.sums.len() - 2);
        let f = (place - j as f64).min(1.0);
        let (lower, upper) = (&self.sums[j], &self.sums[j + 1]);
        let explained = (1.0 - f) * lower.explained + f * upper.explained;
        let square = (1.0 - f) * (1.0 - f) * lower.square
            + 2.0 * f * (1.0 - f) * lower.product
            + f * f * upper.square;
        let gain = if square > 0.0 { explained / square } else { 1.0 };
        let gain = gain.clamp(1.0 / GAIN, GAIN);
        self.square - gain * (2.0 * explained - gain * square)
    }
}
