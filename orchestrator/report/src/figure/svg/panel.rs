//! One panel of a figure: axes, grid and curves.

use super::axes::{Area, Axes};
use super::names;
use super::paint::{escaped, stroke};
use crate::figure::dash::Dashes;
use crate::figure::thin::thinned;
use crate::figure::words::{letters, wrapped};
use crate::figure::{Curve, Panel, Shape, ticks};
use std::fmt::Write as _;

/// Space for labels to the left, at least, to the right, above and below the axes, px.
const LEFT: f64 = 64.0;
const RIGHT: f64 = 14.0;
const ABOVE: f64 = 10.0;
const TITLE: f64 = 18.0;
const BELOW: f64 = 40.0;
/// Height and width that a mark of an axis needs, px.
const MARK_HEIGHT: f64 = 38.0;
const MARK_WIDTH: f64 = 80.0;
/// Width of a letter of a mark, space of a mark beside its letters, and height of a line of the
/// label, px.
const LETTER: f64 = 7.5;
const BESIDE: f64 = 10.0;
const LINE: f64 = 15.0;
/// Largest number of letters of a line of the vertical axis's label, and of its lines.
const LABEL_LETTERS: usize = 30;
const LABEL_LINES: usize = 2;

/// Returns the space that a panel of this height needs to the left of its axes, px.
pub(super) fn left_of(panel: &Panel, height: f64) -> f64 {
    let height = height - above(panel) - BELOW;
    let longest = marks_y(panel, height).iter().map(|(_, text)| letters(text)).max();
    let lines = label(panel).len().max(1) as f64;
    LEFT.max(LINE * lines + BESIDE + LETTER * longest.unwrap_or(0) as f64)
}

/// Returns the space above a panel's axes without a legend, px.
pub(super) fn above(panel: &Panel) -> f64 {
    ABOVE + if panel.title.is_empty() { 0.0 } else { TITLE }
}

/// Returns the lines of the label of the vertical axis.
fn label(panel: &Panel) -> Vec<String> {
    wrapped(&panel.y_label, LABEL_LETTERS, LABEL_LINES)
}

/// Returns the marks of a vertical axis of this height, with their texts.
fn marks_y(panel: &Panel, height: f64) -> Vec<(f64, String)> {
    marks(panel.range(false), panel.log_y, ((height / MARK_HEIGHT) as usize).max(2))
}

/// Returns about `count` marks of an axis, with their texts.
fn marks((low, high): (f64, f64), is_logarithmic: bool, count: usize) -> Vec<(f64, String)> {
    let marks = if is_logarithmic {
        ticks::logarithmic(low, high)
    } else {
        ticks::linear(low, high, count)
    };
    let texts = ticks::labels(&marks, (!is_logarithmic).then_some(high - low));
    marks.into_iter().zip(texts).collect()
}

/// Draws a panel. A page's script finds ranges and frame in the attributes of its group.
pub(super) fn draw_panel(
    out: &mut String,
    panel: &Panel,
    dashes: &Dashes,
    area: Area,
    left_space: f64,
    names_x: bool,
) {
    let above = above(panel) + area.legend;
    let frame = Area {
        x: area.x + left_space,
        y: area.y + above,
        width: area.width - left_space - RIGHT,
        height: area.height - above - BELOW,
        ..area
    };
    let log = [panel.log_x, panel.log_y];
    let axes = Axes { x: panel.range(true), y: panel.range(false), log, frame };
    let Area { x, y, width, height, .. } = frame;
    let ((left, right), (bottom, top)) = (axes.x, axes.y);
    let _ = write!(
        out,
        "<g class=\"panel\" data-frame=\"{x} {y} {width} {height}\" data-x=\"{left:e} {right:e}\" data-y=\"{bottom:e} {top:e}\"{}>",
        if panel.log_x { " data-log=\"\"" } else { "" }
    );
    draw_axes(out, panel, &axes, area, names_x);
    // Every figure of a page has clips of its own, whose names may be equal: they are nested.
    let _ = write!(
        out,
        "<svg class=\"curves\" x=\"{x}\" y=\"{y}\" width=\"{width}\" height=\"{height}\" viewBox=\"{x} {y} {width} {height}\" preserveAspectRatio=\"none\">"
    );
    for curve in &panel.curves {
        draw_curve(out, curve, dashes, &axes);
    }
    out.push_str("</svg>");
    names::write(out, panel, &axes);
    out.push_str("</g>");
}

