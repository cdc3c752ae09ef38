//! Gyroscope, accelerometer and magnetometer, which are sampled together, and the serial line that
//! transmits their samples.
//!
//! Samples are taken at the ticks start + k · period and arrive a fixed delay later. A sample is
//! evaluated from the state committed before its tick, so it can be evaluated again at the same
//! tick. It is committed when time moves on.

use crate::axes::AXES;
use crate::error::{Error, positive};
use crate::fault::FaultKind;
use crate::fixes::{Devices, Fixes};
use crate::frames;
use crate::noise::{normal_pair, uniform};
use crate::platform::Readings;
use crate::time::{check_resolution, tick, tick_time, tick_tolerance};
use crate::triad::{Draws, Memory, Triad, Window};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use settings::{Declared, Entry};
use std::ops::{Deref, DerefMut};

/// Largest number of samples that may be on their way at a time.
pub const IN_FLIGHT: usize = 1000;

/// One value for each sensor: gyroscope, accelerometer, magnetometer.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Declared)]
pub struct PerSensor<T>(
    #[setting(text = "{}", each = SENSORS, units = UNITS, nominals = NOMINALS)] pub [T; 3],
);

/// Units of what each sensor measures.
const UNITS: [&str; 3] = ["rad/s", "m/s2", "T"];
/// Typical magnitudes of what each sensor measures.
const NOMINALS: [f64; 3] = [0.05, 10.0, 5e-5];
/// Endings of names, and names of the sensors.
const SENSORS: [Entry; 3] = [
    (".gyroscope", "gyroscope"),
    (".accelerometer", "accelerometer"),
    (".magnetometer", "magnetometer"),
];

impl<T> PerSensor<T> {
    /// Returns the values, each with the name of its sensor.
    pub fn named(&self) -> impl Iterator<Item = (&'static str, &T)> {
        SENSORS.iter().map(|sensor| sensor.1).zip(&self.0)
    }
}

impl<T> Deref for PerSensor<T> {
    type Target = [T; 3];
    fn deref(&self) -> &[T; 3] {
        &self.0
    }
}

impl<T> DerefMut for PerSensor<T> {
    fn deref_mut(&mut self) -> &mut [T; 3] {
        &mut self.0
    }
}

/// Configuration of the three sensors and their line.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Config {
    /// Errors of gyroscope (rad/s), accelerometer (m/s²) and magnetometer (T).
    pub triads: PerSensor<Triad>,
    /// Timing and drops of the serial line.
    pub line: Line,
    /// Satellite navigation and star tracker of an entry flight.
    pub devices: Devices,
    /// Seed of the random noise and drops.
    pub seed: u64,
}

/// Serial line: when samples are taken, when they arrive, and which are dropped.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Declared)]
pub struct Line {
    /// Sampling period of the sensors.
    #[setting(unit = "s", min = 1e-4, nominal = 0.01, used_with = "sensor.set >= 1")]
    pub period: f64,
    /// Delay between taking a sample and receiving it.
    #[setting(unit = "s", min = 0.0, max = 10.0, nominal = 0.01, used_with = "sensor.set >= 1")]
    pub delay: f64,
    /// Probability that a sample is dropped in transmission.
    ///
    /// It is dropped if it is taken within `drop_window`.
    #[setting(name = "drop.probability", min = 0.0, max = 1.0, nominal = 1.0)]
    #[setting(used_with = "sensor.set >= 1")]
    pub drop_probability: f64,
    /// Time window in which samples can be dropped.
    #[setting(name = "drop", used_with = "sensor.set >= 1 and sensor.drop.probability > 0")]
    pub drop_window: Window,
}

/// Instant at which a sample is taken.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Instant {
    /// Number of the tick, counted from 0.
    pub tick: i64,
    /// Time by the clock of the line, s.
    pub time: f64,
}

