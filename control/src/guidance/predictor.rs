//! Predicts the range of a flight whose bank angle is linear in energy.

use super::glide::{Glide, Loads};
use super::model::Model;
use super::settings::{Settings, Target};
use nalgebra::Vector4;
use vehicle::aerodynamics::Aerodynamics;
use vehicle::integrator::rk4;
use vehicle::math::{sin, sin_cos};

/// Step of the prediction, s.
const STEP: f64 = 4.0;
/// Steps after which a prediction is given up: the flight does not come down.
const MOST_STEPS: usize = 1500;

/// Predictor of the range of flights.
#[derive(Clone, Debug, Default)]
pub struct Predictor {
    /// Vehicle and air as the guidance knows them.
    pub(super) model: Model,
}

/// Beginning of a prediction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Beginning {
    /// Distance from the planet's centre, m.
    pub radius: f64,
    /// Speed, m/s.
    pub speed: f64,
    /// Flight path angle, rad.
    pub path: f64,
    /// sin φ, and cos φ cos ψ of the great circle to the target: on it sin φ is the first times the
    /// cosine of the angle travelled, plus the second times its sine.
    pub latitude: [f64; 2],
    /// cos φ sin ψ of the great circle to the target, which is constant along it.
    pub eastward: f64,
    /// About cos² φ on the way, for the centrifugal acceleration: the product of cos φ at both
    /// ends.
    pub near_equator: f64,
    /// Ratios of the actual lift and drag to those of the model.
    pub ratios: [f64; 2],
}

/// End of a prediction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct End {
    /// Distance over ground, m.
    pub range: f64,
    /// Whether the flight comes to the energy of the target.
    pub arrives: bool,
    /// Largest loads on the way.
    pub loads: Loads,
}

impl Predictor {
    /// Makes the predictor of a vehicle's flights.
    pub fn new(aerodynamics: Aerodynamics) -> Self {
        Self { model: Model::new(aerodynamics) }
    }

    /// Returns the energy-like variable e = μ/r − V²/2 of Lu 2014, which grows during the entry,
    /// m²/s².
    pub fn energy(settings: &Settings, radius: f64, speed: f64) -> f64 {
        settings.planet.gravitation / radius - speed * speed / 2.0
    }

    /// Returns that of the target, m²/s².
    pub fn last_energy(settings: &Settings) -> f64 {
        let Target { altitude, latitude, speed, .. } = settings.target;
        let [surface, _] = settings.planet.planet().surface(sin(latitude));
        Self::energy(settings, surface + altitude, speed)
    }

    /// Returns the beginning of a flight with this bank angle (rad).
    pub(super) fn glide(&self, settings: &Settings, begin: &Beginning, bank: f64) -> Glide {
        let from = Self::energy(settings, begin.radius, begin.speed);
        let to = Self::last_energy(settings);
        let slope = if to > from { (settings.bank.last - bank) / (to - from) } else { 0.0 };
        let state = Vector4::new(begin.radius, begin.speed, begin.path, 0.0);
        self.glide_at(settings, begin, &state, [bank, slope])
    }

    /// Returns the state of a flight with distance from the centre, speed, flight path angle and
    /// angle travelled, and with a bank angle (rad) and its derivative over energy.
    fn glide_at(
        &self,
        settings: &Settings,
        begin: &Beginning,
        state: &Vector4<f64>,
        bank: [f64; 2],
    ) -> Glide {
        let planet = &settings.planet;
        let [radius, speed, path, angle]: [f64; 4] = (*state).into();
        let (sine, cosine) = sin_cos(angle);
        let [here, ahead] = begin.latitude;
        let [surface, slope] = planet.planet().surface(here * cosine + ahead * sine);
        let altitude = radius - surface;
        let (sin_path, cos_path) = sin_cos(path);
        // The surface rises or falls on the way.
        let rising = slope * (ahead * cosine - here * sine) * speed * cos_path / radius;
        let alpha = settings.alpha.at(speed);
        let [lift, drag] = self.model.accelerations(altitude, speed, alpha);
        let [lift_ratio, drag_ratio] = begin.ratios;
        // The planet's rotation makes a vehicle that flies to the east lighter.
        let centrifugal = planet.rate * planet.rate * radius * begin.near_equator;
        Glide {
            altitude,
            speed,
            rate: speed * sin_path - rising,
            sin_path,
            alpha,
            accelerations: [lift * lift_ratio, drag * drag_ratio],
            drag_ratio,
            gravity: planet.gravitation / (radius * radius) - centrifugal,
            radius,
            coriolis: 2.0 * planet.rate * speed * begin.eastward,
            bank,
        }
    }

    /// Flies from `begin` with a bank angle that is linear in energy, from `bank` (rad) to that of
    /// the settings, until the energy of the target.
    pub fn fly(&self, settings: &Settings, begin: &Beginning, bank: f64) -> End {
        let planet = &settings.planet;
        let from = Self::energy(settings, begin.radius, begin.speed);
        let to = Self::last_energy(settings);
        if to <= from {
            return End { range: 0.0, arrives: true, loads: Loads::default() };
        }
        let energy = |state: &Vector4<f64>| Self::energy(settings, state[0], state[1]);
        let slope = (settings.bank.last - bank) / (to - from);
        let glide = |state: &Vector4<f64>| {
            let passed = (energy(state) - from).clamp(0.0, to - from);
            self.glide_at(settings, begin, state, [bank + slope * passed, slope])
        };
        // Distance from the centre, speed, flight path angle, and the angle travelled over ground.
        let derivative = |state: &Vector4<f64>, least: f64| {
            let glide = glide(state);
            let Glide { speed, gravity: g, radius, coriolis, .. } = glide;
            let [lift, drag] = glide.accelerations;
            let (cosine, _) = glide.cosine(&self.model, settings, least);
            let (sin_path, cos_path) = sin_cos(state[2]);
            Vector4::new(
                speed * sin_path,
                -drag - g * sin_path,
                (lift * cosine + (speed * speed / radius - g) * cos_path + coriolis) / speed,
                speed * cos_path / radius,
            )
        };
        let mut state = Vector4::new(begin.radius, begin.speed, begin.path, 0.0);
        let mut loads = Loads::default();
        for _ in 0..MOST_STEPS {
            let here = glide(&state);
            let now = here.loads(&self.model);
            loads = loads.max(&now);
            // What a limit asks for is held over a step, as its powers take long.
            let least = here.least_rate(&self.model, &settings.limit, &now);
            let next = rk4(&mut |_, state: &_| derivative(state, least), 0.0, &state, STEP);
            if energy(&next) >= to || next[0] <= planet.radius * (1.0 - planet.flattening) {
                let (before, after) = (energy(&state), energy(&next));
                let share = ((to - before) / (after - before)).clamp(0.0, 1.0);
                let angle = state[3] + share * (next[3] - state[3]);
                return End { range: angle * planet.radius, arrives: after >= to, loads };
            }
            state = next;
        }
        End { range: state[3] * planet.radius, arrives: false, loads }
    }
}
