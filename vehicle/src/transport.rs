//! Transport delay of the commanded moment. A moment commanded at t acts from t + delay on and is
//! held until the next change arrives. No moment acts before the first command arrives.

use crate::error::{Error, rounded_time};
use crate::time::tolerance;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use std::collections::VecDeque;

/// Longest delay that is allowed, s.
pub const LONGEST: f64 = 1.0;
/// Largest number of changes of the command that can be under way at a time.
pub const UNDER_WAY: usize = 10_000;
/// Name of the delay in error messages.
const NAME: &str = "actuation.delay";

/// Commanded moment that differs from the one before it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct Change {
    /// Time at which the command was given, s.
    time: f64,
    /// Commanded moment about the body axes, N m.
    moment: Vector3<f64>,
}

/// Commands that are under way, and the one that acts.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Transport {
    /// Transport delay of the moment, s.
    delay: f64,
    /// Changes in order of time, oldest first. All but the first are under way.
    changes: VecDeque<Change>,
}

impl Transport {
    /// Makes a transport with a delay in s, or `None` if the delay is zero.
    ///
    /// # Errors
    /// Refuses a delay that is negative or longer than [`LONGEST`].
    pub fn new(delay: f64) -> Result<Option<Self>, Error> {
        if !(0.0..=LONGEST).contains(&delay) {
            let problem = format!("= {delay} s must lie between 0 and {LONGEST} s");
            return Err(Error::parameter(NAME, problem));
        }
        Ok((delay > 0.0).then(|| Self { delay, changes: VecDeque::new() }))
    }

    /// Transport delay of the moment, s.
    pub(crate) fn delay(&self) -> f64 {
        self.delay
    }

    /// Whether restored commands are possible at `time` (s). A step that has `failed` may have gone
    /// beyond `time`.
    pub(crate) fn fits(&self, time: f64, failed: bool) -> bool {
        let past = |change: &Change| {
            failed && change.time.is_finite() || change.time <= time + tolerance(time)
        };
        let ascend =
            self.changes.iter().zip(self.changes.iter().skip(1)).all(|(a, b)| a.time < b.time);
        let finite = |change: &Change| change.moment.iter().all(|value| value.is_finite());
        ascend
            && self.changes.len() <= UNDER_WAY + 2
            && self.changes.iter().all(|change| past(change) && finite(change))
    }

    /// Whether a moment commanded at `commanded` (s) acts at `time` (s). Instants that differ by
    /// rounding count as equal, but a command never acts at the instant at which it is given.
    fn acts(&self, commanded: f64, time: f64) -> bool {
        commanded + self.delay <= time + tolerance(time).min(0.5 * self.delay)
    }

    /// Number of changes that have arrived by `time` (s).
    fn arrived(&self, time: f64) -> usize {
        self.changes.partition_point(|change| self.acts(change.time, time))
    }

    /// Takes the moment (N m) that is commanded from `time` (s) on. It replaces one that was given
    /// at the same time.
    ///
    /// # Errors
    /// Refuses a moment that is not finite, or more than [`UNDER_WAY`] changes under way at a time.
    pub fn command(&mut self, time: f64, moment: Vector3<f64>) -> Result<(), Error> {
        if !moment.iter().all(|value| value.is_finite()) {
            return Err(Error::NotFinite { time, what: "moment" });
        }
        while self.changes.back().is_some_and(|change| change.time >= time) {
            self.changes.pop_back();
        }
        if self.changes.back().map_or_else(Vector3::zeros, |change| change.moment) == moment {
            return Ok(());
        }
        let past = self.arrived(time).saturating_sub(1);
        self.changes.drain(..past);
        if self.changes.len() - self.arrived(time) >= UNDER_WAY {
            let problem = format!(
                "= {} s at t = {} s: the moment changed more than {UNDER_WAY} times within it; use longer communication steps or a shorter delay",
                self.delay,
                rounded_time(time)
            );
            return Err(Error::parameter(NAME, problem));
        }
        self.changes.push_back(Change { time, moment });
        Ok(())
    }

    /// Moment (N m) that acts at `time` (s).
    pub fn moment(&self, time: f64) -> Vector3<f64> {
        self.arrived(time)
            .checked_sub(1)
            .map_or_else(Vector3::zeros, |last| self.changes[last].moment)
    }

    /// Time (s) at which the next change after `time` arrives, if one is under way.
    pub fn next_arrival(&self, time: f64) -> Option<f64> {
        self.changes.get(self.arrived(time)).map(|change| change.time + self.delay)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pitch(moment: f64) -> Vector3<f64> {
        Vector3::new(0.0, moment, 0.0)
    }

    fn transport(delay: f64) -> Transport {
        Transport::new(delay).unwrap().unwrap()
    }

    #[test]
    fn ticks_that_differ_by_rounding_are_one() {
        let mut transport = transport(0.12);
        let (mut commanded, mut expected) = (0.0, 0.0);
        for k in 0..1000 {
            transport.command(commanded, pitch(f64::from(k + 1))).unwrap();
            for time in [0.04 * f64::from(k), commanded] {
                assert_eq!(transport.moment(time).y, expected, "{time}");
            }
            commanded += 0.04;
            expected = f64::from((k - 1).max(0));
        }
    }

    #[test]
    fn a_command_never_acts_when_it_is_given_however_short_the_delay() {
        for delay in [1e-12, 1e-9, 1e-6] {
            let mut transport = transport(delay);
            transport.command(2.0, pitch(1.0)).unwrap();
            assert_eq!(transport.moment(2.0), Vector3::zeros(), "{delay}");
            assert!(transport.next_arrival(2.0).unwrap() > 2.0);
            assert_eq!(transport.moment(2.0 + delay), pitch(1.0), "{delay}");
            assert_eq!(transport.next_arrival(2.0 + delay), None);
        }
    }

    #[test]
    fn what_is_commanded_again_takes_no_room_and_what_replaces_it_counts() {
        let mut transport = transport(0.5);
        for k in 0..100_000 {
            transport.command(1e-5 * f64::from(k), pitch(7.0)).unwrap();
        }
        assert_eq!(transport.changes.len(), 1);
        transport.command(1.0, pitch(8.0)).unwrap();
        transport.command(1.0, pitch(9.0)).unwrap();
        assert_eq!(transport.moment(1.5), pitch(9.0));
        transport.command(1.0, pitch(7.0)).unwrap();
        assert_eq!(transport.next_arrival(1.0), None, "taken back");
    }

    #[test]
    fn too_many_changes_are_refused_with_the_parameters_name() {
        let mut transport = transport(1.0);
        let mut last = Ok(());
        let mut count = 0;
        while last.is_ok() && count < 1_000_000 {
            last = transport.command(1e-5 * f64::from(count), pitch(f64::from(count)));
            count += 1;
        }
        let text = last.unwrap_err().to_string();
        assert!(text.contains("actuation.delay") && text.contains("10000"), "{text}");
        // The first moment is zero, which is no change.
        assert_eq!(count as usize, UNDER_WAY + 2);
        for delay in [-0.1, 1.1, f64::NAN] {
            assert!(Transport::new(delay).unwrap_err().to_string().contains("actuation.delay"));
        }
        assert_eq!(Transport::new(0.0).unwrap(), None);
    }
}
