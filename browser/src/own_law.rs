//! A control law that the page computes, behind the same variable table as the others.

use control::Controller;
use control::controller::{Measurement, ReferenceAt};
use control::error::DesignError;
use control::linearise::InverseKinematics;
use controller_export::{Law, Vehicle};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use settings::Declared;
use vehicle::dynamics::RigidBody;
use vehicle::kinematics::r;
use vehicle::reference::Reference;

/// Number of values that the page receives.
const GIVEN: usize = 34;

/// What the law is built from.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, Declared)]
pub struct Settings {
    /// Sampling period of the control law.
    #[setting(name = "period.feedback", unit = "s", min = 1e-4, max = 10.0, start = 0.04)]
    pub period: f64,
}

/// The law of the page.
#[derive(Clone, Copy, Debug)]
pub struct Asked {
    body: RigidBody,
    limits: [f64; 2],
    period: f64,
}

impl Controller for Asked {
    type Memory = ();

    /// Hands the page time, angles, rates ω and Θ̇, the reference with its two derivatives, the
    /// limits of ‖ω‖ and ‖m‖, the period, and the moment as a function of the acceleration Θ̈: that
    /// for none, and the columns of its derivative. SI units.
    fn command(
        &mut self,
        (): &mut (),
        _: u64,
        time: f64,
        measured: &Measurement,
        reference: ReferenceAt,
    ) -> Vector3<f64> {
        let Measurement { angles, rates, .. } = measured;
        let angle_rates = r(angles) * rates;
        let motion = InverseKinematics::at(angles).motion(&self.body, &angle_rates);
        let Reference { angles: wanted, rates: wanted_rates, accelerations } = reference(time);
        let vectors = [angles, rates, &angle_rates, &wanted, &wanted_rates, &accelerations];
        let given = [time]
            .into_iter()
            .chain(vectors.into_iter().flat_map(|vector| vector.iter().copied()))
            .chain(self.limits)
            .chain([self.period])
            .chain(motion.moment_at_rest.iter().copied())
            .chain(motion.moment_by_acceleration.iter().copied());
        let mut numbers = [0.0; GIVEN];
        numbers.iter_mut().zip(given).for_each(|(number, value)| *number = value);
        page::ask(&numbers)
    }
}

/// The law as an FMU.
#[derive(Clone, Debug, Default, Serialize, Deserialize, Declared)]
pub struct OwnLaw;

impl Law for OwnLaw {
    type Controller = Asked;
    type Settings = Settings;

    const NAME: &'static str = "OwnLaw";
    const DESCRIPTION: &'static str = "Control law that is written on this page";

    fn period(settings: &Settings) -> f64 {
        settings.period
    }

    fn design(settings: Settings, vehicle: &Vehicle) -> Result<Asked, DesignError> {
        let limits = [vehicle.limit_rate, vehicle.limit_moment];
        Ok(Asked { body: vehicle.body, limits, period: settings.period })
    }
}

#[cfg(target_arch = "wasm32")]
#[allow(unsafe_code, reason = "the page's function is imported")]
mod page {
    use nalgebra::Vector3;

    #[link(wasm_import_module = "page")]
    unsafe extern "C" {
        safe fn law(given: *const f64, moment: *mut f64);
    }

    /// Asks the page for its moment, N m.
    pub(super) fn ask(given: &[f64]) -> Vector3<f64> {
        let mut moment = Vector3::zeros();
        law(given.as_ptr(), moment.as_mut_ptr());
        moment
    }
}

/// Outside of a page there is none to ask.
#[cfg(not(target_arch = "wasm32"))]
mod page {
    use nalgebra::Vector3;

    pub(super) fn ask(given: &[f64]) -> Vector3<f64> {
        Vector3::repeat(f64::NAN * given[0])
    }
}
