//! One figure of a run: angles with their reference, errors, rates and moments with their limits.

use crate::error::Error;
use crate::master::{Observer, Sample};
use crate::metrics::{Limits, Places};
use plotters::coord::Shift;
use plotters::prelude::*;
use std::path::Path;

/// A figure holds at most about this many points per curve.
const POINTS: u64 = 5000;

const WIDTH: u32 = 1000;
const LEGEND_WIDTH: u32 = 120;

const COLORS: [RGBColor; 3] = [RGBColor(31, 119, 180), RGBColor(44, 160, 44), RGBColor(214, 39, 40)];
const GREY: RGBColor = RGBColor(110, 110, 110);
const LIMIT: RGBColor = RGBColor(200, 0, 0);

/// Collects the curves.
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
        let mut panels = Vec::new();
        let degrees =
            |curves: &[Vec<f64>; 3]| curves.clone().map(|c| c.iter().map(|v| v.to_degrees()).collect());
        if self.places.attitude.is_some() {
            let mut panel = Panel::new("attitude, deg", ["alpha", "beta", "sigma"], degrees(&self.attitude));
            panel.reference = self.places.reference.map(|_| degrees(&self.reference));
            panels.push(panel);
            if self.places.reference.is_some() {
                let error = [0, 1, 2].map(|axis: usize| {
                    let pairs = self.attitude[axis].iter().zip(&self.reference[axis]);
                    pairs.map(|(a, r)| (a - r).to_degrees()).collect()
                });
                panels.push(Panel::new("tracking error, deg", ["alpha", "beta", "sigma"], error));
            }
        }
        if self.places.rate.is_some() {
            let mut panel = Panel::new("angular rate, deg/s", ["p", "q", "r"], degrees(&self.rate));
            panel.limit = self.limits.rate.map(f64::to_degrees);
            panel.norm = true;
            panels.push(panel);
        }
        if self.places.moment.is_some() {
            let kilo = self.moment.clone().map(|curve| curve.iter().map(|v| v / 1e3).collect());
            let mut panel = Panel::new("control moment, kN m", ["x", "y", "z"], kilo);
            panel.limit = self.limits.moment.map(|limit| limit / 1e3);
            panel.norm = true;
            panels.push(panel);
        }
        if panels.is_empty() || self.time.len() < 2 {
            return Ok(false);
        }
        draw(path, title, &self.time, &panels)
            .map_err(|error| Error::file(path)(std::io::Error::other(error.to_string())))?;
        Ok(true)
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

struct Panel {
    title: &'static str,
    names: [&'static str; 3],
    curves: [Vec<f64>; 3],
    reference: Option<[Vec<f64>; 3]>,
    limit: Option<f64>,
    /// Whether the norm of the three is drawn too, and against the limit.
    norm: bool,
}

impl Panel {
    fn new(title: &'static str, names: [&'static str; 3], curves: [Vec<f64>; 3]) -> Self {
        Self { title, names, curves, reference: None, limit: None, norm: false }
    }

    fn norms(&self) -> Vec<f64> {
        let [x, y, z] = &self.curves;
        x.iter().zip(y).zip(z).map(|((x, y), z)| (x * x + y * y + z * z).sqrt()).collect()
    }

    fn range(&self) -> std::ops::Range<f64> {
        let norms = if self.norm { self.norms() } else { Vec::new() };
        let values = self
            .curves
            .iter()
            .chain(self.reference.iter().flatten())
            .flatten()
            .chain(&norms)
            .copied()
            .chain(self.limit)
            .filter(|value| value.is_finite());
        let (low, high) = values.fold((f64::MAX, f64::MIN), |(low, high), v| (low.min(v), high.max(v)));
        let margin = 0.05 * (high - low).max(1e-6);
        if low > high { -1.0..1.0 } else { low - margin..high + margin }
    }
}

type DrawError = Box<dyn std::error::Error>;

fn draw(path: &Path, title: &str, time: &[f64], panels: &[Panel]) -> Result<(), DrawError> {
    let height = 40 + 260 * panels.len() as u32;
    let root = SVGBackend::new(path, (WIDTH, height)).into_drawing_area();
    root.fill(&WHITE)?;
    let root = root.titled(title, ("sans-serif", 20))?;
    let areas = root.split_evenly((panels.len(), 1));
    for (place, (panel, area)) in panels.iter().zip(&areas).enumerate() {
        draw_panel(panel, time, area, place + 1 == panels.len())?;
    }
    root.present()?;
    Ok(())
}

fn draw_panel(
    panel: &Panel,
    time: &[f64],
    area: &DrawingArea<SVGBackend, Shift>,
    last: bool,
) -> Result<(), DrawError> {
    let (left, right) = area.split_horizontally(WIDTH - LEGEND_WIDTH);
    let mut chart = ChartBuilder::on(&left)
        .margin(6)
        .margin_right(16)
        .x_label_area_size(if last { 34 } else { 18 })
        .y_label_area_size(64)
        .build_cartesian_2d(time[0]..time[time.len() - 1], panel.range())?;
    let mut mesh = chart.configure_mesh();
    mesh.y_desc(panel.title).label_style(("sans-serif", 13)).light_line_style(TRANSPARENT).x_labels(11);
    if last {
        mesh.x_desc("time, s");
    }
    mesh.draw()?;

    let points = |curve: &[f64]| -> Vec<(f64, f64)> {
        time.iter().copied().zip(curve.iter().copied()).filter(|(_, value)| value.is_finite()).collect()
    };
    let mut legend: Vec<(&str, ShapeStyle)> = Vec::new();
    for (curve, color) in panel.reference.iter().flatten().zip(COLORS) {
        chart.draw_series(LineSeries::new(points(curve), color.mix(0.45).stroke_width(1)))?;
    }
    for ((curve, color), name) in panel.curves.iter().zip(COLORS).zip(panel.names) {
        chart.draw_series(LineSeries::new(points(curve), color.stroke_width(2)))?;
        legend.push((name, color.stroke_width(2)));
    }
    if panel.reference.is_some() {
        legend.push(("thin: reference", GREY.mix(0.6).stroke_width(1)));
    }
    if panel.norm {
        chart.draw_series(LineSeries::new(points(&panel.norms()), GREY.stroke_width(1)))?;
        legend.push(("norm", GREY.stroke_width(1)));
    }
    if let Some(limit) = panel.limit {
        let ends = [(time[0], limit), (time[time.len() - 1], limit)];
        chart.draw_series(DashedLineSeries::new(ends, 6, 4, LIMIT.stroke_width(2)))?;
        legend.push(("limit of norm", LIMIT.stroke_width(2)));
    }
    for (y, (name, style)) in (20..).step_by(18).zip(legend) {
        right.draw(&PathElement::new([(0, y), (18, y)], style))?;
        right.draw(&Text::new(name, (24, y - 6), ("sans-serif", 13)))?;
    }
    Ok(())
}
