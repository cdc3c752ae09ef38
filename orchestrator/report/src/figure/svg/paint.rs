//! Attributes of lines, and texts within elements.

use crate::figure::dash::Dashes;
use crate::figure::{Color, Curve, Shape};
use std::fmt::Write as _;

/// Returns the attributes of a curve's line. Lines in black are drawn in the ink of the page.
pub(super) fn stroke(curve: &Curve, dashes: &Dashes) -> String {
    let mut text = if curve.shape.is_straight() {
        "class=\"limit\"".to_string()
    } else if curve.color == Color::INK {
        "class=\"ink\"".to_string()
    } else {
        format!("stroke=\"{}\"", curve.color)
    };
    let _ = write!(text, " stroke-width=\"{}\"", curve.shape.width());
    if curve.shape == Shape::Pale {
        text.push_str(" stroke-opacity=\"0.6\"");
    }
    let dash = dashes.of(curve);
    if !dash.is_empty() {
        let lengths: Vec<String> = dash.iter().map(f64::to_string).collect();
        let _ = write!(text, " stroke-dasharray=\"{}\"", lengths.join(" "));
    }
    text
}

/// Escapes a text for an element or an attribute.
pub(super) fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}
