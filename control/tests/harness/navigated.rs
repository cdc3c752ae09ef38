//! Entry flights whose attitude follows the guidance in an ideal loop, watched by a navigation.
#![allow(dead_code)] // Each user needs a part of it.

use control::guidance::{self, Guidance};
use control::navigation::{self, Line, Memory, Navigation};
use nalgebra::{SMatrix, SVector, Vector3};
use std::collections::BTreeMap;
use std::sync::{Arc, Mutex};
use vehicle::actuators::Command;
use vehicle::aerodynamics::Aerodynamics;
use vehicle::air::{Air, ROWS, Row};
use vehicle::disturbance::{Disturbance, DisturbanceKind};
use vehicle::entry::{Config, Deviations, End, Following, Passage, Prescribed, Trim};
use vehicle::fault::{Fault, FaultKind};
use vehicle::fixes::Devices;
use vehicle::frames::Place;
use vehicle::kinematics::Kinematics;
use vehicle::math::exp;
use vehicle::noise::{normal_pair, uniform};
use vehicle::plant::{Input, Plant, state};
use vehicle::scenario::Scenario;
use vehicle::sensor_data::SensorData;
use vehicle::sensors::{self, Line as Timing, PerSensor};
use vehicle::translation::Planet;
use vehicle::triad::Window;

const PERIOD: f64 = guidance::PERIOD;
/// Altitudes at which the air is known, m: most of them are in the blackout.
const ALTITUDES: [f64; ROWS] = [20e3, 45e3, 55e3, 65e3, 75e3, 85e3];

/// An entry flight with its sensors.
#[derive(Clone, Debug)]
pub(crate) struct Case {
    /// Sensor set, see [`SensorData::inertial`].
    pub(crate) set: i32,
    pub(crate) stars: bool,
    /// Period of the star tracker, s.
    pub(crate) star_period: f64,
    /// Share of the samples that are lost.
    pub(crate) dropped: f64,
    pub(crate) seed: u64,
    /// Wind to the north and to the east at 20, 60 and 100 km, m/s.
    pub(crate) wind: [[f64; 2]; 3],
    /// Ratio of the density to that of the standard atmosphere at [`ALTITUDES`].
    pub(crate) density: [f64; ROWS],
    pub(crate) deviations: Deviations,
    /// Ticks from one time at which it is seen to the next.
    pub(crate) every: u64,
    pub(crate) settings: navigation::Settings,
    /// Faults of the receiver, the star tracker and the inertial sensors.
    pub(crate) faults: [Fault; 3],
}

impl Case {
    pub(crate) fn new(set: i32, stars: bool, seed: u64) -> Self {
        let mut settings =
            navigation::Settings { sensor_set: set, ..navigation::Settings::default() };
        settings.alignment.seed = seed + 1000;
        settings.wind.deviation = 0.0;
        Self {
            set,
            stars,
            star_period: 1.0,
            dropped: 0.0,
            seed,
            wind: [[0.0; 2]; 3],
            density: [1.0; ROWS],
            deviations: Deviations::default(),
            every: 25,
            settings,
            faults: [Fault::default(); 3],
        }
    }

    /// Density that departs from the standard atmosphere as the filter expects, by a factor that
    /// becomes another one over the altitude.
    pub(crate) fn in_other_air(mut self) -> Self {
        let draws: [f64; ROWS] = uniform(self.seed, 98);
        let normal = [0, 2, 4].map(|i| normal_pair([draws[i], draws[i + 1]]));
        let expected = self.settings.drag;
        let mut error = 0.0;
        for (i, draw) in normal.as_flattened().iter().enumerate() {
            let climb = if i == 0 { f64::INFINITY } else { ALTITUDES[i] - ALTITUDES[i - 1] };
            let kept = exp(-climb / expected.correlation);
            error = kept * error + (1.0 - kept * kept).sqrt() * expected.model * draw;
            self.density[i] = exp(error);
        }
        self
    }

    /// Tactical sensors in winds up to some 60 m/s, with lift, drag and side force wrong by
    /// up to 10 %.
    pub(crate) fn windy(seed: u64) -> Self {
        let draws: [f64; 8] = uniform(seed, 99);
        let [side] = uniform(seed, 97);
        let mut case = Self::new(4, false, seed);
        let low = [60.0 * draws[0], 60.0 * draws[1]];
        let middle = [0.7 * low[0] + 20.0 * draws[2], 0.7 * low[1] + 20.0 * draws[3]];
        case.wind = [low, middle, [20.0 * draws[4], 20.0 * draws[5]]];
        case.deviations.lift = 1.0 + 0.1 * draws[6];
        case.deviations.drag = 1.0 + 0.1 * draws[7];
        case.deviations.side = 1.0 + 0.1 * side;
        case.settings.wind.deviation = 40.0;
        case
    }
}

