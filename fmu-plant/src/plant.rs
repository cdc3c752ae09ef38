//! Data of an instance: parameters, inputs, outputs and the plant that computes them.

use crate::parameters::Parameters;
use fmi_export::Failure;
use nalgebra::{SVector, Vector3};
use serde::{Deserialize, Serialize};
use settings::Declared;
use vehicle::Vehicle;
use vehicle::actuators::Command;
use vehicle::axes::{ANGLES, AXES, Entry, RATES};
use vehicle::effectors::{SURFACE_NAMES, SURFACES, Surfaces};
use vehicle::entry::{MOTION as MOTION_NAMES, Motion, NOMINALS, Passage, RATE_UNITS, UNITS};
use vehicle::plant::{Held, Input, Plant};
use vehicle::sensors::Sample;

/// Number of states that describe attitude and rates. The deflections follow after them, and then
/// the motion of the centre of mass.
pub(crate) const ATTITUDE: usize = 6;
/// Number of event indicators: one for each deflection, and altitude and speed above the end of an
/// entry flight.
pub(crate) const INDICATORS: usize = SURFACES + 2;
/// Standard acceleration of gravity, m/s².
const GRAVITY: f64 = 9.80665;
/// Event indicator (s) of a deflection that is at rest.
const AT_REST: f64 = 1.0;

/// Instance of the re-entry vehicle's FMU.
#[derive(Clone, Debug, Serialize, Deserialize, Declared)]
pub struct ReentryPlant {
    #[setting(name = "", output)]
    pub(crate) output: Output,
    #[setting(name = "", input)]
    pub(crate) input: Input,
    #[setting(name = "", input, discrete, used_with = "actuation = surfacesAndJets")]
    pub(crate) command: Command,
    #[setting(name = "")]
    pub(crate) parameters: Parameters,
    /// Vehicle that was read from vehicle.file at initialization.
    #[setting(skip)]
    pub(crate) vehicle: Option<Box<Vehicle>>,
    /// Simulated plant, which exists from initialization on. Every step takes it out and puts it
    /// back: the box spares moving all of it.
    #[setting(skip)]
    pub(crate) plant: Option<Box<Plant>>,
    /// Fixed flight condition, in use without an entry flight.
    #[setting(skip)]
    pub(crate) fixed: Passage,
    /// Error of the inertia: a common factor, and the rest.
    #[setting(skip)]
    pub(crate) inertia_errors: [f64; 2],
    /// Whether the instance runs in model exchange: held quantities then change at events only, and
    /// not when time passes a tick or an input is set.
    #[setting(skip)]
    pub(crate) event_driven: bool,
}

/// Outputs of the instance at one moment of time. An entry flight computes the trajectory from the
/// motion and from the air's forces, which depend on the attitude.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Declared)]
pub(crate) struct Output {
    /// {} relative to the ground velocity.
    #[setting(name = "attitude", each = ANGLES, unit = "rad", nominal = 0.1)]
    pub(crate) angles: Vector3<f64>,
    /// Body {}.
    #[setting(name = "rate", each = RATES, unit = "rad/s", nominal = 0.05)]
    pub(crate) rates: Vector3<f64>,
    /// Time derivative of the {}.
    // They follow Wu 2015 (1), and depend on sigma through the trajectory.
    #[setting(name = "attitudeRate", each = ANGLES, unit = "rad/s", nominal = 0.05)]
    #[setting(derivative = "attitude{.}")]
    #[setting(depends_on = ["motion.*", "attitude.*", "trajectory.*", "rate.*"])]
    pub(crate) angle_rates: Vector3<f64>,
    /// Time derivative of the body {}.
    #[setting(each = RATES, unit = "rad/s2", nominal = 0.05, derivative = "rate{.}")]
    #[setting(depends_on = ["attitude.alpha", "attitude.beta", "rate.*", "moment.*",
        "disturbanceMoment.*", "jet[*", "deflection[*", "motion.*", "attitude.*", "prescribed.*",
        "prescribedRate.*", "trim.alpha"])]
    pub(crate) angular_acceleration: Vector3<f64>,
    /// Control moment that acts on the vehicle about the {}.
    #[setting(each = AXES, unit = "N.m", nominal = 1e5)]
    #[setting(depends_on = ["moment{.}", "jet[*", "deflection[*", "motion.*", "attitude.*"])]
    pub(crate) applied_moment: Vector3<f64>,
    /// Disturbance that acts on the second time derivative of the {}.
    #[setting(name = "disturbance.delta", each = ANGLES, unit = "rad/s2", nominal = 0.03, discrete)]
    #[setting(depends_on = ["attitude.alpha", "attitude.beta", "rate.*", "moment.*", "jet[*",
        "deflection[*", "motion.*", "attitude.*"])]
    pub(crate) delta: Vector3<f64>,
    /// All that acts on the second time derivative of the {} but the control moment, as an
    /// acceleration: disturbance.delta, disturbance.moment and airMoment.
    #[setting(name = "disturbance.total", each = ANGLES, unit = "rad/s2", nominal = 0.03)]
    #[setting(depends_on = ["attitude.*", "rate.*", "moment.*", "jet[*", "deflection[*",
        "motion.*", "disturbanceMoment.*", "trim.alpha"])]
    pub(crate) total_disturbance: Vector3<f64>,
    /// Relative error of the vehicle's inertia, {}.
    #[setting(name = "inertia", each = INERTIA_ERRORS, discrete)]
    pub(crate) inertia_errors: [f64; 2],
    /// Disturbance moment about the {}: external input plus sine.
    #[setting(name = "disturbance.moment", each = AXES, unit = "N.m", nominal = 1e4)]
    #[setting(depends_on = ["disturbanceMoment{.}"])]
    pub(crate) disturbance_moment: Vector3<f64>,
    /// Deflection of the {}, trailing edge down positive.
    #[setting(name = "deflection", each = SURFACE_NAMES, unit = "rad", nominal = 0.1)]
    pub(crate) deflections: Surfaces,
    /// Deflection rate of the {}: its positive or negative limit while moving, 0 at rest.
    #[setting(name = "deflectionRate", each = SURFACE_NAMES, unit = "rad/s", nominal = 0.1)]
    #[setting(derivative = "deflection{.}", depends_on = ["surface{.}", "deflection{.}"])]
    pub(crate) deflection_rates: Surfaces,
    #[setting(skip)]
    pub(crate) indicators: SVector<f64, INDICATORS>,
    #[setting(name = "", depends_on = ["attitude.*", "rate.*", "trajectory.*", "motion.*"])]
    pub(crate) measured: Sample,
    /// {}.
    #[setting(each = MOTION_NAMES, units = UNITS, nominals = NOMINALS)]
    pub(crate) motion: Motion,
    /// Time derivative of motion{.}; 0 without an entry flight.
    #[setting(each = MOTION_NAMES, units = RATE_UNITS, nominals = RATE_NOMINALS)]
    #[setting(derivative = "motion{.}", depends_on = ["motion.*", "attitude.*"])]
    pub(crate) motion_rate: Motion,
    #[setting(name = "", depends_on = ["motion.*", "attitude.*"])]
    pub(crate) passage: Passage,
    /// Specific force in units of 9.80665 m/s2; 0 without an entry flight.
    #[setting(nominal = 1.0, depends_on = ["motion.*", "attitude.*"])]
    pub(crate) load_factor: f64,
    /// Heat flux into the leading edge; 0 without an entry flight.
    #[setting(name = "heating.flux", unit = "W/m2", nominal = 1e5)]
    #[setting(depends_on = ["motion.*", "attitude.*"])]
    pub(crate) heat_flux: f64,
    /// Distance over ground from the start.
    #[setting(name = "downrange", unit = "m", nominal = 1e6)]
    #[setting(depends_on = ["motion.*", "attitude.*"])]
    pub(crate) range: f64,
    /// Moment of the air about the {}, without that of the surfaces.
    #[setting(each = AXES, unit = "N.m", nominal = 1e4)]
    #[setting(depends_on = ["motion.*", "attitude.*", "rate.*", "trim.alpha"])]
    pub(crate) air_moment: Vector3<f64>,
}

