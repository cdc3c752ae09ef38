//! The panels of several recordings as a figure for SVG and PNG.

use super::thin;
use crate::figure::{self, Color, Figure, Legend, Shape};
use crate::plot::COLORS;
use crate::recording::Recording;
use crate::recording::panels::{Curve, Panel, Role, symbols};

/// Returns the figure of these panels.
pub fn figure(runs: &[Recording], panels: &[Panel]) -> Figure {
    let title = match runs {
        [run] => run.title.clone(),
        _ => runs.iter().map(|run| run.name.as_str()).collect::<Vec<_>>().join(", "),
    };
    let panels = panels.iter().map(|panel| drawn(runs, panel)).collect();
    Figure { title, columns: 1, legend: Legend::Beside, panels }
}

fn drawn(runs: &[Recording], panel: &Panel) -> figure::Panel {
    let mut curves: Vec<figure::Curve> =
        panel.curves.iter().map(|curve| one(runs, panel, curve)).collect();
    // What is drawn first lies lowest.
    curves.sort_by_key(|curve| curve.shape != Shape::Pale);
    curves.extend(panel.limit.map(|limit| figure::Curve {
        name: "limit of norm".into(),
        color: Color::LIMIT,
        shape: Shape::Horizontal,
        x: vec![f64::NAN],
        y: vec![limit],
    }));
    let parts = [symbols(&panel.label), panel.unit.clone()];
    let parts: Vec<String> = parts.into_iter().filter(|part| !part.is_empty()).collect();
    figure::Panel {
        title: String::new(),
        x_label: "time, s".into(),
        y_label: parts.join(", "),
        log_x: false,
        x_range: None,
        curves,
    }
}

fn one(runs: &[Recording], panel: &Panel, curve: &Curve) -> figure::Curve {
    let run = &runs[curve.run];
    let name = match (runs.len(), curve.role) {
        (_, Role::Reference) => "thin: reference".to_string(),
        (1, _) => curve.name.clone(),
        _ => format!("{}, {}", curve.name, run.name),
    };
    // In a panel with one signal, the colour tells the runs apart.
    let alone = panel.curves.iter().all(|other| other.place == curve.place);
    let place = if alone { curve.run } else { curve.place };
    let shape = match curve.role {
        Role::Reference => Shape::Pale,
        Role::Norm if runs.len() == 1 => Shape::Pale,
        _ if curve.run % 2 == 1 => Shape::Dashed,
        _ => Shape::Line,
    };
    let color = match curve.role {
        Role::Reference => Color(0, 0, 0),
        Role::Norm if runs.len() == 1 => Color::GREY,
        _ => COLORS[place % COLORS.len()],
    };
    figure::Curve { name, color, shape, x: thin::times(&run.time), y: thin::values(&curve.values) }
}
