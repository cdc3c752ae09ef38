//! `BTVSMC`, `BTVSMC_DO`, `SOTVSMC_DO`: parameters and outputs of the time-varying sliding modes.

use control::error::DesignError;
use control::sliding::{
    BoundaryLayer, Estimate, Memory, Observer, Reaching, SecondOrder, SecondOrderForm, Settings,
    Tvsmc,
};
use controller_export::table::{self, ANGLES, sampled_output, shown_vector, vector};
use controller_export::{ControllerFmu, Law, Vehicle};
use fmi2_export::fields::Fields;
use fmi2_export::table::parameter;
use fmi2_export::{Enumeration, VariableTable};
use model_description::unit;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize, de::DeserializeOwned};

static FORMS: Enumeration<SecondOrderForm> = Enumeration {
    name: "SecondOrderForm",
    description: "Signs of the second-order reaching law",
    items: &[
        (
            SecondOrderForm::Corrected,
            "corrected",
            "signs with which the sliding variables converge to zero",
        ),
        (
            SecondOrderForm::Printed,
            "printed",
            "opposite sign of the term with k3 and a second sgn, as printed in (43) and (45); the sliding variables do not converge",
        ),
    ],
};

/// The parts in which the time-varying sliding modes differ.
pub trait Variant: Sized + Send + Sync + 'static {
    /// Reaching law of the variant.
    type Reaching: Reaching + PartialEq + Serialize + DeserializeOwned + Send + 'static;
    /// Name of the FMU.
    const NAME: &'static str;
    /// Description of the FMU in one line.
    const DESCRIPTION: &'static str;
    /// Whether the variant has a disturbance observer.
    const OBSERVER: bool;
    /// Returns the published settings of the variant.
    fn published() -> Settings<Self::Reaching>;
    /// Adds the parameters of the reaching law.
    fn reaching(
        table: VariableTable<ControllerFmu<TvsmcLaw<Self>>>,
    ) -> VariableTable<ControllerFmu<TvsmcLaw<Self>>>;
}

/// Parameters and outputs of a time-varying sliding mode.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(bound = "")]
pub struct TvsmcLaw<V: Variant> {
    pub(crate) settings: Settings<V::Reaching>,
    /// Gains of the observer; used only if the variant has one.
    pub(crate) observer: Observer,
    sliding: Vector3<f64>,
    estimate: Estimate,
}

impl<V: Variant> Default for TvsmcLaw<V> {
    fn default() -> Self {
        let settings = V::published();
        let observer = settings.observer.unwrap_or(Observer { lambda: [1.0; 3], l: [1.0; 3] });
        Self { settings, observer, sliding: Vector3::zeros(), estimate: Estimate::default() }
    }
}

impl<V: Variant> Law for TvsmcLaw<V> {
    type Controller = Tvsmc<V::Reaching>;
    type Settings = Settings<V::Reaching>;

    const NAME: &'static str = V::NAME;
    const DESCRIPTION: &'static str = V::DESCRIPTION;
    const DOCUMENTATION: &'static str = include_str!("tvsmc.html");
    const FIELDS: &'static Fields = &[
        ("reaching.h", "boundaryLayer.h"),
        ("reaching.eta / reaching.h", "reaching.eta / boundaryLayer.h"),
        ("observer.l", "observer.L"),
    ];

    fn period() -> f64 {
        V::published().period
    }

    fn declare(table: VariableTable<ControllerFmu<Self>>) -> VariableTable<ControllerFmu<Self>> {
        let table = table::period(table, "control law");
        let table = anti_windup(V::reaching(surface(table)));
        let table = if V::OBSERVER { observer(table) } else { table };
        outputs(table)
    }

    fn settings(&self, vehicle: &Vehicle) -> Self::Settings {
        Settings {
            body: vehicle.body,
            period: vehicle.period,
            observer: V::OBSERVER.then_some(self.observer),
            ..self.settings
        }
    }

    fn design(settings: Self::Settings) -> Result<Self::Controller, DesignError> {
        Tvsmc::new(settings)
    }

    fn show(&mut self, memory: &Memory<<V::Reaching as Reaching>::Memory>) {
        self.sliding = shown_vector(&memory.sliding);
        self.estimate = memory.estimate;
        self.estimate.sliding = shown_vector(&memory.estimate.sliding);
        self.estimate.disturbance = shown_vector(&memory.estimate.disturbance);
    }
}

