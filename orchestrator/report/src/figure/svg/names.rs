//! Names of straight lines such as limits, beside their lines where no curve is.

use super::axes::{Area, Axes};
use super::paint::escaped;
use crate::figure::clip::{Point, clipped};
use crate::figure::words::letters;
use crate::figure::{Curve, Panel, Shape};
use std::fmt::Write as _;

/// Width of a letter of a name, and its height, px.
const LETTER: f64 = 6.9;
const HEIGHT: f64 = 12.0;
/// Number of places along a line that are tried.
const PLACES: usize = 25;

/// A name, with the line at which its letters begin or end.
struct Name {
    x: f64,
    y: f64,
    anchor: &'static str,
    width: f64,
}

impl Name {
    /// Returns the upper left and the lower right corner of the letters.
    fn corners(&self) -> (Point, Point) {
        let left = if self.anchor == "end" { self.x - self.width } else { self.x };
        ((left, self.y - 0.8 * HEIGHT), (left + self.width, self.y + 0.2 * HEIGHT))
    }

    /// Returns how many parts of these lines cross the letters.
    fn crossings(&self, lines: &[Vec<Point>]) -> usize {
        let (low, high) = self.corners();
        let parts = lines.iter().flat_map(|line| line.windows(2));
        parts.filter(|pair| clipped(pair[0], pair[1], low, high).is_some()).count()
    }
}

/// Writes the names of straight lines beside them, each once.
pub(super) fn write(out: &mut String, panel: &Panel, axes: &Axes) {
    let mut lines: Vec<Vec<Point>> = Vec::new();
    for curve in &panel.curves {
        match curve.shape {
            Shape::Band(_) | Shape::Steps => {}
            Shape::Horizontal | Shape::Vertical => lines.push(straight(curve, axes)),
            Shape::Dots | Shape::Crosses => {
                let points = axes.runs(&curve.x, &curve.y).concat();
                lines.extend(points.into_iter().map(|point| around(point).to_vec()));
            }
            _ => lines.extend(axes.runs(&curve.x, &curve.y)),
        }
    }
    let mut named: Vec<&str> = Vec::new();
    for curve in panel.curves.iter().filter(|curve| curve.shape.is_straight()) {
        if named.contains(&curve.name.as_str()) {
            continue;
        }
        named.push(&curve.name);
        let width = LETTER * letters(&curve.name) as f64;
        let places = places(straight(curve, axes)[0], curve, width, axes.frame);
        let Some(name) = places.into_iter().min_by_key(|name| name.crossings(&lines)) else {
            continue;
        };
        let _ = write!(
            out,
            "<text class=\"small limit-name\" x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"{}\">{}</text>",
            name.x,
            name.y,
            name.anchor,
            escaped(&curve.name)
        );
        // A frame that no further name crosses.
        let ((left, top), (right, bottom)) = name.corners();
        let middle = f64::midpoint(top, bottom);
        lines.push(vec![(left, top), (right, bottom), (left, middle), (right, middle)]);
    }
}

/// Returns the ends of a straight line across the panel, px.
fn straight(curve: &Curve, axes: &Axes) -> Vec<Point> {
    let Area { x, y, width, height, .. } = axes.frame;
    let first = |values: &[f64]| values.first().copied().unwrap_or(f64::NAN);
    if curve.shape == Shape::Horizontal {
        let at = axes.y_at(first(&curve.y));
        vec![(x, at), (x + width, at)]
    } else {
        let at = axes.x_at(first(&curve.x));
        vec![(at, y), (at, y + height)]
    }
}

/// Returns the diagonals of a mark at a point.
fn around((x, y): Point) -> [Point; 4] {
    [(x - 3.0, y - 3.0), (x + 3.0, y + 3.0), (x - 3.0, y + 3.0), (x + 3.0, y - 3.0)]
}

/// Returns the places beside a line at which its name may stand, the best one first: at the right
/// or at the bottom, above a horizontal line and to the right of a vertical one.
fn places(line: Point, curve: &Curve, width: f64, frame: Area) -> Vec<Name> {
    let (right, bottom) = (frame.x + frame.width, frame.y + frame.height);
    let name = |x: f64, y: f64, anchor| Name { x, y, anchor, width };
    let is_horizontal = curve.shape == Shape::Horizontal;
    let room = if is_horizontal { frame.width - width - 8.0 } else { frame.height - HEIGHT - 8.0 };
    let all = (0..PLACES).flat_map(|place| {
        let back = room.max(0.0) * place as f64 / (PLACES - 1) as f64;
        if is_horizontal {
            [line.1 - 5.0, line.1 + 14.0].map(|y| name(right - 4.0 - back, y, "end"))
        } else {
            let y = bottom - 6.0 - back;
            [name(line.0 + 5.0, y, "start"), name(line.0 - 5.0, y, "end")]
        }
    });
    let fits = |name: &Name| {
        let ((left, top), (end, base)) = name.corners();
        left >= frame.x && end <= right && top >= frame.y && base <= bottom
    };
    let (mut fitting, others): (Vec<Name>, Vec<Name>) = all.partition(fits);
    if fitting.is_empty() {
        fitting = others;
    }
    fitting
}
