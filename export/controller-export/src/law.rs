//! The part of an FMU that a single control law adds, and the data that all controllers share.

use crate::own_vehicle::OwnVehicle;
use crate::reference::{self, Source};
use crate::sampled::SampledFmu;
use control::Controller;
use control::controller::Scheduled;
use control::delay::Latency;
use control::error::DesignError;
use fmi_export::{SettingsFile, VariableTable};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize, de::DeserializeOwned};
use settings::Declared;
use vehicle::axes::{ANGLES, Entry, MOMENTS, RATES};
use vehicle::dynamics::RigidBody;
use vehicle::reference::Reference;
use vehicle::trajectory::Trajectory;

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

/// A controller as an FMU, to be handed to [`fmi_export::export_fmus!`].
pub type ControllerFmu<L> = SampledFmu<ControllerInstance<L>>;

/// An instance of a controller: its parameters, inputs and outputs.
#[derive(Serialize, Deserialize, Declared)]
#[serde(bound = "")]
pub struct ControllerInstance<L: Law> {
    /// Inputs that every controller has.
    #[setting(name = "", input)]
    pub input: Input,
    /// Outputs that every controller has.
    #[setting(name = "", output)]
    pub output: Output,
    /// Parameters that every controller has.
    #[setting(name = "")]
    pub parameters: Parameters,
    /// Parameters of the law alone.
    #[setting(name = "")]
    pub settings: L::Settings,
    #[setting(name = "")]
    pub(crate) file: SettingsFile,
    /// Vehicle that the controller assumes.
    #[setting(name = "")]
    pub own: OwnVehicle,
    /// Outputs of the law alone.
    #[setting(name = "", output, discrete, depends_on = SAMPLED)]
    pub law: L,
    #[setting(skip)]
    pub(crate) source: Source,
}

/// Inputs on which the outputs of a tick depend.
const SAMPLED: [&str; 6] =
    ["attitude.*", "rate.*", "reference.external*", "trajectory.*", "knownMoment.*", "scheduled.*"];

/// Parameters that every controller has.
#[derive(Clone, Debug, Serialize, Deserialize, Declared)]
pub struct Parameters {
    /// Parameters of the reference.
    pub reference: reference::Parameters,
    /// Upper limit on the norm of the body rates.
    #[setting(name = "limit.rate", unit = "rad/s", min = 1e-6, nominal = 0.1)]
    pub limit_rate: f64,
    /// Upper limit on the norm of the control moment.
    #[setting(name = "limit.moment", unit = "N.m", min = 1e-3, nominal = 1e5)]
    pub limit_moment: f64,
    /// Whether the commanded moment is scaled down to a norm of at most limit.moment.
    pub saturation: bool,
    /// Delays over which the law predicts the state.
    #[setting(name = "")]
    pub latency: Latency,
    /// Angular rate of the Earth, for the inputs trajectory.*: 7.2921e-5 rad/s, or 0 to neglect the
    /// rotation.
    #[setting(name = "trajectory.earthRate", unit = "rad/s", min = 0.0, max = 1.0, nominal = 1e-4)]
    pub earth_rate: f64,
}

/// Inputs that every controller has.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize, Declared)]
pub struct Input {
    /// Measured {}.
    #[setting(name = "attitude", each = MEASURED, unit = "rad", nominal = 0.1)]
    pub angles: Vector3<f64>,
    /// Measured body {}.
    #[setting(name = "rate", each = RATES, unit = "rad/s", nominal = 0.05)]
    pub rates: Vector3<f64>,
    /// {} achieved by the actuators.
    ///
    /// All controllers have it, so that they can be exchanged.
    #[setting(each = MOMENTS, unit = "N.m", nominal = 1e5)]
    pub achieved_moment: Vector3<f64>,
    /// Reference from outside the FMU.
    #[setting(name = "reference.external", each = ANGLES)]
    #[setting(used_with = "reference.profile = external")]
    pub reference: Reference,
    /// {} that is known to act besides that of the actuators, such as the air's; the command is the
    /// remainder.
    #[setting(each = MOMENTS, unit = "N.m", nominal = 1e5)]
    pub known_moment: Vector3<f64>,
    /// Limits that hold at present. All controllers have them, so that they can be exchanged.
    #[setting(optional)]
    pub scheduled: Scheduled,
    /// {}, as it is known.
    ///
    /// The trajectory turns the axes from which the angles are counted.
    pub trajectory: Trajectory,
}

