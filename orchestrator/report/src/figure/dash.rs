//! Dashes that distinguish the lines of a figure without their colours.

use super::{Curve, Panel, Shape};

/// Lengths of strokes and gaps of the patterns, px; the first one is a solid line.
const PATTERNS: [&[f64]; 6] = [
    &[],
    &[9.0, 4.0],
    &[2.5, 3.0],
    &[11.0, 3.5, 2.5, 3.5],
    &[18.0, 5.0],
    &[6.0, 3.0, 2.0, 3.0, 2.0, 3.0],
];

/// Patterns of the lines of panels. A name has the same pattern in each.
pub(super) struct Dashes<'a>(Vec<&'a str>);

impl<'a> Dashes<'a> {
    /// Assigns a pattern to the name of every line of panels that share a legend.
    pub(super) fn new(panels: &'a [Panel]) -> Self {
        let mut names: Vec<&str> = Vec::new();
        let curves = panels.iter().flat_map(|panel| &panel.curves);
        for curve in curves.filter(|curve| matches!(curve.shape, Shape::Line | Shape::Thin)) {
            if !names.contains(&curve.name.as_str()) {
                names.push(&curve.name);
            }
        }
        Self(names)
    }

    /// Returns strokes and gaps of a curve, px; nothing for a solid line.
    pub(super) fn of(&self, curve: &Curve) -> &'static [f64] {
        match curve.shape {
            Shape::Dashed | Shape::Horizontal | Shape::Vertical => &[6.0, 4.0],
            Shape::Line | Shape::Thin => {
                let place = self.0.iter().position(|name| *name == curve.name).unwrap_or(0);
                PATTERNS[place % PATTERNS.len()]
            }
            Shape::Patterned(place) => PATTERNS[place % PATTERNS.len()],
            _ => &[],
        }
    }
}
