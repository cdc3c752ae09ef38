//! Plant: the moving vehicle. It integrates Θ̇ = R ω, plus the effect of a turning trajectory, and
//! ω̇ = I⁻¹(m − ω × I ω) + R⁻¹ Δ from one communication point to the next.

mod sensing;

use crate::actuators::{self, Actuators, Command, Drive};
use crate::calibration::Sequence;
use crate::disturbance::{Disturbance, DisturbanceKind, View};
use crate::dynamics::{Inertia, RigidBody};
use crate::effectors::{JETS, SURFACES, Surfaces};
use crate::error::Error;
use crate::integrator::{equal_steps, rk4};
use crate::kinematics::{Kinematics, TRAJECTORY, Trajectory};
use crate::noise::Stream;
use crate::platform::Surroundings;
use crate::sensors::{self, Sensors};
pub use crate::state::{BETA_LIMIT, State, angles, rates, state};
use crate::time::{check_resolution, tolerance};
use crate::transport::Transport;
use crate::turntable::{self, Turntable};
use nalgebra::{Matrix3, Matrix6, Matrix6x3, SMatrix, Vector3};
use serde::{Deserialize, Serialize};

/// Loads at one instant, which the right side needs besides the state.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Load {
    /// Sum of all moments about the body axes, N m.
    pub moment: Vector3<f64>,
    /// Disturbance Δ that enters ẋ_ω, rad/s².
    pub delta: Vector3<f64>,
    /// Turn rate of the trajectory's axes from [`Trajectory::turn_rate`], rad/s.
    pub turn_rate: Vector3<f64>,
}

/// State derivative. The angles follow Wu 2015 (1), and the rates Chai 2022 (1) with Δ = Δ_f-dot +
/// R Δ_m of (4b) put into the rate equation.
pub fn derivative(body: &RigidBody, kinematics: Kinematics, state: &State, load: &Load) -> State {
    let (angles, rates) = (angles(state), rates(state));
    let (matrix, inverse) = kinematics.r_and_inverse(&angles);
    let acceleration = body.angular_acceleration(&rates, &load.moment) + inverse * load.delta;
    let angle_rates = angle_rates(kinematics, &matrix, state, &load.turn_rate);
    self::state(&angle_rates, &acceleration)
}

/// Rates Θ̇ of the attitude angles (rad/s) by Wu 2015 (1), with R at the state as `matrix`.
fn angle_rates(
    kinematics: Kinematics,
    matrix: &Matrix3<f64>,
    state: &State,
    turn_rate: &Vector3<f64>,
) -> Vector3<f64> {
    let angle_rates = matrix * rates(state);
    if *turn_rate == Vector3::zeros() {
        return angle_rates;
    }
    angle_rates + kinematics.turn(&angles(state)) * turn_rate
}

/// Partial derivatives of the state derivative [`derivative`].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Partials {
    /// Derivative with respect to the state (6 × 6).
    pub by_state: Matrix6<f64>,
    /// Derivative with respect to the moment (6 × 3).
    pub by_moment: Matrix6x3<f64>,
    /// Derivative with respect to the trajectory's turn rate (6 × 3).
    pub by_turn_rate: Matrix6x3<f64>,
}