/// Sums over flights.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Figures {
    count: f64,
    squares: [f64; 5],
    variances: [f64; 5],
    /// Square of the normalised error of position, velocity and attitude, per component.
    normalised: f64,
    /// Squares of the innovations of satellite navigation while there are fixes, and their number.
    innovations: [f64; 2],
    /// Square of the error of the sideslip relative to the air below Mach 5, its predicted
    /// variance, and their number.
    slow: [f64; 3],
    /// The same of the altitude at the end of the blackout, m².
    altitude: [f64; 3],
    /// Square of the normalised error of the altitude in the blackout, and the number.
    high: [f64; 2],
}

impl Figures {
    pub(crate) fn of(case: &Case) -> Self {
        let mut sum = Self::default();
        let mut last = [0.0; 3];
        fly(case, |seen| {
            sum.count += 1.0;
            for i in 0..5 {
                sum.squares[i] += seen.errors[i] * seen.errors[i];
                sum.variances[i] += seen.predicted[i] * seen.predicted[i];
            }
            let covariance = seen.covariance;
            let scale = SMatrix::<f64, 9, 9>::from_diagonal(
                &covariance.diagonal().map(|variance| 1.0 / variance.sqrt()),
            );
            let error = scale * seen.error;
            let inverse = (scale * covariance * scale).try_inverse().unwrap();
            sum.normalised += (error.transpose() * inverse * error)[0] / 9.0;
            let blackout = 44e3..86e3;
            if seen.time > 1.0 && !blackout.contains(&seen.altitude) {
                sum.innovations[0] += seen.innovations[0];
                sum.innovations[1] += 1.0;
            }
            let [error, predicted] = seen.altitude_error;
            if (45.1e3..85e3).contains(&seen.altitude) {
                last = [error * error, predicted * predicted, 1.0];
                sum.high[0] += error * error / (predicted * predicted);
                sum.high[1] += 1.0;
            }
            if seen.mach < 5.0 {
                sum.slow[0] += seen.errors[4] * seen.errors[4];
                sum.slow[1] += seen.predicted[4] * seen.predicted[4];
                sum.slow[2] += 1.0;
            }
        });
        sum.altitude = last;
        sum
    }

    pub(crate) fn with(mut self, other: &Self) -> Self {
        self.count += other.count;
        for i in 0..5 {
            self.squares[i] += other.squares[i];
            self.variances[i] += other.variances[i];
        }
        self.normalised += other.normalised;
        for i in 0..2 {
            self.innovations[i] += other.innovations[i];
            self.high[i] += other.high[i];
        }
        for i in 0..3 {
            self.slow[i] += other.slow[i];
            self.altitude[i] += other.altitude[i];
        }
        self
    }

    /// Root mean squares of the errors of α, β, σ, and of α, β relative to the air, rad.
    pub(crate) fn angles(&self) -> [f64; 5] {
        self.squares.map(|sum| (sum / self.count).sqrt())
    }

    /// What the filter predicts of these, rad.
    pub(crate) fn predicted(&self) -> [f64; 5] {
        self.variances.map(|sum| (sum / self.count).sqrt())
    }

    pub(crate) fn normalised_error(&self) -> f64 {
        self.normalised / self.count
    }

    pub(crate) fn innovation(&self) -> f64 {
        self.innovations[0] / self.innovations[1]
    }

    /// Root mean squares of the error of the altitude at the end of the blackout and of what the
    /// filter predicts of it, m.
    pub(crate) fn altitude(&self) -> [f64; 2] {
        [0, 1].map(|i| (self.altitude[i] / self.altitude[2]).sqrt())
    }

    /// Mean square of the normalised error of the altitude in the blackout.
    pub(crate) fn normalised_altitude(&self) -> f64 {
        self.high[0] / self.high[1]
    }

    /// Error of the sideslip relative to the air below Mach 5, rad.
    pub(crate) fn slow_sideslip(&self) -> f64 {
        (self.slow[0] / self.slow[2]).sqrt()
    }

    /// What the filter predicts of it, rad.
    pub(crate) fn slow_prediction(&self) -> f64 {
        (self.slow[1] / self.slow[2]).sqrt()
    }
}