fn surface<V: Variant>(
    table: VariableTable<ControllerFmu<TvsmcLaw<V>>>,
) -> VariableTable<ControllerFmu<TvsmcLaw<V>>> {
    let c = ("surface.c", "Gain c of the sliding surface");
    let lambda = parameter(
        "surface.lambda",
        "Rate lambda at which the offset of the sliding surface decays",
    )
    .real()
    .min(0.0);
    table::gains(table, c, Some(&unit::gain_rate()), |law| &mut law.settings.surface.c)
        .real(lambda.unit(unit::gain_rate()), |m| &mut m.law.settings.surface.lambda)
}

fn anti_windup<V: Variant>(
    table: VariableTable<ControllerFmu<TvsmcLaw<V>>>,
) -> VariableTable<ControllerFmu<TvsmcLaw<V>>> {
    let on = parameter(
        "antiWindup",
        "Whether the sliding surface is placed again through the state while the actuators saturate; false in the paper",
    );
    table::achieved_moment(table)
        .boolean(on, |m| &mut m.law.settings.anti_windup)
        .real(table::anti_windup_threshold(), |m| &mut m.law.settings.threshold)
}

fn observer<V: Variant>(
    mut table: VariableTable<ControllerFmu<TvsmcLaw<V>>>,
) -> VariableTable<ControllerFmu<TvsmcLaw<V>>> {
    for i in 0..3 {
        let text = format!("Gain lambda{i} of the disturbance observer");
        let gain = parameter(&format!("observer.lambda{i}"), &text).real().min(0.0);
        table = table.real(gain, move |m| &mut m.law.observer.lambda[i]);
    }
    let l = (
        "observer.L",
        "Gain L of the disturbance observer, a bound on the second derivative of the disturbance in rad/s4,",
    );
    table::gains(table, l, None, |law| &mut law.observer.l)
}

fn outputs<V: Variant>(
    table: VariableTable<ControllerFmu<TvsmcLaw<V>>>,
) -> VariableTable<ControllerFmu<TvsmcLaw<V>>> {
    let sampled = |name: String, text: String| sampled_output(&name, &text);
    let sliding = |axis: &str, meaning: &str| {
        let text = format!("Sliding variable of the {meaning} at the last tick");
        sampled(format!("slidingVariable.{axis}"), text)
            .real()
            .unit(unit::angular_rate())
            .nominal(1e-3)
    };
    let sliding_estimate = |axis: &str, meaning: &str| {
        let text = format!("Observer's estimate z0 of the sliding variable of the {meaning}");
        sampled(format!("slidingEstimate.{axis}"), text)
            .real()
            .unit(unit::angular_rate())
            .nominal(1e-3)
    };
    let disturbance =
        |axis: &str, meaning: &str| table::disturbance_estimate(axis, meaning).nominal(0.01);
    let table = vector(table, ANGLES, sliding, |m| &mut m.law.sliding);
    if V::OBSERVER {
        let table = vector(table, ANGLES, sliding_estimate, |m| &mut m.law.estimate.sliding);
        vector(table, ANGLES, disturbance, |m| &mut m.law.estimate.disturbance)
    } else {
        table
    }
}

