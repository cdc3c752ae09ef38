//! `TwoLoopSMC` as an FMU.

use control::error::DesignError;
use control::two_loop::{Loop, TwoLoopMemory, TwoLoopSettings, TwoLoopSmc};
use controller_export::table::{ANGLES, RATES, sampled_output, shown_vector, vector};
use controller_export::{ControllerFmu, Law, Vehicle};
use fmi_export::VariableTable;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

/// Outputs of the two-loop sliding mode.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct TwoLoopLaw {
    outer_sliding: Vector3<f64>,
    inner_sliding: Vector3<f64>,
    rate_command: Vector3<f64>,
    outer_integral: Vector3<f64>,
    inner_integral: Vector3<f64>,
}

impl Law for TwoLoopLaw {
    type Controller = TwoLoopSmc;
    type Settings = TwoLoopSettings;

    const NAME: &'static str = "TwoLoopSMC";
    const DESCRIPTION: &'static str =
        "Two-loop sliding-mode attitude controller of Jia, Zhou and Zhou";
    const DOCUMENTATION: &'static str = include_str!("two_loop.html");

    fn settings() -> TwoLoopSettings {
        TwoLoopSettings { achieved_moment_used: false, ..TwoLoopSettings::ours() }
    }

    fn period(settings: &TwoLoopSettings) -> f64 {
        settings.period
    }

    fn uses_achieved_moment(settings: &TwoLoopSettings) -> bool {
        settings.achieved_moment_used
    }

    fn design(settings: TwoLoopSettings, vehicle: &Vehicle) -> Result<TwoLoopSmc, DesignError> {
        TwoLoopSmc::new(TwoLoopSettings { body: vehicle.body, ..settings })
    }

    fn outputs(table: Controller) -> Controller {
        outputs(table)
    }

    fn show(&mut self, settings: &TwoLoopSettings, memory: &TwoLoopMemory) {
        self.outer_sliding = shown_vector(&memory.outer_sliding);
        self.inner_sliding = shown_vector(&memory.inner_sliding);
        self.rate_command = shown_vector(&memory.rate_command);
        let term = |part: &Loop, integral: &Vector3<f64>| {
            shown_vector(&Vector3::from(part.k).component_mul(integral))
        };
        self.outer_integral = term(&settings.outer, &memory.outer_integral);
        self.inner_integral = term(&settings.inner, &memory.inner_integral);
    }
}

type Controller = VariableTable<ControllerFmu<TwoLoopLaw>>;
fn outputs(table: Controller) -> Controller {
    let sampled = |name: String, text: String| sampled_output(&name, &text);
    let outer = |axis: &str, meaning: &str| {
        let text = format!("Sliding variable of the {meaning} at the last tick");
        sampled(format!("slidingVariable.{axis}"), text).real().unit("rad").nominal(1e-2)
    };
    let inner = |axis: &str, meaning: &str| {
        let text = format!("Sliding variable of the {meaning} rate at the last tick");
        sampled(format!("innerSlidingVariable.{axis}"), text).real().unit("rad/s").nominal(1e-2)
    };
    let command = |axis: &str, meaning: &str| {
        let text = format!("Body {meaning} rate commanded by the outer loop");
        sampled(format!("rateCommand.{axis}"), text).real().unit("rad/s").nominal(0.05)
    };
    let outer_integral = |axis: &str, meaning: &str| {
        let text = format!("Integral term of the sliding variable of the {meaning}");
        sampled(format!("integral.{axis}"), text).real().unit("rad").nominal(1e-2)
    };
    let inner_integral = |axis: &str, meaning: &str| {
        let text = format!("Integral term of the sliding variable of the {meaning} rate");
        sampled(format!("innerIntegral.{axis}"), text).real().unit("rad/s").nominal(1e-2)
    };
    let table = vector(table, ANGLES, outer, |m| &mut m.law.outer_sliding);
    let table = vector(table, RATES, inner, |m| &mut m.law.inner_sliding);
    let table = vector(table, RATES, command, |m| &mut m.law.rate_command);
    let table = vector(table, ANGLES, outer_integral, |m| &mut m.law.outer_integral);
    vector(table, RATES, inner_integral, |m| &mut m.law.inner_integral)
}
