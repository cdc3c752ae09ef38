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

use crate::effectors::{Effectors, JETS, Jets, SURFACES, Surfaces};
use crate::error::Error;
use crate::time::tolerance;
use nalgebra::{SMatrix, Vector3};
use serde::{Deserialize, Serialize};

/// Command from which on a jet in on-off mode is switched on.
pub const THRESHOLD: f64 = 0.5;

/// Meaning of a jet's command at the instant at which it is taken.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum JetMode {
    /// The jet gives full thrust for commands from [`THRESHOLD`] on and none below.
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
    /// Factor from the nominal surface effectiveness to that of the vehicle.
    pub aerodynamics_scale: f64,
}

/// Commands to the surfaces and jets.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Command {
    /// Commanded deflection of each surface, rad.
    pub surfaces: Surfaces,
    /// Command to each jet: 0 is off, 1 is full thrust.
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
    /// Direction in which each deflection moves: 1 up, −1 down, 0 at rest.
    direction: Surfaces,
    /// Thrust of each jet as a fraction from 0 to 1.
    thrust: Jets,
}

/// Surfaces and jets at one flight condition.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Actuators {
    /// Surface effectiveness D_A at the dynamic pressure of the flight, N m/rad.
    surface_moments: SMatrix<f64, 3, SURFACES>,
    jet_moments: SMatrix<f64, 3, JETS>,
    min: Surfaces,
    max: Surfaces,
    rate: Surfaces,
    jet_mode: JetMode,
}

