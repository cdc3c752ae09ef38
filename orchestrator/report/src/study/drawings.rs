//! What a study says about its figures.

use super::values::Quantity;
use crate::figure::Color;
use cosim::experiment::Scaled;
use cosim::signal::Signal;
use schemars::JsonSchema;
use serde::Deserialize;
use toml::Spanned;

/// A figure with its panels.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Figure {
    /// Name of its files.
    pub id: String,
    /// One line.
    pub title: String,
    /// What there is to see.
    #[serde(default)]
    pub caption: String,
    /// Panels side by side.
    #[serde(default = "one")]
    pub columns: usize,
    /// Whose curves are drawn.
    #[serde(default)]
    #[schemars(with = "Vec<String>")]
    pub runs: Vec<Spanned<String>>,
    /// The panels, row by row.
    #[serde(rename = "panel")]
    pub panels: Vec<Panel>,
}

fn one() -> usize {
    1
}

/// A panel of a figure. Exactly one of `signal`, `signals`, `histogram`, `scatter` and `across` says what is drawn, or `points` alone.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Panel {
    /// Label of the vertical axis.
    pub label: String,
    /// Label of the horizontal axis, if it is not time.
    pub x_label: Option<String>,
    /// A heading above it.
    #[serde(default)]
    pub title: String,
    /// Instead of the figure's.
    #[schemars(with = "Option<Vec<String>>")]
    pub runs: Option<Vec<Spanned<String>>>,
    /// One curve for each run.
    pub signal: Option<Signal>,
    /// Several curves for each run.
    #[serde(default)]
    pub signals: Vec<Curve>,
    /// Drawn once, of the first run.
    pub reference: Option<Signal>,
    /// Whether the band of all values of `vary` is drawn.
    #[serde(default)]
    pub spread: bool,
    /// The metric of kind `p99` whose single values are counted, over a logarithmic axis.
    pub histogram: Option<String>,
    /// One dot for each value of `vary`.
    pub scatter: Option<Scatter>,
    /// Lines through the metrics of several runs.
    pub across: Option<Across>,
    /// Horizontal lines.
    #[serde(default)]
    pub bounds: Vec<Line>,
    /// Vertical lines.
    #[serde(default)]
    pub marks: Vec<Line>,
    /// Single points.
    #[serde(default)]
    pub points: Vec<Point>,
    /// Instead of the FMU's display unit.
    pub unit: Option<Scaled>,
    /// Part of the horizontal axis to show.
    pub x_range: Option<[f64; 2]>,
}

/// A curve of its own name and colour.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Curve {
    /// What is drawn.
    pub of: Signal,
    /// Name in the legend.
    pub label: String,
    /// Its colour.
    pub color: Color,
}

/// Metrics against each other.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Scatter {
    /// Metric along the horizontal axis.
    pub x: String,
    /// Metric along the vertical axis.
    pub y: String,
}

/// Metrics of several runs against each other.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Across {
    /// Along the horizontal axis.
    pub x: Axis,
    /// Along the vertical axis.
    pub y: Axis,
    /// One line for each of these.
    pub lines: Vec<Through>,
}

/// A metric along an axis.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Axis {
    /// The metric.
    pub of: String,
    /// The axis's unit for a value of 1.
    #[serde(default = "super::values::unscaled")]
    pub factor: f64,
}

/// A line through several runs: the mean of each run's metric.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Through {
    /// Name in the legend.
    pub label: String,
    /// Its colour.
    pub color: Color,
    /// The runs, in their order.
    #[schemars(with = "Vec<String>")]
    pub runs: Vec<Spanned<String>>,
    /// Whether it is dashed.
    #[serde(default)]
    pub dashed: bool,
}

/// A straight line across a panel.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Line {
    /// Where.
    pub at: Quantity,
    /// Name in the legend.
    pub label: String,
    /// Its colour.
    #[serde(default)]
    pub color: Option<Color>,
    /// Whether it is drawn at the negative value too.
    #[serde(default)]
    pub symmetric: bool,
}

/// A single point.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Point {
    /// Along the horizontal axis.
    pub x: Quantity,
    /// Along the vertical axis.
    pub y: Quantity,
    /// Name in the legend.
    pub label: String,
    /// Its colour.
    pub color: Color,
}
