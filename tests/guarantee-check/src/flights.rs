//! Flights whose accepted plans are recorded for the check: any start, reference, disturbance,
//! inertia and measurement error within the assumptions of the guarantee.

pub use crate::random::Random;
use control::crmpc::{Crmpc, Plan, Settings};
use control::delay::{Delayed, Latency};
use control::error::DesignError;
use control::{Controller, Measurement};
use nalgebra::{Matrix3, Rotation3, Vector3};
use vehicle::dynamics::RigidBody;
use vehicle::integrator::rk4;
use vehicle::kinematics::{self, Kinematics};
use vehicle::plant::{self, Load, State};
use vehicle::profile::Profile;
use vehicle::scenario::Scenario;
use vehicle::transport::Transport;

/// A plan that the controller accepted, as it follows it from an optimisation on.
#[derive(Clone, Debug)]
pub struct Recorded {
    /// Nominal trajectory over the horizon, with its braking rate.
    pub plan: Plan,
    /// Feedback ticks from the beginning of the nominal trajectory to the beginning of the plan.
    pub age: usize,
    /// Time of the optimisation, s.
    pub time: f64,
}

/// How a bounded vector changes over time, relative to its bound.
#[derive(Clone, Copy, Debug)]
enum Waveform {
    White,
    Corner(Vector3<f64>),
    Switching(f64),
    AlongRate(f64),
    AlongMoment(f64),
}

impl Waveform {
    fn random(random: &mut Random) -> Self {
        let direction = random.between(-1.0, 1.0).signum();
        match random.below(5) {
            0 => Self::White,
            1 => Self::Corner(random.corner()),
            2 => Self::Switching(random.between(0.1, 3.0)),
            3 => Self::AlongRate(direction),
            _ => Self::AlongMoment(direction),
        }
    }
}

/// A flight from a random start.
pub struct Flight {
    settings: Settings,
    body: RigidBody,
    start: State,
    reference: Profile,
    begin: f64,
    disturbance: Waveform,
    errors: Waveform,
    /// Derivative of the slow errors of the angles, and their present values, rad.
    slow: (Waveform, Vector3<f64>),
    random: Random,
    duration: f64,
}

/// Integration step, and time over which the disturbance is held, at most, s.
const STEP: f64 = 0.02;

impl Flight {
    /// Draws a flight of `duration` (s).
    ///
    /// # Errors
    /// Reports an inertia that no body can have.
    pub fn random(settings: &Settings, seed: u64, duration: f64) -> Result<Self, String> {
        let mut random = Random::new(seed);
        let scenario = Scenario::crmpc2022();
        let scale = match random.below(3) {
            0 => 1.0 - settings.inertia_error,
            1 => 1.0 + settings.inertia_error,
            _ => 1.0 + settings.inertia_error * random.between(-1.0, 1.0),
        };
        let inertia = erroneous(settings, seed) * scale;
        let body = RigidBody::new(inertia).ok_or("no such inertia")?;
        let begin = random.between(0.0, 50.0);
        let reference = match random.below(3) {
            0 => scenario.reference.clone(),
            1 => sine(&mut random),
            _ => {
                let [before, after] = [0, 1].map(|_| steady(&mut random));
                Profile::step(before, after, begin + random.between(0.0, duration))
            }
        };
        let first = reference.at(begin).angles;
        let mut angles = first + random.vector().component_mul(&degrees([10.0, 8.0, 12.0]));
        if random.below(4) == 0 {
            // Near the edge of the domain, and on the way to it.
            let edge = settings.sideslip_domain * random.between(0.9, 1.0);
            angles.y = random.between(-1.0, 1.0).signum() * edge;
        }
        let more = &mut Random::new(seed ^ 1 << 41);
        let slow = (Waveform::random(more), more.corner() * settings.slow_angle_error);
        let direction = random.vector().normalize();
        let rates = direction * settings.limit_rate * random.between(0.0, 0.95);
        Ok(Self {
            settings: *settings,
            body,
            start: plant::state(&angles, &rates),
            reference,
            begin,
            disturbance: Waveform::random(&mut random),
            errors: Waveform::random(&mut random),
            slow,
            random,
            duration,
        })
    }

    /// Flies, and hands every plan that the controller accepts under guarantee to `observe`.
    ///
    /// # Errors
    /// Reports settings that no controller can be designed for.
    pub fn record(mut self, mut observe: impl FnMut(&Recorded)) -> Result<(), DesignError> {
        let s = self.settings;
        let law = Crmpc::new(s)?;
        let ratio = law.design().ratio as u64;
        let latency = Latency { measurement: 0.0, action: s.delay };
        let mut controller = Delayed::new(law, s.body, s.period_feedback, latency, s.limit_moment)?;
        let mut memory = controller.memory();
        let mut transport = Transport::new(s.delay).unwrap_or_default();
        let (profile, begin) = (self.reference.clone(), self.begin);
        let reference = |time: f64| profile.at(begin + time);
        let mut state = self.start;
        let mut acting = Vector3::zeros();
        for tick in 0..(self.duration / s.period_feedback).round() as u64 {
            let time = tick as f64 * s.period_feedback;
            let measured = self.measure(&state, &acting, time);
            let moment = controller.update(&mut memory, tick, time, &measured, &reference);
            if tick % ratio == 0 && memory.inner.assured() {
                let (plan, age) = (memory.inner.plan.clone(), memory.inner.age as usize);
                observe(&Recorded { plan, age, time });
            }
            match &mut transport {
                Some(transport) => drop(transport.command(time, moment)),
                None => acting = moment,
            }
            state = self.advance(state, time, &mut acting, transport.as_ref());
            let sideslip = plant::angles(&state).y.abs();
            if sideslip.is_nan() || sideslip > 1.2 {
                break;
            }
        }
        Ok(())
    }