/// Sample of the three sensors as it arrives.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Declared)]
pub struct Sample {
    /// Readings of the three sensors, with their errors.
    #[setting(name = "measured", text = "{}", each = READINGS, columns = AXES)]
    #[setting(units = UNITS, nominals = NOMINALS)]
    pub readings: Readings,
    /// Time at which the latest received sample was taken.
    #[setting(name = "measured.time", unit = "s", nominal = 1.0, depends_on = [])]
    pub time: f64,
    /// Number of the latest received sample, counted from 1; 0 before the first.
    #[setting(name = "measured.sample", min = 0, depends_on = [])]
    pub number: i32,
    /// Latest fixes, if there is an entry flight.
    #[setting(name = "", discrete, depends_on = [])]
    pub fixes: Fixes,
}

const READINGS: [Entry; 3] = [
    (".gyroscope", "Gyroscope reading of the angular rate about the {}"),
    (".accelerometer", "Accelerometer reading of the specific force along the {}"),
    (".magnetometer", "Magnetometer reading of the magnetic field along the {}"),
];

/// What the sensors would measure without errors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Felt {
    /// Readings of the three sensors.
    pub readings: Readings,
    /// Position, velocity and attitude, and the altitude (m), of an entry flight.
    pub place: Option<(frames::Place, f64)>,
}

impl From<&Readings> for Felt {
    fn from(readings: &Readings) -> Self {
        Self { readings: *readings, place: None }
    }
}

/// Sample that was taken, whether or not it has arrived.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct Taken {
    at: Instant,
    /// Number and time that are given with it, s.
    number: i64,
    stamp: f64,
    memories: [Memory; 3],
    /// Latest fixes that were taken, and those that have arrived.
    seen: Fixes,
    fixes: Fixes,
    dropped: bool,
}

impl Taken {
    fn sample(&self) -> Sample {
        let number = i32::try_from(self.number).unwrap_or(i32::MAX);
        let readings = self.memories.map(|memory| memory.value);
        Sample { number, time: self.stamp, readings, fixes: self.fixes }
    }
}

/// The three sensors with their state.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Sensors {
    config: Config,
    start: f64,
    /// Sample of the tick before the last one.
    before: Option<Taken>,
    /// Sample of the last tick.
    last: Option<Taken>,
    /// Samples on their way, indexed by tick modulo length.
    line: Vec<Option<Taken>>,
    /// Newest sample that has arrived.
    arrived: Sample,
}

impl Config {
    fn check(&self) -> Result<(), Error> {
        let refuse = |name: &'static str, problem: String| Err(Error::parameter(name, problem));
        let Line { period, delay, drop_probability, .. } = self.line;
        positive("sensor.period", period, " s")?;
        if !(delay >= 0.0 && delay / period <= IN_FLIGHT as f64) {
            let problem =
                format!("= {delay} s must lie between 0 and {IN_FLIGHT} times sensor.period");
            return refuse("sensor.delay", problem);
        }
        if !(0.0..=1.0).contains(&drop_probability) {
            let problem = format!("= {drop_probability} must lie between 0 and 1");
            return refuse("sensor.drop.probability", problem);
        }
        let check = |(name, triad): (&str, &Triad)| triad.check(&format!("sensor.{name}"));
        self.triads.named().try_for_each(check)?;
        self.devices.check()
    }

    /// Draws the normal numbers of the three sensors at a tick, and a random number in [0, 1) that
    /// decides whether its sample is dropped.
    fn draw(&self, tick: i64) -> ([Draws; 3], f64) {
        // The inverted seed gives another sequence than that of a disturbance with the same seed.
        let [a, b, c, d, e, f, g, h, i, j, chance] = uniform(!self.seed, tick);
        let [first, second, third, fourth, fifth] =
            [[a, b], [c, d], [e, f], [g, h], [i, j]].map(normal_pair);
        let noise = [
            Vector3::new(first[0], first[1], second[0]),
            Vector3::new(second[1], third[0], third[1]),
            Vector3::new(fourth[0], fourth[1], fifth[0]),
        ];
        let wander = self.wander(tick);
        let draws = std::array::from_fn(|i| Draws { noise: noise[i], wander: wander[i] });
        (draws, f64::midpoint(chance, 1.0))
    }

