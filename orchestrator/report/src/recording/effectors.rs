//! Panels of the surfaces and jets of a vehicle over time.

use super::Recording;
use super::panels::{Curve, Panel, Role};
use cosim::experiment::Vehicle;

/// Number of surfaces in a panel, whose curves can be told apart.
const SURFACES: usize = 4;

/// Returns the panels of a run, which has this place among others: the deflections of its surfaces,
/// and the sum of the commands to its jets. What is not recorded is left out.
pub(super) fn of(run: &Recording, place: usize) -> Vec<Panel> {
    let Some(named) = &run.observe.vehicle else { return Vec::new() };
    surfaces(run, place, named).into_iter().chain(jets(run, place, named)).collect()
}

fn surfaces(run: &Recording, place: usize, named: &Vehicle) -> Vec<Panel> {
    let recorded = named.deflections.iter().enumerate();
    let recorded: Vec<_> = recorded
        .filter_map(|(at, path)| Some((named.surface(at), run.tracks.get(path)?)))
        .collect();
    let panels = recorded.chunks(SURFACES).enumerate().map(|(number, surfaces)| {
        let curves = surfaces.iter().enumerate().map(|(at, (name, track))| {
            let values = track.values.iter().map(|value| track.factor * value).collect();
            curve(name, place, at, values)
        });
        let further =
            if number == 0 { "surfaces".into() } else { format!("surfaces ({})", number + 1) };
        let unit = surfaces.first().map(|(_, track)| track.unit.clone()).unwrap_or_default();
        Panel { label: further, unit, curves: curves.collect(), ..Panel::default() }
    });
    panels.collect()
}

fn jets(run: &Recording, place: usize, named: &Vehicle) -> Option<Panel> {
    let tracks: Vec<_> = named.jets.iter().filter_map(|path| run.tracks.get(path)).collect();
    if tracks.is_empty() {
        return None;
    }
    let sum = |row: usize| tracks.iter().map(|track| track.values[row]).sum();
    let values = (0..run.time.len()).map(sum).collect();
    let label = "jets, sum of commands";
    Some(Panel {
        label: label.into(),
        curves: vec![curve(label, place, 0, values)],
        ..Panel::default()
    })
}

fn curve(name: &str, run: usize, place: usize, values: Vec<f64>) -> Curve {
    Curve { name: name.into(), run, place, role: Role::Signal, values }
}
