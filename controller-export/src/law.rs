//! The part of a unit that a single controller adds: its own parameters, its design and its
//! outputs.

use crate::unit::ControllerFmu;
use control::Controller;
use control::delay::Latency;
use control::error::DesignError;
use fmi2_export::Table;
use fmi2_export::fields::Fields;
use serde::{Serialize, de::DeserializeOwned};
use vehicle::dynamics::RigidBody;

/// Data that every controller receives: its vehicle, limits and schedule.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Vehicle {
    /// Rigid body of the vehicle that the controller uses.
    pub body: RigidBody,
    /// Limit on ‖ω‖, rad/s.
    pub limit_rate: f64,
    /// Limit on ‖m‖, N m.
    pub limit_moment: f64,
    /// Whether the commanded moment is scaled into its limit.
    pub saturation: bool,
    /// Time between two evaluations of the law, s.
    pub period: f64,
    /// Time from the instant of a measurement until the resulting moment acts. The law receives the
    /// state predicted over this time.
    pub latency: Latency,
}

impl Vehicle {
    /// Returns the limit into which a command is scaled, N m; infinite for none.
    pub(crate) fn saturates_at(&self) -> f64 {
        if self.saturation { self.limit_moment } else { f64::INFINITY }
    }
}

/// A control law with the variables that only it has. The value holds those variables; its default
/// holds their start values.
pub trait Law: Default + Serialize + DeserializeOwned + Send + 'static {
    /// Sampled controller of the law.
    type Controller: Controller + Send;
    /// All settings from which the controller is built.
    type Settings: PartialEq + Send;

    /// Name of the unit in FMI.
    const NAME: &'static str;
    /// Description of the unit in one line.
    const DESCRIPTION: &'static str;
    /// Description of the computation, as an HTML fragment.
    const DOCUMENTATION: &'static str = "";
    /// Names of the variables that hold fields of the settings, where they differ from the fields'
    /// own and are not in [`table::FIELDS`](crate::table::FIELDS).
    const FIELDS: &'static Fields = &[];
    /// Version of the unit in FMI.
    const VERSION: &'static str = env!("CARGO_PKG_VERSION");

    /// Returns the start value of the time between two evaluations, s. A law whose period can be
    /// set declares it by [`table::period`](crate::table::period).
    fn period() -> f64;

    /// Adds the law's own variables to the table.
    fn declare(table: Table<ControllerFmu<Self>>) -> Table<ControllerFmu<Self>> {
        table
    }

    /// Returns the settings that follow from the parameters.
    fn settings(&self, vehicle: &Vehicle) -> Self::Settings;

    /// Builds the controller from its settings.
    ///
    /// # Errors
    /// Returns an error that names the field of the settings at fault.
    fn design(settings: Self::Settings) -> Result<Self::Controller, DesignError>;

    /// Copies the law's own outputs from the memory in force.
    fn show(&mut self, _memory: &<Self::Controller as Controller>::Memory) {}

    /// Returns a warning for the log if something went wrong between two ticks.
    fn warning(
        _before: &<Self::Controller as Controller>::Memory,
        _after: &<Self::Controller as Controller>::Memory,
    ) -> Option<&'static str> {
        None
    }
}