/// Parts of the error of the inertia, by docs/guarantee.md.
const INERTIA_ERRORS: [Entry; 2] =
    [(".error", "as a common factor"), (".tensorError", "besides the common factor")];

/// Typical magnitudes of the rates of the motion.
const RATE_NOMINALS: [f64; 6] = [1e3, 0.01, 0.01, 10.0, 1e-3, 0.01];

impl ReentryPlant {
    pub(crate) fn ready(&self) -> Result<&Plant, Failure> {
        self.plant.as_deref().ok_or_else(|| Failure::Error("the plant is not initialized".into()))
    }

    /// Disturbance and commands that act at `time` (s).
    pub(crate) fn held(&self, plant: &Plant, time: f64) -> Held {
        let held = if self.event_driven { plant.held() } else { None };
        held.unwrap_or_else(|| plant.in_force(time, &self.input, &self.command))
    }

    /// Outputs at `time` (s) while these quantities hold.
    pub(crate) fn output_at(&self, plant: &Plant, time: f64, held: &Held) -> Output {
        let entering = plant.entering(time);
        let entering = entering.as_ref();
        let derivative = plant.derivative(entering, time, &self.input, held);
        let mut passage =
            Passage { air_angles: [plant.angles().x, plant.angles().y], ..self.fixed };
        let (mut motion_rate, mut air_moment) = (Motion::zeros(), Vector3::zeros());
        let mut heat_flux = 0.0;
        if let Some(entering) = entering {
            air_moment = plant.air_moment(entering, &self.input);
            heat_flux = plant.heat_flux(entering);
            (passage, motion_rate) = (entering.passage, entering.derivative);
        }
        let disturbance_moment = plant.disturbance_moment(time, &self.input, held);
        let mut indicators = SVector::<f64, INDICATORS>::repeat(AT_REST);
        let left = plant.time_left(held);
        for (indicator, left) in indicators.iter_mut().zip(left.iter()) {
            if left.is_finite() {
                *indicator = *left;
            }
        }
        if let Some(margins) = plant.margins() {
            indicators.fixed_rows_mut::<2>(SURFACES).copy_from_slice(&margins);
        }
        Output {
            angles: plant.angles(),
            rates: plant.rates(),
            angle_rates: derivative.fixed_rows::<3>(0).into(),
            angular_acceleration: derivative.fixed_rows::<3>(3).into(),
            applied_moment: plant.applied_moment(entering, &self.input, held),
            delta: held.delta(),
            total_disturbance: plant.total_disturbance(&(disturbance_moment + air_moment), held),
            inertia_errors: self.inertia_errors,
            disturbance_moment,
            deflections: plant.deflections,
            deflection_rates: plant.deflection_rates(held),
            indicators,
            measured: if self.event_driven {
                plant.measured_since_held(entering, time, &self.input)
            } else {
                plant.measured(entering, time, &self.input)
            },
            motion: plant.motion,
            motion_rate,
            load_factor: passage.specific_force.norm() / GRAVITY,
            passage,
            heat_flux,
            air_moment,
            range: plant.range(),
        }
    }
}
