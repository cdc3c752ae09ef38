//! The signals of a run that an experiment measures, watches and draws.

use super::{Scalar, Trajectory, Vehicle};
use crate::signal::Signal;
use fmi_master::names;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::iter;
use toml::Spanned;

/// The section `[observe]` of an experiment: the signals of a run that are measured, watched and
/// drawn.
#[derive(Clone, Debug, Default, Deserialize, JsonSchema, Serialize)]
#[serde(default, deny_unknown_fields)]
pub struct Observe {
    /// Lists of signals that the other keys refer to, by name.
    pub signals: BTreeMap<String, Vec<Signal>>,
    /// Metrics that are computed from the signals of a run, by their names in `metrics.json`.
    pub metrics: BTreeMap<String, Measure>,
    /// Units in which the summary and the panels show values, by the unit of the values.
    pub units: BTreeMap<String, Scaled>,
    /// Names of the metrics that the summary prints, in this order.
    pub summary: Vec<String>,
    /// Variables in which a component reports whether it guarantees that limits are kept.
    pub guarantee: Option<Guarantee>,
    /// Instant and signals at which the stability margins of the loop are computed.
    pub margins: Option<Margins>,
    /// Condition under which a run counts as lost.
    pub loss: Option<Loss>,
    /// Condition at the end of a run under which it has missed its goal and is not completed.
    pub goal: Option<Loss>,
    /// Panels of the figure of a run.
    pub panels: Vec<Panel>,
    /// Variables by which the page of a run shows the vehicle.
    pub vehicle: Option<Vehicle>,
    /// Variables by which the pictures of a run show a flight over a planet.
    pub trajectory: Option<Trajectory>,
}

/// Stability margins of the loop as metrics: `margin_disk` and so on, each the smallest of all
/// opened signals by themselves and together, and of both sides of an edge.
#[derive(Clone, Debug, Deserialize, JsonSchema, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Margins {
    /// Time of the run at which the loop is linearised, s.
    pub at: f64,
    /// Signals at which the loop is opened: connected inputs or outputs, as `plant.moment.*`.
    pub open: Vec<String>,
}

impl Margins {
    /// Names of the metrics, in the order in which they are computed, with their units.
    pub const NAMES: [(&str, &str); 7] = [
        ("margin_stable", ""),
        ("margin_gain_above", ""),
        ("margin_gain_below", ""),
        ("margin_phase_deg", "deg"),
        ("margin_delay_s", "s"),
        ("margin_disk", ""),
        ("margin_sensitivity", ""),
    ];

    /// Returns whether a metric of this name is one of the margins.
    pub fn is_metric(name: &str) -> bool {
        Self::NAMES.iter().any(|(other, _)| *other == name)
    }

    /// Returns the unit of a margin, if it has one.
    pub fn unit(name: &str) -> Option<String> {
        let (_, unit) = Self::NAMES.iter().find(|(other, _)| *other == name)?;
        (!unit.is_empty()).then(|| (*unit).to_string())
    }
}

/// A number that is computed from signals of a run.
#[derive(Clone, Debug, Deserialize, JsonSchema, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Measure {
    /// Name of the measure in a list of measures. In an experiment the key is the name.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub id: String,
    /// Quantity that is computed from the signals.
    pub kind: MeasureKind,
    /// Name of the list of signals that the number is computed from.
    #[schemars(with = "String")]
    pub signals: Spanned<String>,
    /// Start and end of the part of the run that counts, s. Without this the whole run counts.
    pub over: Option<[f64; 2]>,
    /// Name of a variable that counts events. Only those communication points are used at which it
    /// has grown.
    pub each: Option<String>,
    /// Number n, if only every n-th communication point from the start is used.
    #[serde(default = "super::one")]
    pub every: u32,
    /// Whether only those communication points are used at which a step begins, which are all but
    /// the last.
    #[serde(default)]
    pub steps: bool,
    /// Unit of the number, in place of the display unit of the signals.
    pub unit: Option<Scaled>,
    /// Heading of the number's line in the summary. Metrics with the same heading share a line.
    #[serde(default)]
    pub label: String,
    /// What the heading means, for readers of the page of a run.
    #[serde(default)]
    pub meaning: String,
    /// Label that distinguishes the number from others in the same line of the summary.
    #[serde(default)]
    pub part: String,
    /// Name of the metric that is the limit of this one.
    pub limit: Option<String>,
    /// Whether the number may be null because the FMUs lack a variable.
    #[serde(default)]
    pub optional: bool,
    /// Whether the number is a computing time, which differs from run to run.
    #[serde(default)]
    pub timing: bool,
    /// For `settling`, the width of the band as a fraction of a signal's first magnitude.
    pub band: Option<f64>,
    /// For `leaving`, the magnitude that a signal must exceed. For `settling`, in place of `band`,
    /// the magnitude within which every signal must stay. For `rises`, the least rise that counts.
    /// For `share`, the magnitude within which all signals must lie.
    pub bound: Option<f64>,
    /// For `rms-above`, the frequency above which the signals count, Hz.
    pub frequency: Option<f64>,
}

