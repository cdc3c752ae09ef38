//! Flights of CRMPC under the robust set that test its guarantee, with bounded disturbances of any
//! waveform, delayed moments, measurement errors or an estimator in the loop, any start and any
//! reference.
#![allow(dead_code, unreachable_pub)] // Each user needs a part of it.

use super::{CHECK, platform};
use control::crmpc::{Constraints, Crmpc, GuaranteeStatus, InitialState, Memory, Settings};
use control::delay::{Delayed, Latency};
use control::error::DesignError;
use control::error_dynamics::Gain;
use control::estimation::{self, Alignment, Estimator, mems_corrections};
use control::{Controller, Measurement};
use nalgebra::{Matrix3, Rotation3, Vector3};
use vehicle::dynamics::RigidBody;
use vehicle::integrator::rk4;
use vehicle::kinematics::{self, Kinematics};
use vehicle::noise::uniform;
use vehicle::plant::{self, Load, State};
use vehicle::profile::Profile;
use vehicle::reference::Reference;
use vehicle::scenario::Scenario;
use vehicle::sensors::Sensors;
use vehicle::transport::Transport;

/// Attitude errors above this value count as a lost attitude, rad.
const LOST: f64 = 30.0 * std::f64::consts::PI / 180.0;
/// Relative tolerance for rounding when limits are checked.
const SLACK: f64 = 1e-9;
/// Measurements of ‖ω‖ and β between two checks: one every millisecond.
const FINE: u32 = 10;

/// Random numbers that repeat for the same seed.
#[derive(Clone, Debug)]
pub struct Random {
    seed: u64,
    drawn: i64,
}

impl Random {
    /// Returns the sequence of this seed.
    pub fn new(seed: u64) -> Self {
        Self { seed, drawn: 0 }
    }

    /// Draws a number uniformly from [low, high).
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        self.drawn += 1;
        let [value] = uniform(self.seed, self.drawn);
        low + (high - low) * 0.5 * (value + 1.0)
    }

    /// Draws a whole number below `count`.
    pub fn below(&mut self, count: usize) -> usize {
        (self.between(0.0, count as f64) as usize).min(count - 1)
    }

    /// Draws each component uniformly from [−1, 1).
    pub fn vector(&mut self) -> Vector3<f64> {
        Vector3::from_fn(|_, _| self.between(-1.0, 1.0))
    }

    /// Draws a corner of the box [−1, 1]³.
    pub fn corner(&mut self) -> Vector3<f64> {
        signs(&self.vector())
    }

    /// Draws a vector of this length in any direction.
    pub fn direction(&mut self, length: f64) -> Vector3<f64> {
        self.vector().try_normalize(1e-6).unwrap_or_else(Vector3::x) * length
    }
}

/// A waveform of a vector in the box [−1, 1]³ over time, for the disturbance or the errors relative
/// to their bounds.
#[derive(Clone, Debug)]
pub enum Waveform {
    /// The vector is constant over time.
    Constant(Vector3<f64>),
    /// The vector is drawn again at each request.
    White,
    /// The vector changes its sign every half period (s).
    Square(f64, Vector3<f64>),
    /// The vector moves to a new corner of the box after random times of at most this length (s).
    Switching(f64),
    /// The vector is the corner along x_ω, times this sign.
    AlongRate(f64),
    /// The vector is the corner along the acceleration by the acting moment, times this sign.
    AlongMoment(f64),
    /// The vector takes these values one after the other, each until its time (s); the last one
    /// stays.
    Segments(Vec<(f64, Vector3<f64>)>),
}

impl Waveform {
    /// Draws any waveform except segments.
    pub fn random(random: &mut Random) -> Self {
        let sign = if random.below(2) == 0 { 1.0 } else { -1.0 };
        let period = 10.0_f64.powf(random.between(-1.1, 1.4));
        match random.below(8) {
            0 => Self::White,
            1 => Self::Constant(random.corner()),
            2 => Self::Constant(random.vector()),
            3 => Self::Square(period, random.corner()),
            4 => Self::Square(period, random.vector()),
            5 => Self::Switching(period),
            6 => Self::AlongRate(sign),
            _ => Self::AlongMoment(sign),
        }
    }
}

/// A waveform in progress over time.
#[derive(Clone, Debug)]
struct Progress {
    waveform: Waveform,
    random: Random,
    now: Vector3<f64>,
    until: f64,
}