/// Returns the partial derivatives of [`derivative`].
pub fn partial_derivatives(
    body: &RigidBody,
    kinematics: Kinematics,
    state: &State,
    load: &Load,
) -> Partials {
    let (angles, rates) = (angles(state), rates(state));
    let (r, r_inverse) = (kinematics.r(&angles), kinematics.r_inverse(&angles));
    let (r_alpha, r_beta) = (kinematics.r_alpha(&angles), kinematics.r_beta(&angles));
    let gyroscopic: Matrix3<f64> =
        (body.inertia * rates).cross_matrix() - rates.cross_matrix() * body.inertia;
    let turned_by_beta = kinematics.turn_beta(&angles) * load.turn_rate;
    let turned_by_sigma = kinematics.turn_sigma(&angles) * load.turn_rate;
    let delta = r_inverse * load.delta;

    let mut by_state = Matrix6::zeros();
    by_state.fixed_view_mut::<3, 1>(0, 0).copy_from(&(r_alpha * rates));
    by_state.fixed_view_mut::<3, 1>(0, 1).copy_from(&(r_beta * rates + turned_by_beta));
    by_state.fixed_view_mut::<3, 1>(0, 2).copy_from(&turned_by_sigma);
    by_state.fixed_view_mut::<3, 3>(0, 3).copy_from(&r);
    // ∂R⁻¹ = −R⁻¹ ∂R R⁻¹
    by_state.fixed_view_mut::<3, 1>(3, 0).copy_from(&-(r_inverse * (r_alpha * delta)));
    by_state.fixed_view_mut::<3, 1>(3, 1).copy_from(&-(r_inverse * (r_beta * delta)));
    by_state.fixed_view_mut::<3, 3>(3, 3).copy_from(&(body.inverse * gyroscopic));

    let mut by_moment = Matrix6x3::zeros();
    by_moment.fixed_view_mut::<3, 3>(3, 0).copy_from(&body.inverse);
    let mut by_turn_rate = Matrix6x3::zeros();
    by_turn_rate.fixed_view_mut::<3, 3>(0, 0).copy_from(&kinematics.turn(&angles));
    Partials { by_state, by_moment, by_turn_rate }
}

/// Continuous inputs of the plant. Commands to the actuators are taken at instants and are
/// therefore not among them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Input {
    /// Control moment about the body axes, N m. It acts at once unless there are actuators or a
    /// transport delay.
    pub moment: Vector3<f64>,
    /// Further moment about the body axes, N m.
    pub disturbance_moment: Vector3<f64>,
    /// Trajectory of the vehicle, which turns the axes from which the angles are counted.
    pub trajectory: Trajectory,
}

impl Input {
    /// Returns the name of the input that holds a value that is not finite.
    fn fault(&self) -> Option<&'static str> {
        let broken = |values: &[f64]| values.iter().any(|value| !value.is_finite());
        if broken(self.moment.as_slice()) || broken(self.disturbance_moment.as_slice()) {
            return Some("moment");
        }
        broken(&self.trajectory.values()).then_some("trajectory")
    }
}

impl From<Vector3<f64>> for Input {
    /// Returns an input with this control moment (N m) and nothing else.
    fn from(moment: Vector3<f64>) -> Self {
        Self { moment, ..Self::default() }
    }
}

/// Configuration that determines the motion of a plant, apart from the inputs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Config {
    /// Nominal inertia of the vehicle.
    pub inertia: Inertia,
    /// Factor from the nominal inertia to that of the vehicle.
    pub inertia_scale: f64,
    /// State at the start of the experiment.
    pub initial: State,
    /// Disturbance that acts on the vehicle.
    pub disturbance: Disturbance,
    /// Attitude kinematics, with the matrix R in use.
    pub kinematics: Kinematics,
    /// Angular rate ω_e of the Earth, rad/s.
    pub earth_rate: f64,
    /// Surfaces and jets that make the control moment; without them the moment is an input.
    pub actuators: Option<actuators::Config>,
    /// Time (s, from 0 to [`crate::transport::LONGEST`]) after which the input moment acts; it is
    /// zero with actuators. A delayed moment is taken at the beginning of each communication step.
    pub moment_delay: f64,
    /// Step (N m) of the converter that the input moment passes; 0 for none. A converted moment is
    /// held over each communication step.
    pub moment_resolution: f64,
    /// Prescribed motion that starts at the initial angles and replaces the dynamics.
    pub calibration: Option<Sequence>,
    /// Gravity and magnetic field that the sensors measure.
    pub surroundings: Surroundings,
    /// Configuration of sampled sensors; without it the plant outputs the readings of ideal
    /// sensors.
    pub sensors: Option<sensors::Config>,
    /// Servo of the turntable on which sampled sensors stand.
    pub turntable: turntable::Config,
    /// Longest step of the integration, s.
    pub step: f64,
}

