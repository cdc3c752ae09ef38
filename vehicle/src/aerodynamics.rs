//! Forces of the air on a vehicle, as data: coefficients over the angle of attack, and an
//! exponential atmosphere.

use crate::data;
use crate::math::{exp, powf};
use serde::Deserialize;

/// Foot, m.
pub const FOOT: f64 = 0.3048;
/// Slug, the mass that a pound-force accelerates by 1 ft/s², kg.
const SLUG: f64 = 0.453_592_37 * 9.806_65 / FOOT;
/// British thermal unit (of the international table) per square foot, J/m².
const BTU_PER_SQUARE_FOOT: f64 = 1_055.055_852_62 / (FOOT * FOOT);

/// Forces of the air on a vehicle. The numbers are those of its source, in pounds, slugs and feet,
/// with angles in degrees; the functions take and return SI units and radians.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Aerodynamics {
    weight_lb: f64,
    gravity_ft_s2: f64,
    area_ft2: f64,
    /// Coefficients of lift and drag: factors of 1, α, α², ….
    lift: Vec<f64>,
    drag: Vec<f64>,
    heating: Heating,
    air: ExponentialAir,
}

/// Heating of the leading edge: a polynomial of α times `factor` √ρ (V/10⁴ ft/s)^`exponent`.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
struct Heating {
    polynomial: Vec<f64>,
    factor: f64,
    exponent: f64,
}

/// Air whose density falls exponentially with altitude.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
struct ExponentialAir {
    density_slug_ft3: f64,
    scale_height_ft: f64,
}

/// Accelerations by the air, m/s².
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LiftAndDrag {
    /// Lift per mass.
    pub lift: f64,
    /// Drag per mass.
    pub drag: f64,
}

impl Aerodynamics {
    /// The Space Shuttle of J. T. Betts, "Practical Methods for Optimal Control and Estimation
    /// Using Nonlinear Programming", chapter 6.
    pub fn shuttle() -> Self {
        data::embedded("shuttle.toml", include_str!("../data/shuttle.toml"))
    }

    /// Returns the mass of the vehicle, kg.
    pub fn mass(&self) -> f64 {
        self.weight_lb / self.gravity_ft_s2 * SLUG
    }

    /// Returns the density of the air at an altitude (m), kg/m³.
    pub fn density(&self, altitude: f64) -> f64 {
        let ExponentialAir { density_slug_ft3, scale_height_ft } = self.air;
        let at_zero = density_slug_ft3 * SLUG / (FOOT * FOOT * FOOT);
        at_zero * exp(-altitude / (scale_height_ft * FOOT))
    }

    /// Returns lift and drag per mass at an altitude (m), a speed (m/s) and an angle of attack
    /// (rad).
    pub fn accelerations(&self, altitude: f64, speed: f64, alpha: f64) -> LiftAndDrag {
        let pressure = 0.5 * self.density(altitude) * speed * speed;
        let force = pressure * self.area_ft2 * FOOT * FOOT / self.mass();
        let alpha = alpha.to_degrees();
        LiftAndDrag {
            lift: force * polynomial(&self.lift, alpha),
            drag: force * polynomial(&self.drag, alpha),
        }
    }

    /// Returns the heat flux into the leading edge, W/m².
    pub fn heating(&self, altitude: f64, speed: f64, alpha: f64) -> f64 {
        let Heating { polynomial: factors, factor, exponent } = &self.heating;
        let density = self.density(altitude) * FOOT * FOOT * FOOT / SLUG;
        let flux = factor * density.sqrt() * powf(speed / FOOT / 1e4, *exponent);
        polynomial(factors, alpha.to_degrees()) * flux * BTU_PER_SQUARE_FOOT
    }
}

/// Returns the value of a polynomial with these factors of 1, x, x², ….
fn polynomial(factors: &[f64], x: f64) -> f64 {
    factors.iter().rev().fold(0.0, |sum, factor| sum * x + factor)
}
