//! Arguments that several commands have.

use crate::failure::Failure;
use clap::Args;
use cosim::check::check;
use cosim::experiment::{Experiment, Overrides};
use cosim::interrupt::Interrupt;
use cosim::search::named::{Kind, find};
use cosim::ssp;
use cosim::system::{Opened, System};
use std::path::{Path, PathBuf};
use sweep::runner;

/// Experiment with the changes that the command line makes to it.
#[derive(Args, Default)]
pub(crate) struct Subject {
    /// Experiment: a file, an SSP archive, or the name of an experiment that `list` shows.
    pub(crate) experiment: PathBuf,
    /// Also look for FMUs in this folder, besides those of the experiment and the program. The
    /// option may be given several times.
    #[arg(long, value_name = "DIR")]
    pub(crate) fmu_dir: Vec<PathBuf>,
    // The heading of these would apply to all arguments that follow.
    #[command(flatten)]
    pub(crate) overrides: Overrides,
}

impl Subject {
    /// Finds the file of the experiment.
    ///
    /// # Errors
    /// Returns an error if there is none.
    pub(crate) fn path(&self) -> Result<PathBuf, Failure> {
        Ok(find(&self.experiment, Kind::Experiment)?)
    }

    /// Checks the experiment or the SSP archive in this file. The entries of an archive are needed
    /// for the names of its FMUs in errors.
    ///
    /// # Errors
    /// Returns an error if anything is wrong with the experiment or the archive.
    pub(crate) fn system(&self, path: &Path) -> Result<(System, Option<ssp::Entries>), Failure> {
        if path.extension().is_some_and(|extension| extension == "ssp") {
            let ssp::Loaded { experiment, mut opened, entries } = ssp::load(path, &self.overrides)?;
            let system = check(experiment, &self.fmu_dir, &mut opened);
            return Ok((system.map_err(|error| entries.named(error))?, Some(entries)));
        }
        let mut experiment = Experiment::load(path)?;
        experiment.apply(&self.overrides)?;
        Ok((check(experiment, &self.fmu_dir, &mut Opened::default())?, None))
    }
}

/// Options of a command that flies many cases.
#[derive(Args)]
pub(crate) struct Many {
    /// Folder for the results [default: one below out, with the name of the study or campaign].
    #[arg(long, value_name = "DIR", help_heading = "Results")]
    pub(crate) out: Option<PathBuf>,
    /// Fly everything again, including what is finished.
    #[arg(long, visible_alias = "force", help_heading = "Results")]
    fresh: bool,
    /// Also look for FMUs in this folder, besides those of the experiments and the program. The
    /// option may be given several times.
    #[arg(long, value_name = "DIR")]
    pub(crate) fmu_dir: Vec<PathBuf>,
    /// Number of threads [default: one for each core].
    #[arg(long, value_name = "N", default_value_t = 0, hide_default_value = true)]
    jobs: usize,
    /// Show neither progress nor summary.
    #[arg(long)]
    pub(crate) quiet: bool,
}

impl Many {
    /// Returns the options of the cases.
    pub(crate) fn options(&self, interrupt: &Interrupt) -> runner::Options {
        runner::Options {
            out: self.out.clone(),
            jobs: self.jobs,
            fresh: self.fresh,
            quiet: self.quiet,
            interrupt: interrupt.clone(),
        }
    }
}
