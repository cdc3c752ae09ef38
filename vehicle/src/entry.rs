//! Entry flight: the motion of the vehicle's centre of mass, and the effect of the air on it.
//!
//! The attitude angles Θ are counted from the trajectory's axes, that is from the velocity relative
//! to the rotating planet. The air's forces follow from the flow past the vehicle, which a wind
//! turns away from that velocity.

mod motion;
mod start;

pub use motion::{
    MOTION, Motion, NOMINALS, RATE_UNITS, STEEPEST, UNITS, check, great_circle, motion_rate,
};
pub use start::Start;

use crate::actuators;
use crate::aerodynamics::{Aerodynamics, Flow};
use crate::air::{Air, Conditions};
use crate::axes::{ANGLES, FLOW};
use crate::error::{Error, not_negative, positive};
use crate::kinematics::{Kinematics, Sines, sines};
use crate::math::{asin, atan2};
use crate::platform::{body_from_velocity, body_from_velocity_at, velocity_from_level};
use crate::trajectory::Trajectory;
use crate::translation::Planet;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use settings::{Choice, Declared};

/// Angle of attack at which the vehicle is trimmed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Choice)]
#[serde(rename_all = "camelCase")]
pub enum Trim {
    /// any, as if trim followed the angle of attack at once.
    #[default]
    Anywhere,
    /// the input trim.alpha, about which the static pitch moment acts.
    Input,
}

/// Factors on the air forces and moments, which an on-board computer does not know.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Declared)]
pub struct Deviations {
    /// Ratio of the actual to the nominal lift.
    #[setting(name = "lift.scale", min = 0.0, max = 10.0, nominal = 1.0)]
    pub lift: f64,
    /// Ratio of the actual to the nominal drag.
    #[setting(name = "drag.scale", min = 0.0, max = 10.0, nominal = 1.0)]
    pub drag: f64,
    /// Ratio of the actual to the nominal side force.
    #[setting(name = "side.scale", min = 0.0, max = 10.0, nominal = 1.0)]
    pub side: f64,
    /// Ratio of the actual to the nominal moments of the air, without those of the surfaces.
    #[setting(name = "moment.scale", min = 0.0, max = 10.0, nominal = 1.0)]
    pub moment: f64,
    /// Error of the coefficient of the pitch moment at trim.
    #[setting(name = "pitch.offset", min = -1.0, max = 1.0, nominal = 1e-3)]
    pub pitch: f64,
}

impl Default for Deviations {
    fn default() -> Self {
        Self { lift: 1.0, drag: 1.0, side: 1.0, moment: 1.0, pitch: 0.0 }
    }
}

/// Ideal loop of a prescribed attitude.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Declared)]
pub struct Following {
    /// If true, the attitude of an entry flight follows the inputs prescribed.* by an ideal loop,
    /// whatever the moments.
    pub active: bool,
    /// Natural frequency of this loop, which is critically damped.
    #[setting(unit = "rad/s", above = 0.0, max = 100.0, nominal = 1.0)]
    #[setting(used_with = "~.active = true")]
    pub frequency: f64,
}

/// Altitude or speed at which the flight ends.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Declared)]
pub struct End {
    /// Altitude below which the simulation of an entry flight ends.
    #[setting(unit = "m", nominal = 1e4)]
    pub altitude: f64,
    /// Speed below which the simulation of an entry flight ends.
    #[setting(unit = "m/s", min = 0.0, nominal = 1e3)]
    pub speed: f64,
}

/// Configuration of an entry flight.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Config {
    /// The planet.
    pub planet: Planet,
    /// Forces and moments of the air.
    pub aerodynamics: Aerodynamics,
    /// Factors on them.
    pub deviations: Deviations,
    /// The air.
    pub air: Air,
    /// Where the vehicle is trimmed.
    pub trim: Trim,
    /// Ideal loop that makes the attitude follow a prescribed one.
    pub following: Following,
    /// When the flight ends.
    pub end: End,
}

