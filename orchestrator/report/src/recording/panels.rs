//! Panels in which several recordings are drawn over one another.

use super::cover::covers;
use super::{Recording, Series};
use cosim::experiment::{self, Scaled};
use cosim::signal::{Signal, Term};
use fmi_master::names;
use std::collections::BTreeSet;
use std::iter;

/// Largest number of curves in a panel, beside references, norms and limits.
pub const CURVES: usize = 6;
/// Largest number of variables that are drawn if none are chosen.
pub(super) const UNASKED: usize = 24;

/// A panel with curves of one unit.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Panel {
    /// Label of the vertical axis without the unit.
    pub label: String,
    /// Unit of all values, or an empty text.
    pub unit: String,
    /// Curves of the panel.
    pub curves: Vec<Curve>,
    /// Limits of the norm of all curves, each value once.
    pub limits: Vec<Limit>,
}

/// A limit of the norm of all curves of a panel.
#[derive(Clone, Debug, PartialEq)]
pub struct Limit {
    /// Value of the limit, in the unit of the panel.
    pub value: f64,
    /// Places of the runs that have this limit.
    pub runs: Vec<usize>,
}

/// A curve of a panel.
#[derive(Clone, Debug, PartialEq)]
pub struct Curve {
    /// Name of the curve in the legend, without that of the run.
    pub name: String,
    /// Place of the run among the recordings.
    pub run: usize,
    /// Place of the signal in the panel, by which it has its colour.
    pub place: usize,
    /// The quantity that the curve shows.
    pub role: Role,
    /// Values, one for each row of the recording.
    pub values: Vec<f64>,
}

/// The quantity that a curve shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// A signal.
    Signal,
    /// Reference of a signal: in the first run that has it, and in the others as well unless they
    /// have their own.
    Reference,
    /// Reference of a signal of this run, where it differs from the first run's.
    OwnReference,
    /// The norm of all signals of the panel, which its limit is for.
    Norm,
}

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
    if panels.is_empty() {
        let mut seen = BTreeSet::new();
        let all = runs.iter().flat_map(|run| &run.recorded);
        let all: Vec<String> = all.filter(|name| seen.insert(*name)).cloned().collect();
        return grouped(runs, all.into_iter().take(UNASKED).map(|name| (stem(&name).into(), name)));
    }
    Ok(panels.into_iter().flat_map(|panel| panel.divided(runs)).collect())
}

