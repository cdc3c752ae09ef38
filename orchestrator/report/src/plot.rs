//! The figure of one run, with one panel for each that the experiment asks for.

use crate::figure::{self, Color, Figure, Legend, Shape, svg};
use crate::panels::Panel;
use cosim::error::Error;
use cosim::master::{Observer, Sample};
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
        let panels = self.panels.iter().map(|track| self.panel(track)).collect();
        svg::write(
            &Figure { title: title.into(), columns: 1, legend: Legend::Beside, panels },
            path,
        )?;
        Ok(true)
    }

    fn panel(&self, track: &Track) -> figure::Panel {
        let Track { panel, values, references, limit } = track;
        let colors = || Color::CURVES.iter().copied().cycle();
        let pale = references.iter().zip(colors());
        let mut curves: Vec<_> =
            pale.map(|(y, color)| self.curve("reference", color, Shape::Pale, y.clone())).collect();
        let named = panel.curves.iter().zip(values).zip(colors());
        curves.extend(
            named.map(|((curve, y), color)| self.curve(&curve.name, color, Shape::Line, y.clone())),
        );
        if let Some(limit) = *limit {
            let norm = |k: usize| values.iter().map(|y| y[k] * y[k]).sum::<f64>().sqrt();
            let norms = (0..self.time.len()).map(norm).collect();
            curves.push(self.curve("norm", Color::GREY, Shape::Pale, norms));
            curves.push(figure::Curve {
                name: "limit of norm".into(),
                color: Color::LIMIT,
                shape: Shape::Horizontal,
                x: vec![f64::NAN],
                y: vec![limit],
            });
        }
        let unit = if panel.unit.is_empty() { String::new() } else { format!(", {}", panel.unit) };
        figure::Panel {
            x_label: "time, s".into(),
            y_label: format!("{}{unit}", panel.label),
            curves,
            ..figure::Panel::default()
        }
    }

    fn curve(&self, name: &str, color: Color, shape: Shape, y: Vec<f64>) -> figure::Curve {
        figure::Curve { name: name.into(), color, shape, x: self.time.clone(), y }
    }
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
