//! `TwoLoopSMC` as an FMU.

use control::error::DesignError;
use control::two_loop::{Loop, TwoLoopMemory, TwoLoopSettings, TwoLoopSmc};
use controller_export::table::shown_vector;
use controller_export::{Law, Vehicle};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use settings::Declared;
use vehicle::axes::{ANGLES, RATES};

/// Outputs of the two-loop sliding mode.
#[derive(Clone, Debug, Default, Serialize, Deserialize, Declared)]
pub struct TwoLoopLaw {
    /// Sliding variable of the {} at the last tick.
    #[setting(name = "slidingVariable", each = ANGLES, unit = "rad", nominal = 1e-2)]
    outer_sliding: Vector3<f64>,
    /// Sliding variable of the {} at the last tick.
    #[setting(name = "innerSlidingVariable", each = RATES, unit = "rad/s", nominal = 1e-2)]
    inner_sliding: Vector3<f64>,
    /// Body {} commanded by the outer loop.
    #[setting(each = RATES, unit = "rad/s", nominal = 0.05)]
    rate_command: Vector3<f64>,
    /// Integral term of the sliding variable of the {}.
    #[setting(name = "integral", each = ANGLES, unit = "rad", nominal = 1e-2)]
    outer_integral: Vector3<f64>,
    /// Integral term of the sliding variable of the {}.
    #[setting(each = RATES, unit = "rad/s", nominal = 1e-2)]
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
