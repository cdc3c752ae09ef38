//! Feedback linearisation (FBL) of Wu 2015, (61): the comparison without sliding mode.

use crate::controller::{Controller, Measurement, ReferenceAt};
use crate::error::DesignError;
use crate::error_dynamics::{Gain, SampledError};
use crate::linearise;
use crate::sliding::tracking_error;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use settings::Declared;
use vehicle::dynamics::RigidBody;

/// Settings of the controller. Units SI, angles rad.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Declared)]
pub struct FblSettings {
    /// Model of the vehicle that the controller uses.
    #[setting(skip)]
    pub body: RigidBody,
    /// Sampling period of the control law.
    #[setting(name = "period.feedback", unit = "s", min = 1e-4, max = 10.0, nominal = 0.01)]
    pub period: f64,
    /// Gain k_p on the tracking error of the angles.
    #[setting(name = "gain.p", unit = "1/s2", above = 0.0)]
    pub kp: f64,
    /// Gain k_d on the derivative of the tracking error of the angles.
    #[setting(name = "gain.d", unit = "1/s", above = 0.0)]
    pub kd: f64,
}

/// The law M = K⁻¹ (v − B) with v = Θ̈_r − k_p e − k_d ė, (15) and (61).
///
/// ```
/// use control::closed_loop::fly;
/// use control::sliding::{Fbl, FblSettings};
/// use vehicle::Scenario;
///
/// let settings = FblSettings::published();
/// let mut law = Fbl::new(settings)?;
/// let summary = fly(&mut law, &mut (), settings.period, &Scenario::tvsmc2015(), |_| ())?;
/// assert!(summary.error_rms.to_degrees() < 5.0);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Fbl {
    settings: FblSettings,
}

impl Fbl {
    /// Checks the settings of the law.
    ///
    /// # Errors
    /// Returns an error that names the setting at fault, or the gains that the sampling makes
    /// unstable.
    pub fn new(settings: FblSettings) -> Result<Self, DesignError> {
        settings::check(&settings)?;
        let FblSettings { period, kp, kd, .. } = settings;
        let (k1, k2) = (-kp, -kd);
        let radius = SampledError::new(Gain { k1, k2 }, period).spectral_radius();
        if radius >= 1.0 {
            return Err(DesignError::Unstable { k1, k2, period, radius });
        }
        Ok(Self { settings })
    }
}

impl Controller for Fbl {
    type Memory = ();

    fn command(
        &mut self,
        _memory: &mut (),
        _tick: u64,
        time: f64,
        measured: &Measurement,
        reference: ReferenceAt,
    ) -> Vector3<f64> {
        let FblSettings { body, kp, kd, .. } = &self.settings;
        let reference = reference(time);
        let (error, angle_rates) = tracking_error(measured, &reference);
        let v = reference.accelerations - error.angles * *kp - error.rates * *kd;
        linearise::moment(body, &measured.angles, &angle_rates, &v)
    }
}