impl Progress {
    fn new(waveform: &Waveform, seed: u64) -> Self {
        Self {
            waveform: waveform.clone(),
            random: Random::new(seed),
            now: Vector3::zeros(),
            until: 0.0,
        }
    }

    /// Returns the value at `time` (s), which must not decrease.
    fn at(&mut self, time: f64, vehicle: &Vehicle) -> Vector3<f64> {
        let r = kinematics::r(&vehicle.angles());
        match &self.waveform {
            Waveform::Constant(value) => *value,
            Waveform::White => self.random.vector(),
            Waveform::Square(period, value) => {
                let half = (2.0 * (time + 1e-9) / period).floor() as i64;
                if half % 2 == 0 { *value } else { -*value }
            }
            Waveform::Switching(longest) => {
                if time >= self.until {
                    self.now = self.random.corner();
                    self.until = time + self.random.between(0.0, *longest);
                }
                self.now
            }
            Waveform::AlongRate(sign) => signs(&(r * vehicle.rates())) * *sign,
            Waveform::AlongMoment(sign) => {
                signs(&(r * vehicle.body.inverse * vehicle.moment(time))) * *sign
            }
            Waveform::Segments(segments) => {
                let current = segments.iter().find(|(until, _)| time < *until).or(segments.last());
                current.map_or_else(Vector3::zeros, |(_, value)| *value)
            }
        }
    }
}

fn signs(vector: &Vector3<f64>) -> Vector3<f64> {
    vector.map(|component| if component < 0.0 { -1.0 } else { 1.0 })
}

/// The source of the controller's measurements.
#[derive(Clone, Debug)]
pub enum Sight {
    /// The controller receives the true state.
    Exact,
    /// The angles and x_ω have errors that follow this waveform within the bounds of the settings.
    Errors(Waveform),
    /// The estimator evaluates the typical MEMS sensors with noise of this seed.
    Estimator(u64),
}

/// Definition of a flight.
#[derive(Clone, Debug)]
pub struct Flight {
    /// Settings of the controller, with the delay, the errors and the disturbance bound that are in
    /// force.
    pub settings: Settings,
    /// Ratio of the vehicle's inertia to the one that the controller uses.
    pub inertia_scale: f64,
    /// Relative error E of the vehicle's tensor of inertia, which is I^½ (1 + E) I^½ times the
    /// ratio.
    pub tensor_error: Matrix3<f64>,
    /// Angles Θ at the start, rad.
    pub angles: Vector3<f64>,
    /// Body rates ω at the start, rad/s.
    pub rates: Vector3<f64>,
    /// Reference of the flight.
    pub reference: Profile,
    /// Time of the reference at the start, s.
    pub reference_start: f64,
    /// Waveform of Δ relative to its bound.
    pub disturbance: Waveform,
    /// Time over which Δ is held, s; a whole multiple of [`CHECK`].
    pub hold: f64,
    /// Source of the controller's measurements.
    pub sight: Sight,
    /// Age of the measurements, s, which is a part of the delay of the settings.
    pub age: f64,
    /// Amount by which commands act later than the settings say, s.
    pub late: f64,
    /// Seed of all random numbers of the flight.
    pub seed: u64,
    /// Duration of the flight, s.
    pub duration: f64,
}

/// Results of a flight, relative to the limits of the settings.
#[derive(Clone, Copy, Debug, Default)]
pub struct Shown {
    /// Largest ‖ω‖ relative to its limit in the periods that began under guarantee, measured every
    /// millisecond.
    pub rate: f64,
    /// Time of this largest ‖ω‖, s.
    pub rate_time: f64,
    /// Largest |β| relative to the bound up to which the guarantee is given, in the same periods
    /// and as often.
    pub sideslip: f64,
    /// Largest ‖m‖ relative to its limit that was commanded under guarantee.
    pub moment: f64,
    /// Largest ‖ω‖ relative to its limit over the whole flight.
    pub rate_at_all: f64,
    /// Whether ‖ω‖, |β| or ‖m‖ exceeded its limit under guarantee.
    pub broken: bool,
    /// Time at which the guarantee ended, s.
    pub withdrawn: Option<f64>,
    /// Whether the errors of angles and rates stayed within their bounds, as the guarantee assumes.
    pub assumed: bool,
    /// Whether the attitude was lost.
    pub lost: bool,
    /// Number of optimisations without an optimum.
    pub fallbacks: u32,
    /// Share of the ticks under guarantee.
    pub in_force: f64,
    /// Root mean square over the ticks of ‖Θ − Θ_r‖, deg.
    pub ems_deg: f64,
    /// Largest error of an angle (rad) and of a component of x_ω (rad/s) in the controller's
    /// measurements.
    pub errors: (f64, f64),
}