/// Quantity that a measure computes from its signals.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum MeasureKind {
    /// Square root of the mean of the sum of the signals' squares.
    Rms,
    /// Arithmetic mean of the first signal.
    Mean,
    /// Integral of the first signal over time. A signal in deg gives a number in deg·s, which
    /// `unit` names.
    Integral,
    /// 99th percentile of the first signal, by nearest rank.
    P99,
    /// Largest magnitude of any signal.
    Largest,
    /// Last value of the first signal.
    Last,
    /// Time from which on every signal stays within `band` times its first magnitude, or within
    /// `bound`, s. There is no value if a signal is not seen to do so for a tenth of the time.
    Settling,
    /// Number of times that any signal rises above one half.
    Pulses,
    /// Time at which any signal first exceeds `bound`, s. There is no value if none ever does.
    Leaving,
    /// Number of times that the first signal is greater than at the communication point before, by
    /// more than `bound`, which is 0 by default.
    Rises,
    /// Total variation: sum over the signals of the magnitudes of all changes.
    Variation,
    /// Root mean square of the signals' content above `frequency`, over all signals, by the
    /// discrete Fourier transform with a Hann window.
    RmsAbove,
    /// Share of the communication points at which the magnitudes of all signals are within `bound`.
    Share,
}

/// A unit that is a multiple of another unit.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Scaled {
    /// Name of the unit.
    pub name: String,
    /// Number of these units in one unit of the signals.
    pub factor: f64,
}

/// Variables in which a component reports whether it guarantees that limits are kept.
#[derive(Clone, Debug, Deserialize, JsonSchema, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Guarantee {
    /// Variable that tells whether the guarantee is in force.
    pub in_force: String,
    /// Variable that tells why the guarantee is or is not in force, of an enumeration type.
    pub status: Option<String>,
    /// Variables with the unused share of each limit after the reserve for disturbances, by the
    /// names of the limits.
    #[serde(default)]
    pub margins: BTreeMap<String, String>,
    /// Name of a list of signals that must not exceed 1 while the guarantee is in force. If one
    /// does, the guarantee is broken.
    pub keeps: Option<String>,
    /// Name of a list of signals, as errors over the largest that are declared, which the guarantee
    /// assumes not to exceed 1.
    pub assumes: Option<String>,
    /// What counts as a late arrival at the reference while the guarantee is in force.
    pub late: Option<Late>,
    /// Parameters whose accepted values `margins --guarantee` looks for.
    pub accepted: Option<Accepted>,
    /// Group of variables that show the plan that is followed, for the page of a run: `began`, and
    /// `time`, `rate`, `rateBound`, `moment` and `momentBound` with an index.
    pub plan: Option<String>,
    /// Whether the FMUs may lack `in_force`, `status`, the margins and signals that `assumes` needs.
    #[serde(default)]
    pub optional: bool,
}

/// A late arrival: the norm of signals stays above a bound for three times a time that the design
/// tells.
#[derive(Clone, Debug, Deserialize, JsonSchema, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Late {
    /// Name of the list of signals whose norm decides.
    pub signals: String,
    /// Largest norm with which the reference counts as reached, in the display unit of the signals.
    pub beyond: f64,
    /// Variable with the designed time, s.
    pub time: String,
}

/// Parameters whose accepted values `margins --guarantee` looks for: those with which the instances
/// can be initialized.
#[derive(Clone, Debug, Deserialize, JsonSchema, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Accepted {
    /// Parameters whose largest values are told. That of the first is also told with each of the
    /// others set to zero.
    pub largest: Vec<Signal>,
    /// Parameters whose smallest values are told.
    pub smallest: Vec<Signal>,
    /// Outputs that are told as they are after initialization.
    pub told: Vec<Signal>,
    /// Output with its least value, with which the first parameter is told once more.
    pub leaving: Option<(Signal, f64)>,
    /// Values of parameters with which bounds are refused that are too large.
    #[serde(default)]
    #[schemars(with = "BTreeMap<String, Scalar>")]
    pub with: BTreeMap<String, toml::Value>,
    /// Values of parameters with which the rest is left to a rule of the design.
    #[schemars(with = "BTreeMap<String, Scalar>")]
    pub by_rule: BTreeMap<String, toml::Value>,
}

