//! Actuators turn commands to surfaces and jets into the control moment. A command passes through
//! these effects, in this order:
//!
//! 1. surface: position limits on the command, Wu 2015 (63)
//! 2. surface: rate limit, (63); the deflection moves to the limited command and stops there
//! 3. surface: moment D_A δ_A, (57), at the dynamic pressure of the flight
//! 4. jet: on from a command of one half, or a duty cycle cut off at 0 and 1
//! 5. jet: moment D_RCS δ_RCS, (57)
//!
//! Commands are taken at instants and held in between. The rate of a deflection is constant until
//! the deflection comes to rest, so the right side of its differential equation and its exact
//! solution are both available.

use crate::aerodynamics::{Flow, SurfaceTable};
use crate::effectors::{
    EffectorFault, EffectorFaultKind, Effectors, JETS, Jets, SURFACE_NAMES, SURFACES, Surfaces,
    moment_of_tables,
};
use crate::error::{Error, not_negative};
use crate::time::tolerance;
use nalgebra::{SMatrix, Vector3};
use serde::{Deserialize, Serialize};
use settings::{Declared, Invalid};

/// Command at or above which a jet in on-off mode is switched on.
pub const THRESHOLD: f64 = 0.5;

/// Meaning of a jet's command at the instant at which it is taken.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum JetMode {
    /// The jet gives full thrust for commands at or above [`THRESHOLD`] and none below.
    #[default]
    OnOff,
    /// The command is the mean thrust as a fraction of the full one.
    Duty,
}

/// Configuration that determines the actuators completely.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Config {
    /// Moments and limits of the surfaces and jets.
    pub effectors: Effectors,
    /// Meaning of the commands to the jets.
    pub jet_mode: JetMode,
    /// Dynamic pressure of the flight condition, Pa.
    pub dynamic_pressure: f64,
    /// Mach number of the flight condition.
    pub mach: f64,
    /// Factor from the nominal surface effectiveness to that of the vehicle.
    pub aerodynamics_scale: f64,
    /// A surface or a jet that fails.
    pub fault: EffectorFault,
}

/// Commands to the surfaces and jets.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Declared)]
pub struct Command {
    /// Commanded deflection of the {}, trailing edge down positive.
    #[setting(name = "surface", each = SURFACE_NAMES, unit = "rad", nominal = 0.1)]
    pub surfaces: Surfaces,
    /// Command to jet {}: 0 for off, 1 for full thrust.
    #[setting(name = "jet", nominal = 1.0)]
    pub jets: Jets,
}

impl Command {
    /// Returns the name of the command if one of its values is not finite.
    pub(crate) fn fault(&self) -> Option<&'static str> {
        let broken = self.surfaces.iter().chain(&self.jets).any(|value| !value.is_finite());
        broken.then_some("actuator command")
    }
}

/// Motion of the actuators since commands were last taken or a deflection last came to rest.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Drive {
    /// Target of each deflection, rad.
    target: Surfaces,
    /// Direction in which each deflection moves: 1 up, −1 down, 0 at rest; less if it is slow.
    direction: Surfaces,
    /// Thrust of each jet as a fraction from 0 to 1.
    thrust: Jets,
}

/// Flow past the surfaces.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Conditions {
    /// The flight condition for which the actuators were made, at an angle of attack (rad).
    Fixed(f64),
    /// Another flow, in which the effectiveness of the surfaces has a ratio to that for which the
    /// actuators were made.
    Entry(f64, Flow),
}

/// Surfaces and jets at one flight condition.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Actuators {
    /// Dynamic pressure (Pa) and Mach number of the flight condition.
    condition: [f64; 2],
    scale: f64,
    tables: Vec<SurfaceTable>,
    /// Surface effectiveness D_A at the dynamic pressure of the flight, N m/rad.
    surface_moments: SMatrix<f64, 3, SURFACES>,
    jet_moments: SMatrix<f64, 3, JETS>,
    min: Surfaces,
    max: Surfaces,
    rate: Surfaces,
    jet_mode: JetMode,
    fault: EffectorFault,
}

impl Actuators {
    /// Makes the actuators of a configuration.
    ///
    /// # Errors
    /// Names the value that is out of range.
    pub fn new(config: &Config) -> Result<Self, Error> {
        let scale = config.aerodynamics_scale;
        not_negative("aerodynamics.scale", scale, "")?;
        config.fault.check(&config.effectors).map_err(|Invalid { name, value, problem }| {
            Error::parameter(name, format!("= {value} {problem}"))
        })?;
        let Effectors { min, max, rate, jet_moments, .. } = config.effectors;
        Ok(Self {
            condition: [config.dynamic_pressure, config.mach],
            scale,
            tables: config.effectors.tables.clone(),
            surface_moments: config.effectors.effectiveness_at(config.dynamic_pressure) * scale,
            jet_moments,
            min,
            max,
            rate,
            jet_mode: config.jet_mode,
            fault: config.fault,
        })
    }

