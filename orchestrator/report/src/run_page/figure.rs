//! The panels of several recordings as a figure for SVG and PNG.

use super::thin;
use crate::figure::{self, Color, Figure, Legend, Shape};
use crate::recording::Recording;
use crate::recording::panels::{Curve, Panel, Role, symbols};

/// Largest number of letters of a run's name that a legend has room for.
const NAME: usize = 16;

/// Returns the figure of these panels.
pub fn figure(runs: &[Recording], panels: &[Panel]) -> Figure {
    let names = names(runs);
    let named = runs.iter().zip(&names);
    let numbered = named.map(|(run, name)| {
        if run.name == *name { name.clone() } else { format!("{name}\u{a0}{}", run.name) }
    });
    let title = match runs {
        [run] => run.title.clone(),
        _ => numbered.collect::<Vec<_>>().join(", "),
    };
    let panels = panels.iter().map(|panel| drawn(runs, &names, panel)).collect();
    Figure { title, columns: 1, legend: Legend::Beside, panels }
}

/// Returns the names of the runs in legends: numbers if the names are too long for them.
fn names(runs: &[Recording]) -> Vec<String> {
    let fits = runs.iter().all(|run| run.name.chars().count() <= NAME);
    let name = |(place, run): (usize, &Recording)| {
        if fits { run.name.clone() } else { format!("({})", place + 1) }
    };
    runs.iter().enumerate().map(name).collect()
}

fn drawn(runs: &[Recording], names: &[String], panel: &Panel) -> figure::Panel {
    let mut curves: Vec<figure::Curve> =
        panel.curves.iter().map(|curve| one(runs, names, panel, curve)).collect();
    // Later curves cover earlier ones.
    curves.sort_by_key(|curve| !matches!(curve.shape, Shape::Pale | Shape::Bold));
    curves.extend(panel.limits.iter().map(|limit| figure::Curve {
        name: panel.limit_name(limit, names),
        color: Color::LIMIT,
        shape: Shape::Horizontal,
        x: vec![f64::NAN],
        y: vec![limit.value],
    }));
    let parts = [symbols(&panel.label), panel.unit.clone()];
    let parts: Vec<String> = parts.into_iter().filter(|part| !part.is_empty()).collect();
    figure::Panel {
        x_label: "time, s".into(),
        y_label: parts.join(", "),
        curves,
        ..figure::Panel::default()
    }
}

fn one(runs: &[Recording], names: &[String], panel: &Panel, curve: &Curve) -> figure::Curve {
    let run = &runs[curve.run];
    // In a panel with one signal, the colour distinguishes the runs.
    let place = if panel.has_one_signal() { curve.run } else { curve.place };
    let own = Color::CURVES[place % Color::CURVES.len()];
    let (color, shape) = match curve.role {
        Role::Reference => (Color::INK, Shape::Pale),
        Role::OwnReference => (own, Shape::Pale),
        Role::Norm if runs.len() == 1 => (Color::INK, Shape::Bold),
        Role::Signal if !panel.limits.is_empty() => (own, Shape::Thin),
        _ => (own, Shape::Line),
    };
    let (x, y) = (thin::times(&run.time), thin::values(&curve.values));
    figure::Curve { name: panel.legend(curve, names), color, shape, x, y }
}
