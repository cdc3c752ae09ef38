//! What one controller adds to the unit that all of them share: its own parameters, its design, its own outputs.

use crate::unit::ControllerFmu;
use control::Controller;
use control::delay::Latency;
use control::error::DesignError;
use fmi2_export::Table;
use serde::{Serialize, de::DeserializeOwned};
use vehicle::dynamics::RigidBody;

/// What every controller is told about the vehicle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Vehicle {
    /// The rigid body as the controller believes it to be.
    pub body: RigidBody,
    /// Limit on ‖ω‖, rad/s.
    pub limit_rate: f64,
    /// Limit on ‖m‖, N m.
    pub limit_moment: f64,
    /// Whether the commanded moment is scaled into its limit.
    pub saturation: bool,
    /// Time between the instant that a measurement describes and the action of the moment computed from it. The law sees the
    /// state predicted over it.
    pub latency: Latency,
}

impl Vehicle {
    /// The limit that a command is scaled into, N m; infinite for none. For laws that must know what is left of a command.
    pub fn saturates_at(&self) -> f64 {
        if self.saturation { self.limit_moment } else { f64::INFINITY }
    }
}

/// A control law with the variables only it has. The value holds those variables; its default holds their start values.
pub trait Law: Default + Serialize + DeserializeOwned + Send + 'static {
    /// The sampled controller behind it.
    type Controller: Controller + Send;
    /// All that the controller is built from.
    type Settings: PartialEq + Send;

    /// Name of the unit.
    const NAME: &'static str;
    /// One line: what the unit is.
    const DESCRIPTION: &'static str;
    /// What it computes, as an HTML fragment.
    const DOCUMENTATION: &'static str = "";
    /// Version of the unit.
    const VERSION: &'static str = env!("CARGO_PKG_VERSION");

    /// Adds the law's own variables to the table.
    fn declare(table: Table<ControllerFmu<Self>>) -> Table<ControllerFmu<Self>> {
        table
    }

    /// The settings that the parameters make.
    fn settings(&self, vehicle: &Vehicle) -> Self::Settings;

    /// Builds the controller.
    ///
    /// # Errors
    /// Names the parameter at fault.
    fn design(settings: Self::Settings) -> Result<Self::Controller, DesignError>;

    /// Takes the law's own outputs from the memory in force.
    fn show(&mut self, _memory: &<Self::Controller as Controller>::Memory) {}

    /// A warning for the log if something went wrong between two ticks.
    fn warning(
        _before: &<Self::Controller as Controller>::Memory,
        _after: &<Self::Controller as Controller>::Memory,
    ) -> Option<&'static str> {
        None
    }
}
