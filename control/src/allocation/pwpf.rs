//! Pulse-width pulse-frequency modulation of the jets (Wu 2015, Figure 2): a low-pass filter and a Schmitt trigger in a loop.

use crate::error::DesignError;
use serde::{Deserialize, Serialize};

/// Constants of the modulator.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Pwpf {
    /// K_m, gain of the filter.
    pub gain: f64,
    /// T_m, time constant of the filter, s.
    pub time_constant: f64,
    /// u_on, at which the trigger switches on.
    pub on: f64,
    /// u_off, at which it switches off.
    pub off: f64,
    /// Time between two looks of the trigger, s.
    pub period: f64,
}

/// Where a modulator stands.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Modulator {
    /// Output of the filter.
    pub filtered: f64,
    /// Whether the jet fires.
    pub on: bool,
}

impl Pwpf {
    /// Refuses what cannot work.
    ///
    /// # Errors
    /// Names the constant at fault.
    pub fn check(&self) -> Result<(), DesignError> {
        let positive = [
            ("pwpf.gain", self.gain),
            ("pwpf.timeConstant", self.time_constant),
            ("pwpf.period", self.period),
        ];
        for (name, value) in positive {
            if !(value > 0.0 && value.is_finite()) {
                return Err(DesignError::NotPositive { name, value });
            }
        }
        // A jet that is fully commanded has to switch on, and one that is not has to switch off.
        for (name, value, low, high) in
            [("pwpf.on", self.on, 0.0, self.gain), ("pwpf.off", self.off, 0.0, self.on)]
        {
            if !(value > low && value < high) {
                return Err(DesignError::OutOfRange { name, value, low, high });
            }
        }
        Ok(())
    }

    /// One period on, with the duty cycle `duty` in 0..=1 since the last look.
    pub fn advance(&self, state: Modulator, duty: f64) -> Modulator {
        // T_m df/dt = K_m (duty − on) − f, exact for constant inputs
        let end = self.gain * (duty - f64::from(u8::from(state.on)));
        let filtered = end + (state.filtered - end) * (-self.period / self.time_constant).exp();
        let on = if state.on { filtered > self.off } else { filtered >= self.on };
        Modulator { filtered, on }
    }
}
