//! The command `judge`: another program has flown a run, and gets the files that `run` would write.
//!
//! It is asked by a line of JSON on standard output for variables, each with whether it is read
//! after the step that begins at a communication point, because it responds to the inputs there. It
//! answers by their values at each communication point, as 64-bit floats in little-endian order.

use crate::failure::Failure;
use cosim::check::check;
use cosim::error::Error;
use cosim::experiment::Experiment;
use cosim::files;
use cosim::interrupt::Interrupt;
use cosim::metadata;
use cosim::run::{Observer, Sample};
use cosim::system::{Opened, Parameters, System};
use cosim_metrics::folder::Folder;
use cosim_metrics::metrics::{Meters, Metrics};
use cosim_report::recording::watch::Watch;
use serde_json::json;
use std::io::{Read, Write, stdin, stdout};
use std::path::{Path, PathBuf};

/// Asks for the values of a run of an experiment, and writes its results.
///
/// # Errors
/// Returns an error if the experiment is faulty, if the other program does not answer, or if a file
/// cannot be written.
pub(crate) fn judge(experiment: &Path, fmu_dirs: &[PathBuf], out: &Path) -> Result<(), Failure> {
    let mut system = check(Experiment::load(experiment)?, fmu_dirs, &mut Opened::default())?;
    let mut meters = Meters::new(&mut system)?.ending_when_lost();
    let mut watch = Watch::new(&mut system)?;
    let outcome = show(&system, &mut [&mut watch, &mut meters]);
    if let Err(error @ Error::Experiment { .. }) = outcome {
        return Err(error.into());
    }
    let _folder = Folder::take(out)?;
    let interrupt = Interrupt::default();
    let parameters = system.apart(&interrupt, || {
        let mut run = system.start(&interrupt)?;
        Ok(json!(system.parameters(&mut run)?).to_string())
    })?;
    let parameters: Parameters =
        serde_json::from_str(&parameters).map_err(|error| Error::experiment(error.to_string()))?;
    let metadata = metadata::metadata(&system, &parameters, None, outcome.as_ref().err());
    files::write_json(&out.join("results.json"), &metadata)?;
    // How long the other program took is not known here.
    let wall_s = f64::NAN;
    let metrics = Metrics { wall_s, loop_delay_s: system.loop_delay(), ..meters.metrics() };
    files::write_json(&out.join("metrics.json"), &metrics)?;
    watch.draw(&out.join("plot.svg"), &system.experiment.title)?;
    // The reason why the run ended comes last, as in `run`.
    Ok(outcome?)
}

/// Shows the values of the other program to the observers.
fn show(system: &System, observers: &mut [&mut dyn Observer]) -> Result<(), Error> {
    let ended = |error: std::io::Error| {
        Error::experiment(format!("the program that has flown the run ended: {error}"))
    };
    let variables = system.probed();
    let asked = serde_json::to_string(&variables).map_err(|error| ended(error.into()))?;
    let mut output = stdout().lock();
    writeln!(output, "{asked}").and_then(|()| output.flush()).map_err(ended)?;
    let mut input = stdin().lock();
    let (mut bytes, mut values) = (vec![0; 8 * variables.len()], vec![0.0; variables.len()]);
    for tick in 0..=system.clock.ticks() {
        input.read_exact(&mut bytes).map_err(ended)?;
        for (value, bytes) in values.iter_mut().zip(bytes.as_chunks::<8>().0) {
            *value = f64::from_le_bytes(*bytes);
        }
        let (time, last) = (system.clock.time(tick), tick == system.clock.ticks());
        let sample = Sample { tick, time, last, values: &values };
        observers.iter_mut().try_for_each(|observer| observer.observe(&sample))?;
    }
    Ok(())
}
