//! The part of a study that describes its figures.

use crate::values::{Quantity, ShownMetric, Values};
use cosim::experiment::Scaled;
use cosim::signal::Signal;
use cosim_report::figure::Color;
use schemars::JsonSchema;
use serde::Deserialize;
use toml::Spanned;

/// A figure with its panels.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Figure {
    /// Id of the figure, which is also the name of its files.
    pub id: String,
    /// Title of the figure, in one line.
    pub title: String,
    /// Caption, which explains the figure.
    #[serde(default)]
    pub caption: String,
    /// Number of panels in a row, side by side.
    #[serde(default = "one")]
    pub columns: usize,
    /// Ids of the runs whose curves are drawn.
    #[serde(default)]
    #[schemars(with = "Vec<String>")]
    pub runs: Vec<Spanned<String>>,
    /// Panels of the figure, row by row.
    #[serde(rename = "panel")]
    pub panels: Vec<Panel>,
}

fn one() -> usize {
    1
}

/// A panel of a figure. Exactly one of `signal`, `signals`, `across` and `response` selects
/// the curves.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Panel {
    /// Label of the vertical axis.
    pub label: String,
    /// Label of the horizontal axis, if it is not time.
    pub x_label: Option<String>,
    /// Heading above the panel.
    #[serde(default)]
    pub title: String,
    /// Ids of the runs whose curves are drawn, in place of those of the figure.
    #[schemars(with = "Option<Vec<String>>")]
    pub runs: Option<Vec<Spanned<String>>>,
    /// Signal that is drawn as one curve for each run.
    pub signal: Option<Signal>,
    /// Signals that are drawn as several curves for each run.
    #[serde(default)]
    pub signals: Vec<Curve>,
    /// Signal that the curves are to follow. It is drawn once, for the first run.
    pub reference: Option<Signal>,
    /// Whether a band shows the range of the signal over all values of `vary`.
    #[serde(default)]
    pub spread: bool,
    /// Two metrics that are drawn against each other: as one dot for each case of the runs, or as
    /// lines through several runs.
    pub across: Option<Across>,
    /// Frequency response of the loop that `[observe.margins]` linearises, as one curve for each
    /// run.
    pub response: Option<Response>,
    /// Horizontal lines across the panel.
    #[serde(default)]
    pub bounds: Vec<Line>,
    /// Vertical lines across the panel.
    #[serde(default)]
    pub marks: Vec<Line>,
    /// Unit of the values, in place of the display unit of the FMU.
    pub unit: Option<Scaled>,
    /// Range of the horizontal axis to show, from and to.
    pub x_range: Option<[f64; 2]>,
    /// Range of the vertical axis to show, from and to: the same in panels that are compared.
    pub y_range: Option<[f64; 2]>,
}

/// Content of a panel besides its straight lines.
#[derive(Clone, Copy, Debug)]
pub enum Drawn<'a> {
    /// Signals over time.
    Signals,
    /// Two metrics against each other.
    Across(&'a Across),
    /// Frequency responses.
    Response(Response),
}

impl Panel {
    /// Returns the content of the panel.
    ///
    /// # Errors
    /// Returns an error unless the panel has exactly one key that says so.
    pub fn drawn(&self) -> Result<Drawn<'_>, String> {
        let keys = [
            self.signal.as_ref().map(|_| Drawn::Signals),
            (!self.signals.is_empty()).then_some(Drawn::Signals),
            self.across.as_ref().map(Drawn::Across),
            self.response.map(Drawn::Response),
        ];
        let mut given = keys.into_iter().flatten();
        match (given.next(), given.next()) {
            (Some(drawn), None) => Ok(drawn),
            _ => Err("a panel needs exactly one of signal, signals, across and response".into()),
        }
    }

    /// Returns the lines through runs that the panel draws.
    pub fn lines_across(&self) -> &[Through] {
        self.across.as_ref().map(|across| across.lines.as_slice()).unwrap_or_default()
    }
}

/// A curve with a name and a colour of its own.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Curve {
    /// Signal that is drawn as the curve.
    #[serde(rename = "of")]
    pub signal: Signal,
    /// Name of the curve in the legend.
    pub label: String,
    /// Colour of the curve.
    pub color: Color,
}

/// Frequency response of a loop.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Response {
    /// Magnitude of the return ratio, in dB, over its phase in deg: at the signal with the smallest
    /// disk margin, while the loops of the others are closed. A line surrounds what a disk margin of
    /// 1 excludes.
    Nichols,
    /// Largest singular value of the sensitivity of all signals, in dB, over the frequency in
    /// rad/s.
    Sensitivity,
}

/// Two metrics that are drawn against each other.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Across {
    /// Metric along the horizontal axis.
    pub x: ShownMetric,
    /// Metric along the vertical axis.
    pub y: ShownMetric,
    /// Lines that are drawn, each through runs of its own. Without any, each case of the panel's
    /// runs is a dot.
    #[serde(default)]
    pub lines: Vec<Through>,
}

/// A line through several runs. Each of its points is the mean of a run's metrics.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Through {
    /// Name of the line in the legend.
    pub label: String,
    /// Colour of the line.
    pub color: Color,
    /// Ids of the runs that the line connects, in this order.
    #[schemars(with = "Vec<String>")]
    pub runs: Vec<Spanned<String>>,
}

/// A straight line across a panel.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Line {
    /// Position of the line: a number, or the id of a value. With `± ` before it there is a second
    /// line at the negative position.
    pub at: Quantity,
    /// Name of the line, which stands beside it.
    pub label: String,
}

impl Line {
    /// Returns the positions of the line.
    ///
    /// # Errors
    /// Returns an error that names the id if there is no such value.
    pub fn positions(&self, values: &Values) -> Result<Vec<f64>, String> {
        if let Quantity::Named(text) = &self.at
            && let Some(text) = text.strip_prefix("± ")
        {
            let named = |_| values.number(&Quantity::Named(text.into()));
            return text.parse().or_else(named).map(|at: f64| vec![at, -at]);
        }
        values.number(&self.at).map(|at| vec![at])
    }
}
