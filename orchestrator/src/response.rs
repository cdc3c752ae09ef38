//! The command `response`: the frequency response of a loop in flight, beside that of its linear
//! model.

use crate::failure::Failure;
use crate::linear::{Instant, keep, refuse_closed};
use crate::picture;
use clap::Args;
use cosim::error::Error;
use cosim::interrupt::Interrupt;
use cosim_report::figure::{Color, Curve, Figure, Legend, Panel, Shape, svg};
use linear::curves::decibel;
use linear::frequency::{self, Complex, Point, return_ratio};
use linear::linearise::Lineariser;
use linear::model::OpenLoop;
use serde_json::{Value, json};
use std::f64::consts::PI;
use std::io::Write;
use std::path::PathBuf;

/// Number of frequencies at which the curve of the model is drawn.
const DRAWN: usize = 400;

/// Arguments of `response`.
#[derive(Args)]
pub(crate) struct Response {
    /// Lowest frequency, rad/s.
    #[arg(long, value_name = "RAD/S", help_heading = "Sine", default_value_t = 0.3)]
    from: f64,
    /// Highest frequency, rad/s [default: 0.77 of half the sampling frequency].
    #[arg(long, value_name = "RAD/S", help_heading = "Sine")]
    to: Option<f64>,
    /// Number of frequencies, equally spaced on a logarithmic scale.
    #[arg(long, value_name = "N", help_heading = "Sine", default_value_t = 10, value_parser = clap::value_parser!(u32).range(2..))]
    count: u32,
    /// Amplitude of the sine, in the unit of the signals [default: a ten-thousandth of their
    /// typical magnitude].
    #[arg(long, value_name = "NUMBER", help_heading = "Sine")]
    amplitude: Option<f64>,
    /// Print JSON, for other programs.
    #[arg(long)]
    pub(crate) json: bool,
    /// Also write both responses to this file, as JSON.
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// File for a plot of both responses (.svg).
    #[arg(long, value_name = "FILE")]
    plot: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) instant: Instant,
}

/// Measures the frequency response of a loop, and compares it with that of the linear model.
pub(crate) fn respond(
    asked: &Response,
    out: &mut impl Write,
    interrupt: &Interrupt,
) -> Result<(), Failure> {
    picture::check(asked.plot.as_deref())?;
    let (system, at, open) = asked.instant.system()?;
    if let Some(amplitude) = asked.amplitude
        && !(amplitude > 0.0 && amplitude.is_finite())
    {
        let problem = format!("--amplitude {amplitude}: it must be finite and above 0");
        return Err(Error::experiment(problem).into());
    }
    let title = system.experiment.title.clone();
    let lineariser = Lineariser::new(system, at, &open)?;
    refuse_closed(lineariser.system())?;
    let mut master = lineariser.system().start(interrupt)?;
    let found = lineariser.linearise(&mut master, interrupt)?;
    drop(master);
    let nyquist = PI / found.open.sampling();
    let to = asked.to.unwrap_or(0.77 * nyquist);
    if !(asked.from > 0.0 && to > asked.from && to < nyquist) {
        let problem = format!(
            "--from {} --to {to:.3}: 0 < from < to < {nyquist:.3} rad/s, half the sampling frequency, is needed",
            asked.from
        );
        return Err(Error::experiment(problem).into());
    }
    let frequencies: Vec<f64> = (0..asked.count)
        .map(|k| asked.from * (to / asked.from).powf(f64::from(k) / f64::from(asked.count - 1)))
        .collect();
    if !asked.json {
        writeln!(
            out,
            "{:<24} {:>9} {:>12} {:>12} {:>12} {:>12}",
            "signal", "rad/s", "in flight dB", "deg", "predicted dB", "deg"
        )?;
    }
    let mut all: Vec<Vec<Point>> = Vec::new();
    for (channel, signal) in found.open.signals.iter().enumerate() {
        let input = lineariser.system().variable_at(lineariser.opened()[channel]);
        let amplitude = asked.amplitude.unwrap_or(1e-4 * input.nominal());
        let mut points = Vec::new();
        for &frequency in &frequencies {
            let point =
                frequency::measure(&lineariser, &found, channel, frequency, amplitude, interrupt)?;
            if !asked.json {
                let [[measured, at], [predicted, at_predicted]] = shown(&point);
                writeln!(
                    out,
                    "{:<24} {frequency:>9.4} {measured:>12.3} {at:>12.2} {predicted:>12.3} {at_predicted:>12.2}",
                    signal.name,
                )?;
            }
            points.push(point);
        }
        all.push(points);
    }
    if asked.json || asked.out.is_some() {
        let rows = std::iter::zip(&found.open.signals, &all).flat_map(|(signal, points)| {
            points.iter().map(|point| {
                let [in_flight, predicted] = shown(point).map(|[db, deg]| json!({ "db": db, "deg": deg }));
                json!({ "signal": signal.name, "frequency": point.frequency, "in_flight": in_flight, "predicted": predicted })
            })
        });
        let rows: Value = rows.collect();
        keep(asked.out.as_deref(), &rows)?;
        if asked.json {
            writeln!(out, "{rows:#}")?;
        }
    }
    if let Some(path) = &asked.plot {
        svg::write(&figure(&title, &found.open, &all, [asked.from, to]), path)?;
    }
    Ok(())
}

/// Returns magnitude (dB) and phase (deg) of the return ratio in flight and of the predicted one.
fn shown(point: &Point) -> [[f64; 2]; 2] {
    [point.measured, point.predicted].map(|l| [decibel(l.norm()), l.arg().to_degrees()])
}

/// Draws magnitude and phase of the return ratios: the models' as lines, and those in flight as
/// dots.
fn figure(title: &str, open: &OpenLoop, all: &[Vec<Point>], [from, to]: [f64; 2]) -> Figure {
    let grid: Vec<f64> =
        (0..=DRAWN).map(|k| from * (to / from).powf(k as f64 / DRAWN as f64)).collect();
    let panel = |label: &str, of: &dyn Fn(Complex) -> f64| {
        let curves = all.iter().enumerate().flat_map(|(channel, points)| {
            let color = Color::CURVES[channel % Color::CURVES.len()];
            let name = open.signals[channel].name.clone();
            let model = grid.iter().map(|w| of(return_ratio(open, channel, *w))).collect();
            let line = Curve {
                name: format!("{name}, linear model"),
                color,
                shape: Shape::Line,
                x: grid.clone(),
                y: model,
            };
            let dots = Curve {
                name: format!("{name}, in flight"),
                color,
                shape: Shape::Dots,
                x: points.iter().map(|point| point.frequency).collect(),
                y: points.iter().map(|point| of(point.measured)).collect(),
            };
            [line, dots]
        });
        Panel {
            x_label: "frequency, rad/s".into(),
            y_label: label.into(),
            log_x: true,
            curves: curves.collect(),
            ..Panel::default()
        }
    };
    Figure {
        title: format!("{title}: return ratio"),
        columns: 1,
        legend: Legend::Above,
        panels: vec![
            panel("|L|, dB", &|l| decibel(l.norm())),
            // From 0 down to −360 deg, so that a curve around −180 deg does not jump.
            panel("arg L, deg", &|l| (l.arg().to_degrees() - 360.0) % 360.0),
        ],
    }
}
