//! Settings of CRMPC by the names that its FMU has for them.

use control::crmpc::{Constraints, Settings};
use control::delay::Latency;
use settings::Declared;
use toml::Value;
use vehicle::dynamics::Inertia;

/// Settings that begin as the published ones.
#[derive(Clone, Debug, Declared)]
pub struct Given {
    /// Limit on ‖ω‖.
    #[setting(name = "limit.rate", unit = "rad/s")]
    limit_rate: f64,
    /// Limit on ‖m‖.
    #[setting(name = "limit.moment", unit = "N.m")]
    limit_moment: f64,
    /// Both parts of the time from a measurement to its moment.
    #[setting(name = "")]
    latency: Latency,
    /// Inertia of the vehicle.
    inertia: Inertia,
    /// All others.
    #[setting(name = "")]
    law: Settings,
}

impl Default for Given {
    fn default() -> Self {
        let law = Settings::new(Constraints::Robust);
        let tensor = &law.body.inertia;
        let at = |row: usize, column: usize| tensor[(row, column)];
        Self {
            limit_rate: law.limit_rate,
            limit_moment: law.limit_moment,
            latency: Latency::default(),
            inertia: Inertia {
                Ixx: at(0, 0),
                Iyy: at(1, 1),
                Izz: at(2, 2),
                Ixz: -at(0, 2),
                ..Inertia::default()
            },
            law,
        }
    }
}

impl Given {
    /// Sets one of them: a number is in SI units, a text such as `"20 deg"` says its unit.
    ///
    /// # Errors
    /// Says that there is no such setting, or that it cannot have this value.
    pub fn set(&mut self, name: &str, value: &Value) -> Result<(), String> {
        settings::change(self, name, value).map_err(|error| error.to_string())
    }

    /// Returns the settings with the gain that the controller uses.
    ///
    /// # Errors
    /// Names the setting at fault.
    pub fn settings(self) -> Result<Settings, String> {
        let Self { limit_rate, limit_moment, latency, inertia, law } = self;
        let body = inertia.body(1.0).map_err(|error| error.to_string())?;
        let settings = Settings { body, limit_rate, limit_moment, delay: latency.total(), ..law };
        settings.resolved().map_err(|error| error.to_string())
    }
}