impl Shown {
    /// Returns whether the guarantee failed: a limit was exceeded under guarantee, or the guarantee
    /// was withdrawn while its assumptions were true. A command over the limit ends the guarantee
    /// in the same tick, so that only the withdrawal shows it.
    pub fn defective(&self) -> bool {
        self.assumed && (self.broken || self.withdrawn.is_some()) || self.lost
    }
}

impl Flight {
    /// Returns the flight from the start of Chai 2022 along its reference, without disturbance or
    /// errors.
    pub fn new(settings: &Settings) -> Self {
        let scenario = Scenario::crmpc2022();
        Self {
            settings: *settings,
            inertia_scale: 1.0,
            tensor_error: Matrix3::zeros(),
            angles: scenario.initial_angles,
            rates: scenario.initial_rates,
            reference: scenario.reference,
            reference_start: 0.0,
            disturbance: Waveform::Constant(Vector3::zeros()),
            hold: 0.04,
            sight: Sight::Exact,
            age: 0.0,
            late: 0.0,
            seed: 0,
            duration: scenario.duration,
        }
    }

    /// Draws disturbance, inertia, start and reference, and the waveform of the errors if the
    /// settings have any.
    pub fn random(settings: &Settings, seed: u64) -> Self {
        let random = &mut Random::new(seed);
        let mut flight = Self::new(settings);
        flight.seed = seed;
        flight.duration = 25.0;
        flight.inertia_scale = match random.below(3) {
            0 => 1.0 - settings.inertia_error,
            1 => 1.0 + settings.inertia_error,
            _ => 1.0 + settings.inertia_error * random.between(-1.0, 1.0),
        };
        if settings.delay_error > 0.0 {
            flight.late =
                settings.delay_error * [-1.0, 1.0, random.between(-1.0, 1.0)][random.below(3)];
        }
        if settings.tensor_error > 0.0 {
            flight.tensor_error = Self::tensor_of(settings.tensor_error, random);
        }
        flight.disturbance = Waveform::random(random);
        flight.hold = if random.below(2) == 0 { 0.04 } else { 0.01 };
        match random.below(3) {
            0 => flight.reference_start = random.between(0.0, 50.0),
            1 => flight.reference = Self::random_sine(random),
            _ => {
                let steady = |random: &mut Random| {
                    degrees([10.0, 0.0, -30.0])
                        + random.vector().component_mul(&degrees([5.0, 3.0, 8.0]))
                };
                flight.reference =
                    Profile::step(steady(random), steady(random), random.between(1.0, 20.0));
            }
        }
        if random.below(4) > 0 {
            let first = flight.reference.at(flight.reference_start).angles;
            flight.angles = first + random.vector().component_mul(&degrees([10.0, 8.0, 12.0]));
            let length = random.between(0.0, 0.7) * settings.limit_rate;
            flight.rates = random.direction(length);
        }
        if settings.rate_error > 0.0 || settings.angle_error > 0.0 {
            flight.sight = Sight::Errors(Waveform::random(random));
        }
        flight
    }

