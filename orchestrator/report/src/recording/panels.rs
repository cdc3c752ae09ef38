//! Panels in which several recordings are drawn over one another.

use super::Recording;
use super::cover::covers;
use std::iter;

/// Largest number of curves in a panel, beside references, norms and limits.
pub const CURVES: usize = 6;

/// Multiple of a limit from which on values need a logarithmic axis, and part of the limit at which
/// this axis begins.
const BEYOND: f64 = 5.0;
const SHOWN: f64 = 10.0;

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
    /// Range of the magnitudes on a logarithmic axis, on which a limit is seen that values exceed
    /// many times; `None` for a linear axis of the values.
    pub magnitudes: Option<[f64; 2]>,
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
        let is_of_norm = self.curves.iter().any(|curve| curve.role == Role::Norm);
        let name = if is_of_norm { "limit of norm" } else { "limit" };
        match self.limits.len() {
            1 => name.into(),
            _ => iter::once(name).chain(runs).collect::<Vec<_>>().join(", "),
        }
    }

    /// Adds a limit of the norm of the signals of a run, and the norm of several.
    pub(super) fn limit(&mut self, run: usize, limit: Option<f64>) {
        self.limits.extend(limit.map(|value| Limit { value, runs: vec![run] }));
        let signals = || self.curves.iter().filter(|curve| curve.role == Role::Signal);
        if signals().count() < 2 {
            return;
        }
        let rows = signals().map(|curve| curve.values.len()).min().unwrap_or(0);
        let square = |row: usize| signals().map(|curve| curve.values[row].powi(2)).sum::<f64>();
        let values = (0..rows).map(|row| square(row).sqrt()).collect();
        self.curves.push(Curve { name: "norm".into(), run, place: 0, role: Role::Norm, values });
    }

    /// Gives the norms with their limits a panel of their own, with an axis of magnitudes, if
    /// values exceed a limit so much that its line could not be distinguished from zero.
    pub(super) fn with_visible_limits(mut self) -> Vec<Self> {
        let limits = self.limits.iter().map(|limit| limit.value).filter(|value| *value > 0.0);
        let least = limits.fold(f64::INFINITY, f64::min);
        let values = self.curves.iter().flat_map(|curve| &curve.values).map(|value| value.abs());
        let most = values.filter(|value| value.is_finite()).fold(0.0, f64::max);
        if most <= BEYOND * least {
            return vec![self];
        }
        let magnitudes = Some([least / SHOWN, 1.3 * most]);
        let (norms, signals): (Vec<_>, Vec<_>) =
            self.curves.into_iter().partition(|curve| curve.role == Role::Norm);
        if norms.is_empty() || signals.is_empty() {
            let curves = if norms.is_empty() { signals } else { norms };
            return vec![Self { curves, magnitudes, ..self }];
        }
        let limits = std::mem::take(&mut self.limits);
        let (label, unit) = (format!("norm of {}", self.label), self.unit.clone());
        let limited = Self { label, unit, curves: norms, limits, magnitudes };
        vec![Self { curves: signals, ..self }, limited]
    }

    /// Takes the curves and limits of another run's panel.
    pub(super) fn join(&mut self, other: Self) {
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
    pub(super) fn divided(mut self, runs: &[Recording]) -> Vec<Self> {
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
            panels.push(Self { label, unit, curves: norms, ..Self::default() });
        }
        if let Some(last) = panels.last_mut() {
            last.limits = self.limits;
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
    pub(super) fn shorten(&mut self) {
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
