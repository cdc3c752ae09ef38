//! Shapes a command that jumps into a reference whose rate and acceleration are limited.

use serde::{Deserialize, Serialize};

/// An angle that follows a command, with its derivatives.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Shaped {
    /// The angle, rad.
    pub value: f64,
    /// Its rate, rad/s.
    pub rate: f64,
    /// Its acceleration, which is constant until the next tick, rad/s².
    pub acceleration: f64,
}

/// Limits on rate (rad/s) and acceleration (rad/s²).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// Largest rate, rad/s.
    pub rate: f64,
    /// Largest acceleration, rad/s².
    pub acceleration: f64,
}

impl Shaped {
    /// Moves on by a tick of `period` (s), and decides upon the acceleration until the next tick:
    /// the one that reaches `command` (rad) in the least time, without going beyond it.
    pub fn follow(&mut self, command: f64, limits: &Limits, period: f64) {
        self.value += (self.rate + self.acceleration * period / 2.0) * period;
        self.rate += self.acceleration * period;
        // Of the next rate v the distance until standstill is v² / (2 a), plus the loss of half a
        // period because accelerations change at ticks only.
        let ahead = command - self.value - self.rate * period / 2.0;
        let a = limits.acceleration;
        let fastest = a * ((period * period + 2.0 * ahead.abs() / a).sqrt() - period);
        let step = a * period;
        let next = fastest
            .min(limits.rate)
            .copysign(ahead)
            .clamp(self.rate - step, self.rate + step)
            .clamp(-limits.rate, limits.rate);
        self.acceleration = ((next - self.rate) / period).clamp(-a, a);
    }
}
