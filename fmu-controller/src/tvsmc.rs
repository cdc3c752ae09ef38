//! `BTVSMC`, `BTVSMC_DO` and `SOTVSMC_DO`, the time-varying sliding modes, as FMUs.

use control::error::DesignError;
use control::sliding::{BoundaryLayer, Memory, Observer, Reaching, SecondOrder, Settings, Tvsmc};
use controller_export::table::shown_vector;
use controller_export::{ControllerFmu, Law, Vehicle};
use fmi_export::VariableTable;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize, de::DeserializeOwned};
use settings::Declared;
use std::marker::PhantomData;
use vehicle::axes::ANGLES;

/// The parts in which the time-varying sliding modes differ.
pub trait Variant: Sized + Send + Sync + 'static {
    /// Reaching law of the variant.
    type Reaching: Reaching + Send + 'static;
    /// Settings of the variant.
    type Settings: Complete<Self::Reaching>;
    /// Name of the FMU.
    const NAME: &'static str;
    /// Description of the FMU in one line.
    const DESCRIPTION: &'static str;
    /// Whether the variant has a disturbance observer.
    const OBSERVER: bool;
    /// Returns the published settings of the variant.
    fn published() -> Self::Settings;
}

/// Settings of a variant, with or without an observer.
pub trait Complete<R>:
    Declared + Default + Clone + PartialEq + Serialize + DeserializeOwned + Send
{
    /// Returns the settings without the observer.
    fn law(&self) -> &Settings<R>;

    /// Returns the settings with the observer.
    fn complete(&self) -> Settings<R>;
}

impl<R> Complete<R> for Settings<R>
where
    R: Declared + Default + Copy + PartialEq + Serialize + DeserializeOwned + Send,
{
    fn law(&self) -> &Self {
        self
    }

    fn complete(&self) -> Self {
        *self
    }
}

/// Settings of a variant with a disturbance observer.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Declared)]
pub struct Observing<R> {
    /// Settings without the observer.
    #[setting(name = "")]
    pub law: Settings<R>,
    /// Gains of the observer.
    pub observer: Observer,
}

impl<R: Default> From<Settings<R>> for Observing<R> {
    fn from(law: Settings<R>) -> Self {
        Self { observer: law.observer.unwrap_or_default(), law: Settings { observer: None, ..law } }
    }
}

impl<R> Complete<R> for Observing<R>
where
    R: Declared + Default + Copy + PartialEq + Serialize + DeserializeOwned + Send,
{
    fn law(&self) -> &Settings<R> {
        &self.law
    }

    fn complete(&self) -> Settings<R> {
        Settings { observer: Some(self.observer), ..self.law }
    }
}

/// Outputs of a time-varying sliding mode.
#[derive(Clone, Debug, Serialize, Deserialize, Declared)]
#[serde(bound = "")]
pub struct TvsmcLaw<V: Variant> {
    /// Sliding variable of the {} at the last tick.
    #[setting(name = "slidingVariable", each = ANGLES, unit = "rad/s", nominal = 1e-3)]
    sliding: Vector3<f64>,
    /// Observer's estimate z0 of the sliding variable of the {}.
    #[setting(name = "slidingEstimate", each = ANGLES, unit = "rad/s", nominal = 1e-3)]
    sliding_estimate: Vector3<f64>,
    /// Observer's estimate of the disturbance of the second derivative of the {}.
    #[setting(name = "disturbanceEstimate", each = ANGLES, unit = "rad/s2", nominal = 0.01)]
    disturbance: Vector3<f64>,
    #[serde(skip)]
    #[setting(skip)]
    variant: PhantomData<V>,
}

impl<V: Variant> Default for TvsmcLaw<V> {
    fn default() -> Self {
        let zero = Vector3::zeros();
        Self { sliding: zero, sliding_estimate: zero, disturbance: zero, variant: PhantomData }
    }
}

impl<V: Variant> Law for TvsmcLaw<V> {
    type Controller = Tvsmc<V::Reaching>;
    type Settings = V::Settings;

    const NAME: &'static str = V::NAME;
    const DESCRIPTION: &'static str = V::DESCRIPTION;
    const DOCUMENTATION: &'static str = include_str!("tvsmc.html");

    fn settings() -> V::Settings {
        V::published()
    }

    fn period(settings: &V::Settings) -> f64 {
        settings.law().period
    }

    fn uses_achieved_moment(settings: &V::Settings) -> bool {
        settings.law().achieved_moment_used
    }

    fn design(settings: V::Settings, vehicle: &Vehicle) -> Result<Tvsmc<V::Reaching>, DesignError> {
        Tvsmc::new(Settings { body: vehicle.body, ..settings.complete() })
    }

    fn outputs(table: VariableTable<ControllerFmu<Self>>) -> VariableTable<ControllerFmu<Self>> {
        if V::OBSERVER {
            return table;
        }
        table.without("slidingEstimate").without("disturbanceEstimate")
    }

    fn show(
        &mut self,
        _settings: &V::Settings,
        memory: &Memory<<V::Reaching as Reaching>::Memory>,
    ) {
        self.sliding = shown_vector(&memory.sliding);
        self.sliding_estimate = shown_vector(&memory.estimate.sliding);
        self.disturbance = shown_vector(&memory.estimate.disturbance);
    }
}

/// Returns published settings for an FMU, whose inputs are not connected at first.
fn unconnected<R>(settings: Settings<R>) -> Settings<R> {
    Settings { achieved_moment_used: false, ..settings }
}

/// Variant BTVSMC of Wu 2015, (62).
#[derive(Clone, Copy, Debug)]
pub struct Btvsmc;

impl Variant for Btvsmc {
    type Reaching = BoundaryLayer;
    type Settings = Settings<BoundaryLayer>;
    const NAME: &'static str = "BTVSMC";
    const DESCRIPTION: &'static str = "Time-varying sliding-mode attitude controller with a boundary layer, a comparison law of Wu et al. (2015)";
    const OBSERVER: bool = false;

    fn published() -> Settings<BoundaryLayer> {
        unconnected(Settings::btvsmc())
    }
}

/// Variant BTVSMC/DO of Wu 2015, (36).
#[derive(Clone, Copy, Debug)]
pub struct BtvsmcDo;

impl Variant for BtvsmcDo {
    type Reaching = BoundaryLayer;
    type Settings = Observing<BoundaryLayer>;
    const NAME: &'static str = "BTVSMC_DO";
    const DESCRIPTION: &'static str = "Time-varying sliding-mode attitude controller with a boundary layer and a disturbance observer, of Wu et al. (2015)";
    const OBSERVER: bool = true;

    fn published() -> Observing<BoundaryLayer> {
        unconnected(Settings::btvsmc_do()).into()
    }
}

/// Variant SOTVSMC/DO of Wu 2015, (45).
#[derive(Clone, Copy, Debug)]
pub struct SotvsmcDo;

impl Variant for SotvsmcDo {
    type Reaching = SecondOrder;
    type Settings = Observing<SecondOrder>;
    const NAME: &'static str = "SOTVSMC_DO";
    const DESCRIPTION: &'static str = "Second-order time-varying sliding-mode attitude controller with a disturbance observer, of Wu et al. (2015)";
    const OBSERVER: bool = true;

    fn published() -> Observing<SecondOrder> {
        unconnected(Settings::sotvsmc_do()).into()
    }
}
