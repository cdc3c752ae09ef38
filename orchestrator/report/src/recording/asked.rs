//! Panels that experiments and readers ask for.

use super::effectors;
use super::panels::{CURVES, Curve, Panel, Role, symbols};
use super::{Recording, Series};
use cosim::experiment::{self, Scaled};
use cosim::signal::{Signal, Term};
use fmi_master::names;
use std::collections::BTreeSet;

/// Largest number of variables that are drawn if none are chosen.
pub(super) const UNASKED: usize = 24;

/// Returns the panels of the experiments of these recordings; if there are none, all recorded
/// variables, up to a sensible number.
///
/// # Errors
/// Returns an error if the units of a panel differ.
pub fn of_experiments(runs: &[Recording]) -> Result<Vec<Panel>, String> {
    let mut panels: Vec<Panel> = Vec::new();
    for (place, run) in runs.iter().enumerate() {
        for asked in &run.observe.panels {
            let panel = of_experiment(run, place, asked)?;
            match panels.iter_mut().find(|p| (&p.label, &p.unit) == (&panel.label, &panel.unit)) {
                Some(there) => there.join(panel),
                None if panel.curves.is_empty() => {}
                None => panels.push(panel),
            }
        }
    }
    let drawn = if panels.is_empty() { &[] } else { runs };
    for (place, run) in drawn.iter().enumerate() {
        for panel in effectors::of(run, place) {
            match panels.iter_mut().find(|p| p.label == panel.label) {
                Some(there) => there.join(panel),
                None => panels.push(panel),
            }
        }
    }
    if panels.is_empty() {
        let mut seen = BTreeSet::new();
        let all = runs.iter().flat_map(|run| &run.recorded);
        let all: Vec<String> = all.filter(|name| seen.insert(*name)).cloned().collect();
        return grouped(runs, all.into_iter().take(UNASKED).map(|name| (stem(&name).into(), name)));
    }
    let panels = panels.into_iter().flat_map(|panel| panel.divided(runs));
    Ok(panels.flat_map(Panel::with_visible_limits).collect())
}

fn of_experiment(
    run: &Recording,
    place: usize,
    asked: &experiment::Panel,
) -> Result<Panel, String> {
    let label = if asked.label.is_empty() { &asked.name } else { &asked.label };
    let mut panel = Panel { label: label.clone(), ..Panel::default() };
    if asked.optional && asked.curves.iter().any(|curve| run.series(&curve.of).is_err()) {
        return Ok(panel);
    }
    let mut unit: Option<String> = None;
    let mut drawn = |signal: &Signal| {
        let Series { unit: other, mut values } = run.series(signal).ok()?;
        let shown: Option<&Scaled> =
            asked.unit.as_ref().or_else(|| run.observe.units.get(other.as_str()));
        for value in &mut values {
            *value *= shown.map_or(1.0, |shown| shown.factor);
        }
        let other = shown.map_or(other, |shown| shown.name.clone());
        Some((unit.get_or_insert_with(|| other.clone()).clone() == other).then_some(values))
    };
    let mixed = || format!("panel \"{}\" mixes units", asked.name);
    for (position, curve) in asked.curves.iter().enumerate() {
        let reference = curve.reference.as_ref().and_then(&mut drawn);
        // Only recorded signals can be drawn.
        let Some(values) = drawn(&curve.of) else { continue };
        let mut add = |role, values: Option<Vec<f64>>| {
            let (name, values) = (symbols(&curve.name), values.ok_or_else(mixed)?);
            panel.curves.push(Curve { name, run: place, place: position, role, values });
            Ok::<(), String>(())
        };
        add(Role::Signal, values)?;
        if let Some(reference) = reference {
            add(Role::Reference, reference)?;
        }
    }
    let limit = asked.limit.as_ref().and_then(&mut drawn).flatten();
    panel.unit = unit.unwrap_or_default();
    if let (Some(limit), false) = (limit, panel.curves.is_empty()) {
        panel.limit(place, limit.last().copied().filter(|limit| limit.is_finite()));
    }
    Ok(panel)
}

