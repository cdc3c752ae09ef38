//! Settings of the sliding-mode controllers, with the published ones from `data/tvsmc-2015.toml`.

use crate::sliding::{BoundaryLayer, FblSettings, Observer, SecondOrder, Surface};
use serde::{Deserialize, Serialize};
use std::sync::LazyLock;
use vehicle::data;
use vehicle::dynamics::RigidBody;
use vehicle::scenario::Scenario;

/// Settings of a time-varying sliding mode. Units SI, angles rad.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Settings<R> {
    /// Model of the vehicle that the controller uses.
    pub body: RigidBody,
    /// Time between ticks, s.
    pub period: f64,
    /// Gains of the sliding surface.
    pub surface: Surface,
    /// Reaching law with its gains.
    pub reaching: R,
    /// Disturbance observer, if there is one.
    pub observer: Option<Observer>,
    /// Whether, while the actuators saturate, the surface is placed again through the state and the
    /// reaching law's integral is cleared.
    pub anti_windup: bool,
    /// Value of ‖v_achieved − v‖ above which the actuators count as saturated, rad/s².
    pub threshold: f64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    period: f64,
    feedback_linearisation: FeedbackLinearisation,
    surface: Surface,
    boundary_layer: BoundaryLayer,
    second_order: SecondOrder,
    observer: Observer,
    anti_windup: AntiWindup,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct FeedbackLinearisation {
    kp: f64,
    kd: f64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct AntiWindup {
    threshold: f64,
}

fn embedded() -> &'static File {
    static READ: LazyLock<File> = LazyLock::new(|| {
        data::embedded("tvsmc-2015.toml", include_str!("../../data/tvsmc-2015.toml"))
    });
    &READ
}

fn body() -> RigidBody {
    // This cannot fail, as the tests that use it show: the scenario is embedded.
    Scenario::tvsmc2015().inertia.body(1.0).unwrap_or_else(|error| panic!("{error}"))
}

impl FblSettings {
    /// Returns the settings of Wu 2015, section 6, with its vehicle at the nominal inertia.
    pub fn published() -> Self {
        let &File { period, feedback_linearisation: FeedbackLinearisation { kp, kd }, .. } =
            embedded();
        Self { body: body(), period, kp, kd }
    }
}

impl<R> Settings<R> {
    fn published(file: &File, reaching: R, observer: Option<Observer>) -> Self {
        Self {
            body: body(),
            period: file.period,
            surface: file.surface,
            reaching,
            observer,
            anti_windup: true,
            threshold: file.anti_windup.threshold,
        }
    }
}

impl Settings<BoundaryLayer> {
    /// Returns the settings of BTVSMC in Wu 2015, Table 1.
    pub fn btvsmc() -> Self {
        let file = embedded();
        Self::published(file, file.boundary_layer, None)
    }

    /// Returns the settings of BTVSMC/DO in Wu 2015, Table 1.
    pub fn btvsmc_do() -> Self {
        let file = embedded();
        Self::published(file, file.boundary_layer, Some(file.observer))
    }
}

impl Settings<SecondOrder> {
    /// Returns the settings of SOTVSMC/DO in Wu 2015, Table 1.
    pub fn sotvsmc_do() -> Self {
        let file = embedded();
        Self::published(file, file.second_order, Some(file.observer))
    }
}
