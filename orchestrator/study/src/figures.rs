//! Draws the figures of a study from the results of its runs.

use crate::drawings::{Across, Drawn, Figure, Line, Panel, Response, Through};
use crate::results::{Results, RunResult};
use crate::runs::Run;
use crate::values::ShownMetric;
use cosim::signal::Signal;
use cosim_report::figure::{self, Color, Curve, Shape};
use linear::curves::{ResponseCurves, excluded};
use std::iter;
use toml::Spanned;

/// A run whose curves a panel shows, with its results.
type Shown<'a> = (&'a Run, &'a RunResult);

/// Draws a figure from the results of a study.
///
/// # Errors
/// Returns an error if the figure names an item that does not exist.
pub(crate) fn figure(figure: &Figure, results: &Results) -> Result<figure::Figure, String> {
    let panels = figure.panels.iter().map(|drawn| panel(figure, drawn, results));
    let panels = panels.collect::<Result<_, _>>()?;
    Ok(figure::Figure::new(figure.title.clone(), figure.columns, panels))
}

fn panel(figure: &Figure, panel: &Panel, results: &Results) -> Result<figure::Panel, String> {
    let runs = results.study.runs_of(figure, panel);
    let runs: Vec<Shown> =
        runs.filter_map(|run| Some((run, results.run(run.id.get_ref())?))).collect();
    let drawn = panel.drawn()?;
    let (x_label, mut curves) = match drawn {
        Drawn::Signals => ("time, s", over_time(panel, &runs)),
        Drawn::Across(across) if across.lines.is_empty() => {
            (across.x.metric.as_str(), scattered(across, &runs, results)?)
        }
        Drawn::Across(across) => (across.x.metric.as_str(), lines_across(across, results)?),
        Drawn::Response(Response::Nichols) => ("phase of L, deg", nichols(&runs)),
        Drawn::Response(Response::Sensitivity) => ("frequency, rad/s", sensitivities(&runs)),
    };
    curves.extend(straight_lines(panel, results)?);
    Ok(figure::Panel {
        title: panel.title.clone(),
        log_x: matches!(drawn, Drawn::Response(Response::Sensitivity)),
        x_range: panel.x_range,
        y_range: panel.y_range,
        ..figure::Panel::new(panel.x_label.as_deref().unwrap_or(x_label), &panel.label, curves)
    })
}

/// Returns a curve with the name and the colour of a run.
fn of_run(run: &Run, shape: Shape, x: Vec<f64>, y: Vec<f64>) -> Curve {
    Curve::new(&run.label, run.color, shape, x, y)
}

/// Draws signals over time: first the bands, then the reference, then the lines of the first cases.
fn over_time(panel: &Panel, runs: &[Shown]) -> Vec<Curve> {
    let factor = panel.unit.as_ref().map_or(1.0, |unit| unit.factor);
    let scaled = |values: &Vec<f64>| values.iter().map(|value| value * factor).collect();
    let line = |result: &RunResult, signal: &Signal, name: &str, color: Color, shape: Shape| {
        let y = result.series.signals.get(signal).map(scaled).unwrap_or_default();
        Curve::new(name, color, shape, result.series.time.clone(), y)
    };
    let mut curves = Vec::new();
    for (run, result) in runs.iter().filter(|_| panel.spread) {
        for (signal, name, color) in signals(panel, run) {
            if let Some(band) = result.spread.get(signal) {
                let name = format!("{name}, {} runs", result.cases());
                let shape = Shape::Band(scaled(&band.low));
                let time = result.series.time.clone();
                curves.push(Curve::new(&name, color, shape, time, scaled(&band.high)));
            }
        }
    }
    if let (Some(reference), Some((_, result))) = (&panel.reference, runs.first()) {
        curves.push(line(result, reference, "reference", Color::INK, Shape::Dashed));
    }
    for (run, result) in runs {
        for (signal, name, color) in signals(panel, run) {
            // The line over a band of the same colour is pale, and shows the first run only.
            curves.push(if panel.spread {
                line(result, signal, &format!("{name}, first run"), color, Shape::Pale)
            } else {
                line(result, signal, name, color, Shape::Line)
            });
        }
    }
    curves
}