fn draw_axes(out: &mut String, panel: &Panel, axes: &Axes, area: Area, names_x: bool) {
    let Area { x, y, width, height, .. } = axes.frame;
    let (bottom, middle) = (y + height, x + width / 2.0);
    if !panel.title.is_empty() {
        let above = y - area.legend - 7.0;
        let title = escaped(&panel.title);
        let _ = write!(
            out,
            "<text x=\"{middle:.1}\" y=\"{above:.1}\" text-anchor=\"middle\">{title}</text>"
        );
    }
    out.push_str("<g class=\"marks-x small\" text-anchor=\"middle\">");
    for (mark, text) in marks(axes.x, panel.log_x, ((width / MARK_WIDTH) as usize).max(2)) {
        let at = axes.x_at(mark);
        let _ = write!(
            out,
            "<path class=\"grid\" d=\"M{at:.1} {y:.1}v{height:.1}\"/><text class=\"small\" x=\"{at:.1}\" y=\"{:.1}\">{text}</text>",
            bottom + 15.0
        );
    }
    out.push_str("</g><g class=\"marks-y small\" text-anchor=\"end\">");
    for (mark, text) in marks_y(panel, height) {
        let at = axes.y_at(mark);
        let _ = write!(
            out,
            "<path class=\"grid\" d=\"M{x:.1} {at:.1}h{width:.1}\"/><text class=\"small\" x=\"{:.1}\" y=\"{:.1}\">{text}</text>",
            x - 6.0,
            at + 4.0
        );
    }
    let _ = write!(out, "</g><path class=\"axis\" d=\"M{x:.1} {y:.1}v{height:.1}h{width:.1}\"/>");
    if names_x {
        let (below, label) = (bottom + 33.0, escaped(&panel.x_label));
        let _ = write!(
            out,
            "<text x=\"{middle:.1}\" y=\"{below:.1}\" text-anchor=\"middle\">{label}</text>"
        );
    }
    for (place, line) in label(panel).iter().enumerate() {
        let (side, centre) = (area.x + 14.0 + LINE * place as f64, y + height / 2.0);
        let _ = write!(
            out,
            "<text transform=\"translate({side:.1} {centre:.1}) rotate(-90)\" text-anchor=\"middle\">{}</text>",
            escaped(line)
        );
    }
}

fn draw_curve(out: &mut String, curve: &Curve, dashes: &Dashes, axes: &Axes) {
    let (name, paint) = (escaped(&curve.name), stroke(curve, dashes));
    let begin = format!("data-name=\"{name}\" vector-effect=\"non-scaling-stroke\"");
    let Area { x, y, width, height, .. } = axes.frame;
    let first = |values: &[f64]| values.first().copied().unwrap_or(f64::NAN);
    let area = format!("fill=\"{}\" fill-opacity=\"{}\"", curve.color, curve.shape.opacity());
    match &curve.shape {
        Shape::Line
        | Shape::Patterned(_)
        | Shape::Thin
        | Shape::Bold
        | Shape::Pale
        | Shape::Dashed => {
            for run in axes.runs(&curve.x, &curve.y) {
                let data = path(&thinned(&run));
                let _ = write!(
                    out,
                    "<path {begin} d=\"{data}\" fill=\"none\" stroke-linejoin=\"round\" {paint}/>"
                );
            }
        }
        Shape::Horizontal => {
            let at = axes.y_at(first(&curve.y));
            let _ = write!(out, "<path {begin} d=\"M{x:.1} {at:.1}h{width:.1}\" {paint}/>");
        }
        Shape::Vertical => {
            let at = axes.x_at(first(&curve.x));
            let _ = write!(out, "<path {begin} d=\"M{at:.1} {y:.1}v{height:.1}\" {paint}/>");
        }
        Shape::Band(lower) => {
            let sides = [axes.runs(&curve.x, &curve.y), axes.runs(&curve.x, lower)];
            let [upper, mut lower] = sides.map(|runs| thinned(&runs.concat()));
            lower.reverse();
            let data = path(&[upper, lower].concat());
            let _ = write!(out, "<path {begin} d=\"{data}Z\" {area}/>");
        }
        Shape::Steps => {
            let points = axes.runs(&curve.x, &curve.y).concat();
            let (Some(start), Some(end)) = (points.first(), points.last()) else { return };
            let mut data = format!("M{:.1} {:.1}", start.0, axes.y_at(0.0));
            for pair in points.windows(2) {
                let _ = write!(data, "V{:.1}H{:.1}", pair[0].1, pair[1].0);
            }
            let _ = write!(
                out,
                "<path {begin} d=\"{data}V{:.1}H{:.1}Z\" {area}/>",
                axes.y_at(0.0),
                end.0
            );
        }
        Shape::Dots => {
            for (at, height) in axes.runs(&curve.x, &curve.y).concat() {
                let _ = write!(
                    out,
                    "<circle {begin} cx=\"{at:.1}\" cy=\"{height:.1}\" r=\"3\" fill=\"{}\" fill-opacity=\"0.8\"/>",
                    curve.color
                );
            }
        }
        Shape::Crosses => {
            for (at, height) in axes.runs(&curve.x, &curve.y).concat() {
                let (left, top) = (at - 6.0, height - 6.0);
                let _ = write!(
                    out,
                    "<path {begin} d=\"M{left:.1} {top:.1}l12 12m0 -12l-12 12\" {paint}/>"
                );
            }
        }
    }
}

/// Returns a line through points as the data of a path, in fifths of a pixel and relative to the
/// point before, as short as possible.
pub(super) fn path(points: &[(f64, f64)]) -> String {
    let fifths = |value: i64| (value as f64 / 5.0).to_string();
    let mut places =
        points.iter().map(|(x, y)| ((x * 5.0).round() as i64, (y * 5.0).round() as i64));
    let Some(mut last) = places.next() else { return String::new() };
    let mut data = format!("M{} {}", fifths(last.0), fifths(last.1));
    let mut separator = "l";
    for next in places {
        if next != last {
            let (dx, dy) = (fifths(next.0 - last.0), fifths(next.1 - last.1));
            let _ = write!(data, "{separator}{dx} {dy}");
            (last, separator) = (next, " ");
        }
    }
    data.replace("l0.", "l.").replace(" 0.", " .").replace("-0.", "-.").replace(" -", "-")
}
