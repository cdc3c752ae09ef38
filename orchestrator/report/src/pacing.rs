//! A figure of a paced run, with step times and wake-up jitter as time series and as distributions.

use crate::figure::{Color, Curve, Figure, Legend, Panel, Shape, svg};
use cosim::error::Error;
use cosim::pacing::report::{RealTime, Series};
use std::path::Path;

/// Draws the figure and writes it to a file.
///
/// # Errors
/// Returns an error if the file cannot be written.
pub fn draw(
    path: &Path,
    title: &str,
    report: &RealTime,
    wake_ups: Series,
    steps: Vec<(String, Series)>,
) -> Result<(), Error> {
    let color = |index: usize| Color::CURVES[index % Color::CURVES.len()];
    let line = |name: &str, color, series: Series| Curve {
        name: name.into(),
        color,
        shape: Shape::Line,
        x: series.time,
        y: series.milliseconds,
    };
    let columns = |name: &str, color, histogram: &[(f64, u64)]| Curve {
        name: name.into(),
        color,
        shape: Shape::Steps,
        // The value at an x holds up to the next x.
        x: histogram
            .first()
            .map(|(end, _)| end / 2.0)
            .into_iter()
            .chain(histogram.iter().map(|(end, _)| *end))
            .collect(),
        y: histogram.iter().map(|(_, count)| *count as f64).chain([0.0]).collect(),
    };
    let panel = |y_label: &str, x_label: &str, log_x, curves| Panel {
        x_label: x_label.into(),
        y_label: y_label.into(),
        log_x,
        curves,
        ..Panel::default()
    };
    let names: Vec<String> = steps.iter().map(|(name, _)| name.clone()).collect();
    let step_curves = steps
        .into_iter()
        .enumerate()
        .map(|(index, (name, series))| line(&name, color(index), series));
    let counts = names.iter().enumerate().filter_map(|(index, name)| {
        report
            .components
            .get(name)
            .map(|component| columns(name, color(index), &component.step_ms.histogram))
    });
    let mut panels = vec![
        panel("step time, ms", "time, s", false, step_curves.collect()),
        panel("number of steps", "duration, ms", true, counts.collect()),
    ];
    if report.wake_up_ms.count > 0 {
        let counts = columns("wake-up", Color::GREY, &report.wake_up_ms.histogram);
        panels.push(panel(
            "wake-up jitter, ms",
            "time, s",
            false,
            vec![line("wake-up", Color::GREY, wake_ups)],
        ));
        panels.push(panel("number of wake-ups", "duration, ms", true, vec![counts]));
    }
    let title = format!(
        "{title}: factor {}, {} of {} deadlines missed",
        report.factor.get(),
        report.misses,
        report.deadlines
    );
    svg::write(&Figure { title, columns: 2, legend: Legend::Above, panels }, path)
}