/// What is seen at a tick.
#[derive(Clone, Debug)]
pub(crate) struct Seen {
    pub(crate) time: f64,
    pub(crate) altitude: f64,
    pub(crate) mach: f64,
    /// Shown less true α, β, σ relative to the ground, and α, β relative to the air, rad.
    pub(crate) errors: [f64; 5],
    /// Predicted standard deviations of these, rad.
    pub(crate) predicted: [f64; 5],
    /// Error of the filter in position, velocity and attitude, and its covariance.
    pub(crate) error: SVector<f64, 9>,
    pub(crate) covariance: SMatrix<f64, 9, 9>,
    /// Shown less true altitude, and its predicted standard deviation, m.
    pub(crate) altitude_error: [f64; 2],
    pub(crate) innovations: [f64; 4],
    pub(crate) health: navigation::Health,
    pub(crate) contradiction: navigation::Contradiction,
    /// Shown less true position (m), and its predicted standard deviation along an axis, m.
    pub(crate) position_error: [f64; 2],
    /// Bounds on the errors that the navigation states.
    pub(crate) protection: navigation::Protection,
}

impl Seen {
    /// Returns the largest error of an angle or of the position over its predicted deviation.
    pub(crate) fn deviations(&self) -> f64 {
        let of_angles = self.errors.iter().zip(self.predicted);
        let largest = of_angles.map(|(error, deviation)| error.abs() / deviation);
        let [error, deviation] = self.position_error;
        largest.fold(error / (3_f64.sqrt() * deviation), f64::max)
    }

    /// Returns whether `health` says that the state is not to be trusted.
    pub(crate) fn is_said(&self) -> bool {
        use navigation::Health::{Inconsistent, Lost, Suspect};
        matches!(self.health, Inconsistent | Lost | Suspect)
    }

    /// Returns whether the error of an angle, and that of the position, are within their bounds.
    pub(crate) fn is_protected(&self) -> [bool; 2] {
        let [_, _, sigma, alpha, beta] = self.errors.map(f64::abs);
        let largest = alpha.max(beta).max(sigma);
        [largest <= self.protection.attitude, self.position_error[0] <= self.protection.position]
    }
}

/// Returns the entry flight of a case, and the plant with its sensors.
fn vehicle(case: &Case) -> (Config, vehicle::plant::Config) {
    let initial = case.settings.initial;
    let mut air = Air { rows: ROWS, ..Air::default() };
    for (i, row) in air.profile.iter_mut().enumerate() {
        let altitude = ALTITUDES[i];
        let share = (altitude - 20e3) / 40e3;
        let [below, above] = if share < 1.0 { [0, 1] } else { [1, 2] }.map(|at| case.wind[at]);
        let wind = [0, 1].map(|part| below[part] + share.fract() * (above[part] - below[part]));
        *row = Row { altitude, density: case.density[i], wind };
    }
    let entry = Config {
        planet: Planet::EARTH,
        aerodynamics: Aerodynamics::papers(),
        deviations: case.deviations,
        air,
        trim: Trim::Anywhere,
        following: Following { active: true, frequency: 1.0 },
        end: End { altitude: 20e3, speed: 762.0 },
    };
    let mut devices = Devices::default();
    devices.star.period = if case.stars { case.star_period } else { 0.0 };
    [devices.gnss.fault, devices.star.fault, devices.inertial] = case.faults;
    let data = SensorData::embedded();
    let triads = if case.set == 1 { PerSensor::default() } else { data.inertial(case.set, PERIOD) };
    let scenario = Scenario {
        disturbance: Disturbance {
            kind: DisturbanceKind::None,
            ..Scenario::crmpc2022().disturbance
        },
        ..Scenario::crmpc2022()
    };
    let config = vehicle::plant::Config {
        kinematics: Kinematics::Exact,
        entry: Some(entry.clone()),
        motion: initial.start.motion(),
        initial: state(&initial.angles, &Vector3::zeros()),
        surroundings: data.surroundings,
        sensors: Some(sensors::Config {
            triads,
            line: Timing {
                period: PERIOD,
                delay: 0.0,
                drop_probability: case.dropped,
                drop_window: Window { start: 0.0, end: 1e15 },
            },
            devices,
            seed: case.seed,
        }),
        ..scenario.config(PERIOD)
    };
    (entry, config)
}

/// What the guidance has commanded at each tick of a flight, by what such a flight depends on: not on
/// what is measured. Half of a flight's time would go into it.
static COMMANDED: Mutex<BTreeMap<String, Arc<Vec<Prescribed>>>> = Mutex::new(BTreeMap::new());

