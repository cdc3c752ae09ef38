//! Draws a figure as SVG, for files and for pages. In a page, classes let its style sheet choose
//! the colours of paper and ink, and its script finds curves and axes.

mod axes;
mod names;
mod paint;
mod panel;

use super::dash::Dashes;
use super::words::{letters, shortened, wrapped};
use super::{Curve, Figure, Legend, Panel, Shape};
use axes::Area;
use cosim::error::Error;
use cosim::files;
use paint::{escaped, stroke};
use panel::{draw_panel, left_of};
use std::fmt::Write as _;
use std::path::Path;

/// Width of a figure, and height of a panel, px.
const WIDTH: f64 = 1000.0;
const HEIGHT: f64 = 250.0;
/// Height of a title of one line, of each further line, and of a row of the legend above the
/// panels, px.
const TITLE_HEIGHT: f64 = 34.0;
const TITLE_LINE: f64 = 22.0;
const LEGEND_HEIGHT: f64 = 22.0;
/// Largest number of letters of a line of the title, and of a name in a legend.
const TITLE_LETTERS: usize = 100;
/// Largest number of lines of the title.
const TITLE_LINES: usize = 4;
/// Width of a letter in the legend, and of the sample beside the name, px.
const LETTER: f64 = 7.2;
const SAMPLE: f64 = 56.0;

/// Colours of a file, which a page replaces. Text keeps its size on every screen.
const STYLE: &str = "text{font-family:sans-serif;font-size:13px;fill:#1c2530}.title{font-size:17px}.small{font-size:12px}\
.axis{stroke:#5b6875;fill:none}.grid{stroke:#e1e5e9;fill:none}.paper{fill:#fff}.ink{stroke:#1c2530}.limit{stroke:#5b6875}.limit-name{fill:#5b6875;stroke:#fff;stroke-width:3px;paint-order:stroke}";

/// Writes a figure to a file.
///
/// # Errors
/// Returns an error if the file cannot be written.
pub fn write(figure: &Figure, path: &Path) -> Result<(), Error> {
    files::write(path, text(figure))
}

/// Returns a figure as the text of an SVG file.
pub fn text(figure: &Figure) -> String {
    let style =
        format!("<style>{STYLE}</style><rect class=\"paper\" width=\"100%\" height=\"100%\"/>");
    document(figure, &style, true, WIDTH)
}

/// Returns a figure as an element of a page, whose style sheet has the colours, and whose heading
/// is elsewhere.
pub fn element(figure: &Figure) -> String {
    document(figure, "", false, WIDTH)
}

/// Returns a figure of half the width of others as an element of a page, like [`element`].
pub fn half(figure: &Figure) -> String {
    document(figure, "", false, WIDTH / 2.0)
}

fn document(figure: &Figure, begin: &str, titled: bool, whole: f64) -> String {
    let columns = figure.columns.max(1);
    let shared = Dashes::new(&figure.panels);
    let lines = match figure.legend {
        Legend::Above => {
            arrange(legend(figure.panels.iter().flat_map(|panel| &panel.curves)), whole)
        }
        Legend::Each => Vec::new(),
    };
    let title =
        if titled { wrapped(&figure.title, TITLE_LETTERS, TITLE_LINES) } else { Vec::new() };
    let further = TITLE_LINE * title.len().saturating_sub(1) as f64;
    let title_height = if title.is_empty() { 4.0 } else { TITLE_HEIGHT + further };
    let above = title_height + LEGEND_HEIGHT * lines.len() as f64;
    let width = whole / columns as f64;
    let rows = rows_of(figure, columns, width);
    let height = above + rows.iter().map(|row| row.height).sum::<f64>();
    let mut out = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{whole}\" height=\"{height}\" viewBox=\"0 0 {whole} {height}\" role=\"img\" aria-label=\"{}\">{begin}",
        escaped(&figure.title)
    );
    for (place, line) in title.iter().enumerate() {
        let (middle, y) = (whole / 2.0, 24.0 + TITLE_LINE * place as f64);
        let _ = write!(
            out,
            "<text class=\"title\" x=\"{middle}\" y=\"{y}\" text-anchor=\"middle\">{}</text>",
            escaped(line)
        );
    }
    draw_legend(&mut out, &lines, &shared, (64.0, title_height + 12.0));
    // Axes over one another begin at the same place.
    let left = figure.panels.iter().map(|panel| left_of(panel, HEIGHT)).fold(0.0, f64::max);
    let mut top = above;
    for (place, panel) in figure.panels.iter().enumerate() {
        let (row, x) = (&rows[place / columns], width * (place % columns) as f64);
        // Panels over the same axis have one label.
        let below = figure.panels.get(place + columns);
        let is_named = below.is_none_or(|below| below.x_label != panel.x_label);
        let own = Dashes::new(std::slice::from_ref(panel));
        let dashes = if figure.legend == Legend::Above { &shared } else { &own };
        let area = Area { x, y: top, width, height: row.height, legend: row.legend };
        draw_panel(&mut out, panel, dashes, area, left, is_named);
        match figure.legend {
            Legend::Above => {}
            Legend::Each => {
                let begin = top + panel::above(panel) + 11.0;
                let lines = arrange(legend(panel.curves.iter()), width);
                draw_legend(&mut out, &lines, dashes, (x + left, begin));
            }
        }
        if (place + 1) % columns == 0 {
            top += row.height;
        }
    }
    out.push_str("</svg>\n");
    out
}

