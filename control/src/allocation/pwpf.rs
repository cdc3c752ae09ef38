//! Pulse-width pulse-frequency modulation of the jets (Wu 2015, Figure 2): a low-pass filter and a
//! Schmitt trigger in a loop.

use crate::error::{DesignError, invalid};
use serde::{Deserialize, Serialize};
use settings::Declared;
use std::f64::consts::TAU;
use vehicle::math::{atan2, exp, hypot, sin_cos};

/// Number of periods of a sine over which a describing function is taken, after one that is left
/// out.
const PERIODS: u32 = 8;

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

    /// Returns the describing function of two opposed jets: the first harmonic of their thrust
    /// (from −1 to 1) over a sine that is commanded, as magnitude and phase (rad). The amplitude
    /// of the sine is a duty cycle, its frequency in rad/s; each jet gets one half-wave.
    ///
    /// A. Gelb and W. E. Vander Velde, "Multiple-input describing functions and nonlinear system
    /// design", 1968.
    pub fn describing_function(&self, amplitude: f64, frequency: f64) -> (f64, f64) {
        let samples = (TAU / (frequency * self.period)).round().max(1.0);
        let mut jets = [Modulator::default(); 2];
        let (mut in_phase, mut ahead) = (0.0, 0.0);
        for k in 0..samples as u64 * u64::from(1 + PERIODS) {
            let angle = TAU * (k as f64 / samples).fract();
            let (sine, cosine) = sin_cos(angle);
            // A command acts from its sample until the next one, as in the allocator.
            let thrust = f64::from(u8::from(jets[0].on)) - f64::from(u8::from(jets[1].on));
            if k >= samples as u64 {
                in_phase += thrust * sine;
                ahead += thrust * cosine;
            }
            for (jet, sign) in jets.iter_mut().zip([1.0, -1.0]) {
                *jet = self.advance(*jet, (sign * amplitude * sine).clamp(0.0, 1.0));
            }
        }
        let share = 2.0 / (amplitude * samples * f64::from(PERIODS));
        (share * hypot(in_phase, ahead), atan2(ahead, in_phase))
    }
}
