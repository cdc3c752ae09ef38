//! Forces and moments of the air on a vehicle, as data: one file per vehicle, with a source for
//! every number.
//!
//! Forces act along the axes of the airflow: drag against the velocity relative to the air, lift
//! perpendicular to it in the vehicle's plane of symmetry, and side force to the right. Moments are
//! about the body axes.

mod coefficient;
mod units;

pub use coefficient::Coefficient;
pub use units::FOOT;

use crate::data;
use crate::math::{exp, powf};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use units::{Area, BTU_PER_SQUARE_FOOT, Length, Mass, SLUG};

/// Air forces and moments of a vehicle.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Aerodynamics {
    /// Description of the vehicle and of the validity of the data.
    title: String,
    reference: Reference,
    forces: Forces,
    #[serde(default)]
    moments: Moments,
    heating: Heating,
    air: ExponentialAir,
}

/// Reference quantities of the coefficients.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Reference {
    source: String,
    mass: Mass,
    area: Area,
    /// Span b of roll and yaw moments, and chord c of pitch moments; none without moments.
    span: Option<Length>,
    chord: Option<Length>,
    /// Point about which the moments are given.
    #[serde(default)]
    moment_point: String,
}

/// Coefficients of the forces.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Forces {
    lift: Coefficient,
    drag: Coefficient,
    /// Side force per radian of sideslip.
    #[serde(default)]
    side: Coefficient,
}

/// Coefficients of the moments: static ones per radian, damping ones per rad of p b/(2 V) and so
/// on.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
struct Moments {
    roll_by_sideslip: Coefficient,
    yaw_by_sideslip: Coefficient,
    /// Pitch per radian of α beyond the angle at which the vehicle is trimmed.
    pitch_by_alpha: Coefficient,
    roll_damping: Coefficient,
    pitch_damping: Coefficient,
    yaw_damping: Coefficient,
    /// Effectiveness of the surfaces relative to the one of the effectors' data.
    surfaces: Option<Coefficient>,
}

/// Heating of the leading edge: a polynomial of α times `factor` √ρ (V/10⁴ ft/s)^`exponent`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Heating {
    source: String,
    polynomial: Vec<f64>,
    factor: f64,
    exponent: f64,
}

/// Air whose density falls exponentially with altitude.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct ExponentialAir {
    source: String,
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

/// Flow of the air past the vehicle.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Flow {
    /// Dynamic pressure ½ ρ V², Pa.
    pub dynamic_pressure: f64,
    /// Mach number.
    pub mach: f64,
    /// Speed V relative to the air, m/s.
    pub speed: f64,
    /// Angle of attack relative to the air, rad.
    pub alpha: f64,
    /// Sideslip angle relative to the air, rad.
    pub beta: f64,
}

impl Aerodynamics {
    /// The Space Shuttle of J. T. Betts, "Practical Methods for Optimal Control and Estimation
    /// Using Nonlinear Programming", chapter 6: forces and heating, no moments.
    pub fn shuttle() -> Self {
        data::embedded("shuttle.toml", include_str!("../../data/shuttle.toml"))
    }

    /// The vehicle of the papers: the Shuttle's forces at the same wing loading, and representative
    /// moments.
    pub fn papers() -> Self {
        data::embedded("papers.toml", include_str!("../../data/papers.toml"))
    }

    /// Returns the mass of the vehicle, kg.
    pub fn mass(&self) -> f64 {
        self.reference.mass.kilograms()
    }

    /// Returns the reference area S, m².
    pub fn area(&self) -> f64 {
        self.reference.area.square_metres()
    }

    /// Returns the exponential air that belongs to the data: density at zero altitude (kg/m³) and
    /// scale height (m).
    pub fn exponential_air(&self) -> [f64; 2] {
        let ExponentialAir { density_slug_ft3, scale_height_ft, .. } = self.air;
        [density_slug_ft3 * SLUG / (FOOT * FOOT * FOOT), scale_height_ft * FOOT]
    }

