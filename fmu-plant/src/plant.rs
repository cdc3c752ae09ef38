//! Data of an instance: parameters, inputs, outputs and the plant that computes them.

use crate::parameters::Parameters;
use fmi2_export::Failure;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use vehicle::actuators::Command;
use vehicle::effectors::Surfaces;
use vehicle::plant::{Held, Input, Plant};
use vehicle::sensors::Sample;

/// Number of states that describe the motion, attitude and rates. The deflections follow after
/// them.
pub(crate) const MOTION: usize = 6;

/// Instance of the re-entry vehicle's FMU.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct ReentryPlant {
    pub(crate) parameters: Parameters,
    pub(crate) input: Input,
    pub(crate) command: Command,
    pub(crate) output: Output,
    /// Simulated plant, which exists from initialization on. Every step takes it out and puts it
    /// back: the box spares moving all of it.
    pub(crate) plant: Option<Box<Plant>>,
    /// Dynamic pressure of the flight, Pa: actual, and in the standard atmosphere.
    pub(crate) dynamic_pressure: f64,
    pub(crate) standard_pressure: f64,
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
    pub(crate) indicators: Surfaces,
    pub(crate) dynamic_pressure: f64,
    pub(crate) standard_pressure: f64,
    pub(crate) measured: Sample,
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
}