/// Attitude that an ideal loop follows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Declared)]
pub struct Prescribed {
    /// Prescribed {}.
    #[setting(name = "", each = ANGLES, unit = "rad", nominal = 0.1)]
    pub angles: Vector3<f64>,
    /// Time derivative of the prescribed {}.
    #[setting(name = "+Rate", each = ANGLES, unit = "rad/s", nominal = 0.1)]
    pub rates: Vector3<f64>,
}

/// The vehicle in the air at one instant.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Declared)]
pub struct Passage {
    /// Actual dynamic pressure, with density.scale applied.
    #[setting(name = "flight.dynamicPressure", unit = "Pa", nominal = 1e3)]
    #[setting(depends_on = ["motion.*"])]
    pub dynamic_pressure: f64,
    /// Dynamic pressure without density.scale, the air's profile and wind.
    ///
    /// An on-board computer knows this one.
    #[setting(name = "flight.standardDynamicPressure", unit = "Pa", nominal = 1e3)]
    #[setting(depends_on = ["motion.*"])]
    pub known_pressure: f64,
    /// Mach number.
    #[setting(name = "flow.mach", nominal = 10.0)]
    pub mach: f64,
    /// Speed relative to the air.
    #[setting(name = "flow.speed", unit = "m/s", nominal = 1e3)]
    pub airspeed: f64,
    /// Density of the air.
    #[setting(name = "flow.density", unit = "kg/m3", nominal = 1e-3)]
    pub density: f64,
    /// {} relative to the air.
    #[setting(name = "flow", each = FLOW, unit = "rad", nominal = 0.1)]
    pub air_angles: [f64; 2],
    /// Lift per mass; 0 without an entry flight.
    #[setting(name = "load.lift", unit = "m/s2", nominal = 10.0)]
    pub lift: f64,
    /// Drag per mass; 0 without an entry flight.
    #[setting(name = "load.drag", unit = "m/s2", nominal = 10.0)]
    pub drag: f64,
    /// Specific force along the trajectory's axes, m/s².
    #[setting(skip)]
    pub specific_force: Vector3<f64>,
    /// Moment of the surfaces relative to that at 1 Pa.
    #[setting(skip)]
    pub surface_pressure: f64,
}

impl Passage {
    /// Returns the flow past the vehicle.
    pub fn flow(&self) -> Flow {
        let [alpha, beta] = self.air_angles;
        Flow {
            dynamic_pressure: self.dynamic_pressure,
            mach: self.mach,
            speed: self.airspeed,
            alpha,
            beta,
        }
    }

    /// Returns the flow past the surfaces.
    pub(crate) fn conditions(&self) -> actuators::Conditions {
        actuators::Conditions::Entry(self.surface_pressure, self.flow())
    }
}

