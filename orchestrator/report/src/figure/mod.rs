//! A figure of panels with curves. It is drawn as SVG ([`svg`]) for papers and pages.

pub(crate) mod clip;
mod dash;
pub mod svg;
mod thin;
mod ticks;
mod words;

use schemars::JsonSchema;
use serde::Deserialize;

/// A colour as red, green and blue, which a file writes as `#rrggbb`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(try_from = "String")]
pub struct Color(pub u8, pub u8, pub u8);

impl Color {
    /// Black, which pages draw in the colour of their text.
    pub const INK: Self = Self(0, 0, 0);
    /// Colour of the background, a grey.
    pub const GREY: Self = Self(110, 110, 110);
    /// Colour of limits, a neutral grey.
    pub const LIMIT: Self = Self(91, 104, 117);
    /// Colours that also differ for people who see no red or no green, for curves in their order
    /// (M. Okabe and K. Ito, Color Universal Design, 2008).
    pub const CURVES: [Self; 6] = [
        Self(0, 114, 178),
        Self(213, 94, 0),
        Self(0, 158, 115),
        Self(204, 121, 167),
        Self(86, 180, 233),
        Self(230, 159, 0),
    ];
}

impl TryFrom<String> for Color {
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        let digits = text.strip_prefix('#').filter(|d| d.len() == 6 && d.is_ascii());
        let part =
            |at: usize| digits.and_then(|digits| u8::from_str_radix(&digits[at..at + 2], 16).ok());
        match (part(0), part(2), part(4)) {
            (Some(r), Some(g), Some(b)) => Ok(Self(r, g, b)),
            _ => Err(format!("\"{text}\" is no colour: write it as #rrggbb")),
        }
    }
}

impl std::fmt::Display for Color {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        write!(f, "#{:02x}{:02x}{:02x}", self.0, self.1, self.2)
    }
}

/// Position of a figure's legend.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Legend {
    /// One legend for all panels, above them.
    Above,
    /// One legend for each panel, between its title and its axes.
    Each,
}

/// A figure, whose panels are arranged in rows.
#[derive(Clone, Debug)]
pub struct Figure {
    /// Heading above the whole figure, wrapped if it is long.
    pub title: String,
    /// Number of panels in a row, side by side.
    pub columns: usize,
    /// Position of the legend.
    pub legend: Legend,
    /// Panels of the figure, row by row.
    pub panels: Vec<Panel>,
}

impl Figure {
    /// Creates a figure with at most this number of panels in a row, whose legend is above them.
    pub fn new(title: String, columns: usize, panels: Vec<Panel>) -> Self {
        Self { title, columns: columns.min(panels.len()), legend: Legend::Above, panels }
    }
}

/// One pair of axes with its curves.
#[derive(Clone, Debug, Default)]
pub struct Panel {
    /// Heading of the panel, possibly empty.
    pub title: String,
    /// Label of the horizontal axis.
    pub x_label: String,
    /// Label of the vertical axis.
    pub y_label: String,
    /// Whether the horizontal axis is logarithmic.
    pub log_x: bool,
    /// Whether the vertical axis is logarithmic.
    pub log_y: bool,
    /// Range of the horizontal axis that is shown at first.
    pub x_range: Option<[f64; 2]>,
    /// Range of the vertical axis that is shown at first.
    pub y_range: Option<[f64; 2]>,
    /// Height with the labels, px, in place of that of all panels.
    pub height: Option<f64>,
    /// Curves of the panel; the first one is drawn lowest.
    pub curves: Vec<Curve>,
}

/// A sequence of points, and the way in which they are drawn. Points that are not finite are gaps.
#[derive(Clone, Debug)]
pub struct Curve {
    /// Name of the curve in the legend, which leaves out a curve without a name. Curves with the
    /// same name are shown and hidden together.
    pub name: String,
    /// Colour in which the curve is drawn.
    pub color: Color,
    /// Shape in which the points are drawn.
    pub shape: Shape,
    /// Coordinates along the horizontal axis.
    pub x: Vec<f64>,
    /// Coordinates along the vertical axis.
    pub y: Vec<f64>,
}

impl Curve {
    /// Creates a curve through points.
    pub fn new(name: &str, color: Color, shape: Shape, x: Vec<f64>, y: Vec<f64>) -> Self {
        Self { name: name.into(), color, shape, x, y }
    }
}

/// Returns a name with its unit, as labels and headings write them. Either may be empty.
pub fn with_unit(name: &str, unit: &str) -> String {
    let parts = [name, unit].into_iter().filter(|part| !part.is_empty());
    parts.collect::<Vec<_>>().join(", ")
}

/// Shape in which the points of a curve are drawn.
#[derive(Clone, Debug, PartialEq)]
pub enum Shape {
    /// A line through the points, whose dashes distinguish it from others.
    Line,
    /// A line through the points with the dashes of this number; that of 0 is solid.
    Patterned(usize),
    /// A thin line through the points.
    Thin,
    /// A thick, solid line through the points, for the norm that a limit is for.
    Bold,
    /// A thin, pale line through the points.
    Pale,
    /// A dashed line through the points.
    Dashed,
    /// A filled area between the points and these values.
    Band(Vec<f64>),
    /// Columns of a histogram: the value at an x holds up to the next x.
    Steps,
    /// A dot at each point.
    Dots,
    /// A large cross at each point.
    Crosses,
    /// A dashed line across the panel at the first y.
    Horizontal,
    /// A dashed line across the panel at the first x.
    Vertical,
}

