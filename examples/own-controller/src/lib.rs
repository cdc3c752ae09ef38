//! A control law as an FMU: proportional and derivative action, with nonlinear terms cancelled.
use controller_export::prelude::{ReferenceAt as At, *};
use vehicle::kinematics::r;

/// The law with its settings and with the body of the vehicle.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Declared)]
pub struct Pd {
    #[setting(skip)]
    body: RigidBody,
    /// Gain on the tracking error of the angles.
    #[setting(name = "gain.p", unit = "1/s2", min = 0.0, start = 0.5)]
    p: f64,
    /// Gain on the derivative of the tracking error.
    #[setting(name = "gain.d", unit = "1/s", min = 0.0, start = 1.5)]
    d: f64,
}

impl Controller for Pd {
    type Memory = ();
    fn command(&mut self, (): &mut (), _: u64, t: f64, x: &Measurement, at: At) -> Vector3<f64> {
        let (rates, reference) = (r(&x.angles) * x.rates, at(t));
        let (error, error_rate) = (x.angles - reference.angles, rates - reference.rates);
        let a = reference.accelerations - error * self.p - error_rate * self.d;
        control::linearise::moment(&self.body, &x.angles, &rates, &a)
    }
}

/// The law as an FMU, without outputs of its own.
#[derive(Default, Serialize, Deserialize, Declared)]
pub struct PdFmu;

impl Law for PdFmu {
    type Controller = Pd;
    type Settings = Pd;
    const NAME: &'static str = "PD";
    const DESCRIPTION: &'static str = "Proportional and derivative attitude control";
    fn design(settings: Pd, vehicle: &Vehicle) -> Result<Pd, DesignError> {
        Ok(Pd { body: vehicle.body, ..settings })
    }
}

fmi_export::export_fmus!(ControllerFmu<PdFmu>);
