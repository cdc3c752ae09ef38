//! Actuators: from commands to surfaces and jets, to the moment that acts. What acts on a command, in this order:
//!
//! 1. surface: position limits on the command, Wu 2015 (63)
//! 2. surface: rate limit, (63); the deflection moves to the limited command and stops there
//! 3. surface: moment D_A δ_A, (57), at the dynamic pressure of the flight
//! 4. jet: on from a command of one half, or a duty cycle cut off at 0 and 1
//! 5. jet: moment D_RCS δ_RCS, (57)
//!
//! Commands are taken at instants and held in between; so between two of them every deflection is a known function of time.

use crate::effectors::{Effectors, JETS, Jets, SURFACES, Surfaces};
use crate::error::Error;
use crate::time::tolerance;
use nalgebra::{SMatrix, Vector3};
use serde::{Deserialize, Serialize};

/// The command from which on a jet that only switches is on.
pub const THRESHOLD: f64 = 0.5;

/// What a jet makes of its command.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum JetMode {
    /// On from [`THRESHOLD`], else off; switches when commands are taken.
    #[default]
    OnOff,
    /// The command is the mean thrust as a fraction of the full one, and acts at once.
    Duty,
}

/// All that determines the actuators.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Config {
    /// Surfaces and jets.
    pub effectors: Effectors,
    /// What the jets do.
    pub jet_mode: JetMode,
    /// Dynamic pressure, Pa.
    pub dynamic_pressure: f64,
    /// Factor from the nominal to the vehicle's surface effectiveness.
    pub aerodynamics_scale: f64,
}

/// Commands to the actuators.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Command {
    /// Deflection of each surface, rad.
    pub surfaces: Surfaces,
    /// Each jet: 0 off, 1 full thrust.
    pub jets: Jets,
}

/// The actuators since commands were taken last.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Drive {
    /// When, s.
    since: f64,
    /// Deflections then, rad.
    from: Surfaces,
    /// Deflections they move to, rad.
    to: Surfaces,
    /// Jets that only switch: 0 or 1.
    on: Jets,
}

/// Surfaces and jets at a flight condition.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Actuators {
    /// D_A in flight, N m/rad.
    surface_moments: SMatrix<f64, 3, SURFACES>,
    jet_moments: SMatrix<f64, 3, JETS>,
    min: Surfaces,
    max: Surfaces,
    rate: Surfaces,
    jet_mode: JetMode,
}

