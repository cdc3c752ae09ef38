//! Predicts the range of a flight whose bank angle is linear in energy.

use super::glide::{Glide, Loads};
use super::settings::Settings;
use nalgebra::Vector4;
use vehicle::aerodynamics::Aerodynamics;
use vehicle::atmosphere::air_anywhere;
use vehicle::integrator::rk4;
use vehicle::math::{exp, ln, sin, sin_cos};

/// Distance between the altitudes at which the density is known, m.
const SPACING: f64 = 500.0;
/// Number of these altitudes, up to 140 km.
const ALTITUDES: usize = 281;
/// Step of the prediction, s.
const STEP: f64 = 4.0;
/// Difference of the angle of attack from which a slope follows, rad.
const PROBE: f64 = 0.01;
/// Steps after which a prediction is given up: the flight does not come down.
const MOST_STEPS: usize = 1500;

/// Model of vehicle, air and planet in the guidance.
#[derive(Clone, Debug)]
pub struct Predictor {
    aerodynamics: Aerodynamics,
    area_per_mass: f64,
    /// Logarithms of the density of the standard atmosphere.
    density: [f64; ALTITUDES],
}

/// Beginning of a prediction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Beginning {
    /// Altitude, m.
    pub altitude: f64,
    /// Speed, m/s.
    pub speed: f64,
    /// Flight path angle, rad.
    pub path: f64,
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

impl Default for Predictor {
    /// Returns the predictor for the vehicle of the papers in the standard atmosphere.
    fn default() -> Self {
        let aerodynamics = Aerodynamics::papers();
        Self {
            area_per_mass: aerodynamics.area() / aerodynamics.mass(),
            aerodynamics,
            density: std::array::from_fn(|i| ln(air_anywhere(i as f64 * SPACING).density)),
        }
    }
}

impl Predictor {
    /// Returns the density of the standard atmosphere (kg/m³) at an altitude (m), within 0.12 %.
    pub(super) fn density(&self, altitude: f64) -> f64 {
        let (place, below) = place(altitude);
        let (low, high) = (self.density[below], self.density[below + 1]);
        exp(low + (place - below as f64) * (high - low))
    }

    /// Returns the height over which the density falls to 1/e at an altitude (m), m.
    pub(super) fn scale(&self, altitude: f64) -> f64 {
        let (_, below) = place(altitude);
        SPACING / (self.density[below] - self.density[below + 1])
    }

    /// Returns the heat flux into the leading edge, W/m².
    pub(super) fn heat_flux(&self, density: f64, speed: f64, alpha: f64) -> f64 {
        self.aerodynamics.heat_flux(density, speed, alpha)
    }

    /// Returns the power of the speed with which the heat flux grows.
    pub(super) fn heating_exponent(&self) -> f64 {
        self.aerodynamics.heating_exponent()
    }

    /// Returns the relative change of the lift with the angle of attack, 1/rad.
    pub(super) fn lift_slope(&self, alpha: f64) -> f64 {
        let lift = |angle: f64| self.coefficients(angle)[0];
        (lift(alpha + PROBE) / lift(alpha) - 1.0) / PROBE
    }

    /// Returns the coefficients of lift and drag at an angle of attack (rad).
    pub fn coefficients(&self, alpha: f64) -> [f64; 2] {
        self.aerodynamics.lift_and_drag(alpha)
    }

    /// Returns lift and drag per mass (m/s²) of the model at an altitude (m), a speed (m/s) and an
    /// angle of attack (rad).
    pub fn accelerations(&self, altitude: f64, speed: f64, alpha: f64) -> [f64; 2] {
        let pressure = 0.5 * self.density(altitude) * speed * speed * self.area_per_mass;
        self.coefficients(alpha).map(|coefficient| pressure * coefficient)
    }

    /// Returns the energy-like variable e = μ/r − V²/2 of Lu 2014, which grows during the entry,
    /// m²/s².
    pub fn energy(settings: &Settings, altitude: f64, speed: f64) -> f64 {
        settings.planet.gravitation / (settings.planet.radius + altitude) - speed * speed / 2.0
    }

