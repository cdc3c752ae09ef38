//! `FBL` as an FMU.

use control::error::DesignError;
use control::sliding::{Fbl, FblSettings};
use controller_export::{Law, Vehicle};
use serde::{Deserialize, Serialize};
use settings::Declared;

/// The feedback linearisation, which has no outputs of its own.
#[derive(Clone, Debug, Default, Serialize, Deserialize, Declared)]
pub struct FblLaw;

impl Law for FblLaw {
    type Controller = Fbl;
    type Settings = FblSettings;

    const NAME: &'static str = "FBL";
    const DESCRIPTION: &'static str =
        "Feedback linearisation of the attitude, a comparison law of Wu et al. (2015)";
    const DOCUMENTATION: &'static str = include_str!("fbl.html");

    fn settings() -> FblSettings {
        FblSettings::published()
    }

    fn period(settings: &FblSettings) -> f64 {
        settings.period
    }

    fn design(settings: FblSettings, vehicle: &Vehicle) -> Result<Fbl, DesignError> {
        Fbl::new(FblSettings { body: vehicle.body, ..settings })
    }
}
