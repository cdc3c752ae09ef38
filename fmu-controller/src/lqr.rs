//! `LQR`: its own parameters.

use crate::law::{Law, Vehicle};
use crate::table;
use crate::unit::Unit;
use control::crmpc::{Constraints, Settings};
use control::error::DesignError;
use control::lqr::{Lqr, LqrSettings};
use fmi2_export::Table;
use serde::{Deserialize, Serialize};

/// Parameters of the regulator.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct LqrLaw {
    p: [f64; 6],
    q: [f64; 3],
    period: f64,
}

impl Default for LqrLaw {
    fn default() -> Self {
        let Settings { p, q, period_feedback, .. } = Settings::new(Constraints::Robust);
        Self { p, q, period: period_feedback }
    }
}

impl Law for LqrLaw {
    type Controller = Lqr;
    type Settings = LqrSettings;

    const NAME: &'static str = "LQR";
    const DESCRIPTION: &'static str =
        "Linear-quadratic attitude regulator, the unconstrained comparison of Chai et al. (2022)";
    const DOCUMENTATION: &'static str = concat!(include_str!("lqr.html"), include_str!("wiring.html"));

    fn declare(table: Table<Unit<Self>>) -> Table<Unit<Self>> {
        let table = table::period(table, 0.04, |law| &mut law.period);
        table::weights(table, |law| &mut law.p, |law| &mut law.q)
    }

    #[allow(private_interfaces)]
    fn settings(&self, vehicle: &Vehicle) -> Self::Settings {
        LqrSettings { body: vehicle.body, p: self.p, q: self.q, period: self.period }
    }

    fn design(settings: Self::Settings) -> Result<Self::Controller, DesignError> {
        Lqr::new(settings)
    }

    fn show(&mut self, (): &()) {}
}