/// Quantities that are held for a while. The disturbance is held from one tick or change of its
/// waveform to the next, and the motion of the actuators until commands are taken or a deflection
/// comes to rest.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Held {
    /// Number of the interval over which the disturbance is held.
    tick: i64,
    /// Time at which the disturbance was drawn, s.
    since: f64,
    /// Value of Δ drawn at the beginning of the interval, rad/s².
    sample: Vector3<f64>,
    /// Whether the disturbance acts at present.
    acts: bool,
    /// Present motion of the actuators.
    drive: Drive,
    /// Moment that acts at present if the input moment is delayed, N m.
    delayed: Option<Vector3<f64>>,
}

impl Held {
    /// Disturbance Δ that acts at present, rad/s².
    pub fn delta(&self) -> Vector3<f64> {
        if self.acts { self.sample } else { Vector3::zeros() }
    }
}

/// Prescribed motion that replaces the dynamics.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct Calibration {
    sequence: Sequence,
    initial: Vector3<f64>,
}

/// Plant: the vehicle with its state.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Plant {
    body: RigidBody,
    kinematics: Kinematics,
    earth_rate: f64,
    disturbance: Disturbance,
    actuators: Option<Actuators>,
    transport: Option<Transport>,
    moment_resolution: f64,
    calibration: Option<Calibration>,
    surroundings: Surroundings,
    sensors: Option<Sensors>,
    turntable: Option<Turntable>,
    step: f64,
    start_time: f64,
    held: Option<Held>,
    /// Random numbers of the white noise, near the present tick. They follow from the seed.
    #[serde(skip)]
    noise: Option<Stream<3>>,
    /// Present state of the vehicle, rad and rad/s.
    pub state: State,
    /// Present deflections of the surfaces, rad; zero without actuators.
    pub deflections: Surfaces,
}

impl Plant {
    /// Makes a plant in the initial state at `start_time` (s).
    ///
    /// # Errors
    /// Names the value of the configuration that is out of range.
    pub fn new(config: &Config, start_time: f64) -> Result<Self, Error> {
        let refuse = |name: &'static str, problem: String| Err(Error::parameter(name, problem));
        if !(config.inertia_scale > 0.0 && config.inertia_scale.is_finite()) {
            return refuse("inertia_scale", format!("= {} must be positive", config.inertia_scale));
        }
        let body = config.inertia.body(config.inertia_scale)?;
        if !config.initial.iter().all(|value| value.is_finite()) {
            return refuse("initial", "holds a value that is not finite".into());
        }
        if config.initial[1].abs() >= BETA_LIMIT {
            return refuse(
                "initial[1]",
                format!("= {} deg must lie within 90 deg", config.initial[1].to_degrees()),
            );
        }
        if !(config.step > 0.0 && config.step.is_finite()) {
            return refuse("step", format!("= {} s must be positive", config.step));
        }
        if !config.earth_rate.is_finite() {
            return refuse("earth_rate", "is not finite".into());
        }
        let transport = Transport::new(config.moment_delay)?;
        if config.actuators.is_some() && transport.is_some() {
            let problem = format!(
                "= {} s delays an input moment, and there is none with actuators",
                config.moment_delay
            );
            return refuse("moment_delay", problem);
        }
        let resolution = config.moment_resolution;
        if !(resolution >= 0.0 && resolution.is_finite()) {
            return refuse("moment_resolution", format!("= {resolution} N m must not be negative"));
        }
        if config.actuators.is_some() && resolution > 0.0 {
            let problem = format!(
                "= {resolution} N m rounds an input moment, and there is none with actuators"
            );
            return refuse("moment_resolution", problem);
        }
        let turntable = Turntable::new(&config.turntable)?;
        if turntable.is_some() && config.sensors.is_none() {
            let problem = format!(
                "= {} Hz carries sampled sensors, and there are none",
                config.turntable.bandwidth
            );
            return refuse("turntable.bandwidth", problem);
        }
        config.disturbance.check()?;
        let held = config.disturbance.intervals(start_time).map(|(_, length)| length);
        for period in held.into_iter().chain([config.step]) {
            check_resolution(start_time, period)?;
        }
        config.surroundings.check()?;
        let initial = angles(&config.initial);
        let mut state = config.initial;
        if let Some(sequence) = &config.calibration {
            sequence.check(&initial)?;
            (state, _) = sequence.state_at(config.kinematics, &initial, 0.0);
        }
        Ok(Self {
            body,
            kinematics: config.kinematics,
            earth_rate: config.earth_rate,
            disturbance: config.disturbance.clone(),
            actuators: config.actuators.as_ref().map(Actuators::new).transpose()?,
            transport,
            moment_resolution: resolution,
            calibration: config.calibration.map(|sequence| Calibration { sequence, initial }),
            surroundings: config.surroundings,
            sensors: config
                .sensors
                .as_ref()
                .map(|sensors| Sensors::new(sensors, start_time))
                .transpose()?,
            turntable,
            step: config.step,
            start_time,
            held: None,
            noise: None,
            state,
            deflections: Surfaces::zeros(),
        })
    }