    /// Returns the beginning of a flight with this bank angle (rad).
    pub(super) fn glide(&self, settings: &Settings, begin: &Beginning, bank: f64) -> Glide {
        let from = Self::energy(settings, begin.altitude, begin.speed);
        let to = Self::energy(settings, settings.target.altitude, settings.target.speed);
        let slope = if to > from { (settings.bank.last - bank) / (to - from) } else { 0.0 };
        let state = Vector4::new(begin.altitude, begin.speed, begin.path, 0.0);
        self.glide_at(settings, begin, &state, [bank, slope])
    }

    /// Returns the state of a flight with altitude, speed and flight path angle, and with a bank
    /// angle (rad) and its derivative over energy.
    fn glide_at(
        &self,
        settings: &Settings,
        begin: &Beginning,
        state: &Vector4<f64>,
        bank: [f64; 2],
    ) -> Glide {
        let planet = &settings.planet;
        let [altitude, speed, path, _]: [f64; 4] = (*state).into();
        let radius = planet.radius + altitude;
        let alpha = settings.alpha.at(speed);
        let [lift, drag] = self.accelerations(altitude, speed, alpha);
        let [lift_ratio, drag_ratio] = begin.ratios;
        // The planet's rotation makes a vehicle that flies to the east lighter.
        let centrifugal = planet.rate * planet.rate * radius * begin.near_equator;
        Glide {
            altitude,
            speed,
            rate: speed * sin(path),
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
        let target = &settings.target;
        let from = Self::energy(settings, begin.altitude, begin.speed);
        let to = Self::energy(settings, target.altitude, target.speed);
        if to <= from {
            return End { range: 0.0, arrives: true, loads: Loads::default() };
        }
        let energy = |state: &Vector4<f64>| Self::energy(settings, state[0], state[1]);
        let slope = (settings.bank.last - bank) / (to - from);
        let glide = |state: &Vector4<f64>| {
            let passed = (energy(state) - from).clamp(0.0, to - from);
            self.glide_at(settings, begin, state, [bank + slope * passed, slope])
        };
        // Altitude, speed, flight path angle, and the angle travelled over ground.
        let derivative = |state: &Vector4<f64>, least: f64| {
            let glide = glide(state);
            let Glide { speed, gravity: g, radius, coriolis, .. } = glide;
            let [lift, drag] = glide.accelerations;
            let (cosine, _) = self.cosine(settings, &glide, least);
            let (sin_path, cos_path) = sin_cos(state[2]);
            Vector4::new(
                speed * sin_path,
                -drag - g * sin_path,
                (lift * cosine + (speed * speed / radius - g) * cos_path + coriolis) / speed,
                speed * cos_path / radius,
            )
        };
        let mut state = Vector4::new(begin.altitude, begin.speed, begin.path, 0.0);
        let mut loads = Loads::default();
        for _ in 0..MOST_STEPS {
            let here = glide(&state);
            let now = self.loads(&here);
            loads = loads.max(&now);
            // What a limit asks for is held over a step, as its powers take long.
            let least = self.least_rate(&settings.limit, &here, &now);
            let next = rk4(&mut |_, state: &_| derivative(state, least), 0.0, &state, STEP);
            if energy(&next) >= to || next[0] <= 0.0 {
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

/// Returns an altitude (m) in units of the table, and the place of the table below it.
fn place(altitude: f64) -> (f64, usize) {
    let place = (altitude / SPACING).max(0.0);
    (place, (place as usize).min(ALTITUDES - 2))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn oracle_the_density_is_that_of_the_standard_atmosphere() {
        let predictor = Predictor::default();
        for metres in (0..140_000).step_by(70) {
            let altitude = f64::from(metres);
            let ratio = predictor.density(altitude) / air_anywhere(altitude).density;
            assert!((ratio - 1.0).abs() < 1.2e-3, "{altitude} m: {ratio}");
        }
    }
}
