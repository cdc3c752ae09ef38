//! Settings of the sliding-mode controllers, with the published ones from `data/tvsmc-2015.toml`.

use crate::sliding::{BoundaryLayer, FblSettings, Observer, SecondOrder, Surface};
use serde::{Deserialize, Serialize};
use settings::Declared;
use std::sync::LazyLock;
use vehicle::data::Tables;
use vehicle::dynamics::RigidBody;
use vehicle::scenario::Scenario;

/// Settings of a time-varying sliding mode. Units SI, angles rad.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Declared)]
pub struct Settings<R> {
    /// Model of the vehicle that the controller uses.
    #[setting(skip)]
    pub body: RigidBody,
    /// Sampling period of the control law.
    #[setting(name = "period.feedback", unit = "s", min = 1e-4, max = 10.0, nominal = 0.01)]
    pub period: f64,
    /// Gains of the sliding surface.
    pub surface: Surface,
    /// Reaching law with its gains.
    #[setting(name = "")]
    pub reaching: R,
    /// Whether the inputs achievedMoment are connected; otherwise the law assumes that the
    /// commanded moment acts.
    #[setting(name = "achievedMoment.used")]
    pub achieved_moment_used: bool,
    /// Whether the sliding surface is placed again through the state while the actuators saturate;
    /// false in the paper.
    ///
    /// The reaching law's integral is then cleared as well.
    #[setting(used_with = "achievedMoment.used = true")]
    pub anti_windup: bool,
    /// Norm of the missing angular acceleration above which the actuators count as saturated.
    #[setting(name = "antiWindupThreshold", unit = "rad/s2", above = 0.0, nominal = 0.01)]
    #[setting(used_with = "achievedMoment.used = true and antiWindup = true")]
    pub threshold: f64,
    /// Disturbance observer, if there is one.
    #[setting(skip)]
    pub observer: Option<Observer>,
}

static FILE: LazyLock<Tables> =
    LazyLock::new(|| Tables::new("tvsmc-2015.toml", include_str!("../../data/tvsmc-2015.toml")));

fn body() -> RigidBody {
    // This cannot fail, as the tests that use it show: the scenario is embedded.
    Scenario::tvsmc2015().inertia.body(1.0).unwrap_or_else(|error| panic!("{error}"))
}

impl FblSettings {
    /// Returns the settings of Wu 2015, section 6, with its vehicle at the nominal inertia.
    pub fn published() -> Self {
        let mut settings = Self { body: body(), ..Self::default() };
        FILE.set("feedback_linearisation", &mut settings);
        settings
    }
}

impl<R: Declared + Default> Settings<R> {
    /// Returns the published settings of the law with this table of its reaching law.
    fn published(reaching: &str) -> Self {
        let mut settings = Self { body: body(), ..Self::default() };
        FILE.set("sliding_modes", &mut settings);
        FILE.set(reaching, &mut settings);
        settings
    }

    /// Returns the settings with the published observer.
    fn with_observer(self) -> Self {
        let mut observer = Observer::default();
        FILE.set("observer", &mut observer);
        Self { observer: Some(observer), ..self }
    }
}

impl Settings<BoundaryLayer> {
    /// Returns the settings of BTVSMC in Wu 2015, Table 1.
    pub fn btvsmc() -> Self {
        Self::published("boundary_layer")
    }

    /// Returns the settings of BTVSMC/DO in Wu 2015, Table 1.
    pub fn btvsmc_do() -> Self {
        Self::btvsmc().with_observer()
    }
}

impl Settings<SecondOrder> {
    /// Returns the settings of SOTVSMC/DO in Wu 2015, Table 1.
    pub fn sotvsmc_do() -> Self {
        Self::published("second_order").with_observer()
    }
}