impl Config {
    /// Checks the values, and that the flight from `motion` has not ended before it begins.
    ///
    /// # Errors
    /// Names the value at fault.
    pub fn check(&self, motion: &Motion) -> Result<(), Error> {
        let refuse = |name: &'static str, problem: String| Err(Error::parameter(name, problem));
        let Planet { radius, flattening, gravitation, oblateness, rate } = self.planet;
        let planet = [
            ("planet.radius", radius),
            ("planet.flattening", flattening),
            ("planet.gravitation", gravitation),
            ("planet.oblateness", oblateness),
            ("planet.rate", rate),
        ];
        for (name, value) in planet {
            not_negative(name, value, "")?;
        }
        positive("planet.radius", radius, " m")?;
        let Deviations { lift, drag, side, moment, pitch } = self.deviations;
        for (name, value) in [
            ("aerodynamics.lift.scale", lift),
            ("aerodynamics.drag.scale", drag),
            ("aerodynamics.side.scale", side),
            ("aerodynamics.moment.scale", moment),
        ] {
            not_negative(name, value, "")?;
        }
        if !pitch.is_finite() {
            return refuse("aerodynamics.pitch.offset", "is not finite".into());
        }
        positive("prescribed.frequency", self.following.frequency, " rad/s")?;
        self.air.check()?;
        for ((ending, _), value) in MOTION.iter().zip(motion) {
            if !value.is_finite() {
                return Err(Error::parameter(format!("initial{ending}"), "is not finite"));
            }
        }
        let [altitude, _, latitude, speed, path, _] = (*motion).into();
        for (name, angle) in [("initial.latitude", latitude), ("initial.flightPathAngle", path)] {
            if angle.abs() > STEEPEST {
                let problem = format!("= {} deg must lie within 90 deg", angle.to_degrees());
                return refuse(name, problem);
            }
        }
        if altitude <= self.end.altitude {
            let problem =
                format!("= {altitude} m must lie above end.altitude = {} m", self.end.altitude);
            return refuse("initial.altitude", problem);
        }
        if speed <= self.end.speed.max(0.0) {
            let problem = format!("= {speed} m/s must exceed end.speed = {} m/s", self.end.speed);
            return refuse("initial.speed", problem);
        }
        Ok(())
    }

    /// How far the flight is from its end: altitude (m) above and speed (m/s) beyond those at which
    /// it ends. One of them is zero at the end.
    pub fn margins(&self, motion: &Motion) -> [f64; 2] {
        [motion[0] - self.end.altitude, motion[3] - self.end.speed]
    }

    /// Returns the effect of the air on the vehicle at `time` (s).
    pub fn passage(&self, time: f64, motion: &Motion, angles: &Vector3<f64>) -> Passage {
        self.passage_through(&self.air.at(time, motion[0]), motion, (angles, &sines(angles)))
    }

    /// Returns the effect of the air on the vehicle under given conditions, at attitude angles with
    /// these sines and cosines.
    pub(crate) fn passage_through(
        &self,
        conditions: &Conditions,
        motion: &Motion,
        (angles, sines): (&Vector3<f64>, &Sines),
    ) -> Passage {
        let [_, _, _, speed, path, heading] = (*motion).into();
        let Conditions { density, known_density, sound_speed, wind } = *conditions;
        // Flow past the vehicle along the body axes, and its speed and angles.
        let mut relative = Vector3::new(speed, 0.0, 0.0);
        let mut air_angles = [angles.x, angles.y];
        let mut airspeed = speed;
        let is_windy = wind != Vector3::zeros();
        let body_axes = is_windy.then(|| body_from_velocity_at(sines));
        if let Some(body_axes) = &body_axes {
            let course = Trajectory { flight_path_angle: path, heading, ..Trajectory::default() };
            relative -= velocity_from_level(&course) * wind;
            airspeed = relative.norm();
            let along = body_axes * relative;
            air_angles = [atan2(along.z, along.x), asin((along.y / airspeed).clamp(-1.0, 1.0))];
        }
        let [alpha, beta] = air_angles;
        let dynamic_pressure = 0.5 * density * airspeed * airspeed;
        let flow =
            Flow { dynamic_pressure, mach: airspeed / sound_speed, speed: airspeed, alpha, beta };
        let mass = self.aerodynamics.mass();
        let Deviations { drag, side, lift, .. } = self.deviations;
        let nominal = self.aerodynamics.forces(&flow).map(|force| force / mass);
        let (drag, side, lift) = (nominal[0] * drag, nominal[1] * side, nominal[2] * lift);
        // Along the axes of the flow, drag acts backward and lift upward. The bank angle leads from
        // these axes to the trajectory's, if there is no wind.
        let along_flow = Vector3::new(-drag, side, -lift);
        let specific_force = if let Some(body_axes) = &body_axes {
            let body_from_flow = body_from_velocity(&Vector3::new(alpha, beta, 0.0));
            body_axes.transpose() * (body_from_flow * along_flow)
        } else {
            let (sine, cosine) = sines[2];
            Vector3::new(-drag, cosine * side - sine * lift, -sine * side - cosine * lift)
        };
        Passage {
            density,
            known_pressure: 0.5 * known_density * speed * speed,
            dynamic_pressure,
            mach: flow.mach,
            airspeed,
            air_angles,
            lift,
            drag,
            specific_force,
            surface_pressure: dynamic_pressure * self.aerodynamics.surface_effectiveness(&flow),
        }
    }