    /// Returns the density of the exponential air at an altitude (m), kg/m³.
    pub fn density(&self, altitude: f64) -> f64 {
        let [at_zero, scale_height] = self.exponential_air();
        at_zero * exp(-altitude / scale_height)
    }

    /// Returns lift and drag per mass in exponential air at an altitude (m), a speed (m/s) and an
    /// angle of attack (rad), at a Mach number above that of all tables.
    pub fn accelerations(&self, altitude: f64, speed: f64, alpha: f64) -> LiftAndDrag {
        let dynamic_pressure = 0.5 * self.density(altitude) * speed * speed;
        let flow = Flow { dynamic_pressure, mach: f64::MAX, speed, alpha, beta: 0.0 };
        let [drag, _, lift] = self.forces(&flow).map(|force| force / self.mass());
        LiftAndDrag { lift, drag }
    }

    /// Returns the coefficients of lift and drag at an angle of attack (rad), at a Mach number
    /// above that of all tables.
    pub fn lift_and_drag(&self, alpha: f64) -> [f64; 2] {
        [&self.forces.lift, &self.forces.drag].map(|coefficient| coefficient.at(alpha, f64::MAX))
    }

    /// Returns drag, side force (to the right) and lift, N.
    pub fn forces(&self, flow: &Flow) -> [f64; 3] {
        let Flow { dynamic_pressure, mach, alpha, beta, .. } = *flow;
        let force = dynamic_pressure * self.area();
        let Forces { lift, drag, side } = &self.forces;
        [
            force * drag.at(alpha, mach),
            force * side.at(alpha, mach) * beta,
            force * lift.at(alpha, mach),
        ]
    }

    /// Returns the moment about the body axes (N m) without that of the surfaces, at body `rates`
    /// (rad/s) and trimmed at the angle of attack `trim` (rad).
    pub fn moment(&self, flow: &Flow, rates: &Vector3<f64>, trim: f64) -> Vector3<f64> {
        let (Some(span), Some(chord)) = (&self.reference.span, &self.reference.chord) else {
            return Vector3::zeros();
        };
        let Flow { dynamic_pressure, mach, speed, alpha, beta } = *flow;
        let of = |coefficient: &Coefficient| coefficient.at(alpha, mach);
        let lengths = Vector3::new(span.metres(), chord.metres(), span.metres());
        let damping = if speed > 0.0 {
            let turned = rates.component_mul(&lengths) / (2.0 * speed);
            let Moments { roll_damping, pitch_damping, yaw_damping, .. } = &self.moments;
            turned.component_mul(&Vector3::new(
                of(roll_damping),
                of(pitch_damping),
                of(yaw_damping),
            ))
        } else {
            Vector3::zeros()
        };
        let Moments { roll_by_sideslip, yaw_by_sideslip, pitch_by_alpha, .. } = &self.moments;
        let fixed = Vector3::new(
            of(roll_by_sideslip) * beta,
            of(pitch_by_alpha) * (alpha - trim),
            of(yaw_by_sideslip) * beta,
        );
        (fixed + damping).component_mul(&lengths) * (dynamic_pressure * self.area())
    }

    /// Returns the pitch moment (N m) that belongs to a coefficient.
    pub fn pitch_moment(&self, flow: &Flow, coefficient: f64) -> f64 {
        let chord = self.reference.chord.as_ref().map_or(0.0, Length::metres);
        flow.dynamic_pressure * self.area() * chord * coefficient
    }

    /// Returns the effectiveness of the surfaces relative to that of the effectors' data at the
    /// same dynamic pressure.
    pub fn surface_effectiveness(&self, flow: &Flow) -> f64 {
        self.moments
            .surfaces
            .as_ref()
            .map_or(1.0, |coefficient| coefficient.at(flow.alpha, flow.mach))
    }

    /// Returns the heat flux into the leading edge in exponential air, W/m².
    pub fn heating(&self, altitude: f64, speed: f64, alpha: f64) -> f64 {
        self.heat_flux(self.density(altitude), speed, alpha)
    }

