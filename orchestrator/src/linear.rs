//! The commands `linearise` and `margins`.

use crate::failure::Failure;
use crate::picture;
use crate::run;
use clap::Args;
use cosim::error::Error;
use cosim::experiment::Overrides;
use cosim::interrupt::Interrupt;
use cosim::search::named::{Kind, find};
use cosim::system::System;
use cosim_report::figure::{Color, Curve, Figure, Legend, Panel, Shape, svg};
use fmi_master::quantity::rounded;
use linear::curves::{ResponseCurves, excluded};
use linear::linearise::{Linearised, Lineariser};
use linear::margins::{Crossing, LoopMargins};
use linear::model::{OpenLoop, Step};
use linear::{Matrix, margins as analysis};
use serde_json::{Value, json};
use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

/// The loop to linearise, the instant, and where the loop is opened.
#[derive(Args)]
pub(crate) struct Instant {
    /// Experiment: a file, an SSP archive, or the name of an experiment that `list` shows.
    experiment: PathBuf,
    /// Time of the run at which it is linearised, s [default: that of the experiment's
    /// [observe.margins]].
    #[arg(long, value_name = "SECONDS", help_heading = "Linearisation")]
    at: Option<f64>,
    /// Signals at which the loop is opened: connected inputs or outputs, as `plant.moment.*`. The
    /// option may be given several times [default: those of [observe.margins]].
    #[arg(long, value_name = "SIGNAL", help_heading = "Linearisation")]
    open: Vec<String>,
    /// Also look for FMUs in this folder, besides those of the experiment and the program. The
    /// option may be given several times.
    #[arg(long, value_name = "DIR")]
    fmu_dir: Vec<PathBuf>,
    #[command(flatten)]
    pub(crate) overrides: Overrides,
}

impl Instant {
    /// Returns the system of the experiment, the time at which it is linearised (s), and the
    /// signals at which the loop is opened.
    pub(crate) fn system(&self) -> Result<(System, f64, Vec<String>), Failure> {
        let path = find(&self.experiment, Kind::Experiment)?;
        let (system, _) = run::system(&path, &self.overrides, &self.fmu_dir)?;
        let asked = system.experiment.observe.margins.clone();
        let missing = |option: &str| {
            let problem = format!(
                "{option} is missing: the experiment has no [observe.margins] that gives it"
            );
            Error::experiment(problem)
        };
        let at = self.at.or(asked.as_ref().map(|asked| asked.at));
        let at = at.ok_or_else(|| missing("--at SECONDS"))?;
        let mut open = self.open.clone();
        if open.is_empty() {
            open = asked.ok_or_else(|| missing("--open SIGNAL"))?.open;
        }
        Ok((system, at, open))
    }

    fn linearise(&self, interrupt: &Interrupt) -> Result<Linearised, Failure> {
        let (system, at, open) = self.system()?;
        // What is wrong with the arguments comes first.
        Lineariser::new(system.clone(), at, &open)?;
        refuse_closed(&system)?;
        Ok(linear::linearise::linearise(system, at, &open, interrupt)?)
    }
}

/// Refuses a system whose instances are to run in a closed process, as a model is needed in this
/// one.
pub(crate) fn refuse_closed(system: &System) -> Result<(), Error> {
    if !system.is_closed {
        return Ok(());
    }
    let problem = "its FMUs are to run in a closed process, which gives no model: --isolate=false puts them into this one";
    Err(Error::experiment(problem))
}

/// Arguments of `linearise`.
#[derive(Args)]
pub(crate) struct Linearise {
    /// File for the model [default: standard output].
    #[arg(long, value_name = "FILE")]
    pub(crate) out: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) instant: Instant,
}

/// Arguments of `margins`.
#[derive(Args)]
pub(crate) struct PrintMargins {
    /// Print JSON, for other programs.
    #[arg(long)]
    pub(crate) json: bool,
    /// Also write the margins to this file, as JSON.
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// File for a Nichols plot of the return ratio and a plot of the sensitivity (.svg).
    #[arg(long, value_name = "FILE")]
    plot: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) instant: Instant,
}

/// Writes the open loop of an experiment.
pub(crate) fn linearise(
    asked: &Linearise,
    out: &mut impl Write,
    interrupt: &Interrupt,
) -> Result<(), Failure> {
    let found = asked.instant.linearise(interrupt)?;
    let mut model = model(&found.open);
    model["time"] = json!(found.time);
    model["notes"] = json!(found.notes);
    if let Some(sides) = &found.sides {
        let [increases, decreases] = sides.each_ref().map(|net| self::model(&net.open()));
        model["sides"] = json!({ "increases": increases, "decreases": decreases });
    }
    let text = format!("{}\n", serde_json::to_string(&model).unwrap_or_default());
    match &asked.out {
        Some(path) => fs::write(path, text).map_err(Error::file(path))?,
        None => out.write_all(text.as_bytes())?,
    }
    Ok(())
}

fn model(open: &OpenLoop) -> Value {
    let Step { a, b, c, d } = &open.step;
    let rows = |matrix: &Matrix| -> Vec<Vec<f64>> {
        matrix.row_iter().map(|row| row.iter().copied().collect()).collect()
    };
    json!({
        "period": open.period,
        "samples": open.samples,
        "signals": open.signals,
        "states": open.states,
        "a": rows(a), "b": rows(b), "c": rows(c), "d": rows(d),
    })
}

