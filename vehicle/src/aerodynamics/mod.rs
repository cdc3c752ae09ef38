//! Forces and moments of the air on a vehicle, as data: one file per vehicle, with a source for
//! every number.
//!
//! Forces act along the axes of the airflow: drag against the velocity relative to the air, lift
//! perpendicular to it in the vehicle's plane of symmetry, and side force to the right. Moments are
//! about the body axes.

mod coefficient;
mod groups;
mod surfaces;
mod units;

pub use coefficient::Coefficient;
pub use surfaces::SurfaceTable;
pub use units::FOOT;

pub(crate) use groups::{ExponentialAir, Forces, Heating, HeatingUnits, Moments, Reference};
pub(crate) use surfaces::GivenTable;

use crate::math::{exp, powf};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use units::{BTU_PER_SQUARE_FOOT, SLUG};

/// Air forces and moments of a vehicle.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Aerodynamics {
    /// Description of the vehicle and of the validity of the data.
    pub(crate) title: String,
    pub(crate) reference: Reference,
    pub(crate) forces: Forces,
    pub(crate) moments: Moments,
    pub(crate) heating: Option<Heating>,
    pub(crate) air: Option<ExponentialAir>,
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
    pub fn exponential_air(&self) -> Option<[f64; 2]> {
        let ExponentialAir { density_slug_ft3, scale_height_ft, .. } = self.air.as_ref()?;
        Some([density_slug_ft3 * SLUG / (FOOT * FOOT * FOOT), scale_height_ft * FOOT])
    }

    /// Returns the density of the exponential air at an altitude (m), kg/m³; 0 without one.
    pub fn density(&self, altitude: f64) -> f64 {
        self.exponential_air()
            .map_or(0.0, |[at_zero, scale_height]| at_zero * exp(-altitude / scale_height))
    }

    /// Returns lift and drag per mass in exponential air at an altitude (m), a speed (m/s) and an
    /// angle of attack (rad), at a Mach number above that of all tables.
    pub fn accelerations(&self, altitude: f64, speed: f64, alpha: f64) -> LiftAndDrag {
        let dynamic_pressure = 0.5 * self.density(altitude) * speed * speed;
        let flow = Flow { dynamic_pressure, mach: f64::MAX, speed, alpha, beta: 0.0 };
        let [drag, _, lift] = self.forces(&flow).map(|force| force / self.mass());
        LiftAndDrag { lift, drag }
    }

    /// Returns the coefficients of lift and drag at an angle of attack (rad) and a Mach number.
    pub fn lift_and_drag(&self, alpha: f64, mach: f64) -> [f64; 2] {
        [&self.forces.lift, &self.forces.drag].map(|coefficient| coefficient.at(alpha, mach))
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

    /// Returns span, chord and span, to which roll, pitch and yaw moments refer, m; none without
    /// moments.
    pub(crate) fn lengths(&self) -> Option<Vector3<f64>> {
        let (span, chord) = (self.reference.span?.metres(), self.reference.chord?.metres());
        Some(Vector3::new(span, chord, span))
    }

    /// Returns the point about which the moments are given, from the centre of mass along the body
    /// axes, m.
    pub fn moment_point(&self) -> Option<Vector3<f64>> {
        self.reference.moment_point_metres.map(Vector3::from)
    }

    /// Returns the moment about the body axes and the point of the moments (N m) without that of
    /// the surfaces, at body `rates` (rad/s) and trimmed at the angle of attack `trim` (rad).
    pub fn moment(&self, flow: &Flow, rates: &Vector3<f64>, trim: f64) -> Vector3<f64> {
        let Some(lengths) = self.lengths() else { return Vector3::zeros() };
        let Flow { dynamic_pressure, mach, speed, alpha, beta } = *flow;
        let of = |coefficient: &Coefficient| coefficient.at(alpha, mach);
        let moments = &self.moments;
        let damping = if speed > 0.0 {
            let turned = rates.component_mul(&lengths) / (2.0 * speed);
            turned.component_mul(&Vector3::new(
                of(&moments.roll_damping),
                of(&moments.pitch_damping),
                of(&moments.yaw_damping),
            ))
        } else {
            Vector3::zeros()
        };
        let fixed = Vector3::new(
            of(&moments.roll_by_sideslip) * beta + of(&moments.roll),
            of(&moments.pitch_by_alpha) * (alpha - trim) + of(&moments.pitch),
            of(&moments.yaw_by_sideslip) * beta + of(&moments.yaw),
        );
        (fixed + damping).component_mul(&lengths) * (dynamic_pressure * self.area())
    }

    /// Returns the pitch moment (N m) that belongs to a coefficient.
    pub fn pitch_moment(&self, flow: &Flow, coefficient: f64) -> f64 {
        let chord = self.lengths().map_or(0.0, |lengths| lengths.y);
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
    /// (m/s) and an angle of attack (rad); 0 without data of the heating.
    pub fn heat_flux(&self, density: f64, speed: f64, alpha: f64) -> f64 {
        let Some(heating) = &self.heating else { return 0.0 };
        let [a, b] = self.heating_exponents();
        let (density, speed, unit) = match heating.units {
            HeatingUnits::Imperial => {
                (density * FOOT * FOOT * FOOT / SLUG, speed / FOOT / 1e4, BTU_PER_SQUARE_FOOT)
            }
            HeatingUnits::Si => (density, speed, 1.0),
        };
        // The root is exact on every platform, and by far the most common power.
        let of_density = if a == 0.5 { density.sqrt() } else { powf(density, a) };
        let flux = heating.factor * of_density * powf(speed, b);
        coefficient::polynomial(&heating.polynomial, alpha.to_degrees()) * flux * unit
    }

    /// Returns the powers of density and speed with which the heat flux grows.
    pub fn heating_exponents(&self) -> [f64; 2] {
        self.heating
            .as_ref()
            .map_or([0.5, 0.0], |heating| [heating.density_exponent, heating.exponent])
    }

    /// Returns the name and the source of each group of numbers.
    pub fn sources(&self) -> Vec<(&'static str, &str)> {
        let moments = self.moments.all();
        let coefficients = [("lift", &self.forces.lift), ("drag", &self.forces.drag)];
        let given = coefficients.into_iter().chain([("side force", &self.forces.side)]);
        let given = given.chain(moments).filter(|(_, coefficient)| !coefficient.is_zero());
        let others = [
            Some(("reference quantities", self.reference.source.as_str())),
            self.heating.as_ref().map(|heating| ("heating", heating.source.as_str())),
            self.air.as_ref().map(|air| ("exponential air", air.source.as_str())),
        ];
        let given = given.map(|(name, coefficient)| (name, coefficient.source()));
        others.into_iter().flatten().chain(given).collect()
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