    /// Returns the heat flux into the leading edge (W/m²) in air of a density (kg/m³), at a speed
    /// (m/s) and an angle of attack (rad).
    pub fn heat_flux(&self, density: f64, speed: f64, alpha: f64) -> f64 {
        let Heating { polynomial: factors, factor, exponent, .. } = &self.heating;
        let density = density * FOOT * FOOT * FOOT / SLUG;
        let flux = factor * density.sqrt() * powf(speed / FOOT / 1e4, *exponent);
        coefficient::polynomial(factors, alpha.to_degrees()) * flux * BTU_PER_SQUARE_FOOT
    }

    /// Returns the power of the speed with which the heat flux grows.
    pub fn heating_exponent(&self) -> f64 {
        self.heating.exponent
    }

    /// Returns the name and the source of each group of numbers.
    pub fn sources(&self) -> Vec<(&'static str, &str)> {
        let Moments {
            roll_by_sideslip,
            yaw_by_sideslip,
            pitch_by_alpha,
            roll_damping,
            pitch_damping,
            yaw_damping,
            surfaces,
        } = &self.moments;
        let coefficients = [
            ("lift", Some(&self.forces.lift)),
            ("drag", Some(&self.forces.drag)),
            ("side force", Some(&self.forces.side)),
            ("roll by sideslip", Some(roll_by_sideslip)),
            ("yaw by sideslip", Some(yaw_by_sideslip)),
            ("pitch by angle of attack", Some(pitch_by_alpha)),
            ("roll damping", Some(roll_damping)),
            ("pitch damping", Some(pitch_damping)),
            ("yaw damping", Some(yaw_damping)),
            ("surfaces", surfaces.as_ref()),
        ];
        let given = coefficients.into_iter().filter_map(|(name, coefficient)| {
            Some((name, coefficient.filter(|coefficient| !coefficient.is_zero())?.source()))
        });
        let others = [
            ("reference quantities", self.reference.source.as_str()),
            ("heating", self.heating.source.as_str()),
            ("exponential air", self.air.source.as_str()),
        ];
        others.into_iter().chain(given).collect()
    }

    /// Returns the description of the vehicle and of the validity of the data.
    pub fn title(&self) -> &str {
        &self.title
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every number has a source, and every vehicle a description.
    #[test]
    fn every_number_has_a_source() {
        for vehicle in [Aerodynamics::shuttle(), Aerodynamics::papers()] {
            assert!(vehicle.title().len() > 10);
            for (name, source) in vehicle.sources() {
                assert!(source.split_whitespace().count() >= 4, "{}: {name}", vehicle.title());
            }
        }
    }

    /// The wing loading, and with it the trajectory, is the Shuttle's.
    #[test]
    fn oracle_the_papers_vehicle_flies_as_the_shuttle() {
        let (papers, shuttle) = (Aerodynamics::papers(), Aerodynamics::shuttle());
        for (altitude, speed, alpha) in [(7e4, 7000.0, 0.6), (4e4, 2500.0, 0.3)] {
            let [one, other] =
                [&papers, &shuttle].map(|vehicle| vehicle.accelerations(altitude, speed, alpha));
            assert!((one.lift / other.lift - 1.0).abs() < 1e-3);
            assert!((one.drag / other.drag - 1.0).abs() < 1e-3);
        }
    }

    /// At 2859 Pa a degree of sideslip rolls the papers' vehicle by 8.6 kN m.
    #[test]
    fn oracle_static_moments_at_the_papers_flight_condition() {
        let flow = Flow {
            dynamic_pressure: 2859.0,
            mach: 9.8,
            speed: 3172.5,
            alpha: 0.5,
            beta: 1_f64.to_radians(),
        };
        let moment = Aerodynamics::papers().moment(&flow, &Vector3::zeros(), 0.5);
        assert!((moment.x + 8.58e3).abs() < 30.0, "{}", moment.x);
        assert!((moment.z + 5.24e3).abs() < 20.0, "{}", moment.z);
        assert_eq!(moment.y, 0.0);
        assert_eq!(Aerodynamics::shuttle().moment(&flow, &Vector3::x(), 0.0), Vector3::zeros());
    }
}
