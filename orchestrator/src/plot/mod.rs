//! The command `plot`: draws recorded runs over one another.

mod read;

use crate::failure::Failure;
use crate::picture;
use clap::Args;
use cosim::error::Error;
use cosim_report::figure::svg;
use cosim_report::recording::{Recording, asked as drawn, panels};
use cosim_report::run_page;
use std::io::Write;
use std::path::PathBuf;

/// Options of `plot`.
#[derive(Args)]
pub(crate) struct Plot {
    /// Run to draw: a folder of results (also by its name below out), or its results.csv.
    /// Several runs are drawn over one another.
    #[arg(required = true, value_name = "RUN")]
    runs: Vec<PathBuf>,
    /// Signal to draw: a variable, a pattern with an asterisk as `plant.rate.*`, or a difference or
    /// norm as in an experiment. The option may be given several times [default: those that the
    /// experiment draws].
    #[arg(long, value_name = "SIGNAL")]
    signals: Vec<String>,
    /// Begin at this time, s.
    #[arg(long, value_name = "SECONDS", value_parser = instant, allow_negative_numbers = true)]
    from: Option<f64>,
    /// End at this time, s.
    #[arg(long, value_name = "SECONDS", value_parser = instant, allow_negative_numbers = true)]
    to: Option<f64>,
    /// File to write: a picture (.svg), or a page with the vehicle in motion (.html).
    #[arg(long, value_name = "FILE", default_value = "plot.svg")]
    out: PathBuf,
}

/// Reads a time, s.
fn instant(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(time) if f64::is_finite(time) => Ok(time),
        _ => Err("it must be a finite number of seconds".into()),
    }
}

impl Plot {
    /// Reads the runs, cut to the times that are asked for.
    fn recordings(&self) -> Result<Vec<Recording>, Error> {
        if self.runs.len() > panels::CURVES {
            return Err(Error::experiment(format!(
                "{} runs: at most {} can be distinguished in a picture",
                self.runs.len(),
                panels::CURVES
            )));
        }
        if let (Some(from), Some(to)) = (self.from, self.to)
            && from >= to
        {
            return Err(Error::experiment(format!("--from {from} must be below --to {to}")));
        }
        let mut runs = Vec::new();
        for path in &self.runs {
            let run = read::recording(path)?;
            let span = match (run.time.first(), run.time.last()) {
                (Some(first), Some(last)) => format!("it goes from {first} s to {last} s"),
                _ => "it has no rows".into(),
            };
            let run = run.within(self.from, self.to);
            if run.time.len() < 2 {
                return Err(Error::experiment(format!(
                    "{}: there is nothing to draw in this time; {span}",
                    path.display()
                )));
            }
            runs.push(run);
        }
        // Runs of the same name are distinguished by their paths.
        let names: Vec<String> = runs.iter().map(|run| run.name.clone()).collect();
        for (place, run) in runs.iter_mut().enumerate() {
            if names.iter().filter(|name| **name == names[place]).count() > 1 {
                run.name = self.runs[place].display().to_string();
            }
        }
        Ok(runs)
    }
}

/// Draws runs into a file, and prints its name.
///
/// # Errors
/// Returns an error if a run cannot be read, if a signal is recorded in none of them, or if the
/// file cannot be written.
pub(crate) fn plot(asked: &Plot, out: &mut impl Write) -> Result<(), Failure> {
    let ending = picture::ending(&asked.out, "--out", &["svg", "html"])?;
    let runs = asked.recordings()?;
    let panels = if asked.signals.is_empty() {
        drawn::of_experiments(&runs)
    } else {
        drawn::of_signals(&runs, &asked.signals).map_err(|problem| format!("--signals: {problem}"))
    };
    let panels = panels.map_err(Error::experiment)?;
    if panels.is_empty() {
        return Err(Error::experiment("nothing that could be drawn is recorded").into());
    }
    if ending == "html" {
        run_page::write(&runs, &panels, &asked.out)?;
    } else if asked.signals.is_empty() {
        svg::write(&run_page::figure::figure(&runs, &panels), &asked.out)?;
    } else {
        svg::write(&run_page::figure::of_panels(&runs, &panels), &asked.out)?;
    }
    writeln!(out, "{}", asked.out.display())?;
    Ok(())
}