    /// Draws the normal numbers of the wandering biases at a tick, if there are any.
    fn wander(&self, tick: i64) -> [Vector3<f64>; 3] {
        if self.triads.iter().all(|triad| triad.instability == 0.0) {
            return [Vector3::zeros(); 3];
        }
        let [a, b, c, d, e, f, g, h, i, j] = uniform(self.seed.rotate_left(16) ^ 0x7761_6e64, tick);
        let pairs = [[a, b], [c, d], [e, f], [g, h], [i, j]].map(normal_pair);
        let each = |k: usize| pairs[k / 2][k % 2];
        std::array::from_fn(|i| Vector3::from_fn(|axis, _| each(3 * i + axis)))
    }
}

impl Sensors {
    /// Makes the sensors in the state before their first sample, which is taken at `start` (s).
    ///
    /// # Errors
    /// Names the value of the configuration that is out of range.
    pub fn new(config: &Config, start: f64) -> Result<Self, Error> {
        config.check()?;
        check_resolution(start, config.line.period)?;
        let late =
            config.devices.inertial.of(FaultKind::Late, config.devices.inertial.window.start);
        let length = ((config.line.delay + late) / config.line.period) as usize + 2;
        let arrived = Sample { time: start, ..Sample::default() };
        Ok(Self {
            config: *config,
            start,
            before: None,
            last: None,
            line: vec![None; length],
            arrived,
        })
    }

    /// Whether both have the same configuration and start time.
    pub(crate) fn same_configuration(&self, other: &Self) -> bool {
        self.config == other.config
            && self.start == other.start
            && self.line.len() == other.line.len()
    }

    /// Whether restored sensors are possible at `time` (s), which means that none of their samples
    /// lies in the future. A step that has `failed` may have gone beyond `time`.
    pub(crate) fn fits(&self, time: f64, failed: bool) -> bool {
        let latest = if failed { i64::MAX / 2 } else { self.tick_at(time) };
        let past = |taken: &Taken| {
            (0..=latest).contains(&taken.at.tick) && (taken.at.time + taken.stamp).is_finite()
        };
        check_resolution(time, self.config.line.period).is_ok()
            && self.before.iter().chain(&self.last).chain(self.line.iter().flatten()).all(past)
            && self.arrived.time.is_finite()
    }

    fn tick_at(&self, time: f64) -> i64 {
        tick(time, self.start, self.config.line.period)
    }

    /// First time (s) after `time` at which a sample is taken.
    pub fn next_sample(&self, time: f64) -> f64 {
        tick_time(self.tick_at(time) + 1, self.start, self.config.line.period)
    }

    /// First time (s) after `time` at which a sample is taken or arrives.
    pub fn next_event(&self, time: f64) -> f64 {
        let arrival = tick_time(self.tick_arrived(time) + 1, self.start, self.config.line.period);
        self.next_sample(time).min(arrival.max(self.start) + self.config.line.delay)
    }

    /// Last tick whose sample has had the time to arrive by `time` (s).
    fn tick_arrived(&self, time: f64) -> i64 {
        let Line { period, delay, .. } = self.config.line;
        let delay = delay + self.config.devices.inertial.of(FaultKind::Late, time);
        ((time - delay - self.start + tick_tolerance(time, period)) / period).floor() as i64
    }

    /// Instant of the sample that is due at `time` (s), or `None` if the sample of the present tick
    /// was taken at an earlier time.
    pub fn due(&self, time: f64) -> Option<Instant> {
        let tick = self.tick_at(time);
        let tolerance = tick_tolerance(time, self.config.line.period);
        let taken = self.last.is_some_and(|last| {
            last.at.tick > tick || last.at.tick == tick && time > last.at.time + tolerance
        });
        // An importer may have missed the time of the tick; the sample is then taken late.
        let nominal = tick_time(tick, self.start, self.config.line.period);
        let time = if time > nominal + tolerance { time } else { nominal };
        (!taken).then_some(Instant { tick, time })
    }