    /// Whether this plant can be a later state, at `time` (s), of `built`, which has the same
    /// configuration and start time. A restored plant is checked in this way because its data may
    /// be corrupt. A step that has `failed` may have gone beyond `time`.
    pub fn fits(&self, built: &Self, time: f64, failed: bool) -> bool {
        let held = self.held.as_ref().is_none_or(|held| {
            held.since.is_finite() && (self.actuators.is_none() || Actuators::fits(&held.drive))
        });
        let period =
            self.disturbance.intervals(self.start_time).map_or(self.step, |(_, length)| length);
        held && check_resolution(time, period).is_ok()
            && self.state.iter().chain(&self.deflections).all(|value| value.is_finite())
            && self.same_configuration(built)
            && self.sensors.as_ref().is_none_or(|sensors| sensors.fits(time, failed))
            && self.transport.as_ref().is_none_or(|transport| transport.fits(time, failed))
            && self.turntable.as_ref().is_none_or(|turntable| turntable.fits(time, failed))
    }

    fn same_configuration(&self, other: &Self) -> bool {
        let sensors = match (&self.sensors, &other.sensors) {
            (Some(one), Some(other)) => one.same_configuration(other),
            (one, other) => one.is_none() && other.is_none(),
        };
        let turntables = match (&self.turntable, &other.turntable) {
            (Some(one), Some(other)) => one.same_configuration(other),
            (one, other) => one.is_none() && other.is_none(),
        };
        let transport = self.transport.as_ref().map(Transport::delay);
        sensors
            && turntables
            && transport == other.transport.as_ref().map(Transport::delay)
            && self.body == other.body
            && self.kinematics == other.kinematics
            && self.earth_rate == other.earth_rate
            && self.disturbance == other.disturbance
            && self.actuators == other.actuators
            && self.moment_resolution == other.moment_resolution
            && self.calibration == other.calibration
            && self.surroundings == other.surroundings
            && self.step == other.step
            && self.start_time == other.start_time
    }

    /// Start time of the experiment, s.
    pub fn start_time(&self) -> f64 {
        self.start_time
    }

    /// Rigid body of the vehicle, with its inertia.
    pub fn body(&self) -> &RigidBody {
        &self.body
    }

    /// Present attitude angles Θ, rad.
    pub fn angles(&self) -> Vector3<f64> {
        angles(&self.state)
    }

    /// Present body rates ω, rad/s.
    pub fn rates(&self) -> Vector3<f64> {
        rates(&self.state)
    }

    /// Next time (s) after `time` at which the disturbance jumps or a sample is taken or arrives.
    pub fn next_event(&self, time: f64) -> Option<f64> {
        let jump = self.disturbance.next_change(self.start_time, time);
        let sample = self.sensors.as_ref().map(|sensors| sensors.next_event(time));
        jump.into_iter().chain(sample).min_by(f64::total_cmp)
    }

    /// Time (s) until each deflection comes to rest, infinite for one that is at rest.
    pub fn time_left(&self, held: &Held) -> Surfaces {
        self.actuators.as_ref().map_or(Surfaces::repeat(f64::INFINITY), |actuators| {
            actuators.time_left(&held.drive, &self.deflections)
        })
    }

