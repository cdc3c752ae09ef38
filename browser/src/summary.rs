//! Figures of merit of a flight, as docs/symbols.md defines them.

use crate::closed_loop::Items;
use fmi_master::master::Failed;
use serde::Serialize;

/// Limits of the norms.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Limits {
    /// Limit on ‖ω‖, rad/s.
    pub rate: f64,
    /// Limit on ‖m‖, N m.
    pub moment: f64,
}

/// A message of an FMU.
#[derive(Clone, Debug, Serialize)]
pub struct Message {
    /// Communication point at which it appeared, s.
    pub time: f64,
    /// Text of the message.
    pub text: String,
}

impl From<Failed> for Message {
    fn from(Failed { time, failure, .. }: Failed) -> Self {
        Self { time, text: failure.message }
    }
}

/// Result of a flight, apart from its signals.
#[derive(Clone, Debug, Serialize)]
pub struct Summary {
    /// Number of communication points.
    pub rows: usize,
    /// Communication step, s.
    step: f64,
    /// Limits that the controller knows.
    limits: Limits,
    /// Root mean square of ‖Θ − Θ_r‖ over the steps, rad.
    ems: f64,
    /// Root mean square of ‖m‖ over the steps, as a share of its limit.
    cms: f64,
    /// Largest ‖ω‖ as a share of its limit.
    rate_ratio: f64,
    /// Largest ‖m‖ as a share of its limit.
    moment_ratio: f64,
    /// Items of the guarantee's status and of its contradiction; none if the controller gives no
    /// guarantee.
    guarantee: [Items; 2],
    /// Warnings of the FMUs.
    pub warnings: Vec<Message>,
    /// Why the flight ended early, if it did.
    pub end: Option<Message>,
    /// Whether it ended because the attitude was lost.
    pub lost: bool,
}

fn squared(values: impl Iterator<Item = f64>) -> f64 {
    values.map(|value| value * value).sum()
}

impl Summary {
    /// Returns the summary of a flight that has not begun.
    pub fn new(limits: Limits, step: f64, guarantee: [Items; 2]) -> Self {
        Self {
            rows: 0,
            step,
            limits,
            ems: 0.0,
            cms: 0.0,
            rate_ratio: 0.0,
            moment_ratio: 0.0,
            guarantee,
            warnings: vec![],
            end: None,
            lost: false,
        }
    }

    /// Takes a row into account. At the end of the flight no step begins, so that it has no command
    /// of its own. Returns the norm of the tracking error, rad.
    pub fn take(&mut self, row: &[f64], end: bool) -> f64 {
        let before = self.rows as f64;
        self.rows += 1;
        let rate = squared(row[4..7].iter().copied()).sqrt() / self.limits.rate;
        self.rate_ratio = self.rate_ratio.max(rate);
        let error = squared((1..4).map(|i| row[i] - row[i + 6]));
        if end {
            return error.sqrt();
        }
        let effort = squared(row[10..13].iter().copied()).sqrt() / self.limits.moment;
        self.moment_ratio = self.moment_ratio.max(effort);
        let mean = |rms: f64, square: f64| ((rms * rms * before + square) / (before + 1.0)).sqrt();
        self.ems = mean(self.ems, error);
        self.cms = mean(self.cms, effort * effort);
        error.sqrt()
    }
}
