//! Draws the figures of a study from the results of its runs.

use crate::curves::Series;
use crate::drawings::{Across, Axis, Figure, Panel, Response, Through};
use crate::results::{Metric, Results, RunResult};
use crate::runs::Run;
use cosim::experiment::Scaled;
use cosim::signal::Signal;
use cosim_report::figure::{self, Color, Curve, Legend, Shape};
use linear::curves::excluded;
use toml::Spanned;

/// Number of columns of a histogram for each decade.
const COLUMNS_PER_DECADE: f64 = 12.0;

/// Draws a figure from the results of a study.
///
/// # Errors
/// Returns an error if the figure names an item that does not exist.
pub(crate) fn figure(figure: &Figure, results: &Results) -> Result<figure::Figure, String> {
    let panels =
        figure.panels.iter().map(|p| panel(figure, p, results)).collect::<Result<_, _>>()?;
    Ok(figure::Figure {
        title: figure.title.clone(),
        columns: figure.columns,
        legend: Legend::Above,
        panels,
    })
}

fn panel(figure: &Figure, panel: &Panel, results: &Results) -> Result<figure::Panel, String> {
    let study = results.study;
    let runs: Vec<(&Run, &RunResult)> = study
        .runs_of(figure, panel)
        .filter_map(|run| Some((run, results.run(run.id.get_ref())?)))
        .collect();
    let mut curves = Vec::new();
    let mut x_label = "time, s".to_string();
    if let Some(metric) = &panel.histogram {
        x_label.clone_from(metric);
        let samples = runs.iter().filter_map(|(run, r)| Some((run, r.series.samples.get(metric)?)));
        curves.extend(samples.map(|(run, samples)| histogram(run, samples)));
    } else if let Some(scatter) = &panel.scatter {
        for (run, result) in &runs {
            let numbers = |metric: &str| {
                Metric::parse(metric, study, run)?;
                results.numbers(&format!("{}.{metric}", run.id.get_ref()))
            };
            let (x, y) = (numbers(&scatter.x)?.0, numbers(&scatter.y)?.0);
            debug_assert_eq!(x.len(), result.cases());
            curves.push(Curve {
                name: run.label.clone(),
                color: run.color,
                shape: Shape::Dots,
                x,
                y,
            });
        }
    } else if let Some(response) = panel.response {
        x_label = match response {
            Response::Nichols => "phase of L, deg".into(),
            Response::Sensitivity => "frequency, rad/s".into(),
        };
        curves.extend(responses(response, panel, &runs));
    } else if let Some(across) = &panel.across {
        x_label.clone_from(&across.x.metric);
        for line in &across.lines {
            curves.push(through(across, line, results)?);
        }
    } else {
        let bands = if panel.spread { &runs[..] } else { &[] };
        for (run, result) in bands {
            for (signal, name, color) in drawn(panel, run) {
                if let Some(spread) = result.spread.get(signal) {
                    let scale = |values: &[f64]| scaled(values, panel.unit.as_ref());
                    curves.push(Curve {
                        name: format!("{name}, {} runs", result.cases()),
                        color,
                        shape: Shape::Band(scale(&spread.low)),
                        x: result.series.time.clone(),
                        y: scale(&spread.high),
                    });
                }
            }
        }
        if let (Some(reference), Some((_, result))) = (&panel.reference, runs.first()) {
            let y = values(&result.series, reference, panel);
            let (name, color) = ("reference".into(), Color::INK);
            curves.push(Curve {
                name,
                color,
                shape: Shape::Dashed,
                x: result.series.time.clone(),
                y,
            });
        }
        for (run, result) in &runs {
            for (signal, name, color) in drawn(panel, run) {
                let y = values(&result.series, signal, panel);
                // The line over a band of the same colour is pale, and shows the first run only.
                let shape = if panel.spread { Shape::Pale } else { Shape::Line };
                let name = if panel.spread { format!("{name}, first run") } else { name };
                curves.push(Curve { name, color, shape, x: result.series.time.clone(), y });
            }
        }
    }
    for point in &panel.points {
        let at = |quantity| study.values.number(quantity).map(|number| vec![number]);
        let (x, y) = (at(&point.x)?, at(&point.y)?);
        curves.push(Curve {
            name: point.label.clone(),
            color: point.color,
            shape: Shape::Crosses,
            x,
            y,
        });
    }
    curves.extend(straight(panel, results)?);
    Ok(figure::Panel {
        title: panel.title.clone(),
        x_label: panel.x_label.clone().unwrap_or(x_label),
        y_label: panel.label.clone(),
        log_x: panel.histogram.is_some() || panel.response == Some(Response::Sensitivity),
        x_range: panel.x_range,
        y_range: panel.y_range,
        curves,
    })
}

