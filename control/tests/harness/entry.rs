//! Entry flights of a point mass whose attitude is exactly the guidance's reference.

use control::guidance::{Guidance, Memory, Navigation, PERIOD, Settings};
use nalgebra::Vector3;
use vehicle::aerodynamics::Aerodynamics;
use vehicle::air::{Air, Row};
use vehicle::entry::{Config, Deviations, End, Following, Motion, Trim};
use vehicle::integrator::rk4;
use vehicle::translation::Planet;

/// A flight: its start, and the deviations that the guidance does not know.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Flight {
    pub(crate) start: Motion,
    pub(crate) deviations: Deviations,
    /// Ratio of the density, and wind to the north and east, m/s.
    pub(crate) density: f64,
    pub(crate) wind: [f64; 2],
}

impl Flight {
    /// From 120 km, with the air as it is known.
    pub(crate) fn nominal() -> Self {
        Self {
            start: start([120e3, 0.0, -10.0, 7450.0, -1.2, 60.0]),
            deviations: Deviations::default(),
            density: 1.0,
            wind: [0.0; 2],
        }
    }

    /// From 80 km, on the way of the nominal flight.
    pub(crate) fn lower() -> Self {
        Self { start: start([80e3, 15.7, -0.5, 7400.0, -1.0, 58.0]), ..Self::nominal() }
    }

    /// With density, lift and drag each wrong by up to this share, and wind up to 50 m/s, by
    /// numbers of size 1.
    pub(crate) fn dispersed(share: f64, draws: [f64; 5]) -> Self {
        let [lift, drag, density] = [draws[0], draws[1], draws[2]].map(|draw| 1.0 + share * draw);
        let deviations = Deviations { lift, drag, ..Deviations::default() };
        let wind = [50.0 * draws[3], 50.0 * draws[4]];
        Self { deviations, density, wind, ..Self::nominal() }
    }
}

impl Outcome {
    /// Whether the flight ended in the terminal area: at 24.4 km with 60 km to go within 5 km.
    pub(crate) fn arrived(&self) -> bool {
        (self.range / 1e3 - 60.0).abs() <= 5.0
    }
}

/// Returns a motion from altitude (m), longitude, latitude (deg), speed (m/s), flight path angle
/// and heading (deg).
pub(crate) fn start([altitude, longitude, latitude, speed, path, heading]: [f64; 6]) -> Motion {
    let degrees = [longitude, latitude, path, heading].map(f64::to_radians);
    Motion::new(altitude, degrees[0], degrees[1], speed, degrees[2], degrees[3])
}

/// Result of a flight.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Outcome {
    pub(crate) end: Motion,
    pub(crate) seconds: f64,
    pub(crate) memory: Memory,
    /// Distance to the target at the end, m.
    pub(crate) range: f64,
    pub(crate) greatest_load: f64,
    pub(crate) greatest_pressure: f64,
    /// W/m².
    pub(crate) greatest_heat_flux: f64,
    /// Greatest turn rate of the trajectory's axes relative to inertial space, rad/s.
    pub(crate) greatest_turn: f64,
}

/// Flies until the altitude or the speed of the terminal area. Calls `observe` once a second.
pub(crate) fn fly(
    settings: &Settings,
    flight: &Flight,
    observe: impl FnMut(f64, &Motion, &Memory),
) -> Outcome {
    fly_for(settings, flight, 4000.0, observe).expect("it does not come down")
}

/// Does the same for at most `longest` (s), and returns nothing if the flight is not over then.
pub(crate) fn fly_for(
    settings: &Settings,
    flight: &Flight,
    longest: f64,
    mut observe: impl FnMut(f64, &Motion, &Memory),
) -> Option<Outcome> {
    let guidance = Guidance::new(*settings).unwrap();
    let mut air = Air { rows: 1, ..Air::default() };
    air.profile[0] = Row { altitude: 0.0, density: flight.density, wind: flight.wind };
    let config = Config {
        planet: Planet::EARTH,
        aerodynamics: Aerodynamics::papers(),
        deviations: flight.deviations,
        air,
        trim: Trim::Anywhere,
        following: Following { active: false, frequency: 1.0 },
        end: End { altitude: 0.0, speed: settings.target.speed },
    };
    let mut memory = Memory::default();
    let mut motion = flight.start;
    let mut outcome = Outcome::default();
    for tick in 0..(longest / PERIOD) as u64 {
        let time = tick as f64 * PERIOD;
        let angles: Vector3<f64> = memory.command.reference.angles;
        let passage = config.passage(time, &motion, &angles);
        let navigation = Navigation { motion, lift: passage.lift, drag: passage.drag };
        let command = guidance.update(&mut memory, tick, &navigation);
        if tick % 25 == 0 {
            observe(time, &motion, &memory);
        }
        let angles = command.reference.angles;
        let mut f = |time: f64, motion: &Motion| {
            config.derivative(motion, &config.passage(time, motion, &angles)).0
        };
        motion = rk4(&mut f, time, &motion, PERIOD);
        let passage = config.passage(time, &motion, &angles);
        let turn = config.derivative(&motion, &passage).2.norm();
        outcome.greatest_load = outcome.greatest_load.max(passage.specific_force.norm() / 9.80665);
        outcome.greatest_pressure = outcome.greatest_pressure.max(passage.dynamic_pressure);
        outcome.greatest_heat_flux = outcome.greatest_heat_flux.max(config.heat_flux(&passage));
        outcome.greatest_turn = outcome.greatest_turn.max(turn);
        if config.margins(&motion).iter().any(|margin| *margin <= 0.0) {
            return Some(Outcome {
                end: motion,
                seconds: time + PERIOD,
                memory,
                range: command.range,
                ..outcome
            });
        }
    }
    None
}