    /// Next time (s) after `time` at which the right side may not be smooth or a sample is taken.
    fn next_change(&self, time: f64, held: &Held) -> Option<f64> {
        let jump = self.disturbance.next_change(self.start_time, time);
        let rest = self.actuators.is_some().then(|| time + self.time_left(held).min());
        let sample = self.sensors.as_ref().map(|sensors| sensors.next_sample(time));
        let arrival = self.transport.as_ref().and_then(|transport| transport.next_arrival(time));
        jump.into_iter().chain(rest).chain(sample).chain(arrival).min_by(f64::total_cmp)
    }

    /// Returns the quantities that hold from `time` (s) on if commands are taken then. If a tick
    /// has come, the disturbance is drawn from the present state and `input`, each time anew at the
    /// same tick; otherwise the one already held stays.
    pub fn in_force(&self, time: f64, input: &Input, command: &Command) -> Held {
        let commanded =
            |actuators: &Actuators| actuators.commanded(time, command, &self.deflections);
        self.drawn(time, input, self.actuators.as_ref().map_or_else(Drive::default, commanded))
    }

    fn drawn(&self, time: f64, input: &Input, drive: Drive) -> Held {
        let tick = self.disturbance.tick(self.start_time, time);
        let acts = self.disturbance.acts(time);
        let delayed = self.transport.as_ref().map(|transport| transport.moment(time));
        match self.held {
            Some(held) if held.tick == tick && time > held.since + tolerance(time) => {
                Held { acts, drive, delayed, ..held }
            }
            _ => {
                let (angles, rates) = (self.angles(), self.rates());
                let moment = self.control_moment(input, delayed, &drive, 0.0);
                let view = View {
                    body: &self.body,
                    kinematics: self.kinematics,
                    angles,
                    rates,
                    moment,
                    noise: self.noise.as_ref(),
                };
                Held {
                    tick,
                    since: time,
                    sample: self.disturbance.sample(tick, &view),
                    acts,
                    drive,
                    delayed,
                }
            }
        }
    }

    /// Adopts the result of [`Plant::in_force`]: commands hold until they are taken again, and the
    /// disturbance until the next tick. Deflections that have reached or just passed their target
    /// are set to it, and a sample that is due is taken.
    pub fn hold(&mut self, time: f64, input: &Input, command: &Command) -> Held {
        self.sense(time, input);
        if let Some(held) = self.held {
            self.settle(time, &held);
        }
        let held = self.in_force(time, input, command);
        self.settle(time, &held);
        self.adopt(&held)
    }

    /// Does the work of [`Plant::hold`] between two communication points, where no commands are
    /// taken.
    fn hold_between(&mut self, time: f64, input: &Input, before: &Held) -> Held {
        self.sense(time, input);
        let directed =
            |actuators: &Actuators| actuators.directed(time, before.drive, &self.deflections);
        let drive = self.actuators.as_ref().map_or_else(Drive::default, directed);
        self.adopt(&self.drawn(time, input, drive))
    }

    fn adopt(&mut self, held: &Held) -> Held {
        if self.disturbance.kind == DisturbanceKind::White {
            let seed = self.disturbance.seed;
            self.noise.get_or_insert_with(|| Stream::new(seed)).move_to(held.tick);
        }
        *self.held.insert(*held)
    }

    fn settle(&mut self, time: f64, held: &Held) {
        if let Some(actuators) = &self.actuators {
            actuators.settle(time, &held.drive, &mut self.deflections);
        }
    }

    /// Quantities that are held at present, or `None` before the first call of [`Plant::hold`].
    pub fn held(&self) -> Option<Held> {
        self.held
    }

    /// Disturbing moment (N m) at `time` (s): the sum of the external moment and that of the
    /// disturbance.
    pub fn disturbance_moment(&self, time: f64, input: &Input, held: &Held) -> Vector3<f64> {
        let disturbance_moment =
            if held.acts { self.disturbance.moment(time) } else { Vector3::zeros() };
        input.disturbance_moment + disturbance_moment
    }

