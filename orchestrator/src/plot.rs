//! One figure of a run: angles with their reference, errors, rates and moments with their limits.

use crate::error::Error;
use crate::figure::{Color, Curve, Figure, Legend, Panel, Shape, svg};
use crate::master::{Observer, Sample};
use crate::metrics::{Limits, Places};
use std::path::Path;

/// A figure holds at most about this many points per curve.
const POINTS: u64 = 5000;

const COLORS: [Color; 3] = [Color(31, 119, 180), Color(44, 160, 44), Color(214, 39, 40)];

/// Collects the curves of a run's figure.
pub struct Curves {
    places: Places,
    limits: Limits,
    stride: u64,
    time: Vec<f64>,
    attitude: [Vec<f64>; 3],
    reference: [Vec<f64>; 3],
    rate: [Vec<f64>; 3],
    moment: [Vec<f64>; 3],
}

impl Curves {
    /// Empty curves for a run of so many ticks.
    pub fn new(places: Places, limits: Limits, ticks: u64) -> Self {
        let stride = ticks.div_ceil(POINTS).max(1);
        let capacity = (ticks / stride + 2) as usize;
        let curves = || [(); 3].map(|()| Vec::with_capacity(capacity));
        Self {
            places,
            limits,
            stride,
            time: Vec::with_capacity(capacity),
            attitude: curves(),
            reference: curves(),
            rate: curves(),
            moment: curves(),
        }
    }

    /// Draws the figure, if there is anything to draw. Returns whether there was.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn draw(&self, path: &Path, title: &str) -> Result<bool, Error> {
        let panels = self.panels();
        if panels.is_empty() || self.time.len() < 2 {
            return Ok(false);
        }
        svg::write(&Figure { title: title.into(), columns: 1, legend: Legend::Beside, panels }, path)?;
        Ok(true)
    }

    fn panels(&self) -> Vec<Panel> {
        const ANGLES: [&str; 3] = ["alpha", "beta", "sigma"];
        let mut panels = Vec::new();
        let degrees =
            |curves: &[Vec<f64>; 3]| curves.clone().map(|c| c.iter().map(|v| v.to_degrees()).collect());
        if self.places.attitude.is_some() {
            let mut panel = self.panel("attitude, deg", ANGLES, degrees(&self.attitude));
            if self.places.reference.is_some() {
                let reference = degrees(&self.reference).into_iter().zip(COLORS);
                let pale = |(values, color)| self.curve("thin: reference", color, Shape::Pale, values);
                panel.curves.splice(0..0, reference.map(pale));
            }
            panels.push(panel);
            if self.places.reference.is_some() {
                let error = [0, 1, 2].map(|axis: usize| {
                    let pairs = self.attitude[axis].iter().zip(&self.reference[axis]);
                    pairs.map(|(a, r)| (a - r).to_degrees()).collect()
                });
                panels.push(self.panel("tracking error, deg", ANGLES, error));
            }
        }
        if self.places.rate.is_some() {
            let mut panel = self.panel("angular rate, deg/s", ["p", "q", "r"], degrees(&self.rate));
            self.add_norm(&mut panel, self.limits.rate.map(f64::to_degrees));
            panels.push(panel);
        }
        if self.places.moment.is_some() {
            let kilo = self.moment.clone().map(|curve| curve.iter().map(|v| v / 1e3).collect());
            let mut panel = self.panel("control moment, kN m", ["x", "y", "z"], kilo);
            self.add_norm(&mut panel, self.limits.moment.map(|limit| limit / 1e3));
            panels.push(panel);
        }
        panels
    }

    fn panel(&self, label: &str, names: [&str; 3], curves: [Vec<f64>; 3]) -> Panel {
        let curves = curves
            .into_iter()
            .zip(names)
            .zip(COLORS)
            .map(|((values, name), color)| self.curve(name, color, Shape::Line, values))
            .collect();
        Panel {
            title: String::new(),
            x_label: "time, s".into(),
            y_label: label.into(),
            log_x: false,
            x_range: None,
            curves,
        }
    }

    fn curve(&self, name: &str, color: Color, shape: Shape, y: Vec<f64>) -> Curve {
        Curve { name: name.into(), color, shape, x: self.time.clone(), y }
    }

    /// Adds the norm of the panel's three curves, and its limit.
    fn add_norm(&self, panel: &mut Panel, limit: Option<f64>) {
        let norm = |k| panel.curves.iter().map(|curve| curve.y[k] * curve.y[k]).sum::<f64>().sqrt();
        let norms = (0..self.time.len()).map(norm).collect();
        let norm = self.curve("norm", Color::GREY, Shape::Pale, norms);
        panel.curves.push(norm);
        if let Some(limit) = limit {
            let limit = Curve {
                name: "limit of norm".into(),
                color: Color::LIMIT,
                shape: Shape::Horizontal,
                x: vec![f64::NAN],
                y: vec![limit],
            };
            panel.curves.push(limit);
        }
    }
}

impl Observer for Curves {
    fn observe(&mut self, sample: &Sample) -> Result<(), Error> {
        if !sample.tick.is_multiple_of(self.stride) && !sample.last {
            return Ok(());
        }
        self.time.push(sample.time);
        for (places, curves) in [
            (self.places.attitude, &mut self.attitude),
            (self.places.reference, &mut self.reference),
            (self.places.rate, &mut self.rate),
            (self.places.moment, &mut self.moment),
        ] {
            for (place, curve) in places.into_iter().flatten().zip(curves) {
                curve.push(sample.values[place]);
            }
        }
        Ok(())
    }
}