    /// Sample that is taken at an instant.
    fn sampled(&self, at: Instant, felt: &Felt) -> Taken {
        let before = if self.last.is_some_and(|last| last.at.tick == at.tick) {
            self.before
        } else {
            self.last
        };
        let Config { triads, line, devices, seed } = &self.config;
        let (draws, chance) = self.config.draw(at.tick);
        let fault = &devices.inertial;
        let memories: [Memory; 3] = std::array::from_fn(|i| {
            let before =
                before.as_ref().map(|before| (&before.memories[i], at.time - before.at.time));
            let mut triad = triads[i].drifted(at.time - self.start);
            if let Some(kind) = [FaultKind::Gyroscope, FaultKind::Accelerometer].get(i) {
                triad.bias += Vector3::repeat(fault.of(*kind, at.time));
                if fault.is(FaultKind::Frozen, at.time) {
                    triad.freeze = fault.window;
                }
            }
            triad.sample(at.time, &felt.readings[i], &draws[i], before)
        });
        let [earlier, mut fixes] =
            before.map_or_else(Default::default, |before| [before.seen, before.fixes]);
        let mut seen = earlier;
        if let Some((place, altitude)) = &felt.place {
            let times = (at.time, at.time - self.start, line.period);
            seen = devices.taken((*seed, at.tick), times, (place, *altitude), &earlier);
            fixes = devices.arrived(at.time, [&earlier, &seen], &fixes);
        }
        let dropped = line.drop_window.holds(at.time) && chance < line.drop_probability
            || fault.is(FaultKind::Dropout, at.time);
        let number = match before {
            Some(before) if fault.restarts(before.at.time, at.time) => 1,
            Some(before) => before.number.saturating_add(at.tick - before.at.tick),
            None => at.tick + 1,
        };
        let stamp = at.time + fault.of(FaultKind::Clock, at.time);
        Taken { at, number, stamp, memories, seen, fixes, dropped }
    }

    fn slot(&self, tick: i64) -> usize {
        tick as usize % self.line.len()
    }

    /// Newest of the samples taken that has arrived by `time` (s).
    fn newest(&self, time: f64) -> Sample {
        let Some(last) = self.last else { return self.arrived };
        let newest = self.tick_arrived(time).min(last.at.tick);
        let on_the_line = (0..=newest).rev().take(self.line.len()).find_map(|tick| {
            self.line[self.slot(tick)].filter(|taken| taken.at.tick == tick && !taken.dropped)
        });
        // A line that becomes slower gives nothing older than it has given.
        let newest = on_the_line.map(|taken| taken.sample());
        let is_late = self.config.devices.inertial.is(FaultKind::Late, time);
        newest.filter(|sample| !is_late || sample.time >= self.arrived.time).unwrap_or(self.arrived)
    }

    /// Takes the sample that is due at `time` (s), if there is one, and receives what has arrived.
    /// A call repeated at the same tick replaces the sample.
    pub fn take(&mut self, time: f64, felt: impl Into<Felt>) {
        self.arrived = self.newest(time);
        if let Some(at) = self.due(time) {
            let taken = self.sampled(at, &felt.into());
            if self.last.is_none_or(|last| last.at.tick != at.tick) {
                self.before = self.last;
            }
            self.last = Some(taken);
            let slot = self.slot(at.tick);
            self.line[slot] = Some(taken);
            self.arrived = self.newest(time);
        }
    }

    /// Newest sample that had arrived at the last call of [`Sensors::take`].
    pub fn arrived(&self) -> Sample {
        self.arrived
    }

    /// Newest sample that would have arrived after a call of [`Sensors::take`] at `time` (s).
    pub fn shown(&self, time: f64, felt: impl Into<Felt>) -> Sample {
        let due = self
            .due(time)
            .filter(|at| at.tick <= self.tick_arrived(time))
            .map(|at| self.sampled(at, &felt.into()));
        due.filter(|taken| !taken.dropped).map_or_else(|| self.newest(time), |taken| taken.sample())
    }
}
