//! Parameters and outputs of `TwoLoopSMC`.

use control::error::DesignError;
use control::two_loop::{Form, Loop, OuterKinematics, TwoLoopMemory, TwoLoopSettings, TwoLoopSmc};
use controller_export::table::{self, ANGLES, RATES, sampled_output, shown_vector, vector};
use controller_export::{ControllerFmu, Law, Vehicle};
use fmi2_export::fields::Fields;
use fmi2_export::table::parameter;
use fmi2_export::{Enumeration, VariableTable};
use model_description::unit;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

static FORMS: Enumeration<Form> = Enumeration {
    name: "ReachingForm",
    description: "Signs of the reaching terms",
    items: &[
        (Form::Corrected, "corrected", "signs with which both loops reach their sliding surfaces"),
        (
            Form::PrintedSign,
            "printedSign",
            "opposite sign of I rho SIGN(s_n) in the inner loop, as printed in (10)",
        ),
        (
            Form::PrintedFactor,
            "printedFactor",
            "factor f of (7) and (11) with its minus sign, as printed",
        ),
    ],
};
static KINEMATICS: Enumeration<OuterKinematics> = Enumeration {
    name: "OuterKinematics",
    description: "Matrix R that the outer loop uses",
    items: &[
        (OuterKinematics::Corrected, "corrected", "matrix with consistent order and axes"),
        (OuterKinematics::Printed, "printed", "matrix (3) as printed"),
    ],
};

/// Parameters and outputs of the two-loop sliding mode.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct TwoLoopLaw {
    pub(crate) settings: TwoLoopSettings,
    outer_sliding: Vector3<f64>,
    inner_sliding: Vector3<f64>,
    rate_command: Vector3<f64>,
    outer_integral: Vector3<f64>,
    inner_integral: Vector3<f64>,
}

impl Default for TwoLoopLaw {
    fn default() -> Self {
        let zero = Vector3::zeros();
        Self {
            settings: TwoLoopSettings::ours(),
            outer_sliding: zero,
            inner_sliding: zero,
            rate_command: zero,
            outer_integral: zero,
            inner_integral: zero,
        }
    }
}

impl Law for TwoLoopLaw {
    type Controller = TwoLoopSmc;
    type Settings = TwoLoopSettings;

    const NAME: &'static str = "TwoLoopSMC";
    const DESCRIPTION: &'static str =
        "Two-loop sliding-mode attitude controller of Jia, Zhou and Zhou";
    const DOCUMENTATION: &'static str = include_str!("two_loop.html");
    const FIELDS: &'static Fields = &[
        ("filter", "commandFilter.frequency"),
        ("disturbance", "disturbanceMoment.bound"),
        ("outer.layer", "outer"),
        ("inner.layer", "inner"),
    ];

    fn period() -> f64 {
        TwoLoopSettings::ours().period
    }

    fn declare(table: VariableTable<ControllerFmu<Self>>) -> VariableTable<ControllerFmu<Self>> {
        let table = table::period(table, "control law");
        let outer = ["outer", "outer loop", ""];
        let table = reaching(table, outer, ANGLES, &unit::angular_rate(), &unit::angle(), |law| {
            &mut law.settings.outer
        });
        let inner = ["inner", "inner loop", " rate"];
        let (rho, epsilon) = (unit::angular_acceleration(), unit::angular_rate());
        let table = reaching(table, inner, RATES, &rho, &epsilon, |law| &mut law.settings.inner);
        outputs(printed(actuators(table)))
    }

    fn settings(&self, vehicle: &Vehicle) -> Self::Settings {
        let Vehicle { body, period, .. } = *vehicle;
        TwoLoopSettings { body, period, ..self.settings }
    }

    fn design(settings: Self::Settings) -> Result<Self::Controller, DesignError> {
        TwoLoopSmc::new(settings)
    }

    fn show(&mut self, memory: &TwoLoopMemory) {
        self.outer_sliding = shown_vector(&memory.outer_sliding);
        self.inner_sliding = shown_vector(&memory.inner_sliding);
        self.rate_command = shown_vector(&memory.rate_command);
        let term = |settings: &Loop, integral: &Vector3<f64>| {
            shown_vector(&Vector3::from(settings.k).component_mul(integral))
        };
        self.outer_integral = term(&self.settings.outer, &memory.outer_integral);
        self.inner_integral = term(&self.settings.inner, &memory.inner_integral);
    }
}

type Controller = VariableTable<ControllerFmu<TwoLoopLaw>>;
type Field = fn(&mut Loop) -> &mut [f64; 3];

