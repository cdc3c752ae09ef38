//! The command `margins`.

use crate::accepted;
use crate::arguments::Subject;
use crate::failure::Failure;
use crate::picture;
use clap::Args;
use cosim::error::Error;
use cosim::interrupt::Interrupt;
use cosim_report::figure::{Color, Curve, Figure, Panel, Shape, svg};
use fmi_master::quantity::rounded;
use linear::Matrix;
use linear::curves::{ResponseCurves, excluded};
use linear::linearise::Linearised;
use linear::margins::{self, Crossing, LoopMargins, Margins};
use linear::model::{OpenLoop, Step};
use serde_json::{Value, json};
use std::fs;
use std::io::Write;
use std::path::PathBuf;

/// Refusal of `--guarantee`.
const NO_ANSWERS: &str =
    "--guarantee: the experiment has no [observe.guarantee.accepted], or its FMUs no guarantee";

/// Arguments of `margins`.
#[derive(Args)]
pub(crate) struct PrintMargins {
    /// Time of the run at which it is linearised, s [default: that of the experiment's
    /// [observe.margins]].
    #[arg(long, value_name = "SECONDS", help_heading = "Linearisation")]
    at: Option<f64>,
    /// Signals at which the loop is opened: connected inputs or outputs, as `plant.moment.*`. The
    /// option may be given several times [default: those of [observe.margins]].
    #[arg(long, value_name = "SIGNAL", help_heading = "Linearisation")]
    open: Vec<String>,
    /// Print JSON, for other programs.
    #[arg(long)]
    pub(crate) json: bool,
    /// File for the open loop as a discrete state-space model (JSON).
    #[arg(long, value_name = "FILE")]
    model: Option<PathBuf>,
    /// File for a Nichols plot of the return ratio and a plot of the sensitivity (.svg).
    #[arg(long, value_name = "FILE")]
    plot: Option<PathBuf>,
    /// Print instead which bounds the controller's guarantee accepts, without a flight: the largest
    /// disturbance and the like, with the gains as they are set and by rule.
    #[arg(long, conflicts_with_all = ["at", "open", "model", "plot"])]
    guarantee: bool,
    #[command(flatten)]
    pub(crate) subject: Subject,
}

impl PrintMargins {
    fn print_accepted(&self, out: &mut impl Write, interrupt: &Interrupt) -> Result<(), Failure> {
        let (mut system, _) = self.subject.system(&self.subject.path()?)?;
        let guarantee = system.experiment.observe.guarantee.clone();
        let given = guarantee.filter(|guarantee| system.has(&guarantee.in_force));
        let asked = given.and_then(|guarantee| guarantee.accepted);
        let asked = asked.ok_or_else(|| Error::experiment(NO_ANSWERS))?;
        let answers = accepted::answers(&mut system, &asked, interrupt)?;
        if self.json {
            return Ok(writeln!(out, "{:#}", json!(answers))?);
        }
        Ok(accepted::write(&answers, out)?)
    }

    fn linearise(&self, interrupt: &Interrupt) -> Result<Linearised, Failure> {
        let (system, _) = self.subject.system(&self.subject.path()?)?;
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
        let linearise = || linear::linearise::linearise(system.clone(), at, &open, interrupt);
        Ok(system.apart(interrupt, linearise)?)
    }
}

/// Returns the model as JSON.
fn model(found: &Linearised) -> Value {
    let mut model = state_space(&found.open);
    model["time"] = json!(found.time);
    model["note"] = json!(found.note);
    if let Some(sides) = &found.sides {
        let [increases, decreases] = sides.each_ref().map(state_space);
        model["sides"] = json!({ "increases": increases, "decreases": decreases });
    }
    model
}

fn state_space(open: &OpenLoop) -> Value {
    let Step { a, b, c, d } = &open.step;
    let rows = |matrix: &Matrix| -> Vec<Vec<f64>> {
        matrix.row_iter().map(|row| row.iter().copied().collect()).collect()
    };
    json!({
        "period": open.period,
        "samples": open.samples,
        "signals": open.signals,
        "a": rows(a), "b": rows(b), "c": rows(c), "d": rows(d),
    })
}

/// Prints the margins of an experiment.
pub(crate) fn print(
    asked: &PrintMargins,
    out: &mut impl Write,
    interrupt: &Interrupt,
) -> Result<(), Failure> {
    if asked.guarantee {
        return asked.print_accepted(out, interrupt);
    }
    picture::check(asked.plot.as_deref())?;
    let found = asked.linearise(interrupt)?;
    let margins = margins::margins(&found.open);
    if let Some(path) = &asked.plot {
        svg::write(&figure(&found, &margins)?, path)?;
    }
    if let Some(path) = &asked.model {
        fs::write(path, format!("{}\n", model(&found))).map_err(Error::file(path))?;
    }
    let sides = found.sides.as_ref().map(|sides| sides.each_ref().map(margins::margins));
    let mut value = serde_json::to_value(&margins).unwrap_or_default();
    value["time"] = json!(found.time);
    value["period"] = json!(found.open.period);
    value["note"] = json!(found.note);
    if let Some([increases, decreases]) = &sides {
        value["sides"] = json!({ "increases": increases, "decreases": decreases });
    }
    if asked.json {
        return Ok(writeln!(out, "{value:#}")?);
    }
    writeln!(
        out,
        "t = {} s, {} states, period {} s",
        rounded(found.time),
        found.open.step.a.nrows(),
        rounded(found.open.period)
    )?;
    writeln!(out, "  {}", found.note)?;
    write_table(&margins, out)?;
    for (title, side) in ["increases", "decreases"].iter().zip(sides.iter().flatten()) {
        writeln!(out, "\nthe loop has an edge here; for {title} of every signal:")?;
        write_table(side, out)?;
    }
    Ok(())
}

/// Draws the return ratio at the signal with the smallest disk margin in a Nichols plot, with the
/// set that it does not enter, and the sensitivity over the frequency.
fn figure(found: &Linearised, margins: &Margins) -> Result<Figure, Failure> {
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
    let title = format!("Return ratio and sensitivity at t = {} s", rounded(found.time));
    let nichols = Panel::new("phase of L, deg", "|L|, dB", vec![excluded, ratio]);
    let sensitivity =
        Panel { log_x: true, ..Panel::new("frequency, rad/s", "σ̄(S), dB", vec![sensitivity]) };
    Ok(Figure::new(title, 2, vec![nichols, sensitivity]))
}

fn write_table(margins: &Margins, out: &mut impl Write) -> Result<(), Failure> {
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
