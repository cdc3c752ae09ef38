//! A run in step with the wall clock.
//!
//! Communication point t is due at t₀ + (t − start) / factor on the monotonic clock: absolute instants, so that no error adds
//! up. The master waits for each ([`timer`]), then steps the units and passes values on. What a component computes at a
//! communication point of its own must be there before its next one; what comes later is a *missed deadline*. The
//! [`pacer`] counts them, does what was asked for, and measures; [`report`] says what came of it.

pub mod distribution;
pub mod pacer;
pub mod plot;
pub mod priority;
pub mod report;
pub mod timer;

use serde::{Deserialize, Serialize};
use std::str::FromStr;

/// How a run is paced.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Simulated time over elapsed time.
    pub factor: Factor,
    /// What is done about a missed deadline.
    pub on_miss: OnMiss,
    /// Real-time priority, 1 to 99, if it is asked for.
    pub priority: Option<u8>,
}

/// A finite, positive factor.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Factor(f64);

impl Factor {
    /// The number.
    pub fn get(self) -> f64 {
        self.0
    }
}

impl FromStr for Factor {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let factor: f64 = text.parse().map_err(|_| {
            "not a number; write the experiment before --real-time, or --real-time=1".to_string()
        })?;
        if factor > 0.0 && factor.is_finite() {
            Ok(Self(factor))
        } else {
            Err("the factor must be finite and above 0: 1 is real time, 20 is twenty times as fast".into())
        }
    }
}

/// What is done about a missed deadline. It is counted and reported whatever is done.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum OnMiss {
    /// Go on at once, without waiting, until the run is back in step with the original time base.
    #[default]
    CatchUp,
    /// Shift the time base by the delay: the run goes on at its pace, and ends that much later.
    Slip,
    /// End the run with an error; the results until then are kept.
    Stop,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_factor_is_finite_and_positive() {
        assert_eq!("20".parse::<Factor>().unwrap().get(), 20.0);
        for text in ["0", "-1", "nan", "inf", "-inf", "-0"] {
            let message = text.parse::<Factor>().unwrap_err();
            assert!(message.contains("finite and above 0"), "{text}: {message}");
        }
        assert!("fast".parse::<Factor>().unwrap_err().contains("not a number"));
    }
}
