//! US Standard Atmosphere 1976 from sea level to 120 km.

use crate::error::{Error, not_negative};
use crate::math::{exp, ln, powf, powi};
use serde::{Deserialize, Serialize};
use settings::Declared;
use std::sync::LazyLock;

// U.S. Standard Atmosphere, 1976 (NOAA, NASA, USAF), tables 1 to 4.
const GRAVITY: f64 = 9.80665; // m/s²
const MOLAR_MASS: f64 = 0.028_964_4; // kg/mol, at sea level
const GAS_CONSTANT: f64 = 8.314_32; // J/(mol K), the value of the standard
const HEAT_RATIO: f64 = 1.4;
const EARTH_RADIUS: f64 = 6_356_766.0; // m
const SEA_LEVEL: (f64, f64) = (288.15, 101_325.0); // K, Pa
/// Base (geopotential m) and temperature gradient (K/m) of each layer.
const LAYERS: [(f64, f64); 7] = [
    (0.0, -6.5e-3),
    (11e3, 0.0),
    (20e3, 1e-3),
    (32e3, 2.8e-3),
    (47e3, 0.0),
    (51e3, -2.8e-3),
    (71e3, -2e-3),
];

/// Geometric altitude up to which the air is mixed and the temperature is linear in layers, m.
const MIXED: f64 = 86e3;
/// Above it: geometric altitude (m), pressure (Pa) and mean molar mass (kg/mol) of the main tables.
const THIN: [(f64, f64, f64); 8] = [
    (86e3, 0.373_38, 0.028_952_2),
    (90e3, 0.183_59, 0.028_91),
    (95e3, 7.5966e-2, 0.028_73),
    (100e3, 3.2011e-2, 0.028_40),
    (105e3, 1.4477e-2, 0.027_88),
    (110e3, 7.1042e-3, 0.027_27),
    (115e3, 4.0096e-3, 0.026_68),
    (120e3, 2.5382e-3, 0.026_20),
];

/// Largest geometric altitude of the model, m.
pub const TOP: f64 = 120e3;

/// State of the air at one altitude.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Air {
    /// Molecular-scale temperature, K: it equals the temperature up to 80 km, is 0.04 % above it at
    /// 86 km and 11 % at 120 km, where the air is lighter.
    pub temperature: f64,
    /// Static pressure of the air, Pa.
    pub pressure: f64,
    /// Mass density of the air, kg/m³.
    pub density: f64,
    /// Speed of sound in the air, m/s.
    pub sound_speed: f64,
}

/// Returns the state of the air at a geometric altitude (m) from 0 to [`TOP`].
///
/// # Errors
/// Names the altitude if it lies outside this range.
pub fn air(altitude: f64) -> Result<Air, Error> {
    if !(0.0..=TOP).contains(&altitude) {
        let problem = format!("= {altitude} m must lie between 0 and {TOP} m");
        return Err(Error::parameter("flight.altitude", problem));
    }
    Ok(inside(altitude))
}

/// Returns the state of the air at any altitude (m): as [`air`] where that is defined, the air at
/// sea level below, and above an atmosphere of the top's temperature, whose density falls
/// exponentially.
pub fn air_anywhere(altitude: f64) -> Air {
    let mut air = inside(altitude.clamp(0.0, TOP));
    if altitude > TOP {
        let gravity = GRAVITY * powi(EARTH_RADIUS / (EARTH_RADIUS + TOP), 2);
        let thinner = exp(-gravity * air.density / air.pressure * (altitude - TOP));
        air.pressure *= thinner;
        air.density *= thinner;
    }
    air
}

fn inside(altitude: f64) -> Air {
    let (temperature, pressure) = if altitude > MIXED { thin(altitude) } else { mixed(altitude) };
    let specific = GAS_CONSTANT / MOLAR_MASS * temperature;
    let density = pressure / specific;
    Air { temperature, pressure, density, sound_speed: (HEAT_RATIO * specific).sqrt() }
}

/// Temperature (K) and pressure (Pa) at the base of each layer.
static BASES: LazyLock<[(f64, f64); LAYERS.len()]> = LazyLock::new(|| {
    let mut bases = [SEA_LEVEL; LAYERS.len()];
    for i in 1..LAYERS.len() {
        bases[i] = inside_layer(i - 1, bases[i - 1], LAYERS[i].0);
    }
    bases
});