impl Shape {
    /// Returns whether the shape is a straight line across the panel, such as a limit.
    pub fn is_straight(&self) -> bool {
        matches!(self, Self::Horizontal | Self::Vertical)
    }

    /// Returns the width of a line, px.
    fn width(&self) -> f64 {
        match self {
            Self::Thin | Self::Pale => 1.0,
            Self::Bold => 3.0,
            Self::Crosses => 2.4,
            _ => 1.8,
        }
    }

    /// Returns the opacity of an area.
    fn opacity(&self) -> f64 {
        if *self == Self::Steps { 0.45 } else { 0.25 }
    }
}

impl Panel {
    /// Creates a panel with these labels of the axes.
    pub fn new(x_label: &str, y_label: &str, curves: Vec<Curve>) -> Self {
        Self { x_label: x_label.into(), y_label: y_label.into(), curves, ..Self::default() }
    }

    /// Returns the smallest and the largest value along one axis, including lines across the panel;
    /// `None` if no value is finite.
    fn extent(&self, along_x: bool) -> Option<(f64, f64)> {
        let across = if along_x { Shape::Horizontal } else { Shape::Vertical };
        let within =
            |x: f64| self.x_range.is_none_or(|[low, high]| along_x || (low..=high).contains(&x));
        let mut values = self
            .curves
            .iter()
            .filter(|curve| curve.shape != across)
            .flat_map(|curve| {
                let lower =
                    if let Shape::Band(lower) = &curve.shape { lower.as_slice() } else { &[] };
                let inside = move |(x, v): (&f64, &f64)| {
                    (curve.shape == Shape::Horizontal || within(*x)).then_some(*v)
                };
                let axis = if along_x { &curve.x } else { &curve.y };
                let xs = if curve.shape == Shape::Horizontal { &curve.y } else { &curve.x };
                let lower = if along_x { &[] } else { lower };
                xs.iter().zip(axis).filter_map(inside).chain(lower.iter().copied())
            })
            .filter(|value| value.is_finite());
        let first = values.next()?;
        Some(values.fold((first, first), |(low, high), value| (low.min(value), high.max(value))))
    }

    /// Returns the range of values along one axis, with a margin for drawing.
    pub fn range(&self, along_x: bool) -> (f64, f64) {
        if let Some([low, high]) = if along_x { self.x_range } else { self.y_range } {
            return (low, high);
        }
        let is_logarithmic = if along_x { self.log_x } else { self.log_y };
        let Some((low, high)) = self.extent(along_x) else {
            return if is_logarithmic { (1.0, 10.0) } else { (0.0, 1.0) };
        };
        if is_logarithmic {
            // A logarithmic axis shows no zero.
            let high = if high > 0.0 { high } else { 10.0 };
            let low = if low > 0.0 { low } else { 1e-3 * high };
            return (low / 1.3, high * 1.3);
        }
        // An axis of time needs no margin.
        let is_time = along_x
            && self
                .curves
                .iter()
                .any(|c| matches!(c.shape, Shape::Line | Shape::Thin | Shape::Band(_)));
        let margin = if is_time { 0.0 } else { 0.06 * size(low, high) };
        let is_count = !along_x && self.curves.iter().any(|curve| curve.shape == Shape::Steps);
        // The name of a limit above everything else has room above its line.
        let highest = |curve: &Curve| curve.shape == Shape::Horizontal && curve.y.contains(&high);
        let is_limited = !along_x && self.curves.iter().any(highest);
        let above = if is_limited { 0.11 * size(low, high) } else { margin };
        (if is_count { 0.0 } else { low - margin }, high + above)
    }
}

/// Returns the size to which an axis from `low` to `high` is drawn. A value that does not change,
/// except for rounding, is drawn to its own magnitude, as the page of a run does.
fn size(low: f64, high: f64) -> f64 {
    let magnitude = low.abs().max(high.abs());
    if high - low > 1e-9 * magnitude {
        high - low
    } else if magnitude > 0.0 {
        magnitude
    } else {
        1.0 / 0.06
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn curve(shape: Shape, x: &[f64], y: &[f64]) -> Curve {
        Curve { name: "c".into(), color: Color::GREY, shape, x: x.to_vec(), y: y.to_vec() }
    }

    fn panel(curves: Vec<Curve>) -> Panel {
        Panel { curves, ..Panel::default() }
    }

    #[test]
    fn a_colour_is_six_digits() {
        assert_eq!(Color::try_from("#0a10ff".to_string()), Ok(Color(10, 16, 255)));
        assert_eq!(Color(10, 16, 255).to_string(), "#0a10ff");
        for text in ["0a10ff", "#0a10f", "#0a10fg", "#éé0"] {
            assert!(Color::try_from(text.to_string()).unwrap_err().contains(text));
        }
    }

    #[test]
    fn lines_across_the_panel_widen_the_axis_they_cut_only() {
        let panel = panel(vec![
            curve(Shape::Line, &[0.0, 1.0], &[2.0, f64::NAN]),
            curve(Shape::Band(vec![-1.0, 0.0]), &[0.0, 1.0], &[3.0, 4.0]),
            curve(Shape::Horizontal, &[f64::NAN], &[9.0]),
            curve(Shape::Vertical, &[5.0], &[f64::NAN]),
        ]);
        assert_eq!(panel.extent(true), Some((0.0, 5.0)));
        assert_eq!(panel.extent(false), Some((-1.0, 9.0)));
    }
}