impl Actuators {
    /// Makes the actuators of a configuration.
    ///
    /// # Errors
    /// Names the value that is out of range.
    pub fn new(config: &Config) -> Result<Self, Error> {
        let scale = config.aerodynamics_scale;
        if !(scale >= 0.0 && scale.is_finite()) {
            let problem = format!("= {scale} must not be negative");
            return Err(Error::parameter("actuators.aerodynamics_scale", problem));
        }
        let Effectors { min, max, rate, jet_moments, .. } = config.effectors;
        Ok(Self {
            surface_moments: config.effectors.effectiveness_at(config.dynamic_pressure) * scale,
            jet_moments,
            min,
            max,
            rate,
            jet_mode: config.jet_mode,
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
    /// (s).
    pub fn directed(&self, time: f64, drive: Drive, deflections: &Surfaces) -> Drive {
        let way = drive.target - deflections;
        // A distance that would be covered within the time tolerance counts as zero.
        let least = self.rate * tolerance(time);
        let direction =
            Surfaces::from_fn(|i, _| if way[i].abs() <= least[i] { 0.0 } else { way[i].signum() });
        Drive { direction, ..drive }
    }

    /// Whether a restored drive holds only values that a drive can have.
    pub(crate) fn fits(drive: &Drive) -> bool {
        (0..SURFACES)
            .all(|i| drive.target[i].is_finite() && [-1.0, 0.0, 1.0].contains(&drive.direction[i]))
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
            direction => direction * way[i] / self.rate[i],
        })
    }

    /// Sets every deflection that has reached its target by `time` (s), or has passed it, to the
    /// target.
    pub fn settle(&self, time: f64, drive: &Drive, deflections: &mut Surfaces) {
        let way = drive.target - *deflections;
        for i in 0..SURFACES {
            let left =
                if drive.direction[i] == 0.0 { way[i].abs() } else { drive.direction[i] * way[i] };
            if left <= self.rate[i] * tolerance(time) {
                deflections[i] = drive.target[i];
            }
        }
    }

    /// Control moment (N m) of the surfaces and jets.
    pub fn moment(&self, drive: &Drive, deflections: &Surfaces) -> Vector3<f64> {
        self.surface_moments * deflections + self.jet_moments * drive.thrust
    }

    /// Partial derivative of [`Actuators::moment`] with respect to the deflections, N m/rad.
    pub fn moment_by_deflections(&self) -> &SMatrix<f64, 3, SURFACES> {
        &self.surface_moments
    }

    /// Partial derivative of the moment (N m) with respect to the jet commands at the instant at
    /// which they are taken.
    pub fn moment_by_jets(&self, command: &Command) -> SMatrix<f64, 3, JETS> {
        let mut derivative = self.jet_moments;
        for (j, mut column) in derivative.column_iter_mut().enumerate() {
            if self.jet_mode == JetMode::OnOff || !(0.0..=1.0).contains(&command.jets[j]) {
                column.fill(0.0);
            }
        }
        derivative
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn actuators(jet_mode: JetMode) -> Actuators {
        let effectors = Effectors::published();
        let dynamic_pressure = effectors.reference_pressure;
        Actuators::new(&Config { effectors, jet_mode, dynamic_pressure, aerodynamics_scale: 1.0 })
            .unwrap()
    }

    fn surfaces(deflections_deg: [f64; SURFACES]) -> Command {
        Command {
            surfaces: Surfaces::from(deflections_deg).map(f64::to_radians),
            jets: Jets::zeros(),
        }
    }

    fn degrees(deflections: &Surfaces) -> Surfaces {
        deflections.map(f64::to_degrees)
    }

    const FAR: [f64; SURFACES] = [-90.0, -20.0, 5.0, -3.0, 90.0, -90.0, 90.0, -90.0];

    /// Returns the exact motion from rest at zero until `end`, followed from one arrival to the
    /// next, and the times of the arrivals.
    fn moved(
        actuators: &Actuators,
        command: &Command,
        begin: f64,
        end: f64,
    ) -> (Surfaces, Vec<f64>) {
        let mut deflections = Surfaces::zeros();
        let (mut time, mut arrivals) = (begin, Vec::new());
        loop {
            let drive = actuators.commanded(time, command, &deflections);
            let arrival = time + actuators.time_left(&drive, &deflections).min();
            let next = arrival.min(end);
            deflections += actuators.rates(&drive) * (next - time);
            actuators.settle(next, &drive, &mut deflections);
            if arrival > end {
                return (deflections, arrivals);
            }
            arrivals.push(arrival);
            time = next;
        }
    }

    #[test]
    fn published_rate_and_position_limits_are_met_exactly() {
        // Wu 2015, (63): 10 deg/s; -25 to 0 deg, -10 to 30 deg, -30 to 30 deg
        let actuators = actuators(JetMode::OnOff);
        for (time, expected) in [
            (2.0, [0.0; SURFACES]),
            (2.2, [-2.0, -2.0, 0.0, -2.0, 2.0, -2.0, 2.0, -2.0]),
            (2.5, [-5.0, -5.0, 0.0, -3.0, 5.0, -5.0, 5.0, -5.0]),
            (3.5, [-15.0, -15.0, 0.0, -3.0, 15.0, -10.0, 15.0, -15.0]),
            (9.0, [-25.0, -20.0, 0.0, -3.0, 30.0, -10.0, 30.0, -30.0]),
        ] {
            let deflections = degrees(&moved(&actuators, &surfaces(FAR), 2.0, time).0);
            assert!(
                (deflections - Surfaces::from(expected)).amax() < 1e-12,
                "{deflections} at {time}"
            );
        }
        let effectors = Effectors::published();
        let rest = moved(&actuators, &surfaces(FAR), 2.0, 9.0).0;
        assert_eq!(
            (rest[0], rest[4], rest[5]),
            (effectors.min[0], effectors.max[4], effectors.min[5])
        );
        assert_eq!(rest[3], (-3f64).to_radians(), "the command itself, without rounding");
    }

    #[test]
    fn the_position_limit_acts_before_the_rate_limit() {
        // A command far beyond the limit does not wind up: the deflection turns back at once.
        let actuators = actuators(JetMode::OnOff);
        let away = moved(&actuators, &surfaces([-90.0; SURFACES]), 0.0, 10.0).0;
        let back = actuators.commanded(10.0, &surfaces([0.0; SURFACES]), &away);
        let deflections = degrees(&(away + actuators.rates(&back) * 0.1));
        assert!(
            (deflections[0] + 24.0).abs() < 1e-12 && (deflections[4] + 9.0).abs() < 1e-12,
            "{deflections}"
        );
    }

    #[test]
    fn arrivals_come_when_deflections_come_to_rest() {
        let actuators = actuators(JetMode::OnOff);
        let arrivals = moved(&actuators, &surfaces(FAR), 2.0, 9.0).1;
        let expected = [2.3, 3.0, 4.0, 4.5, 5.0];
        assert_eq!(arrivals.len(), expected.len(), "{arrivals:?}");
        assert!(arrivals.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-12), "{arrivals:?}");
    }

    #[test]
    fn a_deflection_behind_its_target_is_put_on_it_and_one_before_it_is_not() {
        let actuators = actuators(JetMode::OnOff);
        let drive = actuators.commanded(0.0, &surfaces(FAR), &Surfaces::zeros());
        for (left, arrives) in [(1e-6, false), (1e-10, true), (0.0, true), (-0.01, true)] {
            // The fourth surface moves down to -3 deg at 10 deg/s.
            let mut deflections = surfaces(FAR).surfaces;
            deflections[3] += left * 10f64.to_radians();
            assert!((actuators.time_left(&drive, &deflections)[3] - left).abs() < 1e-15);
            let before = deflections[3];
            actuators.settle(0.3, &drive, &mut deflections);
            let expected = if arrives { (-3f64).to_radians() } else { before };
            assert_eq!(deflections[3], expected, "{left}");
            let after = actuators.commanded(0.3, &surfaces(FAR), &deflections);
            assert_eq!(actuators.rates(&after)[3] == 0.0, arrives, "{left}");
            assert_eq!(
                actuators.time_left(&after, &deflections)[3] == f64::INFINITY,
                arrives,
                "{left}"
            );
        }
    }

    #[test]
    fn taking_the_same_command_again_changes_nothing() {
        let actuators = actuators(JetMode::OnOff);
        let command = surfaces(FAR);
        let mut often = Surfaces::zeros();
        for k in 0..400 {
            let time = 0.013 * f64::from(k);
            let drive = actuators.commanded(time, &command, &often);
            for i in 0..SURFACES {
                often[i] +=
                    actuators.rates(&drive)[i] * actuators.time_left(&drive, &often)[i].min(0.013);
            }
            actuators.settle(time + 0.013, &drive, &mut often);
            let once = moved(&actuators, &command, 0.0, time + 0.013).0;
            assert!((once - often).amax() < 1e-14);
        }
    }

    #[test]
    fn published_moments_at_rest() {
        // Wu 2015, (64): jets 3 and 7; flaps at 2 and -1 deg in the representative effectiveness
        let mut command = surfaces([0.0, 0.0, 0.0, 0.0, 2.0, -1.0, 0.0, 0.0]);
        (command.jets[2], command.jets[6]) = (1.0, 1.0);
        let actuators = actuators(JetMode::OnOff);
        let drive = actuators.commanded(0.0, &command, &Surfaces::zeros());
        let jets = Vector3::new(11625.0 - 11623.0, -9466.0 - 9465.0, 0.0);
        assert!((actuators.moment(&drive, &Surfaces::zeros()) - jets).amax() < 1e-9);
        let flaps = Vector3::new(3.0 * 1375.0, -5100.0, -3000.0);
        assert!((actuators.moment(&drive, &command.surfaces) - jets - flaps).amax() < 1e-9);
    }

    #[test]
    fn jets_switch_at_one_half_when_commands_are_taken() {
        let actuators = actuators(JetMode::OnOff);
        let mut command = Command::default();
        let full = Vector3::new(0.0, -498.0, 19897.0);
        for (value, on) in
            [(0.0, 0.0), (0.4999, 0.0), (0.5, 1.0), (1.0, 1.0), (7.0, 1.0), (-7.0, 0.0)]
        {
            command.jets[0] = value;
            let drive = actuators.commanded(0.0, &command, &Surfaces::zeros());
            assert_eq!(actuators.moment(&drive, &Surfaces::zeros()), full * on, "{value}");
        }
        assert!(actuators.moment_by_jets(&command).iter().all(|derivative| *derivative == 0.0));
    }

    #[test]
    fn duty_cycles_scale_the_thrust_and_are_cut_off() {
        let actuators = actuators(JetMode::Duty);
        let mut command = Command::default();
        let full = Vector3::new(0.0, -498.0, 19897.0);
        for (value, duty) in [(0.0, 0.0), (0.25, 0.25), (1.0, 1.0), (1.5, 1.0), (-0.5, 0.0)] {
            command.jets[0] = value;
            let drive = actuators.commanded(0.0, &command, &Surfaces::zeros());
            let moment = actuators.moment(&drive, &Surfaces::zeros());
            assert!((moment - full * duty).amax() < 1e-9, "{value}");
            let slope = if value == duty { full } else { Vector3::zeros() };
            assert!((actuators.moment_by_jets(&command).column(0) - slope).amax() < 1e-9);
        }
    }

    #[test]
    fn aerodynamics_and_density_biases_multiply() {
        let effectors = Effectors::published();
        let command = surfaces([-5.0, -3.0, -5.0, -3.0, 5.0, 3.0, 0.0, 0.0]);
        let moment = |pressure: f64, scale: f64| {
            let dynamic_pressure = pressure * effectors.reference_pressure;
            let config = Config {
                effectors: effectors.clone(),
                jet_mode: JetMode::OnOff,
                dynamic_pressure,
                aerodynamics_scale: scale,
            };
            let actuators = Actuators::new(&config).unwrap();
            let drive = actuators.commanded(0.0, &command, &Surfaces::zeros());
            actuators.moment(&drive, &command.surfaces)
        };
        let (nominal, biased) = (moment(1.0, 1.0), moment(0.9, 0.9));
        assert!(nominal.amin() > 500.0);
        assert!((biased - nominal * 0.81).amax() < 1e-9);
    }

    #[test]
    fn a_negative_scale_is_refused_by_name() {
        let effectors = Effectors::published();
        let config = Config {
            effectors,
            jet_mode: JetMode::OnOff,
            dynamic_pressure: 1e3,
            aerodynamics_scale: -1.0,
        };
        let text = Actuators::new(&config).unwrap_err().to_string();
        assert!(text.contains("`actuators.aerodynamics_scale`"));
    }
}
