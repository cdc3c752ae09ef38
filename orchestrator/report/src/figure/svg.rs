//! Draws a figure as SVG.

use super::{Color, Curve, Figure, Legend, Panel, Shape};
use cosim::error::Error;
use cosim::files;
use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::Color as _;
use std::path::Path;

type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;
type DrawError = Box<dyn std::error::Error>;

const FONT: &str = "sans-serif";
/// Width of a figure, width of a legend beside a panel, and height of a panel, px.
const WIDTH: u32 = 1000;
const LEGEND_WIDTH: u32 = 120;
const HEIGHT: u32 = 260;
/// Height of the title, and of a row of the legend above the panels, px.
const TITLE_HEIGHT: u32 = 40;
const LEGEND_HEIGHT: u32 = 20;
/// Largest width of a letter in the legend, px.
const LETTER: u32 = 7;

impl From<Color> for RGBColor {
    fn from(Color(r, g, b): Color) -> Self {
        Self(r, g, b)
    }
}

/// Writes a figure to a file.
///
/// # Errors
/// Returns an error if the file cannot be written.
pub fn write(figure: &Figure, path: &Path) -> Result<(), Error> {
    files::write(path, text(figure).map_err(|error| Error::file(path)(error))?)
}

/// Draws a figure as the text of an SVG file.
///
/// # Errors
/// Returns an error if a part of the figure cannot be drawn.
pub fn text(figure: &Figure) -> std::io::Result<String> {
    let mut text = String::new();
    draw(figure, &mut text).map_err(|error| std::io::Error::other(error.to_string()))?;
    Ok(text)
}

fn draw(figure: &Figure, text: &mut String) -> Result<(), DrawError> {
    let columns = figure.columns.max(1);
    let rows = figure.panels.len().div_ceil(columns).max(1);
    let entries = match figure.legend {
        Legend::Above => legend(figure.panels.iter().flat_map(|panel| &panel.curves)),
        Legend::Beside => Vec::new(),
    };
    let lines = arrange(&entries);
    let above = LEGEND_HEIGHT * lines.len() as u32 + if lines.is_empty() { 0 } else { 6 };
    let height = TITLE_HEIGHT + above + HEIGHT * rows as u32;
    let root = SVGBackend::with_string(text, (WIDTH, height)).into_drawing_area();
    root.fill(&WHITE)?;
    let root = root.titled(&figure.title, (FONT, 20))?;
    let (top, panels) = root.split_vertically(above);
    for (y, line) in (4..).step_by(LEGEND_HEIGHT as usize).zip(&lines) {
        let mut x = 70;
        for curve in line {
            x = draw_entry(curve, &top, (x, y))?;
        }
    }
    let areas = panels.split_evenly((rows, columns));
    for (place, (panel, area)) in figure.panels.iter().zip(&areas).enumerate() {
        let lowest = place + columns >= figure.panels.len();
        match figure.legend {
            Legend::Above => draw_panel(panel, area, lowest)?,
            Legend::Beside => {
                let (left, right) = area.split_horizontally(WIDTH / columns as u32 - LEGEND_WIDTH);
                draw_panel(panel, &left, lowest)?;
                for (y, curve) in (14..).step_by(18).zip(legend(panel.curves.iter())) {
                    draw_entry(curve, &right, (0, y))?;
                }
            }
        }
    }
    root.present()?;
    Ok(())
}

/// Returns the first curve of each name, for the legend.
fn legend<'a>(curves: impl Iterator<Item = &'a Curve>) -> Vec<&'a Curve> {
    let mut entries: Vec<&Curve> = Vec::new();
    for curve in curves {
        if !entries.iter().any(|entry| entry.name == curve.name) {
            entries.push(curve);
        }
    }
    entries
}

/// Arranges the entries of a legend in lines that fit the width of the figure.
fn arrange<'a>(entries: &[&'a Curve]) -> Vec<Vec<&'a Curve>> {
    let mut lines: Vec<Vec<&Curve>> = Vec::new();
    let mut used = 0;
    for entry in entries {
        let width = entry_width(entry);
        if lines.is_empty() || used + width > WIDTH - 90 {
            lines.push(Vec::new());
            used = 0;
        }
        used += width;
        if let Some(line) = lines.last_mut() {
            line.push(entry);
        }
    }
    lines
}