    /// Draws a flight that begins just inside the set of states from which a plan is certified:
    /// with much sideslip, with fast rates, or with both. The result is `None` if not even the
    /// reference at rest is certified.
    pub fn at_the_edge(settings: &Settings, seed: u64) -> Option<Self> {
        let random = &mut Random::new(seed ^ (1 << 40));
        let mut flight = Self::random(settings, seed);
        flight.duration = 4.0;
        let angles = flight.reference.at(flight.reference_start).angles;
        let mut far = angles + random.vector().component_mul(&degrees([8.0, 0.0, 10.0]));
        let mut rates = random.direction(settings.limit_rate);
        let kind = random.below(4);
        if kind != 1 {
            far.y = settings.sideslip_domain * if random.below(2) == 0 { 1.0 } else { -1.0 };
        }
        let mut share = random.between(0.0, 1.0);
        if kind == 0 {
            // The sideslip begins below its bound by this share of it, and moves outwards.
            let below = 10.0_f64.powf(random.between(-5.0, -1.0));
            far.y *= 1.0 - below;
            rates.y = rates.y.abs() * far.y.signum();
            share = 1.0;
        }
        if kind == 3 {
            rates *= random.between(0.0, 0.7);
        }
        let mut law = Crmpc::new(*settings).unwrap();
        let begin = |size: f64| {
            // Either the angles or the rates stay as they are while the others grow.
            let (of_angles, of_rates) = match kind {
                0 | 1 => (share, size),
                2 => (size, size),
                _ => (size, 1.0),
            };
            (angles + (far - angles) * of_angles, rates * of_rates)
        };
        let mut certified = |size: f64| {
            let ((angles, rates), mut memory) = (begin(size), law.memory());
            let measured = Measurement { angles, rates, ..Measurement::default() };
            let reference = |time: f64| flight.reference.at(flight.reference_start + time);
            law.update(&mut memory, 0, 0.0, &measured, &reference);
            memory.assured()
        };
        let (mut low, mut high) = (0.0, 1.0);
        if !certified(low) {
            return None;
        }
        for _ in 0..14 {
            let middle = 0.5 * (low + high);
            if certified(middle) { low = middle } else { high = middle }
        }
        (flight.angles, flight.rates) = begin(low * if random.below(2) == 0 { 1.0 } else { 0.999 });
        // Many disturbances drive the sideslip further outwards, and some flights have none.
        let mut outwards = random.corner();
        outwards.y = flight.angles.y.signum();
        match random.below(4) {
            0 => flight.disturbance = Waveform::Constant(outwards),
            1 => flight.disturbance = Waveform::Constant(Vector3::zeros()),
            _ => {}
        }
        Some(flight)
    }

    /// Draws a symmetric matrix in any directions, whose eigenvalues are of this size.
    pub fn tensor_of(size: f64, random: &mut Random) -> Matrix3<f64> {
        let turned = Rotation3::new(random.direction(1.0) * random.between(0.0, 3.1)).into_inner();
        let error = turned * Matrix3::from_diagonal(&(random.corner() * size)) * turned.transpose();
        // Rounding must leave the tensor symmetric.
        0.5 * (error + error.transpose())
    }

    fn random_sine(random: &mut Random) -> Profile {
        let mean =
            degrees([10.0, 0.0, -30.0]) + random.vector().component_mul(&degrees([5.0, 2.0, 20.0]));
        // A moving sideslip needs many optimisations.
        let sideslip = if random.below(12) == 0 { 3.0 } else { 0.0 };
        let amplitude = random.vector().component_mul(&degrees([3.0, sideslip, 6.0]));
        Profile::sine(mean, amplitude, random.between(0.1, 0.8), random.between(0.0, 6.3))
    }

    /// Returns the vehicle's inertia if this is the one of the controller, kg m².
    fn inertia(&self, inertia: &Matrix3<f64>) -> Matrix3<f64> {
        if self.tensor_error == Matrix3::zeros() {
            return inertia * self.inertia_scale;
        }
        let mut root = inertia.symmetric_eigen();
        root.eigenvalues.apply(|value| *value = value.sqrt());
        let root = root.recompose();
        let inertia = root * (Matrix3::identity() + self.tensor_error) * root * self.inertia_scale;
        0.5 * (inertia + inertia.transpose())
    }

    /// Runs the flight and returns its results.
    pub fn fly(&self) -> Shown {
        self.fly_seen(|_, _, _, _| {})
    }