/// The frequency responses of runs, with the set that a disk margin excludes.
fn responses(response: Response, panel: &Panel, runs: &[(&Run, &RunResult)]) -> Vec<Curve> {
    let mut curves = Vec::new();
    if let (Response::Nichols, Some(alpha)) = (response, panel.disk) {
        let (x, y) = excluded(alpha);
        let name = format!("disk margin {alpha}");
        curves.push(Curve { name, color: Color::LIMIT, shape: Shape::Dashed, x, y });
    }
    for (run, result) in runs {
        let Some(curve) = &result.series.response else { continue };
        let (x, y) = match response {
            Response::Nichols => (&curve.phase, &curve.gain),
            Response::Sensitivity => (&curve.frequency, &curve.sensitivity),
        };
        let (name, x, y) = (run.label.clone(), x.clone(), y.clone());
        curves.push(Curve { name, color: run.color, shape: Shape::Line, x, y });
    }
    curves
}

/// The straight lines of a panel: its bounds and its marks.
fn straight(panel: &Panel, results: &Results) -> Result<Vec<Curve>, String> {
    let mut curves = Vec::new();
    for (lines, shape) in [(&panel.bounds, Shape::Horizontal), (&panel.marks, Shape::Vertical)] {
        for line in lines {
            let at = results.study.values.number(&line.at)?;
            let sides = if line.symmetric { vec![at, -at] } else { vec![at] };
            for side in sides {
                let (x, y) = match shape {
                    Shape::Horizontal => (f64::NAN, side),
                    _ => (side, f64::NAN),
                };
                let (name, shape) = (line.label.clone(), shape.clone());
                curves.push(Curve { name, color: Color::LIMIT, shape, x: vec![x], y: vec![y] });
            }
        }
    }
    Ok(curves)
}

/// Returns a line through the means of several runs.
fn through(across: &Across, line: &Through, results: &Results) -> Result<Curve, String> {
    let along = |axis: &Axis| {
        let mean = |run: &Spanned<String>| {
            let numbers = results.numbers(&format!("{}.{}", run.get_ref(), axis.metric))?;
            // A run without this metric leaves a gap.
            Ok(if numbers.0.is_empty() { f64::NAN } else { numbers.mean() * axis.factor })
        };
        line.runs.iter().map(mean).collect::<Result<Vec<_>, String>>()
    };
    let (x, y) = (along(&across.x)?, along(&across.y)?);
    Ok(Curve { name: line.label.clone(), color: line.color, shape: Shape::Line, x, y })
}

/// Returns the curves that a panel draws for a run, each with its signal, name and colour.
fn drawn<'a>(panel: &'a Panel, run: &'a Run) -> Vec<(&'a Signal, String, Color)> {
    let for_run = panel.signal.iter().map(|signal| (signal, run.label.clone(), run.color));
    for_run
        .chain(panel.signals.iter().map(|curve| (&curve.signal, curve.label.clone(), curve.color)))
        .collect()
}

fn values(series: &Series, signal: &Signal, panel: &Panel) -> Vec<f64> {
    series.signals.get(signal).map(|values| scaled(values, panel.unit.as_ref())).unwrap_or_default()
}

fn scaled(values: &[f64], unit: Option<&Scaled>) -> Vec<f64> {
    values.iter().map(|value| value * unit.map_or(1.0, |unit| unit.factor)).collect()
}

/// Returns a histogram of durations: shares, in per cent, in columns of equal width on a
/// logarithmic axis.
fn histogram(run: &Run, values: &[f64]) -> Curve {
    let column = |value: f64| (value.log10() * COLUMNS_PER_DECADE).floor();
    let timed: Vec<f64> = values.iter().copied().filter(|value| *value > 0.0).collect();
    let (first, last) = timed
        .iter()
        .map(|&value| column(value))
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), c| (low.min(c), high.max(c)));
    let (mut x, mut y) = (Vec::new(), Vec::new());
    let mut edge = first;
    // A further, empty column ends the last one.
    while edge <= last + 1.0 {
        x.push(10_f64.powf(edge / COLUMNS_PER_DECADE));
        let inside = timed.iter().filter(|&&value| column(value) == edge).count();
        y.push(100.0 * inside as f64 / timed.len() as f64);
        edge += 1.0;
    }
    Curve { name: run.label.clone(), color: run.color, shape: Shape::Steps, x, y }
}