    /// Returns the motion that a command taken at `time` (s) starts from the given deflections
    /// (rad).
    pub fn commanded(&self, time: f64, command: &Command, deflections: &Surfaces) -> Drive {
        let target = Surfaces::from_fn(|i, _| command.surfaces[i].clamp(self.min[i], self.max[i]));
        let thrust = command.jets.map(|jet| match self.jet_mode {
            JetMode::OnOff if jet >= THRESHOLD => 1.0,
            JetMode::OnOff => 0.0,
            JetMode::Duty => jet.clamp(0.0, 1.0),
        });
        self.directed(time, Drive { target, thrust, ..Drive::default() }, deflections)
    }

    /// Returns the drive with the direction of each surface set from the distance left at `time`
    /// (s), and with what a fault makes of it.
    pub fn directed(&self, time: f64, mut drive: Drive, deflections: &Surfaces) -> Drive {
        let (fault, failed) = self.fault.at(time);
        match fault {
            EffectorFaultKind::Stuck => drive.target[failed] = deflections[failed],
            EffectorFaultKind::Floating => drive.target[failed] = 0.0,
            EffectorFaultKind::JetOn => drive.thrust[failed] = 1.0,
            EffectorFaultKind::JetOff => drive.thrust[failed] = 0.0,
            EffectorFaultKind::None | EffectorFaultKind::Slow => {}
        }
        let way = drive.target - deflections;
        // A distance that would be covered within the time tolerance counts as zero.
        let least = self.rate * tolerance(time);
        drive.direction =
            Surfaces::from_fn(|i, _| if way[i].abs() <= least[i] { 0.0 } else { way[i].signum() });
        if fault == EffectorFaultKind::Slow {
            drive.direction[failed] *= self.fault.share;
        }
        drive
    }

    /// Returns the next time (s) after `time` at which something fails.
    pub(crate) fn next_fault(&self, time: f64) -> Option<f64> {
        self.fault.next(time)
    }

    /// Whether a restored drive holds only values that a drive can have.
    pub(crate) fn fits(drive: &Drive) -> bool {
        (0..SURFACES).all(|i| drive.target[i].is_finite() && drive.direction[i].abs() <= 1.0)
            && drive.thrust.iter().all(|value| value.is_finite())
    }

    /// Rate of each deflection, rad/s.
    pub fn rates(&self, drive: &Drive) -> Surfaces {
        self.rate.component_mul(&drive.direction)
    }

    /// Time (s) until each moving deflection comes to rest: negative if it is beyond its target,
    /// infinite if it is at rest.
    pub fn time_left(&self, drive: &Drive, deflections: &Surfaces) -> Surfaces {
        let way = drive.target - deflections;
        Surfaces::from_fn(|i, _| match drive.direction[i] {
            0.0 => f64::INFINITY,
            direction => way[i] / (direction * self.rate[i]),
        })
    }

    /// Sets every deflection that has reached its target by `time` (s), or has passed it, to the
    /// target.
    pub fn settle(&self, time: f64, drive: &Drive, deflections: &mut Surfaces) {
        let way = drive.target - *deflections;
        for i in 0..SURFACES {
            let left = match drive.direction[i] {
                0.0 => way[i].abs(),
                direction => direction.signum() * way[i],
            };
            if left <= self.rate[i] * tolerance(time) {
                deflections[i] = drive.target[i];
            }
        }
    }

    /// Control moment (N m) of the surfaces and jets.
    pub fn moment(
        &self,
        drive: &Drive,
        deflections: &Surfaces,
        conditions: &Conditions,
    ) -> Vector3<f64> {
        let [dynamic_pressure, mach] = self.condition;
        let (ratio, flow) = match *conditions {
            Conditions::Fixed(alpha) => {
                (1.0, Flow { dynamic_pressure, mach, alpha, ..Flow::default() })
            }
            Conditions::Entry(ratio, flow) => (ratio, flow),
        };
        let moment = self.surface_moments * deflections * ratio + self.jet_moments * drive.thrust;
        if self.tables.is_empty() {
            return moment;
        }
        moment + moment_of_tables(&self.tables, &flow, deflections) * self.scale
    }
}

#[cfg(test)]
mod tests;
