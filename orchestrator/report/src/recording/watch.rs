//! Collects a recording while the run goes on, of variables that may not be written to its files.

use super::asked::{self, UNASKED};
use super::{Recording, Track};
use crate::figure::svg;
use crate::run_page::figure::figure;
use cosim::error::Error;
use cosim::experiment::{Observe, Trajectory, Vehicle};
use cosim::run::{Observer, Sample};
use cosim::signal::Signal;
use cosim::system::System;
use serde_json::Value;
use std::collections::BTreeMap;
use std::iter;
use std::path::Path;

/// Place that names the variables that are recorded.
const RECORD: &str = "[record]";
/// Place that names the variables of a guarantee, which an FMU may lack.
const GUARANTEE: &str = "[observe.guarantee]";
/// Place that names the variables of panels that an FMU may lack.
const OPTIONAL: &str = "optional [[observe.panels]]";

/// An observer that keeps the variables that the pictures of a run show.
pub struct Watch {
    columns: Vec<(String, usize, Track)>,
    /// Number of columns, the first ones, that are drawn because the experiment has no panels.
    unasked: usize,
    time: Vec<f64>,
    observe: Observe,
}

impl Watch {
    /// Requests the variables that the experiment draws, and the first ones that are recorded if it
    /// has no panels. Variables that are missing because the command line replaced their FMU are
    /// left out.
    ///
    /// # Errors
    /// Returns an error if the experiment names a variable that does not exist.
    pub fn new(system: &mut System) -> Result<Self, Error> {
        let mut columns = Vec::new();
        let unasked = unasked(system);
        let count = unasked.len();
        let mut named = names(&system.experiment.observe);
        named.extend(plan(system).map(|name| (name, GUARANTEE)));
        named.retain(|name, _| !unasked.contains(name));
        let named = unasked.into_iter().map(|name| (name, RECORD)).chain(named);
        for (name, place) in named {
            let is_optional =
                [GUARANTEE, OPTIONAL].contains(&place) || system.lost_by_exchange([name.as_str()]);
            if !system.has(&name) && is_optional {
                continue;
            }
            let fault = |problem| Error::experiment(format!("{place}: {problem}"));
            let probed = system.probe(&name).map_err(fault)?;
            let signal = Signal::try_from(name.clone()).map_err(fault)?;
            let shown = system.resolve(&signal).map_err(fault)?;
            let track = Track {
                unit: shown.unit,
                factor: shown.factor,
                items: probed.items,
                values: Vec::new(),
            };
            columns.push((name, probed.place, track));
        }
        let observe = system.experiment.observe.clone();
        Ok(Self { columns, unasked: count, time: Vec::new(), observe })
    }

    /// Draws the figure that the experiment asks for, if it does, and returns whether it does.
    ///
    /// # Errors
    /// Returns an error if the file cannot be written.
    pub fn draw(&self, path: &Path, title: &str) -> Result<bool, Error> {
        if self.unasked > 0 || self.time.len() < 2 {
            return Ok(false);
        }
        let tracks = self.columns.iter().map(|(name, _, track)| (name.clone(), track.clone()));
        let run = Recording {
            title: title.into(),
            time: self.time.clone(),
            tracks: tracks.collect(),
            observe: self.observe.clone(),
            ..Recording::default()
        };
        let runs = [run];
        let panels = asked::of_experiments(&runs).map_err(Error::experiment)?;
        let drawn = figure(&runs, &panels);
        if !drawn.panels.is_empty() {
            svg::write(&drawn, path)?;
        }
        Ok(!drawn.panels.is_empty())
    }

    /// Returns the recording of the run whose `results.json` has this content.
    pub fn recording(self, name: &str, metadata: &Value) -> Recording {
        let tracks = self.columns.into_iter().map(|(name, _, track)| (name, track)).collect();
        let mut recording = Recording::new(name, metadata, self.time, tracks);
        if self.unasked > 0 {
            recording.recorded.truncate(self.unasked);
        }
        recording
    }
}

/// Returns the recorded variables that are drawn if an experiment has no panels.
fn unasked(system: &System) -> Vec<String> {
    let count = if system.experiment.observe.panels.is_empty() { UNASKED } else { 0 };
    system.recorded().into_iter().take(count).collect()
}

/// Returns the recorded variables that show plans under guarantee.
fn plan(system: &System) -> impl Iterator<Item = String> {
    let guarantee = system.experiment.observe.guarantee.as_ref();
    let group =
        guarantee.and_then(|guarantee| guarantee.plan.as_ref()).map(|plan| format!("{plan}."));
    let recorded = system.recorded().into_iter();
    recorded.filter(move |name| group.as_ref().is_some_and(|group| name.starts_with(group)))
}

/// Returns the names of the variables that an experiment draws, each with the place that names it.
fn names(observe: &Observe) -> BTreeMap<String, &'static str> {
    let mut names = BTreeMap::new();
    for panel in &observe.panels {
        let place = if panel.optional { OPTIONAL } else { "[[observe.panels]]" };
        for path in panel.paths() {
            names.entry(path.to_string()).or_insert(place);
        }
    }
    for (_, path) in observe.vehicle.iter().flat_map(Vehicle::paths) {
        names.insert(path.to_string(), "[observe.vehicle]");
    }
    for path in observe.trajectory.iter().flat_map(Trajectory::paths) {
        names.insert(path.to_string(), "[observe.trajectory]");
    }
    if let Some(guarantee) = &observe.guarantee {
        for path in iter::once(&guarantee.in_force).chain(&guarantee.status) {
            names.insert(path.clone(), GUARANTEE);
        }
    }
    names
}

impl Observer for Watch {
    fn observe(&mut self, sample: &Sample) -> Result<(), Error> {
        self.time.push(sample.time);
        for (_, place, track) in &mut self.columns {
            track.values.push(sample.values[*place]);
        }
        Ok(())
    }
}