fn boundary_layer<V: Variant<Reaching = BoundaryLayer>>(
    table: VariableTable<ControllerFmu<TvsmcLaw<V>>>,
) -> VariableTable<ControllerFmu<TvsmcLaw<V>>> {
    let eta = ("reaching.eta", "Reaching gain eta");
    let h = ("boundaryLayer.h", "Thickness h of the boundary layer");
    let table = table::gains(table, eta, Some(&unit::angular_acceleration()), |law| {
        &mut law.settings.reaching.eta
    });
    table::gains(table, h, Some(&unit::angular_rate()), |law| &mut law.settings.reaching.h)
}

/// Variant BTVSMC of Wu 2015, (62).
#[derive(Clone, Copy, Debug)]
pub struct Btvsmc;

impl Variant for Btvsmc {
    type Reaching = BoundaryLayer;
    const NAME: &'static str = "BTVSMC";
    const DESCRIPTION: &'static str = "Time-varying sliding-mode attitude controller with a boundary layer, a comparison law of Wu et al. (2015)";
    const OBSERVER: bool = false;

    fn published() -> Settings<BoundaryLayer> {
        Settings::btvsmc()
    }

    fn reaching(
        table: VariableTable<ControllerFmu<TvsmcLaw<Self>>>,
    ) -> VariableTable<ControllerFmu<TvsmcLaw<Self>>> {
        boundary_layer(table)
    }
}

/// Variant BTVSMC/DO of Wu 2015, (36).
#[derive(Clone, Copy, Debug)]
pub struct BtvsmcDo;

impl Variant for BtvsmcDo {
    type Reaching = BoundaryLayer;
    const NAME: &'static str = "BTVSMC_DO";
    const DESCRIPTION: &'static str = "Time-varying sliding-mode attitude controller with a boundary layer and a disturbance observer, of Wu et al. (2015)";
    const OBSERVER: bool = true;

    fn published() -> Settings<BoundaryLayer> {
        Settings::btvsmc_do()
    }

    fn reaching(
        table: VariableTable<ControllerFmu<TvsmcLaw<Self>>>,
    ) -> VariableTable<ControllerFmu<TvsmcLaw<Self>>> {
        boundary_layer(table)
    }
}

/// Variant SOTVSMC/DO of Wu 2015, (45).
#[derive(Clone, Copy, Debug)]
pub struct SotvsmcDo;

impl Variant for SotvsmcDo {
    type Reaching = SecondOrder;
    const NAME: &'static str = "SOTVSMC_DO";
    const DESCRIPTION: &'static str = "Second-order time-varying sliding-mode attitude controller with a disturbance observer, of Wu et al. (2015)";
    const OBSERVER: bool = true;

    fn published() -> Settings<SecondOrder> {
        Settings::sotvsmc_do()
    }

    fn reaching(
        table: VariableTable<ControllerFmu<TvsmcLaw<Self>>>,
    ) -> VariableTable<ControllerFmu<TvsmcLaw<Self>>> {
        let text = |what| ("reaching.".to_owned() + what, "Reaching gain ".to_owned() + what);
        let [(n1, t1), (n2, t2), (n3, t3), (n4, t4)] = ["k1", "k2", "k3", "k4"].map(text);
        let table = table::gains(table, (&n1, &t1), None, |law| &mut law.settings.reaching.k1);
        let rate = unit::gain_rate();
        let table =
            table::gains(table, (&n2, &t2), Some(&rate), |law| &mut law.settings.reaching.k2);
        let table = table::gains(table, (&n3, &t3), None, |law| &mut law.settings.reaching.k3);
        let angle = unit::gain_angle();
        let table =
            table::gains(table, (&n4, &t4), Some(&angle), |law| &mut law.settings.reaching.k4);
        let m = parameter("reaching.m", "Exponent m of the reaching law; above 2").real().min(2.0);
        let form = parameter("reaching.form", FORMS.description);
        table
            .real(m, |m| &mut m.law.settings.reaching.m)
            .enumeration(form, &FORMS, |m| &mut m.law.settings.reaching.form)
    }
}
