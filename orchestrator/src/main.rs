//! The command line.

use clap::{Parser, Subcommand};
use orchestrator::error::Error;
use orchestrator::experiment::{Experiment, Overrides};
use orchestrator::run::{Options, Plan};
use orchestrator::{inspect, list, report};
use std::io::{BufWriter, IsTerminal, Write, stderr, stdout};
use std::path::PathBuf;
use std::process::ExitCode;
use tracing_subscriber::EnvFilter;

/// Runs FMI 2.0 co-simulation experiments.
///
/// Exit code 0: fine; 1: the run failed; 2: bad usage or a bad experiment. Log messages go to standard error; the
/// environment variable RUST_LOG chooses how many (error, warn, info, debug).
#[derive(Parser)]
#[command(version)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Run an experiment and write results.csv, results.json, metrics.json and plot.svg.
    Run {
        /// Experiment file.
        experiment: PathBuf,
        /// Folder for the results [default: out/<name of the experiment>].
        #[arg(long, value_name = "DIR")]
        out: Option<PathBuf>,
        /// A further folder with FMUs, besides the experiment's own and target/fmu. May be given several times.
        #[arg(long, value_name = "DIR")]
        fmu_dir: Vec<PathBuf>,
        #[command(flatten)]
        overrides: Overrides,
        /// No progress and no summary.
        #[arg(long)]
        quiet: bool,
    },
    /// Show the variables and capabilities of an FMU.
    Inspect {
        /// The archive.
        fmu: PathBuf,
    },
    /// List experiments and FMUs.
    List {
        /// Folder to look in.
        #[arg(default_value = ".")]
        folder: PathBuf,
    },
}

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    let filter = EnvFilter::try_from_default_env().unwrap_or_else(|_| EnvFilter::new("warn"));
    tracing_subscriber::fmt()
        .with_env_filter(filter)
        .with_writer(stderr)
        .with_ansi(stderr().is_terminal())
        .without_time()
        .with_target(false)
        .init();

    let mut out = BufWriter::new(stdout().lock());
    let outcome = execute(arguments.command, &mut out).and_then(|()| out.flush().map_err(Error::from));
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) if error.is_broken_pipe() => {
            // What could not be written must not be tried again when the writer is dropped.
            let _ = out.into_parts();
            ExitCode::SUCCESS
        }
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::from(error.exit_code())
        }
    }
}

fn execute(command: Command, out: &mut impl Write) -> Result<(), Error> {
    match command {
        Command::Run { experiment, out: folder, fmu_dir, overrides, quiet } => {
            let mut experiment = Experiment::load(&experiment)?;
            experiment.apply(&overrides)?;
            let report = Plan::new(experiment, &fmu_dir)?.run(&Options { out: folder, quiet })?;
            if !quiet {
                report::summary(&report, out)?;
            }
            Ok(())
        }
        Command::Inspect { fmu } => inspect::inspect(&fmu, out),
        Command::List { folder } => list::list(&folder, out),
    }
}