    /// Returns the moment of the air about the centre of mass (N m) without that of the surfaces,
    /// at body `rates` (rad/s); `trim` is the input for the angle of attack at which the vehicle is
    /// trimmed, rad.
    #[inline]
    pub fn moment(&self, passage: &Passage, rates: &Vector3<f64>, trim: f64) -> Vector3<f64> {
        let flow = passage.flow();
        let trim = match self.trim {
            Trim::Anywhere => flow.alpha,
            Trim::Input => trim,
        };
        let mut moment = self.aerodynamics.moment(&flow, rates, trim) * self.deviations.moment;
        moment.y += self.aerodynamics.pitch_moment(&flow, self.deviations.pitch);
        if let Some(point) = self.aerodynamics.moment_point() {
            // The forces act at the point of the moments, which leaves a lever arm.
            let [_, side, _] = self.aerodynamics.forces(&flow);
            let mass = self.aerodynamics.mass();
            let side = side * self.deviations.side;
            let force = Vector3::new(-passage.drag * mass, side, -passage.lift * mass);
            let along_flow = Vector3::new(flow.alpha, flow.beta, 0.0);
            moment += point.cross(&(body_from_velocity(&along_flow) * force));
        }
        moment
    }

    /// Returns the heat flux into the leading edge, W/m².
    pub fn heat_flux(&self, passage: &Passage) -> f64 {
        let Passage { density, airspeed, air_angles: [alpha, _], .. } = *passage;
        self.aerodynamics.heat_flux(density, airspeed, alpha)
    }

    /// Returns the time derivative of the motion, the trajectory's angles and rates, and the turn
    /// rate of its axes, rad/s.
    pub fn derivative(
        &self,
        motion: &Motion,
        passage: &Passage,
    ) -> (Motion, Trajectory, Vector3<f64>) {
        let mut trajectory = Trajectory {
            flight_path_angle: motion[4],
            heading: motion[5],
            latitude: motion[2],
            ..Trajectory::default()
        };
        let sines = trajectory.sines();
        let derivative = motion_rate(&self.planet, motion, &sines, &passage.specific_force);
        trajectory = Trajectory {
            flight_path_angle_rate: derivative[4],
            heading_rate: derivative[5],
            longitude_rate: derivative[1],
            latitude_rate: derivative[2],
            ..trajectory
        };
        let around = trajectory.longitude_rate + self.planet.rate;
        (derivative, trajectory, trajectory.turn_rate_at(around, &sines))
    }

    /// Returns the angular acceleration (rad/s²) of the ideal loop that follows a prescribed
    /// attitude: with natural frequency f and critical damping, ω̇ = 2 f (ω_c − ω), where ω_c gives
    /// the angles the rates Θ̇_c + f/2 (Θ_c − Θ).
    pub fn prescribed_acceleration(
        &self,
        kinematics: Kinematics,
        prescribed: &Prescribed,
        (angles, rates): (&Vector3<f64>, &Vector3<f64>),
        turn_rate: &Vector3<f64>,
    ) -> Vector3<f64> {
        let frequency = self.following.frequency;
        let wanted = prescribed.rates + (prescribed.angles - angles) * (frequency / 2.0);
        let turned = kinematics.turn(angles) * turn_rate;
        let command = kinematics.r_inverse(angles) * (wanted - turned);
        (command - rates) * (2.0 * frequency)
    }
}
