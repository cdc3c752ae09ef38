//! The command `judge`: another program flies a run, and its results are those of `run`.

use crate::failure::Failure;
use cosim::check::check;
use cosim::error::Error;
use cosim::experiment::{Experiment, Overrides};
use cosim::files;
use cosim::interrupt::Interrupt;
use cosim::metadata;
use cosim::recorder::Format;
use cosim::system::Opened;
use cosim_report::folder::Folder;
use cosim_report::metrics::{Meters, Metrics};
use cosim_report::panels::Panel;
use cosim_report::plot::Curves;
use std::path::{Path, PathBuf};
use sweep::outside;

/// Asks the program at the other end of standard input and output for a run of an experiment, and
/// writes the files that `run` would write.
///
/// # Errors
/// Returns an error if the experiment is faulty, if the run failed, or if a file cannot be written.
pub(crate) fn judge(
    experiment: &Path,
    overrides: &Overrides,
    law: Option<&str>,
    fmu_dirs: &[PathBuf],
    out: &Path,
) -> Result<(), Failure> {
    let mut experiment = Experiment::load(experiment)?;
    experiment.apply(overrides)?;
    if let Some(law) = law {
        experiment.name_law(law, overrides);
    }
    let mut system = check(experiment, fmu_dirs, &mut Opened::default())?;
    if system.experiment.observe.margins.is_some() {
        let problem = "[observe.margins] is for FMUs, not for a law in another program";
        return Err(Error::experiment(problem).into());
    }
    let mut meters = Meters::new(&mut system)?.ending_when_lost();
    let panels = Panel::resolve_all(&mut system)?;
    let folder = Folder::take(out)?;
    folder.clear()?;
    let mut recorder = system.recorder(out, Format::Csv, false)?;
    let mut curves = Curves::new(panels, system.clock.ticks());
    let outcome = outside::fly(&system, None, &[], &mut [&mut curves, &mut recorder, &mut meters]);
    if matches!(outcome, Err(Error::Experiment { .. })) {
        // The other program failed, which is no result of the run.
        recorder.finish()?;
        folder.clear()?;
        return Ok(outcome?);
    }
    let mut write = || -> Result<(), Failure> {
        recorder.finish()?;
        let mut master = system.start(&Interrupt::default())?;
        let parameters = system.parameters(&mut master)?;
        let metadata = metadata::metadata(&system, &parameters, None, outcome.as_ref().err());
        files::write_json(&out.join("results.json"), &metadata)?;
        // How long the other program took is not known here.
        let wall_s = f64::NAN;
        let metrics = Metrics { wall_s, loop_delay_s: system.loop_delay(), ..meters.metrics() };
        files::write_json(&out.join("metrics.json"), &metrics)?;
        curves.draw(&out.join("plot.svg"), &system.experiment.title)?;
        Ok(())
    };
    let written = write();
    // The reason why the run ended comes first, as in `run`.
    outcome?;
    written
}
