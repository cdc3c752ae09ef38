//! A control law as an FMU: proportional and derivative action, with nonlinear terms cancelled.

use control::crmpc::{Constraints, Settings};
use control::{Controller, DesignError, Measurement, controller::ReferenceAt as At};
use controller_export::{ControllerFmu, Law, Vehicle};
use fmi2_export::{VariableTable, table::parameter};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use vehicle::{dynamics::RigidBody, kinematics::r};

/// The law and its parameters; `body` is that of the vehicle.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Pd {
    body: RigidBody,
    gains: (f64, f64), // on the angles, 1/s², and on their rates, 1/s
}

impl Default for Pd {
    fn default() -> Self {
        Self { body: Settings::new(Constraints::Robust).body, gains: (0.5, 1.5) }
    }
}

impl Controller for Pd {
    type Memory = ();

    fn command(&mut self, (): &mut (), _: u64, t: f64, x: &Measurement, at: At) -> Vector3<f64> {
        let (rates, reference) = (r(&x.angles) * x.rates, at(t));
        let (error, error_rate) = (x.angles - reference.angles, rates - reference.rates);
        let a = reference.accelerations - error * self.gains.0 - error_rate * self.gains.1;
        control::linearise::moment(&self.body, &x.angles, &rates, &a)
    }
}

impl Law for Pd {
    type Controller = Self;
    type Settings = Self;
    const NAME: &'static str = "PD";
    const DESCRIPTION: &'static str = "Proportional and derivative attitude control";

    fn period() -> f64 {
        0.04 // s
    }

    fn declare(table: VariableTable<ControllerFmu<Self>>) -> VariableTable<ControllerFmu<Self>> {
        let p = parameter("gain.p", "Gain on the tracking error of the angles").real();
        let d = parameter("gain.d", "Gain on the derivative of the tracking error").real();
        table.real(p.min(0.0), |m| &mut m.law.gains.0).real(d.min(0.0), |m| &mut m.law.gains.1)
    }

    fn settings(&self, vehicle: &Vehicle) -> Self {
        Self { body: vehicle.body, ..*self }
    }

    fn design(settings: Self) -> Result<Self, DesignError> {
        Ok(settings)
    }
}

fmi2_export::export_fmus!(ControllerFmu<Pd>);