/// Returns panels of these signals: names, patterns with an asterisk, or differences and norms as
/// experiments write them.
///
/// # Errors
/// Returns an error with the nearest name if a signal is recorded in none of the runs.
pub fn of_signals(runs: &[Recording], asked: &[String]) -> Result<Vec<Panel>, String> {
    let mut seen = BTreeSet::new();
    let mut names = Vec::new();
    for asked in asked {
        for name in matching(runs, asked)? {
            if seen.insert(name.clone()) {
                // Signals that are named one by one are compared.
                let group = if asked.contains('*') { stem(&name) } else { "" };
                names.push((group.to_string(), name));
            }
        }
    }
    grouped(runs, names.into_iter())
}

/// Returns panels of signals with the groups in which they are drawn together.
fn grouped(
    runs: &[Recording],
    names: impl Iterator<Item = (String, String)>,
) -> Result<Vec<Panel>, String> {
    let mut panels: Vec<Panel> = Vec::new();
    for (group, name) in names {
        let signal = signal(runs, &name)?;
        let mut series = Vec::new();
        let mut fault = None;
        for (run, recording) in runs.iter().enumerate() {
            match recording.series(&signal) {
                Ok(values) => series.push((run, values)),
                Err(problem) => fault = fault.or(Some(problem)),
            }
        }
        if series.is_empty() {
            return Err(fault.unwrap_or_else(|| format!("{name}: there is no run")));
        }
        add(&mut panels, runs, (&group, &name), series);
    }
    panels.iter_mut().for_each(Panel::shorten);
    Ok(panels)
}

/// Returns the signal of this name. A file of another program may call its columns as it likes.
fn signal(runs: &[Recording], name: &str) -> Result<Signal, String> {
    if runs.iter().any(|run| run.recorded.iter().any(|recorded| recorded == name)) {
        let terms = vec![Term::single(name.to_string())];
        return Ok(Signal { terms, norm: false, over: None });
    }
    Signal::try_from(name.to_string())
}

/// Adds a signal to the panel of its unit and group that has room for it.
fn add(
    panels: &mut Vec<Panel>,
    runs: &[Recording],
    (group, name): (&str, &str),
    series: Vec<(usize, Series)>,
) {
    let room = CURVES / runs.len().max(1);
    for (run, Series { unit, values }) in series {
        let shown = runs[run].observe.units.get(&unit);
        let factor = shown.map_or(1.0, |shown| shown.factor);
        let values = values.iter().map(|value| factor * value).collect();
        let unit = shown.map_or(unit, |shown| shown.name.clone());
        let fits = |panel: &Panel| {
            let names: BTreeSet<&str> =
                panel.curves.iter().map(|curve| curve.name.as_str()).collect();
            panel.unit == unit
                && panel.label == group
                && (names.contains(name) || names.len() < room.max(1))
        };
        let position = panels.iter().position(fits).unwrap_or(panels.len());
        if position == panels.len() {
            panels.push(Panel { label: group.into(), unit, ..Panel::default() });
        }
        let panel = &mut panels[position];
        let there = panel.curves.iter().find(|curve| curve.name == name).map(|curve| curve.place);
        let next = panel.curves.iter().map(|curve| curve.place + 1).max().unwrap_or(0);
        let place = there.unwrap_or(next);
        panel.curves.push(Curve { name: name.into(), run, place, role: Role::Signal, values });
    }
}

/// Returns the signals of a name or pattern.
fn matching(runs: &[Recording], asked: &str) -> Result<Vec<String>, String> {
    if !asked.contains('*') {
        return Ok(vec![asked.to_string()]);
    }
    let mut found: Vec<String> = Vec::new();
    for name in runs.iter().flat_map(|run| &run.recorded) {
        if names::matches(asked, name) && !found.contains(name) {
            found.push(name.clone());
        }
    }
    if found.is_empty() {
        let all: BTreeSet<&str> =
            runs.iter().flat_map(|run| &run.recorded).map(String::as_str).collect();
        let hint = names::hint(&asked.replace('*', ""), all.iter().copied());
        return Err(format!("no recorded variable matches \"{asked}\"{hint}"));
    }
    Ok(found)
}

/// Returns the name of a variable before its last part; nothing for a combination.
fn stem(name: &str) -> &str {
    if name.contains(' ') || name.contains('(') {
        return "";
    }
    let end = name.rfind(['.', '[']).unwrap_or(0);
    &name[..end]
}

#[cfg(test)]
mod tests;
