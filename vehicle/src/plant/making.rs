//! Makes a plant from its configuration, which it checks.

use super::Plant;
use super::config::Config;
use crate::actuators::{self, Actuators};
use crate::effectors::Surfaces;
use crate::error::{Error, finite, not_negative, positive};
use crate::sensors::Sensors;
use crate::state::BETA_LIMIT;
use crate::time::check_resolution;
use crate::transport::Transport;
use crate::turntable::Turntable;

impl Plant {
    /// Makes a plant in the initial state at `start_time` (s).
    ///
    /// # Errors
    /// Names the value of the configuration that is out of range.
    pub fn new(config: &Config, start_time: f64) -> Result<Self, Error> {
        let refuse = |name: &'static str, problem: String| Err(Error::parameter(name, problem));
        positive("inertia.scale", config.inertia_scale, "")?;
        let body = config.inertia.body(config.inertia_scale)?;
        finite("initial", &config.initial)?;
        if config.initial[1].abs() >= BETA_LIMIT {
            return refuse(
                "initial.beta",
                format!("= {} deg must lie within 90 deg", config.initial[1].to_degrees()),
            );
        }
        positive("integrator.step", config.step, " s")?;
        check_motion(config)?;
        if !config.earth_rate.is_finite() {
            return refuse("trajectory.earthRate", "is not finite".into());
        }
        let transport = Transport::new(config.moment_delay)?;
        if config.actuators.is_some() && transport.is_some() {
            let problem = format!(
                "= {} s delays an input moment, and there is none with actuators",
                config.moment_delay
            );
            return refuse("actuation.delay", problem);
        }
        let resolution = config.moment_resolution;
        not_negative("actuation.resolution", resolution, " N m")?;
        if config.actuators.is_some() && resolution > 0.0 {
            let problem = format!(
                "= {resolution} N m rounds an input moment, and there is none with actuators"
            );
            return refuse("actuation.resolution", problem);
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
        let actuators = |actuators: &actuators::Config| match &config.entry {
            None => Actuators::new(actuators),
            // The moment of the surfaces is proportional to the dynamic pressure of the flight.
            Some(_) => {
                Actuators::new(&actuators::Config { dynamic_pressure: 1.0, ..actuators.clone() })
            }
        };
        Ok(Self {
            body,
            kinematics: config.kinematics,
            earth_rate: config.earth_rate,
            disturbance: config.disturbance.clone(),
            actuators: config.actuators.as_ref().map(actuators).transpose()?,
            transport,
            moment_resolution: resolution,
            surroundings: config.surroundings,
            sensors: config
                .sensors
                .as_ref()
                .map(|sensors| Sensors::new(sensors, start_time))
                .transpose()?,
            turntable,
            entry: config.entry.clone().map(Box::new),
            origin: [config.motion[1], config.motion[2]],
            ended: None,
            step: config.step,
            start_time,
            held: None,
            noise: None,
            state: config.initial,
            motion: config.motion,
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
            && self.ended.is_none_or(f64::is_finite)
            && self
                .state
                .iter()
                .chain(&self.motion)
                .chain(&self.deflections)
                .all(|value| value.is_finite())
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
            && self.surroundings == other.surroundings
            && self.entry == other.entry
            && self.origin == other.origin
            && self.step == other.step
            && self.start_time == other.start_time
    }
}

/// Checks the motion of the centre of mass.
fn check_motion(config: &Config) -> Result<(), Error> {
    if let Some(entry) = &config.entry {
        entry.check(&config.motion)?;
        return Ok(());
    }
    finite("flight", &config.motion)
}
