//! Pulse-width pulse-frequency modulation of the jets (Wu 2015, Figure 2): a low-pass filter and a
//! Schmitt trigger in a loop.

use crate::error::{DesignError, invalid};
use serde::{Deserialize, Serialize};
use settings::Declared;
use vehicle::math::exp;

/// Constants of the modulator.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Declared)]
pub struct Pwpf {
    /// Gain K_m of the modulator's filter.
    #[setting(name = "pwpf.gain", used_with = "jets = pwpf", above = 0.0)]
    pub gain: f64,
    /// Time constant T_m of the modulator's filter.
    #[setting(
        name = "pwpf.timeConstant",
        used_with = "jets = pwpf",
        unit = "s",
        min = 1e-5,
        max = 10.0,
        nominal = 0.1
    )]
    pub time_constant: f64,
    /// Filter output u_on at which a jet switches on.
    #[setting(name = "pwpf.on", used_with = "jets = pwpf", above = 0.0)]
    pub on: f64,
    /// Filter output u_off at which a jet switches off.
    #[setting(name = "pwpf.off", used_with = "jets = pwpf", above = 0.0)]
    pub off: f64,
    /// Sampling period of the modulator.
    #[setting(
        name = "pwpf.period",
        used_with = "jets = pwpf",
        unit = "s",
        min = 1e-5,
        max = 10.0,
        nominal = 1e-3
    )]
    pub period: f64,
}

/// State of one modulator.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Modulator {
    /// Output of the filter.
    pub filtered: f64,
    /// Whether the jet is firing.
    pub on: bool,
}

impl Pwpf {
    /// Checks that the constants make a working modulator.
    ///
    /// # Errors
    /// Returns an error that names the constant at fault.
    pub fn check(&self) -> Result<(), DesignError> {
        settings::check(self)?;
        // A jet with full command must switch on, and a jet without command must switch off.
        for (name, value, high) in
            [("pwpf.on", self.on, self.gain), ("pwpf.off", self.off, self.on)]
        {
            if value >= high {
                return Err(invalid(name, value, format!("must be below {high}")));
            }
        }
        Ok(())
    }

    /// Returns the state one period later, with the duty cycle `duty` in 0..=1 since the last
    /// evaluation.
    pub fn advance(&self, state: Modulator, duty: f64) -> Modulator {
        // The filter obeys T_m df/dt = K_m (duty − on) − f; the step is exact for constant inputs.
        let end = self.gain * (duty - f64::from(u8::from(state.on)));
        let filtered = end + (state.filtered - end) * exp(-self.period / self.time_constant);
        let on = if state.on { filtered > self.off } else { filtered >= self.on };
        Modulator { filtered, on }
    }
}
