//! Plant: the moving vehicle. It integrates its equations of motion from one communication point to
//! the next.
//!
//! | module | content |
//! |---|---|
//! | `equations` | the equations of motion |
//! | `config`, `making` | the configuration of a plant, and the plant that is made from it |
//! | `flight` | an entry flight |
//! | `loads` | the inputs, and the moments and derivatives that follow from them |
//! | `holding` | quantities that are held from one event to the next |
//! | `sensing` | measurements of the sensors |

mod config;
mod equations;
mod flight;
mod holding;
mod loads;
mod making;
mod sensing;

use crate::actuators::{Actuators, Command};
use crate::disturbance::Disturbance;
use crate::dynamics::RigidBody;
use crate::effectors::Surfaces;
use crate::entry;
use crate::error::Error;
use crate::integrator::{equal_steps, rk4};
use crate::kinematics::Kinematics;
use crate::noise::Stream;
use crate::platform::Surroundings;
use crate::sensors::Sensors;
use crate::time::tolerance;
use crate::transport::Transport;
use crate::turntable::Turntable;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

pub use crate::state::{BETA_LIMIT, State, angles, rates, state};
pub use config::Config;
pub use equations::{Load, check, derivative};
pub use flight::Entering;
pub use holding::Held;
pub use loads::Input;

/// Time (s) over which the standard atmosphere is approximated by a parabola.
const AIR_WAY: f64 = 0.05;

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
    surroundings: Surroundings,
    sensors: Option<Sensors>,
    turntable: Option<Turntable>,
    entry: Option<Box<entry::Config>>,
    /// Longitude and latitude at the start, rad.
    origin: [f64; 2],
    /// Time at which the entry flight ended, s.
    ended: Option<f64>,
    step: f64,
    start_time: f64,
    held: Option<Held>,
    /// Random numbers of the white noise, near the present tick. They follow from the seed.
    #[serde(skip)]
    noise: Option<Stream<3>>,
    /// Present state of the vehicle, rad and rad/s.
    pub state: State,
    /// Present motion of the centre of mass.
    pub motion: entry::Motion,
    /// Present deflections of the surfaces, rad; zero without actuators.
    pub deflections: Surfaces,
}

impl Plant {
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
            ("actuation.delay", format!("{} s delays", transport.delay()))
        } else if self.moment_resolution > 0.0 {
            ("actuation.resolution", format!("{} N m rounds", self.moment_resolution))
        } else {
            return Ok(());
        };
        // Inputs have derivatives up to order three, and a cubic with four equal values is
        // constant.
        let begin = input(from).moment;
        let mut parts = [1.0 / 3.0, 2.0 / 3.0, 1.0].into_iter();
        // Values that are not finite are reported where they are used.
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
    /// a piece. An entry flight that ends within the interval leaves the plant at its end, see
    /// [`Plant::ended`].
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
            // Over a longer path a parabola would be too inaccurate.
            let renewed = ((AIR_WAY / h) as u64).max(1);
            let mut air = None;
            for k in 0..steps {
                if self.entry.is_some() && k.is_multiple_of(renewed) {
                    air = Some(self.air_ahead(renewed as f64 * h));
                }
                let begin = time + k as f64 * h;
                let (motion, next) = if let (Some(entry), Some(air)) = (&self.entry, &air) {
                    self.moved(entry, (time, begin, h), air, &held, &mut input)
                } else {
                    let mut f = |t: f64, state: &State| {
                        let load = self.load((t, t - time), state[0], &input(t), &held);
                        equations::derivative(&self.body, self.kinematics, state, &load)
                    };
                    (self.motion, rk4(&mut f, begin, &self.state, h))
                };
                check(&next, begin + h)
                    .and_then(|()| self.check_motion(&motion, begin + h))
                    .map_err(|error| {
                        let fault = input(begin).fault().or_else(|| input(begin + h).fault());
                        let fault = fault.or_else(|| command.fault());
                        fault.map_or(error, |what| Error::NotFinite { time: begin, what })
                    })?;
                if let Some(air) = air.as_ref().filter(|_| self.has_ended_at(&motion)) {
                    self.end((time, begin, h), air, &held, &mut input);
                    return Ok(());
                }
                (self.motion, self.state) = (motion, next);
            }
            self.deflections += self.deflection_rates(&held) * (end - time);
            self.settle(end, &held);
            before = Some(held);
            time = end;
        }
        Ok(())
    }
}