    /// Runs the flight; `observe` receives memory, tick, measurement and reference after each
    /// update.
    pub fn fly_seen(
        &self,
        mut observe: impl FnMut(&Memory, u64, &Measurement, &Reference),
    ) -> Shown {
        let s = &self.settings;
        let law = Crmpc::new(*s).unwrap();
        let latency = Latency { measurement: self.age, action: s.delay - self.age };
        let Settings { body, period_feedback: period, limit_moment, .. } = *s;
        let mut controller = Delayed::new(law, body, period, latency, limit_moment).unwrap();
        let mut memory = controller.memory();
        let mut vehicle = Vehicle::new(self);
        let mut disturbance = Progress::new(&self.disturbance, self.seed);
        let mut eyes = Eyes::new(self);
        let reference = |time: f64| self.reference.at(self.reference_start + time);
        let (ticks, checks) =
            ((self.duration / period).round() as u64, (period / CHECK).round() as u64);
        let holds = (self.hold / CHECK).round() as u64;
        let (mut shown, mut error, mut in_force, mut before) = (Shown::default(), 0.0, 0, false);
        let mut delta = Vector3::zeros();
        for tick in 0..ticks {
            let time = tick as f64 * period;
            let measured = eyes.look(time, &vehicle);
            let off = vehicle.angles() - reference(time).angles;
            error += off.norm_squared();
            shown.lost |= off.norm() > LOST;
            let moment = controller.update(&mut memory, tick, time, &measured, &reference);
            vehicle.command(time, moment);
            observe(&memory.inner, tick, &measured, &reference(time));
            let now = memory.inner.guarantee == GuaranteeStatus::InForce;
            if before && !now && shown.withdrawn.is_none() {
                shown.withdrawn = Some(time);
            }
            before = now;
            in_force += u64::from(now);
            if now {
                shown.moment = shown.moment.max(moment.norm() / s.limit_moment);
            }
            for i in 0..checks {
                let at = |i: u64| time + i as f64 * CHECK;
                let check = tick * checks + i;
                if check % holds == 0 {
                    delta = disturbance.at(at(i), &vehicle) * s.disturbance_bound;
                }
                let fine = |j: u32| at(i) + f64::from(j) * (CHECK / f64::from(FINE));
                for j in 0..FINE {
                    vehicle.advance(fine(j), fine(j + 1), &delta);
                    let rate = vehicle.rates().norm() / s.limit_rate;
                    shown.rate_at_all = shown.rate_at_all.max(rate);
                    if now && rate > shown.rate {
                        (shown.rate, shown.rate_time) = (rate, fine(j + 1));
                    }
                    if now {
                        let sideslip = vehicle.angles().y.abs() / s.sideslip_domain;
                        shown.sideslip = shown.sideslip.max(sideslip);
                    }
                }
                eyes.sample(at(i + 1), &vehicle);
            }
        }
        let largest = shown.rate.max(shown.moment).max(shown.sideslip);
        shown.broken = largest > 1.0 + SLACK;
        Shown {
            fallbacks: memory.inner.report.fallbacks,
            in_force: in_force as f64 / ticks as f64,
            ems_deg: (error / ticks as f64).sqrt().to_degrees(),
            errors: eyes.largest,
            assumed: eyes.within_bounds(),
            ..shown
        }
    }
}

fn degrees(values: [f64; 3]) -> Vector3<f64> {
    Vector3::from(values).map(f64::to_radians)
}

/// The plant with a disturbance that is set from step to step.
struct Vehicle {
    body: RigidBody,
    state: State,
    commanded: Vector3<f64>,
    transport: Option<Transport>,
}

impl Vehicle {
    fn new(flight: &Flight) -> Self {
        let Settings { body, delay, .. } = &flight.settings;
        Self {
            body: RigidBody::new(flight.inertia(&body.inertia)).unwrap(),
            state: plant::state(&flight.angles, &flight.rates),
            commanded: Vector3::zeros(),
            transport: Transport::new(delay - flight.age + flight.late).unwrap(),
        }
    }

    fn angles(&self) -> Vector3<f64> {
        plant::angles(&self.state)
    }

    fn rates(&self) -> Vector3<f64> {
        plant::rates(&self.state)
    }

    fn command(&mut self, time: f64, moment: Vector3<f64>) {
        self.commanded = moment;
        if let Some(transport) = &mut self.transport {
            transport.command(time, moment).unwrap();
        }
    }

    /// Returns the acting moment, N m.
    fn moment(&self, time: f64) -> Vector3<f64> {
        self.transport.as_ref().map_or(self.commanded, |transport| transport.moment(time))
    }

    fn advance(&mut self, from: f64, to: f64, delta: &Vector3<f64>) {
        let mut time = from;
        while time < to {
            let arrival =
                self.transport.as_ref().and_then(|transport| transport.next_arrival(time));
            let end =
                arrival.filter(|&arrival| arrival > time && arrival < to - 1e-9).unwrap_or(to);
            let load = Load { moment: self.moment(time), delta: *delta, ..Load::default() };
            let mut f = |_: f64, state: &State| {
                plant::derivative(&self.body, Kinematics::Printed, state, &load)
            };
            self.state = rk4(&mut f, time, &self.state, end - time);
            time = end;
        }
    }
}