/// Flies to the terminal area, and calls `see` as often as the case says.
pub(crate) fn fly(case: &Case, mut see: impl FnMut(&Seen)) {
    let guidance = Guidance::new(guidance::Settings::default()).unwrap();
    let (entry, config) = vehicle(case);
    let mut plant = Plant::new(&config, 0.0).unwrap();
    let navigation = Navigation::new(case.settings).unwrap();
    let mut memory: Memory = navigation.memory();
    let mut guided = guidance::Memory::default();
    let mut input = Input::default();
    let flight = format!("{:?}", (case.wind, case.density, case.deviations, case.settings.initial));
    let commanded = COMMANDED.lock().unwrap().get(&flight).cloned();
    let mut commands = Vec::new();
    for tick in 0..100_000_u64 {
        let time = tick as f64 * PERIOD;
        if plant.ended().is_some() {
            if commanded.is_none() {
                COMMANDED.lock().unwrap().insert(flight, Arc::new(commands));
            }
            return;
        }
        let entering = plant.entering(time).unwrap();
        let passage = entering.passage;
        input.prescribed = if let Some(commanded) = &commanded {
            commanded[tick as usize]
        } else {
            let (motion, Passage { lift, drag, .. }) = (plant.motion, passage);
            let known = guidance::Navigation { motion, lift, drag };
            let reference = guidance.update(&mut guided, tick, &known).reference;
            Prescribed { angles: reference.angles, rates: reference.rates }
        };
        commands.push(input.prescribed);
        let sample = plant.measured(Some(&entering), time, &input);
        let [rate, force, _] = sample.readings;
        let line =
            Line { sample: sample.number, time: sample.time, rate, force, fixes: sample.fixes };
        navigation.update(&mut memory, time, &line);
        let altitude = plant.motion[0];
        let wind = entry.air.at(time, altitude).wind;
        let truth = Place::of(&entry.planet, &plant.motion, &plant.angles(), time);
        // There is none before the first sample.
        if tick.is_multiple_of(case.every)
            && let Some((error, covariance)) = navigation.error(&memory, &truth, [wind.x, wind.y])
        {
            let shown = &memory.shown;
            let off = shown.angles - plant.angles();
            let turn = |angle: f64| vehicle::axes::nearest(angle, 0.0);
            see(&Seen {
                time,
                altitude,
                mach: passage.mach,
                errors: [
                    turn(off.x),
                    off.y,
                    turn(off.z),
                    shown.flow[0] - passage.air_angles[0],
                    shown.flow[1] - passage.air_angles[1],
                ],
                predicted: [
                    shown.deviations.angles.x,
                    shown.deviations.angles.y,
                    shown.deviations.angles.z,
                    shown.deviations.flow[0],
                    shown.deviations.flow[1],
                ],
                error: error.fixed_rows::<9>(0).into(),
                covariance: covariance.fixed_view::<9, 9>(0, 0).into(),
                altitude_error: [shown.motion[0] - altitude, shown.deviations.altitude],
                innovations: shown.innovations,
                health: memory.health,
                contradiction: memory.contradiction,
                protection: shown.protection,
                position_error: {
                    let place = Place::of(&entry.planet, &shown.motion, &shown.angles, time);
                    let off = (place.position - truth.position).norm();
                    [off, shown.deviations.position]
                },
            });
        }
        // A reference that is held would shake the vehicle between the samples.
        let moving = |at: f64| {
            let mut input = input;
            input.prescribed.angles += input.prescribed.rates * (at - time);
            input
        };
        plant.advance_with(time, time + PERIOD, &Command::default(), moving).unwrap();
    }
    panic!("it does not come down");
}

/// Returns a flight whose receiver (0), star tracker (1) or inertial unit (2) has a fault.
pub(crate) fn faulty(
    device: usize,
    kind: FaultKind,
    size: f64,
    window: [f64; 2],
    seed: u64,
) -> Case {
    let mut case = Case::new(4, device == 1, seed);
    let [start, end] = window;
    case.faults[device] = Fault { kind, window: Window { start, end }, size };
    case
}

/// Returns the shares of the instants at which an angle or the position is wrong by more than its
/// bound.
pub(crate) fn exceeded(case: &Case) -> [f64; 2] {
    judged(case).0
}

/// Returns the same, and the number of times at which an error begins to exceed five of its predicted
/// deviations, and of those that `health` does not say within ten seconds. Sees the flight once a
/// second.
pub(crate) fn judged(case: &Case) -> ([f64; 2], [u32; 2]) {
    judged_with(case, |_| {})
}

/// Returns the same, and calls `see` as often as the case says.
pub(crate) fn judged_with(case: &Case, mut see: impl FnMut(&Seen)) -> ([f64; 2], [u32; 2]) {
    let (mut count, mut beyond) = (0.0, [0.0; 2]);
    let (mut times, mut lasted, mut unsaid) = ([0; 2], 0, 0);
    fly(case, |seen| {
        see(seen);
        let is_large = seen.deviations() > 5.0;
        times[0] += u32::from(is_large && lasted == 0);
        lasted = if is_large { lasted + 1 } else { 0 };
        unsaid = if is_large && !seen.is_said() { unsaid + 1 } else { 0 };
        times[1] += u32::from(unsaid == 11);
        count += 1.0;
        for (sum, is_within) in beyond.iter_mut().zip(seen.is_protected()) {
            *sum += f64::from(u8::from(!is_within));
        }
    });
    (beyond.map(|sum| sum / count), times)
}