/// Returns temperature (K) and pressure (Pa) up to [`MIXED`].
fn mixed(altitude: f64) -> (f64, f64) {
    let height = EARTH_RADIUS * altitude / (EARTH_RADIUS + altitude); // geopotential
    let layer = LAYERS.partition_point(|layer| layer.0 <= height).saturating_sub(1);
    inside_layer(layer, BASES[layer], height)
}

/// Returns temperature (K) and pressure (Pa) at a geopotential `height` (m) of a layer, from those
/// at its base.
fn inside_layer(layer: usize, (temperature, pressure): (f64, f64), height: f64) -> (f64, f64) {
    let weight = GRAVITY * MOLAR_MASS / GAS_CONSTANT;
    let (base, gradient) = LAYERS[layer];
    let above = temperature + gradient * (height - base);
    let ratio = if gradient == 0.0 {
        exp(-weight * (height - base) / temperature)
    } else {
        powf(temperature / above, weight / gradient)
    };
    (above, pressure * ratio)
}

/// Returns molecular-scale temperature (K) and pressure (Pa) above [`MIXED`]. Between the altitudes
/// of the table the logarithm of the pressure is the cubic that has the slope of hydrostatic
/// equilibrium at both.
fn thin(altitude: f64) -> (f64, f64) {
    let next = THIN.partition_point(|(node, ..)| *node < altitude).clamp(1, THIN.len() - 1);
    let [(from, low, m_low), (to, high, m_high)] = [THIN[next - 1], THIN[next]];
    let (length, share) = (to - from, (altitude - from) / (to - from));
    let slope = |node: f64, mass: f64| {
        let gravity = GRAVITY * powi(EARTH_RADIUS / (EARTH_RADIUS + node), 2);
        -gravity * mass / (GAS_CONSTANT * kinetic_temperature(node)) * length
    };
    let (begin, end) = (slope(from, m_low), slope(to, m_high));
    let change = ln(high / low);
    // Hermite's cubic from 0 to `change`.
    let curve = share
        * (begin
            + share * (3.0 * change - 2.0 * begin - end + share * (begin + end - 2.0 * change)));
    let mass = m_low + share * (m_high - m_low);
    (kinetic_temperature(altitude) * MOLAR_MASS / mass, low * exp(curve))
}

/// Returns the kinetic temperature (K) above [`MIXED`], equations (25), (27) and (29).
fn kinetic_temperature(altitude: f64) -> f64 {
    if altitude <= 91e3 {
        186.8673
    } else if altitude <= 110e3 {
        263.1905 - 76.3232 * (1.0 - powi((altitude - 91e3) / 19_942.9, 2)).sqrt()
    } else {
        240.0 + 12e-3 * (altitude - 110e3)
    }
}

/// Flight condition of the vehicle: altitude and Mach number.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Declared)]
#[serde(deny_unknown_fields)]
pub struct Flight {
    /// Geometric altitude, which determines air density and speed of sound.
    #[setting(unit = "m", min = 0.0, max = TOP, nominal = 1e4)]
    pub altitude: f64,
    /// Mach number.
    #[setting(min = 0.0, max = 100.0, nominal = 10.0)]
    pub mach: f64,
}

