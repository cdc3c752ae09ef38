//! Configuration of a plant.

use crate::actuators::{self};
use crate::disturbance::Disturbance;
use crate::dynamics::Inertia;
use crate::entry;
use crate::kinematics::Kinematics;
use crate::platform::Surroundings;
use crate::sensors::{self};
use crate::state::State;
use crate::turntable::{self};
use serde::{Deserialize, Serialize};

/// Configuration that determines the motion of a plant, apart from the inputs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Config {
    /// Nominal inertia of the vehicle.
    pub inertia: Inertia,
    /// Factor from the nominal inertia to that of the vehicle.
    pub inertia_scale: f64,
    /// State at the start of the experiment.
    pub initial: State,
    /// Disturbance that acts on the vehicle.
    pub disturbance: Disturbance,
    /// Motion of the centre of mass at the start. Without an entry flight it stays.
    pub motion: entry::Motion,
    /// Entry flight; without it the trajectory is an input, and the flight condition is fixed.
    pub entry: Option<entry::Config>,
    /// Attitude kinematics, with the matrix R in use.
    pub kinematics: Kinematics,
    /// Angular rate ω_e of the Earth for a trajectory that is an input, rad/s.
    pub earth_rate: f64,
    /// Surfaces and jets that make the control moment; without them the moment is an input.
    pub actuators: Option<actuators::Config>,
    /// Time (s, from 0 to [`crate::transport::LONGEST`]) after which the input moment acts; it is
    /// zero with actuators. A delayed moment is taken at the beginning of each communication step.
    pub moment_delay: f64,
    /// Step (N m) of the converter that the input moment passes; 0 for none. A converted moment is
    /// held over each communication step.
    pub moment_resolution: f64,
    /// Gravity and magnetic field that the sensors measure.
    pub surroundings: Surroundings,
    /// Configuration of sampled sensors; without it the plant outputs the readings of ideal
    /// sensors.
    pub sensors: Option<sensors::Config>,
    /// Servo of the turntable on which sampled sensors are mounted.
    pub turntable: turntable::Config,
    /// Longest step of the integration, s.
    pub step: f64,
}