/// Draws an entry of a legend and returns the horizontal position at which the next one may begin.
fn draw_entry(curve: &Curve, area: &Area, (x, y): (i32, i32)) -> Result<i32, DrawError> {
    let color = RGBColor::from(curve.color);
    let middle = y + 7;
    match &curve.shape {
        Shape::Band(_) | Shape::Steps => {
            area.draw(&Rectangle::new(
                [(x, middle - 5), (x + 20, middle + 5)],
                color.mix(fill(&curve.shape)).filled(),
            ))?;
        }
        Shape::Dots => area.draw(&Circle::new((x + 10, middle), 3, color.filled()))?,
        Shape::Crosses => area.draw(&Cross::new((x + 10, middle), 6, color.stroke_width(2)))?,
        shape if is_dashed(shape) => {
            for start in [x, x + 12] {
                area.draw(&PathElement::new([(start, middle), (start + 8, middle)], style(curve)))?;
            }
        }
        _ => area.draw(&PathElement::new([(x, middle), (x + 20, middle)], style(curve)))?,
    }
    area.draw(&Text::new(curve.name.clone(), (x + 26, y + 1), (FONT, 13)))?;
    Ok(x + entry_width(curve).cast_signed())
}

/// Returns the width that an entry of a legend takes, px.
fn entry_width(curve: &Curve) -> u32 {
    50 + LETTER * curve.name.chars().count() as u32
}

fn is_dashed(shape: &Shape) -> bool {
    matches!(shape, Shape::Dashed | Shape::Horizontal | Shape::Vertical)
}

/// Returns the opacity of an area.
fn fill(shape: &Shape) -> f64 {
    if *shape == Shape::Steps { 0.45 } else { 0.25 }
}

fn style(curve: &Curve) -> ShapeStyle {
    let color = RGBColor::from(curve.color);
    match curve.shape {
        Shape::Pale => color.mix(0.55).stroke_width(1),
        Shape::Dashed | Shape::Horizontal | Shape::Vertical => color.stroke_width(2),
        _ => color.mix(0.9).stroke_width(2),
    }
}

