//! The part of an FMU that a single control law adds, and the data that all controllers share.

use crate::reference::{self, Source};
use crate::sampled::SampledFmu;
use control::Controller;
use control::controller::Measurement;
use control::delay::Latency;
use control::error::DesignError;
use fmi2_export::VariableTable;
use fmi2_export::fields::Fields;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize, de::DeserializeOwned};
use vehicle::dynamics::{Inertia, RigidBody};
use vehicle::reference::Reference;

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

/// A controller as an FMU, to be handed to [`fmi2_export::export_fmus!`].
pub type ControllerFmu<L> = SampledFmu<ControllerInstance<L>>;

/// An instance of a controller: its parameters, inputs and outputs.
#[derive(Serialize, Deserialize)]
#[serde(bound = "")]
pub struct ControllerInstance<L: Law> {
    /// Parameters that every controller has.
    pub parameters: Parameters,
    /// Inputs that every controller has.
    pub input: Input,
    /// Outputs that every controller has.
    pub output: Output,
    /// Parameters and outputs of the law alone.
    pub law: L,
    pub(crate) source: Source,
}

/// Parameters that every controller has.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Parameters {
    /// Parameters of the reference.
    pub reference: reference::Parameters,
    /// Inertia that the controller uses, kg m².
    pub inertia: Inertia,
    /// Limit on ‖ω‖, rad/s.
    pub limit_rate: f64,
    /// Limit on ‖m‖, N m.
    pub limit_moment: f64,
    /// Whether the commanded moment is scaled into its limit.
    pub saturation: bool,
    /// Time between two evaluations of the law, s; only laws that let it be set declare it.
    pub period: f64,
    /// Delays over which the law predicts the state.
    pub latency: Latency,
    /// Whether the input `achieved_moment` is connected; only laws that use it declare this
    /// parameter.
    pub achieved_moment_used: bool,
}

/// Inputs that every controller has.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub struct Input {
    /// Measured angles and rates.
    pub measured: Measurement,
    /// Moment that the actuators give, N m.
    pub achieved_moment: Vector3<f64>,
    /// Reference from outside the FMU.
    pub reference: Reference,
}

/// Outputs that every controller has.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub struct Output {
    /// Commanded moment of the controller, N m.
    pub moment: Vector3<f64>,
    /// Reference that is in force.
    pub reference: Reference,
    /// Estimated delay of the loop, s.
    pub loop_delay: f64,
    /// Whether it differs from the given delay by more than half a period.
    pub has_other_delay: bool,
}

/// A control law with the variables that only it has. The value holds those variables; its default
/// holds their start values.
pub trait Law: Default + Serialize + DeserializeOwned + Send + 'static {
    /// Sampled controller of the law.
    type Controller: Controller + Send;
    /// All settings from which the controller is built.
    type Settings: PartialEq + Send;

    /// Name of the FMU.
    const NAME: &'static str;
    /// Description of the FMU in one line.
    const DESCRIPTION: &'static str;
    /// Description of the computation, as an HTML fragment.
    const DOCUMENTATION: &'static str = "";
    /// Names of the variables that hold fields of the settings, where they differ from the fields'
    /// names and are not in [`table::FIELDS`](crate::table::FIELDS).
    const FIELDS: &'static Fields = &[];
    /// Version of the FMU.
    const VERSION: &'static str = env!("CARGO_PKG_VERSION");

    /// Returns the start value of the time between two evaluations, s. A law whose period can be
    /// set declares it by [`table::period`](crate::table::period).
    fn period() -> f64;

    /// Adds the variables of the law to the table.
    fn declare(table: VariableTable<ControllerFmu<Self>>) -> VariableTable<ControllerFmu<Self>> {
        table
    }

    /// Returns the settings that follow from the parameters.
    fn settings(&self, vehicle: &Vehicle) -> Self::Settings;

    /// Builds the controller from its settings.
    ///
    /// # Errors
    /// Returns an error that names the field of the settings at fault.
    fn design(settings: Self::Settings) -> Result<Self::Controller, DesignError>;

    /// Copies the outputs of the law from the memory in force.
    fn show(&mut self, _memory: &<Self::Controller as Controller>::Memory) {}

    /// Returns a warning for the log if something went wrong between two ticks.
    fn warning(
        _before: &<Self::Controller as Controller>::Memory,
        _after: &<Self::Controller as Controller>::Memory,
    ) -> Option<&'static str> {
        None
    }
}