impl Flight {
    /// Dynamic pressure ½ ρ V² of the flight condition, Pa.
    ///
    /// # Errors
    /// Names the value that is out of range.
    pub fn dynamic_pressure(&self) -> Result<f64, Error> {
        not_negative("flight.mach", self.mach, "")?;
        let air = air(self.altitude)?;
        Ok(0.5 * air.density * powi(self.mach * air.sound_speed, 2))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn close(value: f64, expected: f64, relative: f64) {
        assert!((value / expected - 1.0).abs() < relative, "{value}, not {expected}");
    }

    /// Converts a geopotential altitude (m) to the geometric altitude (m).
    fn geometric(height: f64) -> f64 {
        EARTH_RADIUS * height / (EARTH_RADIUS - height)
    }

    #[test]
    fn oracle_pressures_at_the_layers_bases() {
        // The table holds the base pressures as derived from the standard's definition.
        for (height, pressure) in [
            (0.0, 101_325.0),
            (11e3, 22_632.06),
            (20e3, 5474.889),
            (32e3, 868.0187),
            (47e3, 110.9063),
            (51e3, 66.93887),
            (71e3, 3.956_420),
        ] {
            close(air(geometric(height)).unwrap().pressure, pressure, 2e-7);
        }
        // The top of the last layer is at 86 km geometric, which is 84.852 km geopotential
        // altitude.
        close(air(MIXED).unwrap().pressure, 0.373_38, 2e-5);
        close(air(MIXED).unwrap().temperature, 186.946, 2e-6);
    }

    #[test]
    fn oracle_tabulated_air_at_geometric_altitudes() {
        for (altitude, temperature, pressure, density) in [
            (0.0, 288.150, 1.01325e5, 1.2250),
            (10e3, 223.252, 2.64999e4, 0.413_51),
            (20e3, 216.650, 5.52930e3, 8.8910e-2),
            (30e3, 226.509, 1.19703e3, 1.8410e-2),
            (50e3, 270.650, 7.9779e1, 1.0269e-3),
        ] {
            let air = air(altitude).unwrap();
            close(air.temperature, temperature, 5e-6);
            close(air.pressure, pressure, 1e-5);
            close(air.density, density, 3e-5);
        }
        close(air(0.0).unwrap().sound_speed, 340.294, 2e-6);
    }

    #[test]
    fn oracle_tabulated_densities_above_86_km() {
        for (altitude, density) in [
            (90e3, 3.416e-6),
            (95e3, 1.393e-6),
            (100e3, 5.604e-7),
            (105e3, 2.325e-7),
            (110e3, 9.708e-8),
            (115e3, 4.289e-8),
            (120e3, 2.222e-8),
        ] {
            close(air(altitude).unwrap().density, density, 4e-4);
        }
    }

    #[test]
    fn oracle_above_86_km_the_air_carries_what_lies_above_it() {
        // The pressure falls by the weight of the air in between, by Simpson's rule. The table
        // itself departs from that by 1.1 % between 95 and 100 km, where its gases begin to
        // separate.
        for (from, to) in [(86e3, 92.5e3), (92.5e3, 101e3), (101e3, 113e3), (113e3, 120e3)] {
            let weight = |z: f64| {
                let gravity = GRAVITY * (EARTH_RADIUS / (EARTH_RADIUS + z)).powi(2);
                air(z).unwrap().density * gravity
            };
            let steps = 200;
            let h = (to - from) / f64::from(steps);
            let at = |k: i32| weight(from + f64::from(k) * h);
            let inner: f64 = (1..steps).map(|k| at(k) * if k % 2 == 1 { 4.0 } else { 2.0 }).sum();
            let fallen = (at(0) + at(steps) + inner) * h / 3.0;
            let pressure = |z: f64| air(z).unwrap().pressure;
            close(pressure(from) - pressure(to), fallen, 1.2e-2);
        }
        let [below, above] = [MIXED, MIXED + 1e-6].map(|at| air(at).unwrap());
        close(below.pressure, above.pressure, 2e-5);
        close(below.temperature, above.temperature, 2e-6);
    }

    #[test]
    fn oracle_the_published_flight_condition() {
        // 55 km and Mach 9.8 of Wu 2015, section 6
        let at = air(55e3).unwrap();
        close(at.temperature, 260.77, 2e-5);
        close(at.pressure, 42.525, 2e-5);
        close(at.density, 5.681e-4, 2e-5);
        close(at.sound_speed, 323.72, 2e-5);
        close(Flight { altitude: 55e3, mach: 9.8 }.dynamic_pressure().unwrap(), 2858.9, 2e-5);
    }

    #[test]
    fn the_air_is_continuous_at_the_layers_and_thins_with_altitude() {
        for (base, _) in &LAYERS[1..] {
            let [below, above] = [-1e-6, 1e-6].map(|by| air(geometric(*base) + by).unwrap());
            close(below.pressure, above.pressure, 1e-9);
            close(below.temperature, above.temperature, 1e-9);
        }
        let densities: Vec<f64> =
            (0..=120).map(|km| air(f64::from(km) * 1e3).unwrap().density).collect();
        assert!(densities.windows(2).all(|pair| pair[0] > pair[1]));
    }
}