/// A row of panels.
struct Row {
    /// Height with the labels, px.
    height: f64,
    /// Height of the legends above the axes, px.
    legend: f64,
}

/// Returns the rows of a figure, of which there is at least one.
fn rows_of(figure: &Figure, columns: usize, width: f64) -> Vec<Row> {
    let row = |panels: &[Panel]| {
        let lines = panels.iter().map(|panel| arrange(legend(panel.curves.iter()), width).len());
        let lines = lines.max().filter(|_| figure.legend == Legend::Each).unwrap_or(0);
        let legend = LEGEND_HEIGHT * lines as f64;
        let height = panels.iter().map(|panel| panel.height.unwrap_or(HEIGHT)).fold(0.0, f64::max);
        Row { height: height + legend, legend }
    };
    let rows: Vec<Row> = figure.panels.chunks(columns).map(row).collect();
    if rows.is_empty() { vec![Row { height: HEIGHT, legend: 0.0 }] } else { rows }
}

/// Returns the first curve of each name, for the legend. Straight lines have their names beside
/// them.
fn legend<'a>(curves: impl Iterator<Item = &'a Curve>) -> Vec<&'a Curve> {
    let mut entries: Vec<&Curve> = Vec::new();
    for curve in curves.filter(|curve| !curve.shape.is_straight() && !curve.name.is_empty()) {
        if !entries.iter().any(|entry| entry.name == curve.name) {
            entries.push(curve);
        }
    }
    entries
}

/// Arranges the entries of a legend in lines that fit this width, px.
fn arrange(entries: Vec<&Curve>, width: f64) -> Vec<Vec<&Curve>> {
    let mut lines: Vec<Vec<&Curve>> = Vec::new();
    let mut used = 0.0;
    for entry in entries {
        let needed = entry_width(entry);
        if lines.is_empty() || used + needed > width - 70.0 {
            lines.push(Vec::new());
            used = 0.0;
        }
        used += needed;
        if let Some(line) = lines.last_mut() {
            line.push(entry);
        }
    }
    lines
}

/// Draws a legend in lines, the first of which begins at this place.
fn draw_legend(out: &mut String, lines: &[Vec<&Curve>], dashes: &Dashes, (x, y): (f64, f64)) {
    for (row, line) in lines.iter().enumerate() {
        let mut at = (x, y + LEGEND_HEIGHT * row as f64);
        for curve in line {
            entry(out, curve, dashes, at);
            at.0 += entry_width(curve);
        }
    }
}

/// Draws an entry of a legend whose sample begins at this place.
fn entry(out: &mut String, curve: &Curve, dashes: &Dashes, (x, y): (f64, f64)) {
    let (name, paint) = (escaped(&curve.name), stroke(curve, dashes));
    let _ = write!(out, "<g class=\"entry\" data-name=\"{name}\">");
    let _ = match &curve.shape {
        Shape::Band(_) | Shape::Steps => write!(
            out,
            "<rect x=\"{x}\" y=\"{}\" width=\"26\" height=\"10\" fill=\"{}\" fill-opacity=\"{}\"/>",
            y - 5.0,
            curve.color,
            curve.shape.opacity()
        ),
        Shape::Dots => {
            write!(out, "<circle cx=\"{}\" cy=\"{y}\" r=\"3\" fill=\"{}\"/>", x + 13.0, curve.color)
        }
        Shape::Crosses => {
            write!(out, "<path d=\"M{} {}l10 10m0 -10l-10 10\" {paint}/>", x + 8.0, y - 5.0)
        }
        _ => write!(out, "<path d=\"M{x} {y}h28\" fill=\"none\" {paint}/>"),
    };
    let text = escaped(&shortened(&curve.name, TITLE_LETTERS));
    let _ = write!(out, "<text x=\"{}\" y=\"{}\">{text}</text></g>", x + 34.0, y + 4.5);
}

/// Returns the width that an entry of a legend takes, px.
fn entry_width(curve: &Curve) -> f64 {
    SAMPLE + LETTER * letters(&curve.name).min(TITLE_LETTERS) as f64
}

#[cfg(test)]
mod tests;