impl Actuators {
    /// At rest with all deflections zero.
    ///
    /// # Errors
    /// Names the value that is out of range.
    pub fn new(config: &Config) -> Result<Self, Error> {
        let scale = config.aerodynamics_scale;
        if !(scale >= 0.0 && scale.is_finite()) {
            let problem = format!("= {scale} must not be negative");
            return Err(Error::Parameter { name: "aerodynamics.scale", problem });
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

    /// The drive that a command taken at `time` (s) sets off, from the deflections that `drive` has reached.
    pub fn commanded(&self, time: f64, command: &Command, drive: &Drive) -> Drive {
        Drive {
            since: time,
            from: self.deflections(time, drive),
            to: Surfaces::from_fn(|i, _| command.surfaces[i].clamp(self.min[i], self.max[i])),
            on: command.jets.map(|jet| if jet >= THRESHOLD { 1.0 } else { 0.0 }),
        }
    }

    /// Deflections at `time` (s), not before commands were taken; rad.
    pub fn deflections(&self, time: f64, drive: &Drive) -> Surfaces {
        let elapsed = (time - drive.since).max(0.0);
        Surfaces::from_fn(|i, _| {
            let way = drive.to[i] - drive.from[i];
            let reach = self.rate[i] * elapsed;
            if way.abs() > reach { drive.from[i] + reach.copysign(way) } else { drive.to[i] }
        })
    }

    /// The first time (s) after `time` at which a deflection comes to rest.
    pub fn next_change(&self, time: f64, drive: &Drive) -> Option<f64> {
        let arrivals =
            (0..SURFACES).map(|i| drive.since + (drive.to[i] - drive.from[i]).abs() / self.rate[i]);
        arrivals.filter(|&arrival| arrival > time + tolerance(time)).min_by(f64::total_cmp)
    }

    /// The moment (N m) of surfaces and jets at `time` (s).
    pub fn moment(&self, time: f64, command: &Command, drive: &Drive) -> Vector3<f64> {
        let jets = match self.jet_mode {
            JetMode::OnOff => drive.on,
            JetMode::Duty => command.jets.map(|duty| duty.clamp(0.0, 1.0)),
        };
        self.surface_moments * self.deflections(time, drive) + self.jet_moments * jets
    }

    /// Partial derivative of [`Actuators::moment`] by the commands to the jets, N m.
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
        Actuators::new(&Config { effectors, jet_mode, dynamic_pressure, aerodynamics_scale: 1.0 }).unwrap()
    }

    fn surfaces(deflections_deg: [f64; SURFACES]) -> Command {
        Command { surfaces: Surfaces::from(deflections_deg).map(f64::to_radians), jets: Jets::zeros() }
    }

    fn degrees(deflections: &Surfaces) -> Surfaces {
        deflections.map(f64::to_degrees)
    }

    const FAR: [f64; SURFACES] = [-90.0, -20.0, 5.0, -3.0, 90.0, -90.0, 90.0, -90.0];

    #[test]
    fn published_rate_and_position_limits_are_met_exactly() {
        // Wu 2015, (63): 10 deg/s; -25 to 0 deg, -10 to 30 deg, -30 to 30 deg
        let actuators = actuators(JetMode::OnOff);
        let drive = actuators.commanded(2.0, &surfaces(FAR), &Drive::default());
        for (time, expected) in [
            (2.0, [0.0; SURFACES]),
            (2.2, [-2.0, -2.0, 0.0, -2.0, 2.0, -2.0, 2.0, -2.0]),
            (2.5, [-5.0, -5.0, 0.0, -3.0, 5.0, -5.0, 5.0, -5.0]),
            (3.5, [-15.0, -15.0, 0.0, -3.0, 15.0, -10.0, 15.0, -15.0]),
            (9.0, [-25.0, -20.0, 0.0, -3.0, 30.0, -10.0, 30.0, -30.0]),
        ] {
            let found = degrees(&actuators.deflections(time, &drive));
            assert!((found - Surfaces::from(expected)).amax() < 1e-12, "{found} at {time}");
        }
        let effectors = Effectors::published();
        let rest = actuators.deflections(9.0, &drive);
        assert_eq!((rest[0], rest[4], rest[5]), (effectors.min[0], effectors.max[4], effectors.min[5]));
        assert_eq!(rest[3], (-3f64).to_radians(), "the command itself, without rounding");
    }

    #[test]
    fn the_position_limit_acts_before_the_rate_limit() {
        // A command far beyond the limit does not wind up: the way back begins at once
        let actuators = actuators(JetMode::OnOff);
        let away = actuators.commanded(0.0, &surfaces([-90.0; SURFACES]), &Drive::default());
        let back = actuators.commanded(10.0, &surfaces([0.0; SURFACES]), &away);
        let found = degrees(&actuators.deflections(10.1, &back));
        assert!((found[0] + 24.0).abs() < 1e-12 && (found[4] + 9.0).abs() < 1e-12, "{found}");
    }

    #[test]
    fn changes_come_when_deflections_come_to_rest() {
        let actuators = actuators(JetMode::OnOff);
        let drive = actuators.commanded(2.0, &surfaces(FAR), &Drive::default());
        let mut time = 2.0;
        for expected in [2.3, 3.0, 4.0, 4.5, 5.0] {
            time = actuators.next_change(time, &drive).unwrap();
            assert!((time - expected).abs() < 1e-12, "{time}, not {expected}");
        }
        assert_eq!(actuators.next_change(time, &drive), None);
    }

    #[test]
    fn taking_the_same_command_again_changes_nothing() {
        let actuators = actuators(JetMode::OnOff);
        let command = surfaces(FAR);
        let once = actuators.commanded(0.0, &command, &Drive::default());
        let mut often = once;
        for k in 0..100 {
            often = actuators.commanded(0.013 * f64::from(k), &command, &often);
            let time = 0.013 * f64::from(k + 1);
            let difference = actuators.deflections(time, &once) - actuators.deflections(time, &often);
            assert!(difference.amax() < 1e-14);
        }
    }

    #[test]
    fn published_moments_at_rest() {
        // Wu 2015, (64): jets 3 and 7; flaps at 2 and -1 deg in the representative effectiveness
        let mut command = surfaces([0.0, 0.0, 0.0, 0.0, 2.0, -1.0, 0.0, 0.0]);
        (command.jets[2], command.jets[6]) = (1.0, 1.0);
        let actuators = actuators(JetMode::OnOff);
        let drive = actuators.commanded(0.0, &command, &Drive::default());
        let jets = Vector3::new(11625.0 - 11623.0, -9466.0 - 9465.0, 0.0);
        assert!((actuators.moment(0.0, &command, &drive) - jets).amax() < 1e-9);
        let flaps = Vector3::new(3.0 * 1375.0, -5100.0, -3000.0);
        assert!((actuators.moment(1.0, &command, &drive) - jets - flaps).amax() < 1e-9);
    }

    #[test]
    fn jets_switch_at_one_half_when_commands_are_taken() {
        let actuators = actuators(JetMode::OnOff);
        let mut command = Command::default();
        let full = Vector3::new(0.0, -498.0, 19897.0);
        for (value, on) in [(0.0, 0.0), (0.4999, 0.0), (0.5, 1.0), (1.0, 1.0), (7.0, 1.0), (-7.0, 0.0)] {
            command.jets[0] = value;
            let drive = actuators.commanded(0.0, &command, &Drive::default());
            command.jets[0] = 0.5 - value;
            assert_eq!(actuators.moment(0.0, &command, &drive), full * on, "{value}");
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
            let moment = actuators.moment(0.0, &command, &Drive::default());
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
            let drive = actuators.commanded(0.0, &command, &Drive::default());
            actuators.moment(5.0, &command, &drive)
        };
        let (nominal, biased) = (moment(1.0, 1.0), moment(0.9, 0.9));
        assert!(nominal.amin() > 500.0);
        assert!((biased - nominal * 0.81).amax() < 1e-9);
    }

    #[test]
    fn a_negative_scale_is_refused_by_name() {
        let effectors = Effectors::published();
        let config =
            Config { effectors, jet_mode: JetMode::OnOff, dynamic_pressure: 1e3, aerodynamics_scale: -1.0 };
        assert!(Actuators::new(&config).unwrap_err().to_string().contains("aerodynamics.scale"));
    }
}