fn draw_panel(panel: &Panel, area: &Area, lowest: bool) -> Result<(), DrawError> {
    // A logarithmic axis is drawn as a linear axis of the logarithm, with other labels.
    let place = |x: f64| if panel.log_x { x.log10() } else { x };
    let (left, right) = panel.range(true);
    let (left, right) = (place(left), place(right));
    let (bottom, top) = panel.range(false);
    let mut builder = ChartBuilder::on(area);
    builder
        .margin(6)
        .margin_right(16)
        .x_label_area_size(if lowest { 36 } else { 20 })
        .y_label_area_size(66);
    if !panel.title.is_empty() {
        builder.caption(&panel.title, (FONT, 15));
    }
    let mut chart = builder.build_cartesian_2d(left..right, bottom..top)?;
    let decade = |x: &f64| {
        let whole = (x - x.round()).abs() < 1e-9;
        if whole { plain(10_f64.powf(x.round()), 3) } else { String::new() }
    };
    let label_x = |x: &f64| if panel.log_x { decade(x) } else { plain(*x, decimals(right - left)) };
    // Long labels are few, so that they do not touch each other: about 7 pixels for each digit.
    let longest = [left, right].map(|end| label_x(&end).chars().count()).into_iter().max();
    let room = area.dim_in_pixel().0 as usize / (7 * longest.unwrap_or(0) + 14);
    let label_y = |y: &f64| plain(*y, decimals(top - bottom));
    let mut mesh = chart.configure_mesh();
    mesh.y_desc(&panel.y_label)
        .label_style((FONT, 13))
        .axis_desc_style((FONT, 14))
        .light_line_style(TRANSPARENT)
        .x_labels(room.clamp(3, 11))
        .y_labels(7)
        .x_label_formatter(&label_x)
        .y_label_formatter(&label_y);
    if lowest {
        mesh.x_desc(&panel.x_label);
    }
    mesh.draw()?;

    for curve in &panel.curves {
        let color = RGBColor::from(curve.color);
        let points: Vec<(f64, f64)> = curve
            .x
            .iter()
            .zip(&curve.y)
            .map(|(&x, &y)| (place(x), y))
            .filter(|(x, y)| (left..=right).contains(x) && y.is_finite())
            .collect();
        match &curve.shape {
            Shape::Line | Shape::Pale => {
                chart.draw_series(LineSeries::new(points, style(curve)))?;
            }
            Shape::Dashed => {
                chart.draw_series(DashedLineSeries::new(points, 6, 4, style(curve)))?;
            }
            Shape::Horizontal => {
                let at = curve.y.first().copied().unwrap_or(f64::NAN);
                chart.draw_series(DashedLineSeries::new(
                    [(left, at), (right, at)],
                    6,
                    4,
                    style(curve),
                ))?;
            }
            Shape::Vertical => {
                let at = place(curve.x.first().copied().unwrap_or(f64::NAN));
                chart.draw_series(DashedLineSeries::new(
                    [(at, bottom), (at, top)],
                    6,
                    4,
                    style(curve),
                ))?;
            }
            Shape::Band(lower) => {
                let lower = curve.x.iter().zip(lower).rev().map(|(&x, &y)| (place(x), y));
                let lower = lower.filter(|(x, y)| (left..=right).contains(x) && y.is_finite());
                let outline: Vec<(f64, f64)> = points.into_iter().chain(lower).collect();
                chart.draw_series([Polygon::new(outline, color.mix(fill(&curve.shape)))])?;
            }
            Shape::Steps => {
                let corners = points.windows(2).flat_map(|pair| [pair[0], (pair[1].0, pair[0].1)]);
                let base =
                    [points.last(), points.first()].into_iter().flatten().map(|(x, _)| (*x, 0.0));
                let outline: Vec<(f64, f64)> = corners.chain(base).collect();
                chart.draw_series([Polygon::new(outline, color.mix(fill(&curve.shape)))])?;
            }
            Shape::Dots => {
                chart.draw_series(
                    points.into_iter().map(|at| Circle::new(at, 3, color.mix(0.8).filled())),
                )?;
            }
            Shape::Crosses => {
                chart.draw_series(
                    points.into_iter().map(|at| Cross::new(at, 7, color.stroke_width(2))),
                )?;
            }
        }
    }
    Ok(())
}

/// Returns the number of digits after the point that is needed to tell the labels of an axis apart.
fn decimals(range: f64) -> usize {
    // An axis has about six labels.
    (-(range / 6.0).log10().floor()).clamp(0.0, 12.0) as usize
}

/// Formats a number with at most this many digits after the point, without `-0` and without
/// trailing zeros.
fn plain(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    let text =
        if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { &text };
    if text == "-0" { "0".into() } else { text.into() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn labels_are_as_short_as_they_can_be() {
        assert_eq!((decimals(50.0), decimals(6.0), decimals(0.4)), (0, 0, 2));
        let labels =
            [(10.0, 0), (0.5, 1), (-0.0, 2), (1e-9, 2), (2.50, 2)].map(|(v, d)| plain(v, d));
        assert_eq!(labels, ["10", "0.5", "0", "0", "2.5"]);
    }

    #[test]
    fn what_lies_outside_the_range_is_not_drawn() {
        let panel = Panel {
            title: String::new(),
            x_label: String::new(),
            y_label: String::new(),
            log_x: false,
            x_range: Some([0.0, 1.0]),
            curves: vec![Curve {
                name: "c".into(),
                color: Color(1, 2, 3),
                shape: Shape::Line,
                x: vec![0.0, 1.0, 2.0],
                y: vec![0.0, 1.0, 0.5],
            }],
        };
        let figure =
            Figure { title: String::new(), columns: 1, legend: Legend::Above, panels: vec![panel] };
        let text = text(&figure).unwrap();
        let curve = text
            .lines()
            .find(|line| line.contains("polyline") && line.contains("#010203"))
            .unwrap();
        let points = curve.split("points=\"").nth(1).unwrap().split('"').next().unwrap();
        assert_eq!(points.split_whitespace().count(), 2, "{curve}");
    }
}
