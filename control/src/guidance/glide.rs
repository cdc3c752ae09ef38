//! Feedback of the altitude rate: it damps the oscillation about the equilibrium glide, and keeps
//! heat flux, load and dynamic pressure below their limits. P. Lu, "Entry guidance: a unified
//! method" (2014), on altitude-rate compensation and on path constraints.

use super::model::Model;
use super::settings::{Limit, Settings, over_speed};
use settings::Declared;
use vehicle::math::{cos, hypot, ln, tan};

/// Least share of gravity that is taken to be left to the lift, where the speed is almost that of
/// an orbit.
const LEAST_WEIGHT: f64 = 0.1;
/// Speeds between which the damping fades away, m/s. At the end the base may be so large that there
/// is no glide with it, and the range decides.
const FADING: [f64; 2] = [1000.0, 2000.0];
/// Distance of the base from bank.largest below which the damping fades away, too, rad: a near
/// target needs the steepest flight.
const ROOM: f64 = 0.2;
/// Standard gravity, in which loads count, m/s².
const GRAVITY: f64 = 9.80665;

/// Quantities that have limits: heat flux, load and dynamic pressure.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize, Declared,
)]
pub struct Loads {
    /// Heat flux into the leading edge.
    #[setting(unit = "W/m2", nominal = 1e5)]
    pub heat_flux: f64,
    /// Load, in 9.80665 m/s2.
    pub load: f64,
    /// Dynamic pressure.
    #[setting(unit = "Pa", nominal = 1e4)]
    pub pressure: f64,
}

impl Loads {
    /// Returns the three numbers.
    pub fn all(&self) -> [f64; 3] {
        [self.heat_flux, self.load, self.pressure]
    }

    /// Returns the share of each limit that they leave.
    #[must_use]
    pub fn margins(&self, limit: &Limit) -> Self {
        Self {
            heat_flux: 1.0 - self.heat_flux / limit.heat_flux,
            load: 1.0 - self.load / limit.load,
            pressure: 1.0 - self.pressure / limit.pressure,
        }
    }

    /// Returns the larger one of each.
    #[must_use]
    pub fn max(&self, other: &Self) -> Self {
        Self {
            heat_flux: self.heat_flux.max(other.heat_flux),
            load: self.load.max(other.load),
            pressure: self.pressure.max(other.pressure),
        }
    }
}

/// State of the flight in the vertical plane, as far as the feedback depends on it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Glide {
    /// Altitude, m.
    pub altitude: f64,
    /// Speed, m/s.
    pub speed: f64,
    /// Altitude rate, m/s, and the sine of the flight path angle.
    pub rate: f64,
    pub sin_path: f64,
    /// Angle of attack, rad.
    pub alpha: f64,
    /// Lift and drag per mass, m/s².
    pub accelerations: [f64; 2],
    /// Ratio of the drag to that of the model.
    pub drag_ratio: f64,
    /// Gravity less the centrifugal acceleration of the planet's rotation, m/s².
    pub gravity: f64,
    /// Distance from the planet's centre, m.
    pub radius: f64,
    /// Upward Coriolis acceleration, m/s².
    pub coriolis: f64,
    /// Base of the bank angle, rad, and its derivative over energy, rad per m²/s².
    pub bank: [f64; 2],
}

impl Loads {
    /// Returns heat flux, load and dynamic pressure in air of a density (kg/m³), at a speed (m/s)
    /// and an angle of attack (rad), with lift and drag per mass (m/s²).
    fn of(model: &Model, density: f64, [speed, alpha]: [f64; 2], [lift, drag]: [f64; 2]) -> Self {
        Self {
            heat_flux: model.heat_flux(density, speed, alpha),
            load: hypot(lift, drag) / GRAVITY,
            pressure: 0.5 * density * speed * speed,
        }
    }

    /// Returns those of the model at an altitude (m), a speed (m/s) and an angle of attack (rad).
    pub(super) fn at(model: &Model, altitude: f64, speed: f64, alpha: f64) -> Self {
        let accelerations = model.accelerations(altitude, speed, alpha);
        Self::of(model, model.density(altitude), [speed, alpha], accelerations)
    }
}

impl Glide {
    /// Returns −V̇/V, 1/s.
    fn braking(&self) -> f64 {
        (self.accelerations[1] + self.gravity * self.sin_path) / self.speed
    }

    /// Returns heat flux, load and dynamic pressure. The ratio of the drag to that of the model is
    /// taken for that of the density.
    pub(super) fn loads(&self, model: &Model) -> Loads {
        let density = model.density(self.altitude) * self.drag_ratio;
        Loads::of(model, density, [self.speed, self.alpha], self.accelerations)
    }

    /// Returns the least altitude rate at which no load rises beyond its limit, m/s: for each load
    /// y ∼ ρᵃ Vᵇ, ẏ/y = −a ḣ/H + b V̇/V must be at most ln(limit/y)/τ.
    pub(super) fn least_rate(&self, model: &Model, limit: &Limit, loads: &Loads) -> f64 {
        let exponents = [model.heating_exponents(), [1.0, 2.0], [1.0, 2.0]];
        let scale = model.scale(self.altitude);
        let each = loads.all().into_iter().zip(limit.all()).zip(exponents);
        each.fold(f64::NEG_INFINITY, |least, ((load, largest), [a, b])| {
            let room = ln((1.0 - limit.margin) * largest / load) / limit.time;
            least.max(-scale / a * (room + b * self.braking()))
        })
    }

    /// Returns the cosine of the commanded bank angle, and whether a limit has made it: cos σ =
    /// cos σ₀ − k (ḣ − ḣ₀), with ḣ₀ of the equilibrium glide, and with at least the altitude rate
    /// `least` (m/s).
    pub(super) fn cosine(&self, model: &Model, settings: &Settings, least: f64) -> (f64, bool) {
        let Glide { speed, rate, gravity, radius, coriolis, bank: [bank, slope], .. } = *self;
        let base = cos(bank);
        if self.accelerations[1] < settings.damping.drag {
            return (base, false);
        }
        // Lift carries the weight, L cos σ = g − V²/r − (Coriolis), while V, the angle of attack
        // and σ change: ρ̇/ρ + 2 V̇/V + Ċ_L/C_L − σ̇ tan σ is the relative change of the weight.
        let weight = (gravity - speed * speed / radius - coriolis).max(LEAST_WEIGHT * gravity);
        let by_weight = (2.0 * speed * speed / radius + coriolis) / weight;
        let by_alpha = speed
            * settings.alpha.slope(speed)
            * model.lift_slope(self.alpha, model.mach(self.altitude, speed));
        let by_bank = slope * tan(bank) * speed * speed;
        let shares = 2.0 + by_weight + by_alpha + by_bank;
        let equilibrium = -model.scale(self.altitude) * self.braking() * shares;
        let room = ((settings.bank.largest - bank) / ROOM).clamp(0.0, 1.0);
        let gain = room * over_speed(speed, FADING, [0.0, settings.damping.gain]);
        let damped = base - gain * (rate - equilibrium);
        let limited = base - settings.limit.gain * (rate - least);
        let is_limited = rate < least && limited > damped;
        let cosine = if is_limited { limited } else { damped };
        (cosine.clamp(cos(settings.bank.largest), 1.0), is_limited)
    }
}
