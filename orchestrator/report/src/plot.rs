//! The figure of one run, with one panel for each that the experiment asks for.

use crate::figure::svg;
use crate::panels::Panel;
use crate::recording::Recording;
use crate::recording::panels::{self, Role, symbols};
use crate::run_page::figure::figure;
use cosim::error::Error;
use cosim::run::{Observer, Sample};
use std::path::Path;

/// Approximate largest number of points of a curve.
const POINTS: u64 = 5000;

/// Collects the curves of a run's figure.
pub struct Curves {
    panels: Vec<Track>,
    stride: u64,
    time: Vec<f64>,
}

/// Values of a panel's curves over time.
struct Track {
    panel: Panel,
    values: Vec<Vec<f64>>,
    references: Vec<Vec<f64>>,
    limit: Option<f64>,
}

impl Curves {
    /// Creates empty curves for a run of this number of ticks.
    pub fn new(panels: Vec<Panel>, ticks: u64) -> Self {
        let stride = ticks.div_ceil(POINTS).max(1);
        let capacity = (ticks / stride + 2) as usize;
        let empty = |count| (0..count).map(|_| Vec::with_capacity(capacity)).collect::<Vec<_>>();
        let track = |panel: Panel| {
            let count = panel.curves.len();
            let references = if panel.has_references() { count } else { 0 };
            Track { panel, values: empty(count), references: empty(references), limit: None }
        };
        let panels = panels.into_iter().map(track).collect();
        Self { panels, stride, time: Vec::with_capacity(capacity) }
    }

    /// Draws the figure if it has any content, and returns whether it has.
    ///
    /// # Errors
    /// Returns an error if the file cannot be written.
    pub fn draw(&self, path: &Path, title: &str) -> Result<bool, Error> {
        if self.panels.is_empty() || self.time.len() < 2 {
            return Ok(false);
        }
        let (title, time) = (title.into(), self.time.clone());
        let run = Recording { title, time, ..Recording::default() };
        let panels: Vec<_> = self.panels.iter().map(drawn).collect();
        svg::write(&figure(&[run], &panels), path)?;
        Ok(true)
    }
}

/// Returns a panel as those of recordings are.
fn drawn(track: &Track) -> panels::Panel {
    let Track { panel, values, references, limit } = track;
    let mut drawn = panels::Panel::default();
    (drawn.label, drawn.unit) = (panel.label.clone(), panel.unit.clone());
    for (place, curve) in panel.curves.iter().enumerate() {
        let mut add = |role, values: &[f64]| {
            let (name, values) = (symbols(&curve.name), values.to_vec());
            drawn.curves.push(panels::Curve { name, run: 0, place, role, values });
        };
        add(Role::Signal, &values[place]);
        if curve.reference.is_some() {
            add(Role::Reference, &references[place]);
        }
    }
    if limit.is_some() {
        drawn.limit(0, *limit);
    }
    drawn
}

impl Observer for Curves {
    fn observe(&mut self, sample: &Sample) -> Result<(), Error> {
        if !sample.tick.is_multiple_of(self.stride) && !sample.last {
            return Ok(());
        }
        self.time.push(sample.time);
        for Track { panel, values, references, limit } in &mut self.panels {
            *limit = panel.limit_in(sample.values);
            values.iter_mut().zip(panel.values(sample.values)).for_each(|(y, value)| y.push(value));
            let followed = panel.references(sample.values);
            references.iter_mut().zip(followed).for_each(|(y, value)| y.push(value));
        }
        Ok(())
    }
}