fn of_experiment(
    run: &Recording,
    place: usize,
    asked: &experiment::Panel,
) -> Result<Panel, String> {
    let label = if asked.label.is_empty() { &asked.name } else { &asked.label };
    let mut panel = Panel { label: label.clone(), ..Panel::default() };
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

impl Panel {
    /// Returns whether all curves of the panel are of one signal, so that colours can distinguish
    /// the runs.
    pub fn has_one_signal(&self) -> bool {
        self.curves.iter().all(|curve| curve.place == self.curves[0].place)
    }

    /// Returns the text of a curve in the legend; it is empty if the label of the panel says all.
    /// `names` are those of the runs, of which a single one need not be named.
    pub fn legend(&self, curve: &Curve, names: &[String]) -> String {
        let run = names.get(curve.run).filter(|_| names.len() > 1).map_or("", String::as_str);
        let text = match curve.role {
            Role::Reference => return "reference".into(),
            Role::OwnReference if self.has_one_signal() => "reference".into(),
            Role::OwnReference => format!("reference of {}", curve.name),
            // The norms of several runs have a panel of their own.
            Role::Norm if !run.is_empty() => String::new(),
            _ if curve.name == symbols(&self.label) => String::new(),
            _ => curve.name.clone(),
        };
        let parts = [text.as_str(), run];
        parts.into_iter().filter(|part| !part.is_empty()).collect::<Vec<_>>().join(", ")
    }

    /// Returns the text beside a limit, with the names of its runs if the limits of others differ.
    pub fn limit_name(&self, limit: &Limit, names: &[String]) -> String {
        let runs = limit.runs.iter().filter_map(|run| names.get(*run)).map(String::as_str);
        match self.limits.len() {
            1 => "limit of norm".into(),
            _ => iter::once("limit of norm").chain(runs).collect::<Vec<_>>().join(", "),
        }
    }

    /// Adds a limit of the norm of the signals of a run, and the norm.
    pub fn limit(&mut self, run: usize, limit: Option<f64>) {
        self.limits.extend(limit.map(|value| Limit { value, runs: vec![run] }));
        let signals = || self.curves.iter().filter(|curve| curve.role == Role::Signal);
        let rows = signals().map(|curve| curve.values.len()).min().unwrap_or(0);
        let square = |row: usize| signals().map(|curve| curve.values[row].powi(2)).sum::<f64>();
        let values = (0..rows).map(|row| square(row).sqrt()).collect();
        self.curves.push(Curve { name: "norm".into(), run, place: 0, role: Role::Norm, values });
    }

    /// Takes the curves and limits of another run's panel.
    fn join(&mut self, other: Self) {
        self.curves.extend(other.curves);
        for limit in other.limits {
            match self.limits.iter_mut().find(|there| there.value == limit.value) {
                Some(there) => there.runs.extend(limit.runs),
                None => self.limits.push(limit),
            }
        }
    }

    /// Divides a panel with curves of several runs, so that none has too many. The norms, with
    /// their limits, then have a panel of their own.
    fn divided(mut self, runs: &[Recording]) -> Vec<Self> {
        if runs.len() < 2 {
            return vec![self];
        }
        self.tell_references_apart(runs);
        let (norms, curves): (Vec<_>, Vec<_>) =
            self.curves.into_iter().partition(|curve| curve.role == Role::Norm);
        let (label, unit) = (self.label, self.unit);
        let room = (CURVES / runs.len()).max(1);
        let mut panels: Vec<Self> = Vec::new();
        for curve in curves {
            let part = curve.place / room;
            if panels.len() <= part {
                let (label, unit) = (label.clone(), unit.clone());
                panels.resize(part + 1, Self { label, unit, ..Self::default() });
            }
            panels[part].curves.push(curve);
        }
        panels.retain(|panel| !panel.curves.is_empty());
        if !norms.is_empty() {
            let label = format!("norm of {label}");
            panels.push(Self { label, unit, curves: norms, limits: self.limits });
        }
        panels
    }

    /// Leaves out references that are those of the first run as well, and marks the others as their
    /// runs' own.
    fn tell_references_apart(&mut self, runs: &[Recording]) {
        let mut firsts: Vec<Curve> = Vec::new();
        self.curves.retain_mut(|curve| {
            if curve.role != Role::Reference {
                return true;
            }
            let Some(first) = firsts.iter().find(|first| first.place == curve.place) else {
                firsts.push(curve.clone());
                return true;
            };
            curve.role = Role::OwnReference;
            let [there, here] = [first, curve].map(|curve| (&runs[curve.run].time, &curve.values));
            !covers(there, here)
        });
    }

    /// Leaves out of the names of the curves the parts that the label has. The label names the
    /// signal if it is the only one.
    fn shorten(&mut self) {
        let first = self.curves.first().map(|curve| curve.name.clone()).unwrap_or_default();
        if self.curves.iter().all(|curve| curve.name == first) {
            self.label = symbols(&first);
            self.curves.iter_mut().for_each(|curve| curve.name.clone_from(&self.label));
            return;
        }
        for curve in &mut self.curves {
            let rest = curve.name.strip_prefix(&self.label).filter(|_| !self.label.is_empty());
            curve.name = symbols(rest.map_or(&*curve.name, |rest| rest.trim_start_matches('.')));
        }
    }
}

/// Returns the name of a variable before its last part; nothing for a combination.
fn stem(name: &str) -> &str {
    if name.contains(' ') || name.contains('(') {
        return "";
    }
    let end = name.rfind(['.', '[']).unwrap_or(0);
    &name[..end]
}

/// Writes the angles of the vehicle by their symbols, where they are whole words.
pub fn symbols(name: &str) -> String {
    let mut text = String::new();
    let mut word = String::new();
    let symbol = |word: &str| match word {
        "alpha" => "α".to_string(),
        "beta" => "β".to_string(),
        "sigma" => "σ".to_string(),
        other => other.to_string(),
    };
    for letter in name.chars() {
        if letter.is_alphanumeric() {
            word.push(letter);
        } else {
            text += &symbol(&word);
            word.clear();
            text.push(letter);
        }
    }
    text + &symbol(&word)
}

#[cfg(test)]
mod tests;
