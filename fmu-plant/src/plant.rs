//! Data of an instance: parameters, inputs, outputs and the plant that computes them.

use crate::parameters::Parameters;
use fmi_export::Failure;
use nalgebra::{SVector, Vector3};
use serde::{Deserialize, Serialize};
use vehicle::Vehicle;
use vehicle::actuators::Command;
use vehicle::effectors::{SURFACES, Surfaces};
use vehicle::entry::{Motion, Passage};
use vehicle::plant::{Held, Input, Plant};
use vehicle::sensors::Sample;

/// Number of states that describe attitude and rates. The deflections follow after them, and then
/// the motion of the centre of mass.
pub(crate) const ATTITUDE: usize = 6;
/// Index of the first state of the motion.
pub(crate) const MOTION: usize = ATTITUDE + SURFACES;
/// Number of event indicators: one for each deflection, and altitude and speed above the end of an
/// entry flight.
pub(crate) const INDICATORS: usize = SURFACES + 2;
/// Standard acceleration of gravity, m/s².
const GRAVITY: f64 = 9.80665;
/// Event indicator (s) of a deflection that is at rest.
const AT_REST: f64 = 1.0;

/// Instance of the re-entry vehicle's FMU.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct ReentryPlant {
    pub(crate) parameters: Parameters,
    pub(crate) input: Input,
    pub(crate) command: Command,
    pub(crate) output: Output,
    /// Vehicle that was read from vehicle.file at initialization.
    pub(crate) vehicle: Option<Box<Vehicle>>,
    /// Simulated plant, which exists from initialization on. Every step takes it out and puts it
    /// back: the box spares moving all of it.
    pub(crate) plant: Option<Box<Plant>>,
    /// Fixed flight condition, in use without an entry flight.
    pub(crate) fixed: Passage,
    /// Whether the instance runs in model exchange: held quantities then change at events only, and
    /// not when time passes a tick or an input is set.
    pub(crate) event_driven: bool,
}

/// Outputs of the instance at one moment of time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Output {
    pub(crate) angles: Vector3<f64>,
    pub(crate) rates: Vector3<f64>,
    pub(crate) angle_rates: Vector3<f64>,
    pub(crate) angular_acceleration: Vector3<f64>,
    pub(crate) applied_moment: Vector3<f64>,
    pub(crate) delta: Vector3<f64>,
    pub(crate) disturbance_moment: Vector3<f64>,
    pub(crate) deflections: Surfaces,
    pub(crate) deflection_rates: Surfaces,
    pub(crate) indicators: SVector<f64, INDICATORS>,
    pub(crate) measured: Sample,
    pub(crate) motion: Motion,
    pub(crate) motion_rate: Motion,
    pub(crate) passage: Passage,
    /// Magnitude of the specific force in units of the standard gravity.
    pub(crate) load_factor: f64,
    /// Heat flux into the leading edge, W/m².
    pub(crate) heat_flux: f64,
    pub(crate) air_moment: Vector3<f64>,
    pub(crate) range: f64,
}

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
            disturbance_moment: plant.disturbance_moment(time, &self.input, held),
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
