//! The variables by which the pictures of a run show its flight over a planet.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The section `[observe.trajectory]`: variables by which the pictures of a run show altitude over
/// speed with its corridor, and the ground track. Those that an FMU lacks which the command line
/// put in are left out.
#[derive(Clone, Debug, Deserialize, JsonSchema, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Trajectory {
    /// Altitude, m.
    pub altitude: String,
    /// Speed, m/s.
    pub speed: String,
    /// Longitude and latitude, rad.
    pub position: [String; 2],
    /// Longitude and latitude of the target, rad.
    pub target: Option<[String; 2]>,
    /// Variable that counts the bank reversals, which are marked on the ground track.
    pub reversals: Option<String>,
    /// Density of the air, kg/m³. The corridor needs it.
    pub density: Option<String>,
    /// Limits whose altitudes at each speed bound the corridor.
    #[serde(default)]
    pub corridor: Vec<Bound>,
    /// Variables of the altitude at which the lift holds the vehicle without bank.
    pub equilibrium: Option<Equilibrium>,
}

/// A limit of a quantity that grows with the density of the air.
#[derive(Clone, Debug, Deserialize, JsonSchema, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Bound {
    /// Name of the limit in the legend.
    pub name: String,
    /// Variable of the quantity.
    pub of: String,
    /// Variable of its limit.
    pub limit: String,
    /// Power of the density to which the quantity is proportional at constant speed.
    #[serde(default = "one")]
    pub power: f64,
}

/// Variables of the equilibrium glide, in which lift and centrifugal force equal the weight.
#[derive(Clone, Debug, Deserialize, JsonSchema, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Equilibrium {
    /// Lift per mass, m/s².
    pub lift: String,
    /// Radius of the planet, m.
    pub radius: String,
    /// Gravitational parameter of the planet, m³/s².
    pub gravitation: String,
}

fn one() -> f64 {
    1.0
}

impl Trajectory {
    /// Returns the names of all variables.
    pub fn paths(&self) -> impl Iterator<Item = &str> {
        let Self { altitude, speed, position, target, reversals, density, corridor, equilibrium } =
            self;
        let single = [altitude, speed].into_iter().chain(position).chain(target.iter().flatten());
        let bounds = corridor.iter().flat_map(|bound| [&bound.of, &bound.limit]);
        let glide = equilibrium.iter().flat_map(|e| [&e.lift, &e.radius, &e.gravitation]);
        single.chain(reversals).chain(density).chain(bounds).chain(glide).map(String::as_str)
    }
}
