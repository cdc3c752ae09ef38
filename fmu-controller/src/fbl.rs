//! Parameters of `FBL`.

use control::error::DesignError;
use control::sliding::{Fbl, FblSettings};
use controller_export::{ControllerFmu, Law, Vehicle, table};
use fmi2_export::VariableTable;
use fmi2_export::fields::Fields;
use fmi2_export::table::parameter;
use model_description::unit;
use serde::{Deserialize, Serialize};

/// Parameters of the feedback linearisation.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct FblLaw {
    pub(crate) settings: FblSettings,
}

impl Default for FblLaw {
    fn default() -> Self {
        Self { settings: FblSettings::published() }
    }
}

impl Law for FblLaw {
    type Controller = Fbl;
    type Settings = FblSettings;

    const NAME: &'static str = "FBL";
    const DESCRIPTION: &'static str =
        "Feedback linearisation of the attitude, a comparison law of Wu et al. (2015)";
    const DOCUMENTATION: &'static str = include_str!("fbl.html");
    const FIELDS: &'static Fields = &[("kp", "gain.p"), ("kd", "gain.d")];

    fn period() -> f64 {
        FblSettings::published().period
    }

    fn declare(table: VariableTable<ControllerFmu<Self>>) -> VariableTable<ControllerFmu<Self>> {
        let p = parameter("gain.p", "Gain on the tracking error of the angles").real().min(0.0);
        let d = parameter("gain.d", "Gain on the derivative of the tracking error of the angles")
            .real()
            .min(0.0);
        table::period(table, "control law")
            .real(p.unit(unit::gain_angle()), |m| &mut m.law.settings.kp)
            .real(d.unit(unit::gain_rate()), |m| &mut m.law.settings.kd)
    }

    fn settings(&self, vehicle: &Vehicle) -> Self::Settings {
        FblSettings { body: vehicle.body, period: vehicle.period, ..self.settings }
    }

    fn design(settings: Self::Settings) -> Result<Self::Controller, DesignError> {
        Fbl::new(settings)
    }
}
