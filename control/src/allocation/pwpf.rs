//! Pulse-width pulse-frequency modulation of the jets (Wu 2015, Figure 2): a low-pass filter and a
//! Schmitt trigger in a loop.

use crate::error::{DesignError, invalid, positive};
use serde::{Deserialize, Serialize};
use vehicle::math::exp;

/// Constants of the modulator.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Pwpf {
    /// Gain K_m of the filter.
    pub gain: f64,
    /// Time constant T_m of the filter, s.
    pub time_constant: f64,
    /// Level u_on at which the trigger switches on.
    pub on: f64,
    /// Level u_off at which the trigger switches off.
    pub off: f64,
    /// Time between two evaluations of the trigger, s.
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
        positive("pwpf.gain", self.gain)?;
        positive("pwpf.timeConstant", self.time_constant)?;
        positive("pwpf.period", self.period)?;
        // A jet with full command must switch on, and a jet without command must switch off.
        for (name, value, low, high) in
            [("pwpf.on", self.on, 0.0, self.gain), ("pwpf.off", self.off, 0.0, self.on)]
        {
            if !(value > low && value < high) {
                return Err(invalid(name, value, format!("must be above {low} and below {high}")));
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
