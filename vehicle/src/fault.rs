//! Faults of sensors, which begin and end at given times.

use crate::error::Error;
use crate::triad::Window;
use serde::{Deserialize, Serialize};
use settings::{Choice, Declared};

/// Kind of a fault. Its size is a multiple of that which is said here.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Choice)]
#[serde(rename_all = "camelCase")]
#[setting(name = "SensorFault")]
pub enum FaultKind {
    /// There is no fault.
    #[default]
    None,
    /// The values stay, while number and time go on.
    Frozen,
    /// Nothing arrives.
    Dropout,
    /// It arrives 0.2 s late, with the right time.
    Late,
    /// Its clock is 0.2 s ahead.
    Clock,
    /// Its number begins anew.
    Restart,
    /// The position of satellite navigation is off by 500 m along each level axis.
    Position,
    /// The velocity of satellite navigation is off by 20 m/s along each level axis.
    Velocity,
    /// The attitude of the star tracker is off by 0.5 deg about each axis.
    Attitude,
    /// The bias of the gyroscope is larger by 100 deg/h about each axis.
    Gyroscope,
    /// The bias of the accelerometer is larger by 0.5 m/s2, 50 mg, along each axis.
    Accelerometer,
}

/// Fault of a sensor, from a start to an end.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Declared)]
pub struct Fault {
    /// Kind.
    #[setting(part)]
    pub kind: FaultKind,
    /// Time window.
    #[setting(name = "", part, used_with = "~.kind != none")]
    pub window: Window,
    /// Size as a multiple of that of its kind.
    #[setting(part, nominal = 1.0)]
    #[setting(
        used_with = "~.kind = late or clock or position or velocity or attitude or gyroscope or accelerometer"
    )]
    pub size: f64,
}

impl Default for Fault {
    fn default() -> Self {
        Self { kind: FaultKind::None, window: Window { start: 0.0, end: 1e15 }, size: 1.0 }
    }
}

impl Fault {
    /// Returns whether the fault is of a kind, and acts at `time` (s).
    pub fn is(&self, kind: FaultKind, time: f64) -> bool {
        self.kind == kind && self.window.holds(time)
    }

    /// Returns the size of a fault of a kind at `time` (s) in its unit, or 0.
    pub fn of(&self, kind: FaultKind, time: f64) -> f64 {
        let unit = match kind {
            FaultKind::Late | FaultKind::Clock => 0.2,
            FaultKind::Position => 500.0,
            FaultKind::Velocity => 20.0,
            FaultKind::Attitude => 0.5_f64.to_radians(),
            FaultKind::Gyroscope => 100_f64.to_radians() / 3600.0,
            FaultKind::Accelerometer => 0.5,
            _ => 1.0,
        };
        if self.is(kind, time) { self.size * unit } else { 0.0 }
    }

    /// Returns whether the number of the samples has begun anew since `before` (s), at `now` (s).
    pub fn restarts(&self, before: f64, now: f64) -> bool {
        self.is(FaultKind::Restart, now) && !self.window.holds(before)
    }

    /// Refuses sizes that are not finite or too large, an end before the start, and what the device
    /// does not measure.
    pub(crate) fn check(
        &self,
        name: &str,
        measures: &[FaultKind],
        latest: f64,
    ) -> Result<(), Error> {
        let refuse = |part: &str, problem: String| {
            Err(Error::parameter(format!("sensor.{name}.fault.{part}"), problem))
        };
        let quantities = FaultKind::Position as u8..=FaultKind::Accelerometer as u8;
        if quantities.contains(&(self.kind as u8)) && !measures.contains(&self.kind) {
            return refuse("kind", "is an error of what this sensor does not measure".into());
        }
        let Window { start, end } = self.window;
        if self.kind != FaultKind::None && end < start {
            return refuse("end", format!("= {end} s is before the start, {start} s"));
        }
        let late = self.of(FaultKind::Late, self.window.start);
        if !(self.size.is_finite() && late >= 0.0 && (late <= latest || latest == 0.0)) {
            let problem =
                format!("= {} makes it {late} s late, and {latest} s is the most", self.size);
            return refuse("size", problem);
        }
        Ok(())
    }
}
