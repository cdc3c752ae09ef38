//! Parameters of `LQR`.

use control::crmpc::{Constraints, Settings};
use control::error::DesignError;
use control::lqr::{Lqr, LqrSettings};
use controller_export::{ControllerFmu, Law, Vehicle, table};
use fmi2_export::VariableTable;
use serde::{Deserialize, Serialize};

/// Parameters of the regulator.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct LqrLaw {
    /// Settings of the regulator; the body in them is replaced by that of the vehicle.
    pub(crate) settings: LqrSettings,
}

impl Default for LqrLaw {
    fn default() -> Self {
        let Settings { body, p, q, period_feedback: period, .. } =
            Settings::new(Constraints::Robust);
        Self { settings: LqrSettings { body, p, q, period } }
    }
}

impl Law for LqrLaw {
    type Controller = Lqr;
    type Settings = LqrSettings;

    const NAME: &'static str = "LQR";
    const DESCRIPTION: &'static str = "Linear-quadratic attitude regulator, the unconstrained comparison law of Chai et al. (2022)";
    const DOCUMENTATION: &'static str = include_str!("lqr.html");

    fn period() -> f64 {
        Settings::new(Constraints::Robust).period_feedback
    }

    fn declare(table: VariableTable<ControllerFmu<Self>>) -> VariableTable<ControllerFmu<Self>> {
        let table = table::period(table, "control law");
        table::weights(table, |law| &mut law.settings.p, |law| &mut law.settings.q)
    }

    fn settings(&self, vehicle: &Vehicle) -> Self::Settings {
        LqrSettings { body: vehicle.body, period: vehicle.period, ..self.settings }
    }

    fn design(settings: Self::Settings) -> Result<Self::Controller, DesignError> {
        Lqr::new(settings)
    }
}