    /// Control moment (N m) at the time `elapsed` (s) after the present one, provided that the
    /// drive does not change until then.
    fn control_moment(
        &self,
        input: &Input,
        delayed: Option<Vector3<f64>>,
        drive: &Drive,
        elapsed: f64,
    ) -> Vector3<f64> {
        self.actuators.as_ref().map_or_else(
            || self.converted(&delayed.unwrap_or(input.moment)),
            |actuators| {
                actuators.moment(drive, &(self.deflections + actuators.rates(drive) * elapsed))
            },
        )
    }

    /// Moment (N m) behind the converter.
    fn converted(&self, moment: &Vector3<f64>) -> Vector3<f64> {
        match self.moment_resolution {
            0.0 => *moment,
            step => moment.map(|component| (component / step).round() * step),
        }
    }

    /// Control moment (N m) that acts at present.
    pub fn applied_moment(&self, input: &Input, held: &Held) -> Vector3<f64> {
        self.control_moment(input, held.delayed, &held.drive, 0.0)
    }

    /// Rate of each deflection, rad/s: plus or minus the rate limit, or zero.
    pub fn deflection_rates(&self, held: &Held) -> Surfaces {
        self.actuators
            .as_ref()
            .map_or_else(Surfaces::zeros, |actuators| actuators.rates(&held.drive))
    }

    /// Partial derivatives of [`Plant::applied_moment`] with respect to the input moment (3 × 3)
    /// and the deflections (3 × 8).
    pub fn applied_moment_by_moment_and_deflections(
        &self,
    ) -> (Matrix3<f64>, SMatrix<f64, 3, SURFACES>) {
        let held = self.transport.is_some() || self.moment_resolution > 0.0;
        let at_once = if held { Matrix3::zeros() } else { Matrix3::identity() };
        self.actuators.as_ref().map_or((at_once, SMatrix::zeros()), |actuators| {
            (Matrix3::zeros(), *actuators.moment_by_deflections())
        })
    }

    /// Partial derivative of the applied moment with respect to the jet commands at the instant at
    /// which they are taken (3 × 10).
    pub fn applied_moment_by_jets(&self, command: &Command) -> SMatrix<f64, 3, JETS> {
        self.actuators
            .as_ref()
            .map_or_else(SMatrix::zeros, |actuators| actuators.moment_by_jets(command))
    }

    /// Turn rate (rad/s) of the trajectory, which is zero during the calibration sequence.
    fn turn_rate(&self, input: &Input) -> Vector3<f64> {
        if self.calibration.is_some() {
            return Vector3::zeros();
        }
        input.trajectory.turn_rate(self.earth_rate)
    }

    /// Returns the loads at `time` (s), which is `elapsed` (s) after the time of the deflections.
    fn load(&self, time: f64, input: &Input, held: &Held, elapsed: f64) -> Load {
        Load {
            moment: self.control_moment(input, held.delayed, &held.drive, elapsed)
                + self.disturbance_moment(time, input, held),
            delta: held.delta(),
            turn_rate: self.turn_rate(input),
        }
    }

    /// State derivative at `time` (s) for a given state.
    fn derivative_at(&self, time: f64, state: &State, load: &Load) -> State {
        match &self.calibration {
            None => derivative(&self.body, self.kinematics, state, load),
            Some(Calibration { sequence, initial }) => {
                sequence.state_at(self.kinematics, initial, time - self.start_time).1
            }
        }
    }

    /// State derivative at `time` (s) for the present state.
    pub fn derivative(&self, time: f64, input: &Input, held: &Held) -> State {
        self.derivative_at(time, &self.state, &self.load(time, input, held, 0.0))
    }

    /// Partial derivatives of [`Plant::derivative`], and those of the turn rate with respect to the
    /// trajectory (3 × 7).
    pub fn partial_derivatives(
        &self,
        time: f64,
        input: &Input,
        held: &Held,
    ) -> (Partials, SMatrix<f64, 3, TRAJECTORY>) {
        let load = self.load(time, input, held, 0.0);
        let mut partials = partial_derivatives(&self.body, self.kinematics, &self.state, &load);
        if self.calibration.is_some() {
            partials = Partials::default();
        }
        (partials, input.trajectory.turn_rate_by_fields(self.earth_rate))
    }

