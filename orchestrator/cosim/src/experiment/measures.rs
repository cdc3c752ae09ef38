//! What an experiment asks of its runs: which signals are measured, watched and drawn.

use crate::signal::Signal;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use toml::Spanned;

/// The section `[observe]` of an experiment: what is measured, watched and drawn of a run.
#[derive(Clone, Debug, Default, Deserialize, JsonSchema, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Observe {
    /// Lists of signals, by name.
    #[serde(default)]
    pub signals: BTreeMap<String, Vec<Signal>>,
    /// Numbers that are taken of a run, by their name in `metrics.json`.
    #[serde(default)]
    pub metrics: BTreeMap<String, Measure>,
    /// Metrics that the summary prints, in this order.
    #[serde(default)]
    pub summary: Vec<String>,
    /// Variables by which a unit says whether it guarantees that limits are kept.
    #[serde(default)]
    pub guarantee: Option<Guarantee>,
    /// When a run is lost.
    #[serde(default)]
    pub loss: Option<Loss>,
    /// Panels of the figure of a run and of the live view.
    #[serde(default)]
    pub panels: Vec<Panel>,
    /// Lines of the live view: variables by the heading of the line.
    #[serde(default)]
    pub readings: BTreeMap<String, Vec<String>>,
}

/// A number that is taken of signals.
#[derive(Clone, Debug, Deserialize, JsonSchema, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Measure {
    /// Its name where measures are listed; in an experiment it is the key.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub id: String,
    /// What is done with the signals.
    pub kind: Kind,
    /// A list of signals.
    #[schemars(with = "String")]
    pub signals: Spanned<String>,
    /// From and to, s; the whole run if it is left out.
    #[serde(default)]
    pub over: Option<[f64; 2]>,
    /// A variable that counts: a communication point is taken where it has grown.
    #[serde(default)]
    pub each: Option<String>,
    /// Every n-th communication point is taken, from the first on.
    #[serde(default = "super::one")]
    pub every: u32,
    /// Whether only those communication points are taken that begin a step: all but the last.
    #[serde(default)]
    pub steps: bool,
    /// Instead of the display unit of the signals.
    #[serde(default)]
    pub unit: Option<Scaled>,
    /// Heading of its line in the summary; metrics of one heading share a line.
    #[serde(default)]
    pub label: String,
    /// What tells it from others in the same line of the summary.
    #[serde(default)]
    pub part: String,
    /// The metric that is its limit.
    #[serde(default)]
    pub limit: Option<String>,
    /// Whether it may be null because the units lack a variable.
    #[serde(default)]
    pub optional: bool,
    /// Whether it is a computing time, which differs from run to run.
    #[serde(default)]
    pub timing: bool,
    /// For `settling`: fraction of a signal's first magnitude.
    #[serde(default)]
    pub band: Option<f64>,
    /// For `settling`: for how long (s) the signals must have been seen within the band.
    #[serde(default)]
    pub hold: f64,
    /// For `leaving`: a magnitude.
    #[serde(default)]
    pub bound: Option<f64>,
}

/// What is done with the signals of a measure.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Kind {
    /// √(mean of the sum of squares).
    Rms,
    /// Mean of the first signal.
    Mean,
    /// 99th percentile of the first signal, by nearest rank.
    P99,
    /// Largest magnitude of any signal.
    Largest,
    /// The last value of the first signal.
    Last,
    /// Time, s, from which on every signal stays within `band` times its first magnitude; nothing
    /// if one never does.
    Settling,
    /// How often any signal rises above one half.
    Pulses,
    /// Time, s, at which any signal first exceeds `bound`; nothing if none ever does.
    Leaving,
}

/// A unit made of another.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Scaled {
    /// Its name.
    pub name: String,
    /// Its value for a value of 1.
    pub factor: f64,
}

/// Variables by which a unit says whether it guarantees that limits are kept.
#[derive(Clone, Debug, Deserialize, JsonSchema, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Guarantee {
    /// Whether the guarantee is in force.
    pub in_force: String,
    /// Why it is or is not, as an item of an enumeration.
    #[serde(default)]
    pub status: Option<String>,
    /// Shares of the limits that are left beyond what is reserved, by the names of the limits.
    #[serde(default)]
    pub margins: BTreeMap<String, String>,
    /// A list of signals that are at most 1 while the guarantee is in force, and else it is broken.
    #[serde(default)]
    pub keeps: Option<String>,
    /// Whether the units may lack these variables.
    #[serde(default)]
    pub optional: bool,
}

/// When a run is lost, and ends.
#[derive(Clone, Debug, Deserialize, JsonSchema, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Loss {
    /// What is lost, for the message.
    pub what: String,
    /// A list of signals: their norm decides.
    pub signals: String,
    /// The largest norm with which the run goes on, in the display unit of the signals.
    pub beyond: f64,
}

/// A panel of the figure of a run, and of the live view.
#[derive(Clone, Debug, Deserialize, JsonSchema, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Panel {
    /// Short name, for the live view.
    pub name: String,
    /// Label of the vertical axis without the unit; the name if it is left out.
    #[serde(default)]
    pub label: String,
    /// Instead of the display unit of the signals.
    #[serde(default)]
    pub unit: Option<Scaled>,
    /// The curves.
    pub curves: Vec<Curve>,
    /// The limit of the norm of all curves.
    #[serde(default)]
    pub limit: Option<Signal>,
}

/// A curve of a panel.
#[derive(Clone, Debug, Deserialize, JsonSchema, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Curve {
    /// Name in the legend.
    pub name: String,
    /// What is drawn.
    pub of: Signal,
    /// What it is to follow, drawn as a pale line.
    #[serde(default)]
    pub reference: Option<Signal>,
}

impl Observe {
    /// The list of signals of this name.
    ///
    /// # Errors
    /// If there is none.
    pub fn list(&self, name: &str) -> Result<&[Signal], String> {
        self.signals.get(name).map(Vec::as_slice).ok_or_else(|| {
            let known = self.signals.keys().map(String::as_str);
            format!("[signals] has no \"{name}\"{}", fmu_import::names::hint(name, known))
        })
    }
}

impl Measure {
    /// What is wrong with it, if anything is.
    pub fn fault(&self) -> Option<String> {
        let is = |kind| self.kind == kind;
        let fault = if self.every == 0 {
            "every = 0: at least 1"
        } else if self.over.is_some_and(|[from, to]| from >= to) {
            "over must be [from, to] with from below to"
        } else if is(Kind::Leaving) && !self.bound.is_some_and(|bound| bound > 0.0) {
            "leaving wants a bound above 0"
        } else if !is(Kind::Leaving) && self.bound.is_some() {
            "bound is for leaving only"
        } else if is(Kind::Settling) && !(self.band.is_some_and(|band| band > 0.0) && self.hold >= 0.0) {
            "settling wants a band above 0, and a hold not below"
        } else if !is(Kind::Settling) && self.band.is_some() {
            "band is for settling only"
        } else if !is(Kind::Settling) && self.hold != 0.0 {
            "hold is for settling only"
        } else {
            return None;
        };
        Some(fault.into())
    }
}