/// Returns the signals that a panel draws for a run, each with the name and colour of its curve.
fn signals<'a>(panel: &'a Panel, run: &'a Run) -> Vec<(&'a Signal, &'a str, Color)> {
    let by_run = panel.signal.iter().map(|signal| (signal, run.label.as_str(), run.color));
    let named = panel.signals.iter().map(|curve| (&curve.signal, &curve.label[..], curve.color));
    by_run.chain(named).collect()
}

/// Draws each case of a run as a dot.
fn scattered(across: &Across, runs: &[Shown], results: &Results) -> Result<Vec<Curve>, String> {
    let dots = |(run, _): &Shown| {
        let numbers = |ShownMetric { metric, factor }: &ShownMetric| {
            let numbers = results.numbers(&format!("{}.{metric}", run.id.get_ref()))?.0;
            Ok::<_, String>(numbers.into_iter().map(|number| number * factor).collect())
        };
        Ok(of_run(run, Shape::Dots, numbers(&across.x)?, numbers(&across.y)?))
    };
    runs.iter().map(dots).collect()
}

/// Draws lines through the means of several runs.
fn lines_across(across: &Across, results: &Results) -> Result<Vec<Curve>, String> {
    let means = |line: &Through, axis: &ShownMetric| {
        let mean = |run: &Spanned<String>| {
            let numbers = results.numbers(&format!("{}.{}", run.get_ref(), axis.metric))?;
            // A run without this metric leaves a gap.
            Ok(if numbers.0.is_empty() { f64::NAN } else { numbers.mean() * axis.factor })
        };
        line.runs.iter().map(mean).collect::<Result<Vec<_>, String>>()
    };
    let curve = |line: &Through| {
        let (x, y) = (means(line, &across.x)?, means(line, &across.y)?);
        Ok(Curve::new(&line.label, line.color, Shape::Line, x, y))
    };
    across.lines.iter().map(curve).collect()
}

/// Draws a frequency response of each run that has one.
fn responses(runs: &[Shown], xy: fn(&ResponseCurves) -> (&Vec<f64>, &Vec<f64>)) -> Vec<Curve> {
    let curve = |(run, result): &Shown| {
        let (x, y) = xy(result.series.response.as_ref()?);
        Some(of_run(run, Shape::Line, x.clone(), y.clone()))
    };
    runs.iter().filter_map(curve).collect()
}

/// Draws return ratios, with the set that a disk margin of 1 excludes.
fn nichols(runs: &[Shown]) -> Vec<Curve> {
    let (x, y) = excluded(1.0);
    let limit = Curve::new("disk margin 1", Color::LIMIT, Shape::Dashed, x, y);
    iter::once(limit).chain(responses(runs, |curves| (&curves.phase, &curves.gain))).collect()
}

fn sensitivities(runs: &[Shown]) -> Vec<Curve> {
    responses(runs, |curves| (&curves.frequency, &curves.sensitivity))
}

/// Draws the straight lines of a panel: its bounds, and then its marks.
fn straight_lines(panel: &Panel, results: &Results) -> Result<Vec<Curve>, String> {
    let mut curves = Vec::new();
    let mut draw = |line: &Line, shape: &Shape, place: fn(f64) -> (f64, f64)| {
        for at in line.positions(&results.study.values)? {
            let (x, y) = place(at);
            curves.push(Curve::new(&line.label, Color::LIMIT, shape.clone(), vec![x], vec![y]));
        }
        Ok::<_, String>(())
    };
    for line in &panel.bounds {
        draw(line, &Shape::Horizontal, |y| (f64::NAN, y))?;
    }
    for line in &panel.marks {
        draw(line, &Shape::Vertical, |x| (x, f64::NAN))?;
    }
    Ok(curves)
}