/// The source of the measurements.
struct Eyes {
    errors: Option<Progress>,
    /// Bounds on the errors of angles (rad) and rates (rad/s).
    bounds: (f64, f64),
    estimation: Option<(Sensors, Estimator, estimation::Memory)>,
    largest: (f64, f64),
    /// Angles and rates at the checks since the instant to which a present measurement refers;
    /// empty if that is the present.
    past: Vec<(Vector3<f64>, Vector3<f64>)>,
}

impl Eyes {
    fn new(flight: &Flight) -> Self {
        let Settings { angle_error, rate_error, .. } = flight.settings;
        let errors = match &flight.sight {
            Sight::Errors(waveform) => {
                Some(Progress::new(waveform, flight.seed.wrapping_add(1 << 32)))
            }
            Sight::Exact | Sight::Estimator(_) => None,
        };
        let estimation = match flight.sight {
            Sight::Estimator(seed) => {
                let settings = estimation::Settings {
                    corrections: mems_corrections(),
                    alignment: Alignment::Given,
                    initial: flight.angles,
                    prediction: flight.age == 0.0,
                    ..estimation::Settings::default()
                };
                let estimator = Estimator::new(settings).unwrap();
                let memory = estimator.memory();
                Some((Sensors::new(&platform::mems(seed), 0.0).unwrap(), estimator, memory))
            }
            Sight::Exact | Sight::Errors(_) => None,
        };
        let mut eyes = Self {
            errors,
            bounds: (angle_error, rate_error),
            estimation,
            largest: (0.0, 0.0),
            past: Vec::new(),
        };
        let (vehicle, steps) = (Vehicle::new(flight), (flight.age / CHECK).round() as usize);
        if steps > 0 {
            eyes.past = vec![(vehicle.angles(), vehicle.rates()); steps + 1];
        }
        eyes.sample(0.0, &vehicle);
        eyes
    }

    /// Returns the angles and rates to which a present measurement refers.
    fn past(&self, vehicle: &Vehicle) -> (Vector3<f64>, Vector3<f64>) {
        self.past.first().copied().unwrap_or_else(|| (vehicle.angles(), vehicle.rates()))
    }

    /// Takes a sample of the sensors.
    fn sample(&mut self, time: f64, vehicle: &Vehicle) {
        if !self.past.is_empty() {
            self.past.remove(0);
            self.past.push((vehicle.angles(), vehicle.rates()));
        }
        if let Some((sensors, estimator, memory)) = &mut self.estimation {
            let truth = platform::Truth { time, angles: vehicle.angles(), rates: vehicle.rates() };
            sensors.take(time, &platform::felt(&truth));
            let sample = sensors.arrived();
            let line = estimation::Line {
                sample: sample.number,
                time: sample.time,
                readings: sample.readings,
            };
            estimator.update(memory, time, &line);
        }
    }

    /// Returns the controller's measurement at a tick.
    fn look(&mut self, time: f64, vehicle: &Vehicle) -> Measurement {
        let (angles, rates) = self.past(vehicle);
        let angle_rates = kinematics::r(&angles) * rates;
        let (angle_bound, rate_bound) = self.bounds;
        let mut measured = Measurement { angles, rates, ..Measurement::default() };
        if let Some(errors) = &mut self.errors {
            let error = errors.at(time, vehicle);
            measured.angles = angles + error * angle_bound;
            measured.rates =
                kinematics::r_inverse(&measured.angles) * (angle_rates + error * rate_bound);
        }
        if let Some((_, _, memory)) = &self.estimation {
            measured.angles = memory.estimate.angles;
            measured.rates = memory.estimate.rates;
        }
        let of_rates = kinematics::r(&measured.angles) * measured.rates - angle_rates;
        let (angle, rate) = &mut self.largest;
        let of_angles = measured.angles - angles;
        *angle = angle.max(of_angles.amax());
        *rate = rate.max(of_rates.amax());
        if std::env::var("EYES").is_ok() {
            let a = angle_rates;
            println!(
                "E {time:.2} {} {} {} {} {} {} {} {} {}",
                of_angles.x,
                of_angles.y,
                of_angles.z,
                of_rates.x,
                of_rates.y,
                of_rates.z,
                a.x,
                a.y,
                a.z
            );
        }
        measured
    }

