//! Vehicle and air as the guidance knows them.

use vehicle::aerodynamics::Aerodynamics;
use vehicle::atmosphere::air_anywhere;
use vehicle::math::{exp, ln};

/// Distance between the altitudes at which the density is known, m.
const SPACING: f64 = 500.0;
/// Number of these altitudes, up to 140 km.
const ALTITUDES: usize = 281;
/// Difference of the angle of attack from which a slope follows, rad.
const PROBE: f64 = 0.01;

/// Vehicle and air as the guidance knows them.
#[derive(Clone, Debug)]
pub(super) struct Model {
    aerodynamics: Aerodynamics,
    area_per_mass: f64,
    /// Logarithms of the density of the standard atmosphere, and the speed of sound in it, m/s.
    /// They are not part of the structure itself, because a host may have little stack.
    density: Vec<f64>,
    sound_speed: Vec<f64>,
}

impl Default for Model {
    /// Returns the vehicle of the papers in the standard atmosphere.
    fn default() -> Self {
        Self::new(Aerodynamics::papers())
    }
}

impl Model {
    /// Returns a vehicle in the standard atmosphere.
    pub(super) fn new(aerodynamics: Aerodynamics) -> Self {
        let air = |i: usize| air_anywhere(i as f64 * SPACING);
        Self {
            area_per_mass: aerodynamics.area() / aerodynamics.mass(),
            aerodynamics,
            density: (0..ALTITUDES).map(|i| ln(air(i).density)).collect(),
            sound_speed: (0..ALTITUDES).map(|i| air(i).sound_speed).collect(),
        }
    }

    /// Returns the air forces and moments of the vehicle.
    pub(super) fn aerodynamics(&self) -> &Aerodynamics {
        &self.aerodynamics
    }

    /// Returns the Mach number at an altitude (m) and a speed (m/s).
    pub(super) fn mach(&self, altitude: f64, speed: f64) -> f64 {
        let (place, below) = place(altitude);
        let (low, high) = (self.sound_speed[below], self.sound_speed[below + 1]);
        speed / (low + (place - below as f64).min(1.0) * (high - low))
    }

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

    /// Returns the powers of density and speed with which the heat flux grows.
    pub(super) fn heating_exponents(&self) -> [f64; 2] {
        self.aerodynamics.heating_exponents()
    }

    /// Returns the relative change of the lift with the angle of attack at an angle of attack (rad)
    /// and a Mach number, 1/rad; 0 without lift.
    pub(super) fn lift_slope(&self, alpha: f64, mach: f64) -> f64 {
        let lift = |angle: f64| self.coefficients(angle, mach)[0];
        let slope = (lift(alpha + PROBE) / lift(alpha) - 1.0) / PROBE;
        if slope.is_finite() { slope } else { 0.0 }
    }

    /// Returns the coefficients of lift and drag at an angle of attack (rad) and a Mach number.
    pub(super) fn coefficients(&self, alpha: f64, mach: f64) -> [f64; 2] {
        self.aerodynamics.lift_and_drag(alpha, mach)
    }

    /// Returns lift and drag per mass (m/s²) of the model at an altitude (m), a speed (m/s) and an
    /// angle of attack (rad).
    pub(super) fn accelerations(&self, altitude: f64, speed: f64, alpha: f64) -> [f64; 2] {
        let pressure = 0.5 * self.density(altitude) * speed * speed * self.area_per_mass;
        self.coefficients(alpha, self.mach(altitude, speed))
            .map(|coefficient| pressure * coefficient)
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
        let model = Model::default();
        for metres in (0..140_000).step_by(70) {
            let altitude = f64::from(metres);
            let ratio = model.density(altitude) / air_anywhere(altitude).density;
            assert!((ratio - 1.0).abs() < 1.2e-3, "{altitude} m: {ratio}");
        }
    }
}
