//! The panels of several recordings as a figure for SVG and PNG.

use super::thin;
use crate::figure::{self, Color, Figure, Legend, Shape, with_unit};
use crate::recording::Recording;
use crate::recording::panels::{Curve, Panel, Role, symbols};
use crate::recording::trajectory;

/// Largest number of letters of a run's name that a legend has room for.
const NAME: usize = 16;

/// Returns the figure of what the experiments ask for: these panels, behind those of a flight.
pub fn figure(runs: &[Recording], panels: &[Panel]) -> Figure {
    arranged(runs, panels, trajectory::panels(runs, &names(runs)))
}

/// Returns the figure of these panels alone.
pub fn of_panels(runs: &[Recording], panels: &[Panel]) -> Figure {
    arranged(runs, panels, Vec::new())
}

fn arranged(runs: &[Recording], panels: &[Panel], flights: Vec<figure::Panel>) -> Figure {
    let names = names(runs);
    let named = runs.iter().zip(&names);
    let numbered = named.map(|(run, name)| {
        if run.name == *name { name.clone() } else { format!("{name}\u{a0}{}", run.name) }
    });
    let title = match runs {
        [run] => run.title.clone(),
        _ => numbered.collect::<Vec<_>>().join(", "),
    };
    let (columns, legend) = (if flights.is_empty() { 1 } else { 2 }, Legend::Each);
    let over_time = panels.iter().map(|panel| drawn(runs, &names, panel));
    Figure { title, columns, legend, panels: flights.into_iter().chain(over_time).collect() }
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
    if let Some([low, _]) = panel.magnitudes {
        let drawn = curves.iter_mut().filter(|curve| !curve.shape.is_straight());
        drawn.flat_map(|curve| &mut curve.y).for_each(|y| *y = y.abs().max(low));
    }
    figure::Panel {
        log_y: panel.magnitudes.is_some(),
        x_range: span(runs),
        y_range: panel.magnitudes,
        ..figure::Panel::new("time, s", &with_unit(&symbols(&panel.label), &panel.unit), curves)
    }
}

/// Returns the times from the first row to the last one of these runs.
fn span(runs: &[Recording]) -> Option<[f64; 2]> {
    let first = runs.iter().filter_map(|run| run.time.first()).copied().reduce(f64::min)?;
    let last = runs.iter().filter_map(|run| run.time.last()).copied().reduce(f64::max)?;
    (first < last).then_some([first, last])
}

fn one(runs: &[Recording], names: &[String], panel: &Panel, curve: &Curve) -> figure::Curve {
    let run = &runs[curve.run];
    // Colours distinguish the signals of a run, or several runs, whose signals then have dashes.
    let is_alone = runs.len() == 1;
    let own = Color::CURVES[if is_alone { curve.place } else { curve.run } % Color::CURVES.len()];
    let has_norm = || panel.curves.iter().any(|curve| curve.role == Role::Norm);
    let (color, shape) = match curve.role {
        Role::Reference => (Color::INK, Shape::Pale),
        Role::OwnReference => (own, Shape::Pale),
        Role::Norm if is_alone => (Color::INK, Shape::Bold),
        Role::Signal if is_alone && has_norm() => (own, Shape::Thin),
        _ if is_alone => (own, Shape::Line),
        _ => (own, Shape::Patterned(curve.place)),
    };
    let (x, y) = (thin::times(&run.time), thin::values(&curve.values));
    figure::Curve { name: panel.legend(curve, names), color, shape, x, y }
}