    /// Returns whether the errors have stayed within the bounds of the settings.
    fn within_bounds(&self) -> bool {
        let (angle, rate) = self.bounds;
        let within = |value: f64, bound: f64| value <= bound * (1.0 + SLACK) + 1e-12;
        within(self.largest.0, angle) && within(self.largest.1, rate)
    }
}

/// Returns the settings of Chai 2022 with another period of the optimisation (s), and with a
/// horizon of 20 s as there, or of 100 steps if that is shorter. The terminal law is one that is
/// stable if it is held over the period.
pub fn optimised_every(period: f64) -> Settings {
    let published = Settings::new(Constraints::Robust);
    let terminal = if period > 0.3 { Gain { k1: -0.6, k2: -1.6 } } else { published.terminal };
    let horizon = ((20.0 / period).round() as usize).min(100);
    Settings { period_optimisation: period, horizon, terminal, ..published }
}

/// Result of trying some settings.
#[derive(Clone, Debug)]
pub enum Tried {
    /// The settings were accepted and flown.
    Flown(Shown),
    /// The settings were refused because no guarantee can be given.
    Refused {
        /// Number of bounds that the message names.
        bounds: usize,
        /// Messages about the settings with a named bound that are not accepted either.
        not_accepted: Vec<String>,
    },
    /// The settings were refused for another reason.
    Invalid(String),
}

/// Draws every setting that a user may set.
pub fn random_settings(seed: u64) -> Settings {
    let random = &mut Random::new(seed);
    let half = |random: &mut Random, high: f64| {
        if random.below(2) == 0 { 0.0 } else { random.between(0.0, high) }
    };
    let published = Settings::new(Constraints::Robust);
    let period_feedback = [0.02, 0.04, 0.05, 0.1][random.below(4)];
    let initial_states = [InitialState::Measured, InitialState::Nominal, InitialState::Tube];
    let mut settings = Settings {
        feedback: Gain { k1: random.between(-10.0, -0.5), k2: random.between(-10.0, -1.0) },
        delay: half(random, 0.15),
        angle_error: half(random, 0.2).to_radians(),
        rate_error: half(random, 0.2).to_radians(),
        disturbance_bound: random.between(0.0, 4.0).to_radians(),
        inertia_error: random.between(0.0, 0.1),
        horizon: 20 + random.below(81),
        period_feedback,
        // The period is at most 0.3 s, so that the terminal law is stable.
        period_optimisation: period_feedback
            * (1 + random.below((0.3 / period_feedback) as usize)) as f64,
        limit_rate: published.limit_rate * random.between(0.5, 2.0),
        limit_moment: published.limit_moment * random.between(0.5, 3.0),
        initial_state: initial_states[random.below(3)],
        tensor_error: half(random, 0.08),
        ..published
    };
    if settings.initial_state != InitialState::Tube && settings.feedback.eigenvalues().is_some() {
        settings.delay_error = half(random, 0.5) * settings.delay.min(period_feedback);
    }
    settings
}

/// Flies the settings for 15 s if the design accepts them, and otherwise tries each bound that its
/// refusal names.
pub fn tried(settings: &Settings, seed: u64) -> Tried {
    let Err(error) = Crmpc::new(*settings) else {
        return Tried::Flown(Flight { duration: 15.0, ..Flight::random(settings, seed) }.fly());
    };
    let DesignError::NoGuarantee { disturbance, errors, delay, delay_error, .. } = error else {
        return Tried::Invalid(error.to_string());
    };
    // The bounds are rounded as the message prints them.
    let down = |value: f64| (value * 1e4).floor() / 1e4;
    let down_angle = |value: f64| down(value.to_degrees()).to_radians();
    let with = [
        disturbance.map(|bound| Settings { disturbance_bound: down_angle(bound), ..*settings }),
        errors.map(|(angle, rate)| Settings {
            angle_error: down_angle(angle),
            rate_error: down_angle(rate),
            ..*settings
        }),
        delay.map(|delay| Settings { delay: down(delay), ..*settings }),
        delay_error.map(|error| Settings { delay_error: down(error), ..*settings }),
    ];
    let named: Vec<Settings> = with.into_iter().flatten().collect();
    let refusal = |settings: &Settings| Crmpc::new(*settings).err();
    let not_accepted =
        named.iter().filter_map(refusal).map(|refusal| format!("{error}; then {refusal}"));
    Tried::Refused { bounds: named.len(), not_accepted: not_accepted.collect() }
}