/// Condition under which a run is lost and ends, or under which it has missed its goal. Of signals
/// that are differences, what is controlled must also have moved away from its reference by half of
/// the bound: a command alone loses nothing.
#[derive(Clone, Debug, Deserialize, JsonSchema, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Loss {
    /// Name of the lost quantity or of the goal, for the message.
    pub what: String,
    /// Name of the list of signals whose norm decides.
    pub signals: String,
    /// Largest norm with which the run continues or the goal is met, in the display unit of the
    /// signals.
    pub beyond: f64,
}

/// A panel of the figure of a run.
#[derive(Clone, Debug, Deserialize, JsonSchema, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Panel {
    /// Name of the panel, by which errors name it.
    pub name: String,
    /// Label of the vertical axis, without the unit. By default it is the name of the panel.
    #[serde(default)]
    pub label: String,
    /// Unit of the vertical axis, in place of the display unit of the signals.
    pub unit: Option<Scaled>,
    /// Curves of the panel, with their names and signals.
    pub curves: Vec<Curve>,
    /// Limit of the norm of all curves.
    pub limit: Option<Signal>,
    /// Whether the FMUs may lack what it draws.
    #[serde(default)]
    pub optional: bool,
}

impl Panel {
    /// Returns the variables that the panel draws.
    pub fn paths(&self) -> impl Iterator<Item = &str> {
        let curves = self.curves.iter();
        let signals = curves.flat_map(|curve| iter::once(&curve.of).chain(&curve.reference));
        signals.chain(&self.limit).flat_map(Signal::paths)
    }
}

/// A curve of a panel.
#[derive(Clone, Debug, Deserialize, JsonSchema, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Curve {
    /// Name of the curve in the legend.
    pub name: String,
    /// Signal that is drawn as the curve.
    pub of: Signal,
    /// Signal that the curve is to follow, drawn as a pale line.
    pub reference: Option<Signal>,
}

fn hint<'a>(wrong: &str, names: impl Iterator<Item = &'a String> + Clone) -> String {
    names::hint(wrong, names.map(String::as_str))
}

impl Observe {
    /// Returns the list of signals with this name.
    ///
    /// # Errors
    /// Returns an error if there is no such list, or if it is empty.
    pub fn list(&self, name: &str) -> Result<&[Signal], String> {
        match self.signals.get(name) {
            Some(signals) if signals.is_empty() => {
                Err(format!("[observe.signals] \"{name}\" is empty"))
            }
            Some(signals) => Ok(signals),
            None => {
                let hint = hint(name, self.signals.keys());
                Err(format!("[observe.signals] has no \"{name}\"{hint}"))
            }
        }
    }

    /// Describes a metric that has an id of its own, or one that the summary or another metric
    /// names and that does not exist.
    pub fn fault(&self) -> Option<String> {
        let unknown = |place: &str, name: &String| {
            let hint = hint(name, self.metrics.keys());
            (!self.metrics.contains_key(name))
                .then(|| format!("{place}: there is no metric \"{name}\"{hint}"))
        };
        let limit = |(name, measure): (&String, &Measure)| {
            unknown(&format!("[observe.metrics.{name}] limit"), measure.limit.as_ref()?)
        };
        let id = |(name, measure): (&String, &Measure)| {
            (!measure.id.is_empty()).then(|| {
                format!(
                    "[observe.metrics.{name}] id = \"{}\": leave it out, the key is the name",
                    measure.id
                )
            })
        };
        let mut summary = self.summary.iter().filter_map(|name| unknown("[observe] summary", name));
        let metrics = || self.metrics.iter();
        summary.next().or_else(|| metrics().find_map(limit)).or_else(|| metrics().find_map(id))
    }
}

impl Measure {
    /// Returns a measure of this kind over the whole run, without signals.
    pub fn new(kind: MeasureKind) -> Self {
        Self {
            id: String::new(),
            kind,
            signals: Spanned::new(0..0, String::new()),
            over: None,
            each: None,
            every: 1,
            steps: false,
            unit: None,
            label: String::new(),
            meaning: String::new(),
            part: String::new(),
            limit: None,
            optional: false,
            timing: false,
            band: None,
            bound: None,
            frequency: None,
        }
    }
}