/// Writes JSON to the file that is asked for, if there is one.
pub(crate) fn keep(path: Option<&Path>, value: &Value) -> Result<(), Error> {
    path.map_or(Ok(()), |path| fs::write(path, format!("{value:#}\n")).map_err(Error::file(path)))
}

/// Prints the margins of an experiment.
pub(crate) fn margins(
    asked: &PrintMargins,
    out: &mut impl Write,
    interrupt: &Interrupt,
) -> Result<(), Failure> {
    picture::check(asked.plot.as_deref())?;
    let found = asked.instant.linearise(interrupt)?;
    let margins = analysis::margins(&found.net, &found.open);
    if let Some(path) = &asked.plot {
        svg::write(&figure(&found, &margins)?, path)?;
    }
    let sides = found
        .sides
        .as_ref()
        .map(|sides| sides.each_ref().map(|net| analysis::margins(net, &net.open())));
    let mut value = serde_json::to_value(&margins).unwrap_or_default();
    value["time"] = json!(found.time);
    value["period"] = json!(found.open.period);
    value["notes"] = json!(found.notes);
    if let Some([increases, decreases]) = &sides {
        value["sides"] = json!({ "increases": increases, "decreases": decreases });
    }
    keep(asked.out.as_deref(), &value)?;
    if asked.json {
        return Ok(writeln!(out, "{value:#}")?);
    }
    writeln!(
        out,
        "t = {} s, {} states, period {} s",
        rounded(found.time),
        found.open.states.len(),
        rounded(found.open.period)
    )?;
    for note in &found.notes {
        writeln!(out, "  {note}")?;
    }
    print(&margins, out)?;
    for (title, side) in ["increases", "decreases"].iter().zip(sides.iter().flatten()) {
        writeln!(out, "\na component has an edge here; for {title} of every input:")?;
        print(side, out)?;
    }
    Ok(())
}

/// Draws the return ratio at the signal with the smallest disk margin in a Nichols plot, with the
/// set that it does not enter, and the sensitivity over the frequency.
fn figure(found: &Linearised, margins: &analysis::Margins) -> Result<Figure, Failure> {
    let curves = ResponseCurves::of(found);
    let worst = margins.loops.iter().min_by(|a, b| a.disk.alpha.total_cmp(&b.disk.alpha));
    let (Some(curves), Some(worst)) = (curves, worst) else {
        let problem = format!("--plot: the loop is unstable at t = {} s", rounded(found.time));
        return Err(Error::experiment(problem).into());
    };
    // From 2 on the set has no edge.
    let alpha = worst.disk.alpha.min(1.999);
    let (x, y) = excluded(alpha);
    let excluded =
        Curve::new(&format!("disk margin {alpha:.3}"), Color::LIMIT, Shape::Dashed, x, y);
    let ratio = Curve::new(&worst.signal, Color::CURVES[0], Shape::Line, curves.phase, curves.gain);
    let sensitivity =
        Curve::new("all together", Color::INK, Shape::Line, curves.frequency, curves.sensitivity);
    let panel = |x_label: &str, y_label: &str, log_x, curves| Panel {
        x_label: x_label.into(),
        y_label: y_label.into(),
        log_x,
        curves,
        ..Panel::default()
    };
    Ok(Figure {
        title: format!("Return ratio and sensitivity at t = {} s", rounded(found.time)),
        columns: 2,
        legend: Legend::Above,
        panels: vec![
            panel("phase of L, deg", "|L|, dB", false, vec![excluded, ratio]),
            panel("frequency, rad/s", "σ̄(S), dB", true, vec![sensitivity]),
        ],
    })
}

fn print(margins: &analysis::Margins, out: &mut impl Write) -> Result<(), Failure> {
    if !margins.stable {
        writeln!(
            out,
            "unstable: an eigenvalue of the closed loop has the magnitude {:.6}",
            margins.spectral_radius
        )?;
        return Ok(());
    }
    writeln!(
        out,
        "{:<24} {:>16} {:>10} {:>10} {:>7} {:>11} {:>7}",
        "signal", "gain", "phase deg", "delay s", "disk", "at rad/s", "max |S|"
    )?;
    for row in margins.loops.iter().chain(&margins.together) {
        let LoopMargins { signal, classical, disk, sensitivity } = row;
        let shown = |crossing: Option<Crossing>, digits: usize| {
            crossing.map_or("none".into(), |crossing| format!("{:.digits$}", crossing.value))
        };
        let gain =
            format!("{} to {}", shown(classical.gain_below, 3), shown(classical.gain_above, 3));
        writeln!(
            out,
            "{signal:<24} {gain:>16} {:>10} {:>10} {:>7.3} {:>11.3} {:>7.3}",
            shown(classical.phase, 2),
            classical.delay.map_or_else(
                || format!("> {:.3}", classical.longest_delay),
                |crossing| format!("{:.4}", crossing.value)
            ),
            disk.alpha,
            disk.frequency,
            sensitivity.value
        )?;
    }
    Ok(())
}
