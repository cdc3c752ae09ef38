//! Runs that keep in step with the wall clock.
//!
//! Communication point t is due at t₀ + (t − start) / factor on the monotonic clock: these instants
//! are absolute, so that errors do not accumulate. The master waits for each instant ([`timer`]),
//! then steps the instances and transfers values. The values that a component computes at one of
//! its communication points must be ready before its next one; if they are not, a *deadline is
//! missed*. The [`pacer`] counts missed deadlines, takes the requested action, and measures times;
//! [`report`] summarizes them.

pub mod distribution;
pub mod pacer;
pub mod report;
pub mod timer;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::str::FromStr;

/// Settings of a run that is paced by the wall clock.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Simulated time divided by elapsed time, as requested.
    pub factor: Factor,
    /// Action taken when a deadline is missed.
    pub on_miss: OnMiss,
}

/// A real-time factor, which is finite and positive.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Factor(f64);

impl Factor {
    /// Returns the factor as a number.
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
            Err("the factor must be finite and above 0: 1 is real time, 20 is twenty times as fast"
                .into())
        }
    }
}

/// Action taken on a missed deadline, which is counted and reported in any case.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, JsonSchema, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum OnMiss {
    /// Continue at once, without waiting, until the run is back in step with the original time
    /// base.
    #[default]
    CatchUp,
    /// End the run with an error. The results so far are kept.
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