    /// Checks that a moment that is delayed or converted is held over a communication step.
    ///
    /// # Errors
    /// Reports a moment that is not held.
    fn check_held(
        &self,
        from: f64,
        to: f64,
        input: &mut impl FnMut(f64) -> Input,
    ) -> Result<(), Error> {
        let (name, done) = if let Some(transport) = &self.transport {
            ("moment_delay", format!("{} s delays", transport.delay()))
        } else if self.moment_resolution > 0.0 {
            ("moment_resolution", format!("{} N m rounds", self.moment_resolution))
        } else {
            return Ok(());
        };
        // Inputs have derivatives up to order three, and a cubic with four equal values is
        // constant.
        let begin = input(from).moment;
        let mut parts = [1.0 / 3.0, 2.0 / 3.0, 1.0].into_iter();
        // What is not finite is reported as such where it is used.
        let finite = begin.iter().all(|value| value.is_finite());
        if !finite || parts.all(|part| input(from + part * (to - from)).moment == begin) {
            return Ok(());
        }
        let problem = format!(
            "= {done} a moment that is held over each communication step; give its inputs no derivatives"
        );
        Err(Error::parameter(name, problem))
    }

    /// Moves the plant from `from` to `to` (s) under a constant control moment (N m).
    ///
    /// # Errors
    /// Reports that the attitude becomes singular or a value is not finite; the state is then the
    /// last good one.
    pub fn advance(&mut self, from: f64, to: f64, moment: Vector3<f64>) -> Result<(), Error> {
        self.advance_with(from, to, &Command::default(), |_| moment.into())
    }

    /// Moves the plant from `from` to `to` (s) under an input that is a function of time. The
    /// `command`, and a delayed moment, are taken at `from`. The interval is cut where the
    /// disturbance jumps, a deflection comes to rest or a delayed moment arrives. Every piece is
    /// integrated in equal steps, so the end is met exactly. Deflections are linear in time within
    /// a piece.
    ///
    /// # Errors
    /// Reports that the attitude becomes singular or a value is not finite; the state is then the
    /// last good one. Also refuses a delayed moment that is not held over the interval, or too many
    /// changes of it under way at once.
    pub fn advance_with(
        &mut self,
        from: f64,
        to: f64,
        command: &Command,
        mut input: impl FnMut(f64) -> Input,
    ) -> Result<(), Error> {
        if from < to {
            self.check_held(from, to, &mut input)?;
            if let Some(transport) = &mut self.transport {
                transport.command(from, input(from).moment)?;
            }
        }
        let mut time = from;
        let mut before = None;
        while time < to {
            let held = match before {
                None => self.hold(time, &input(time), command),
                Some(before) => self.hold_between(time, &input(time), &before),
            };
            let cut = self
                .next_change(time, &held)
                .filter(|&change| change > time && change + tolerance(to) < to);
            let end = cut.unwrap_or(to);
            let steps = equal_steps(end - time, self.step);
            let h = (end - time) / steps as f64;
            for k in 0..steps {
                let begin = time + k as f64 * h;
                let mut f = |t: f64, state: &State| {
                    let load = self.load(t, &input(t), &held, t - time);
                    self.derivative_at(t, state, &load)
                };
                let next = rk4(&mut f, begin, &self.state, h);
                check(&next, begin + h).map_err(|error| {
                    let fault = input(begin).fault().or_else(|| input(begin + h).fault());
                    let fault = fault.or_else(|| command.fault());
                    fault.map_or(error, |what| Error::NotFinite { time: begin, what })
                })?;
                self.state = next;
            }
            self.deflections += self.deflection_rates(&held) * (end - time);
            self.settle(end, &held);
            before = Some(held);
            time = end;
        }
        Ok(())
    }
}

/// Checks that the equations hold at a state.
///
/// # Errors
/// Reports a state that is not finite or has a sideslip angle of ±90°.
pub fn check(state: &State, time: f64) -> Result<(), Error> {
    if !state.iter().all(|value| value.is_finite()) {
        return Err(Error::NotFinite { time, what: "attitude or rate" });
    }
    if state[1].abs() >= BETA_LIMIT {
        return Err(Error::Singular { time, beta_deg: state[1].to_degrees() });
    }
    Ok(())
}
