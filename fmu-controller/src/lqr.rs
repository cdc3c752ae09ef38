//! `LQR` as an FMU.

use control::crmpc::{self, Constraints};
use control::error::DesignError;
use control::lqr::{Lqr, LqrSettings};
use controller_export::{Law, Vehicle};
use serde::{Deserialize, Serialize};
use settings::Declared;

/// The regulator, which has no outputs of its own.
#[derive(Clone, Debug, Default, Serialize, Deserialize, Declared)]
pub struct LqrLaw;

impl Law for LqrLaw {
    type Controller = Lqr;
    type Settings = LqrSettings;

    const NAME: &'static str = "LQR";
    const DESCRIPTION: &'static str = "Linear-quadratic attitude regulator, the unconstrained comparison law of Chai et al. (2022)";
    const DOCUMENTATION: &'static str = include_str!("lqr.html");

    fn settings() -> LqrSettings {
        let crmpc::Settings { body, p, q, period_feedback: period, .. } =
            crmpc::Settings::new(Constraints::Robust);
        LqrSettings { body, period, p, q }
    }

    fn period(settings: &LqrSettings) -> f64 {
        settings.period
    }

    fn design(settings: LqrSettings, vehicle: &Vehicle) -> Result<Lqr, DesignError> {
        Lqr::new(LqrSettings { body: vehicle.body, ..settings })
    }
}