/// Adds the parameters of one loop, per axis. `suffix` completes the name of an axis.
fn reaching(
    mut table: Controller,
    [name, loop_name, suffix]: [&str; 3],
    axes: [(&str, &str); 3],
    rho: &unit::Unit,
    epsilon: &unit::Unit,
    settings: fn(&mut TwoLoopLaw) -> &mut Loop,
) -> Controller {
    let gain = unit::gain_rate();
    let parameters: [(&str, &str, Option<&unit::Unit>, Field); 4] = [
        ("k", "Gain K on the integral of the error", Some(&gain), |l| &mut l.k),
        ("rho", "Reaching gain rho", Some(rho), |l| &mut l.layer.rho),
        ("epsilon", "Thickness epsilon of the boundary layer", Some(epsilon), |l| {
            &mut l.layer.epsilon
        }),
        ("b", "Exponent b (below 1) of the finite-time factor", None, |l| &mut l.layer.b),
    ];
    for (symbol, text, unit, field) in parameters {
        for (i, (_, meaning)) in axes.into_iter().enumerate() {
            let text = format!("{text} in the {loop_name} for the {meaning}{suffix}");
            let real = parameter(&format!("{name}.{symbol}[{}]", i + 1), &text).real().min(0.0);
            let real = match unit {
                Some(unit) => real.unit(unit.clone()),
                None => real.max(1.0),
            };
            table = table.real(real, move |m| &mut field(settings(&mut m.law))[i]);
        }
    }
    table
}

fn actuators(mut table: Controller) -> Controller {
    for (i, axis) in ["x", "y", "z"].into_iter().enumerate() {
        let text = format!(
            "Bound on the disturbance moment about the {axis} axis that the inner loop must overcome"
        );
        let bound = parameter(&format!("disturbanceMoment.bound[{}]", i + 1), &text).real();
        table = table.real(bound.unit(unit::moment()).min(0.0).nominal(1e5), move |m| {
            &mut m.law.settings.disturbance[i]
        });
    }
    let filter = parameter(
        "commandFilter.frequency",
        "Natural frequency of the critically damped filter on the reference; 0 for no filter",
    );
    let on = parameter("antiWindup", "Whether the integrals are held while the actuators saturate");
    table::achieved_moment(table)
        .real(filter.real().unit(unit::gain_rate()).min(0.0), |m| &mut m.law.settings.filter)
        .boolean(on, |m| &mut m.law.settings.anti_windup)
        .real(table::anti_windup_threshold(), |m| &mut m.law.settings.threshold)
}

fn printed(table: Controller) -> Controller {
    let form = parameter("form", FORMS.description);
    let kinematics = parameter("kinematics", KINEMATICS.description);
    table.enumeration(form, &FORMS, |m| &mut m.law.settings.form).enumeration(
        kinematics,
        &KINEMATICS,
        |m| &mut m.law.settings.kinematics,
    )
}

fn outputs(table: Controller) -> Controller {
    let sampled = |name: String, text: String| sampled_output(&name, &text);
    let outer = |axis: &str, meaning: &str| {
        let text = format!("Sliding variable of the {meaning} at the last tick");
        sampled(format!("slidingVariable.{axis}"), text).real().unit(unit::angle()).nominal(1e-2)
    };
    let inner = |axis: &str, meaning: &str| {
        let text = format!("Sliding variable of the {meaning} rate at the last tick");
        sampled(format!("innerSlidingVariable.{axis}"), text)
            .real()
            .unit(unit::angular_rate())
            .nominal(1e-2)
    };
    let command = |axis: &str, meaning: &str| {
        let text = format!("Body {meaning} rate commanded by the outer loop");
        sampled(format!("rateCommand.{axis}"), text).real().unit(unit::angular_rate()).nominal(0.05)
    };
    let outer_integral = |axis: &str, meaning: &str| {
        let text = format!("Integral term of the sliding variable of the {meaning}");
        sampled(format!("integral.{axis}"), text).real().unit(unit::angle()).nominal(1e-2)
    };
    let inner_integral = |axis: &str, meaning: &str| {
        let text = format!("Integral term of the sliding variable of the {meaning} rate");
        sampled(format!("innerIntegral.{axis}"), text)
            .real()
            .unit(unit::angular_rate())
            .nominal(1e-2)
    };
    let table = vector(table, ANGLES, outer, |m| &mut m.law.outer_sliding);
    let table = vector(table, RATES, inner, |m| &mut m.law.inner_sliding);
    let table = vector(table, RATES, command, |m| &mut m.law.rate_command);
    let table = vector(table, ANGLES, outer_integral, |m| &mut m.law.outer_integral);
    vector(table, RATES, inner_integral, |m| &mut m.law.inner_integral)
}