    /// Measures the state with errors of angles and x_ω within their bounds.
    fn measure(&mut self, state: &State, moment: &Vector3<f64>, time: f64) -> Measurement {
        let angles = plant::angles(state) + self.slow_error(state, moment, time);
        let rates = plant::rates(state);
        let Settings { angle_error, rate_error, .. } = self.settings;
        let waveform = self.errors;
        let error = self.value(waveform, state, moment, time);
        let seen = angles + error * angle_error;
        let angle_rates = kinematics::r(&angles) * rates + error * rate_error;
        let rates = kinematics::r_inverse(&seen) * angle_rates;
        Measurement { angles: seen, rates, ..Measurement::default() }
    }

    /// Changes the slow errors of the angles by as much as they may in a feedback period.
    fn slow_error(&mut self, state: &State, moment: &Vector3<f64>, time: f64) -> Vector3<f64> {
        let Settings { slow_angle_error: most, slow_angle_rate, period_feedback, .. } =
            self.settings;
        if slow_angle_rate > 0.0 {
            let derivative = self.value(self.slow.0, state, moment, time) * slow_angle_rate;
            self.slow.1 += derivative * period_feedback;
            for i in 0..2 {
                self.slow.1[i] = self.slow.1[i].clamp(-most, most);
            }
        }
        self.slow.1
    }

    fn value(
        &mut self,
        waveform: Waveform,
        state: &State,
        moment: &Vector3<f64>,
        time: f64,
    ) -> Vector3<f64> {
        let r = kinematics::r(&plant::angles(state));
        match waveform {
            Waveform::White => self.random.vector(),
            Waveform::Corner(corner) => corner,
            Waveform::Switching(period) => {
                let place = (time / period).floor() as u64;
                Random::new(place ^ (period.to_bits() >> 20)).corner()
            }
            Waveform::AlongRate(direction) => {
                (r * plant::rates(state)).map(f64::signum) * direction
            }
            Waveform::AlongMoment(direction) => {
                (r * self.body.inverse * moment).map(f64::signum) * direction
            }
        }
    }

    /// Integrates the motion over one feedback period.
    fn advance(
        &mut self,
        mut state: State,
        time: f64,
        acting: &mut Vector3<f64>,
        transport: Option<&Transport>,
    ) -> State {
        let (mut now, end) = (time, time + self.settings.period_feedback);
        while now < end - 1e-12 {
            let mut until = (now + STEP).min(end);
            if let Some(transport) = transport {
                *acting = transport.moment(now + 1e-12);
                let arrival = transport.next_arrival(now + 1e-12).unwrap_or(until);
                if arrival > now + 1e-9 {
                    until = until.min(arrival);
                }
            }
            let waveform = self.disturbance;
            let delta = self.value(waveform, &state, acting, now) * self.settings.disturbance_bound;
            let load = Load { moment: *acting, delta, ..Load::default() };
            let mut f = |_: f64, state: &State| {
                plant::derivative(&self.body, Kinematics::Printed, state, &load)
            };
            state = rk4(&mut f, now, &state, until - now);
            now = until;
        }
        state
    }
}

/// The inertia with an error of the tensor within its bound, often at it.
fn erroneous(s: &Settings, seed: u64) -> Matrix3<f64> {
    if s.tensor_error == 0.0 {
        return s.body.inertia;
    }
    let eigen = s.body.inertia.symmetric_eigen();
    let roots = Matrix3::from_diagonal(&eigen.eigenvalues.map(f64::sqrt));
    let root = eigen.eigenvectors * roots * eigen.eigenvectors.transpose();
    let mut random = Random::new(seed ^ 1 << 40);
    let axes = Rotation3::new(random.vector() * 3.0).into_inner();
    let sizes = random.vector().map(|size| (2.0 * size).clamp(-1.0, 1.0) * s.tensor_error);
    let error = axes * Matrix3::from_diagonal(&sizes) * axes.transpose();
    let inertia = root * (Matrix3::identity() + error) * root;
    // Products are symmetric except for rounding.
    (inertia + inertia.transpose()) * 0.5
}

fn degrees(values: [f64; 3]) -> Vector3<f64> {
    Vector3::from(values).map(f64::to_radians)
}

fn steady(random: &mut Random) -> Vector3<f64> {
    degrees([10.0, 0.0, -30.0]) + random.vector().component_mul(&degrees([8.0, 6.0, 15.0]))
}

fn sine(random: &mut Random) -> Profile {
    let amplitude = random.vector().component_mul(&degrees([4.0, 3.0, 8.0]));
    let (frequency, phase) = (random.between(0.1, 0.8), random.between(0.0, 6.3));
    Profile::sine(steady(random), amplitude, frequency, phase)
}