const MEASURED: [Entry; 3] = [
    (".alpha", "angle of attack relative to the air"),
    (".beta", "sideslip angle relative to the air"),
    (".sigma", "bank angle relative to the ground velocity"),
];

/// Outputs that every controller has.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize, Declared)]
pub struct Output {
    /// Commanded {}, held between the ticks of period.feedback.
    #[setting(each = MOMENTS, unit = "N.m", nominal = 1e5, discrete, depends_on = SAMPLED)]
    pub moment: Vector3<f64>,
    /// {} at the present time.
    ///
    /// It is the reference in force, which may come from outside.
    #[setting(each = ANGLES)]
    pub reference: Reference,
    /// Estimated delay from a measurement to the resulting moment; equals delay + measurement.age
    /// until the response of the vehicle allows an estimate.
    #[setting(name = "loopDelay.estimate", unit = "s", nominal = 0.1)]
    #[setting(discrete, depends_on = SAMPLED)]
    pub loop_delay: f64,
    /// Whether loopDelay.estimate differs from delay + measurement.age by more than half of
    /// period.feedback.
    #[setting(name = "loopDelay.differs", depends_on = SAMPLED)]
    pub has_other_delay: bool,
}

/// A control law as an FMU. The value holds the outputs that only this law has.
pub trait Law: Declared + Default + Serialize + DeserializeOwned + Send + 'static {
    /// Sampled controller of the law.
    type Controller: Controller + Send;
    /// Settings of the law, which become parameters of the FMU.
    type Settings: Declared + Default + Clone + PartialEq + Serialize + DeserializeOwned + Send;

    /// Name of the FMU.
    const NAME: &'static str;
    /// Description of the FMU in one line.
    const DESCRIPTION: &'static str;
    /// Description of the computation, as an HTML fragment.
    const DOCUMENTATION: &'static str = "";
    /// Version of the FMU.
    const VERSION: &'static str = env!("CARGO_PKG_VERSION");

    /// Whether the law plans over the future of its reference.
    const PLANS: bool = false;

    /// Returns the start values of the settings, by default those that are declared.
    fn settings() -> Self::Settings {
        settings::start()
    }

    /// Returns the time between two evaluations of the law, s. By default it is the 0.04 s of the
    /// laws of Chai 2022.
    fn period(_settings: &Self::Settings) -> f64 {
        0.04
    }

    /// Returns whether the law receives the moment of the actuators.
    fn uses_achieved_moment(_settings: &Self::Settings) -> bool {
        false
    }

    /// Builds the controller for a vehicle.
    ///
    /// # Errors
    /// Returns an error that names the setting at fault.
    fn design(settings: Self::Settings, vehicle: &Vehicle)
    -> Result<Self::Controller, DesignError>;

    /// Changes the table, which has the outputs that the law declares.
    fn outputs(table: VariableTable<ControllerFmu<Self>>) -> VariableTable<ControllerFmu<Self>> {
        table
    }

    /// Copies the outputs of the law from the memory in force.
    fn show(
        &mut self,
        _settings: &Self::Settings,
        _memory: &<Self::Controller as Controller>::Memory,
    ) {
    }

    /// Returns a warning for the log if something went wrong between two ticks.
    fn warning(
        _before: &<Self::Controller as Controller>::Memory,
        _after: &<Self::Controller as Controller>::Memory,
    ) -> Option<&'static str> {
        None
    }
}
