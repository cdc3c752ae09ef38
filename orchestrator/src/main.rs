//! The command line of the orchestrator.

use clap::{CommandFactory, Parser, Subcommand};
mod arguments;
mod campaign;
mod catalogue;
mod failure;
mod inspect;
mod isolated;
mod judge;
mod linear;
mod list;
mod live;
mod pack;
mod plain;
mod response;
mod run;
mod schema;
mod show;
mod summary;

use arguments::choice;
use catalogue::Filter;
use cosim::interrupt::Interrupt;
use cosim::pacing::{self, Factor, OnMiss};
use cosim::search;
use failure::Failure;
use fmu_import::crash;
use live::log::Messages;
use plain::{Plain, plain};
use run::{Files, Options};
use std::io::{BufWriter, IsTerminal, Write, stderr, stdout};
use std::path::PathBuf;
use std::process::ExitCode;
use study::definition::Study;
use study::reproduce;
use tracing_subscriber::EnvFilter;

/// Runs FMI 2.0 co-simulation experiments.
///
/// The exit code is 0 if all went well, 1 if a run failed, 2 for bad usage or a bad experiment, 3
/// if the attitude was lost as the experiment defines it, and 130, 143 or 129 if Ctrl-C, SIGTERM or
/// SIGHUP ended the run. Log messages go to standard error; the environment variable RUST_LOG
/// chooses how many there are (error, warn, info, debug).
///
/// Experiments and FMUs are also looked for beside the program and in the folders of the
/// environment variable ORCHESTRATOR_PATH.
#[derive(Parser)]
#[command(version)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Run an experiment and write results.csv, results.json, metrics.json and plot.svg.
    ///
    /// With --real-time the run keeps in step with the wall clock; the summary, metrics.json and
    /// realtime.svg show how well it did. Ctrl-C, SIGTERM and SIGHUP end a run and keep its
    /// results.
    Run {
        /// Experiment to run: a file, an SSP archive, or the name of an experiment that `list`
        /// shows.
        experiment: PathBuf,
        /// Folder for the results [default: out/EXPERIMENT].
        #[arg(long, value_name = "DIR")]
        out: Option<PathBuf>,
        /// Also look for FMUs in this folder, besides the folder of the experiment and target/fmu.
        /// The option may be given several times.
        #[arg(long, value_name = "DIR")]
        fmu_dir: Vec<PathBuf>,
        #[command(flatten)]
        overrides: arguments::Overrides,
        /// Show neither progress nor summary.
        #[arg(long)]
        quiet: bool,
        /// Keep the run in step with the wall clock, FACTOR times as fast as real time. FACTOR is 1
        /// if it is left out.
        #[arg(long, value_name = "FACTOR", num_args = 0..=1, default_missing_value = "1", allow_negative_numbers = true)]
        real_time: Option<Factor>,
        /// Choose what happens after a missed deadline, that is, if the values that a component
        /// computes at one of its communication points are not ready at its next one. All missed
        /// deadlines are counted and reported.
        #[arg(long, value_parser = choice::<OnMiss>(&[]), default_value = "catch-up", requires = "real_time")]
        on_miss: OnMiss,
        /// Ask for real-time scheduling (SCHED_FIFO with this priority, 1 to 99; 50 if it is left
        /// out) and for memory that is never swapped out. If the system refuses either, the refusal
        /// is reported and the run continues without it.
        #[arg(long, value_name = "PRIORITY", num_args = 0..=1, default_missing_value = "50", requires = "real_time",
              value_parser = clap::value_parser!(u8).range(1..=99))]
        priority: Option<u8>,
        /// Show the run on the terminal while it is in progress. The key q ends the run and keeps
        /// its results.
        #[arg(long, conflicts_with = "quiet")]
        live: bool,
        #[command(flatten)]
        files: Files,
        /// Replace the results of an earlier run in the folder. Without this option they are left
        /// alone and nothing is run.
        #[arg(long)]
        force: bool,
    },
    /// Repeat a paper's comparison and write report.html, with figures, tables and a verdict on
    /// each claim.
    ///
    /// Finished parts are kept. After an interruption the same command continues where it stopped.
    Reproduce {
        /// Study to run: a folder below orchestrator/experiments, a folder with a study.toml, or
        /// such a file.
        study: PathBuf,
        /// Folder for the results [default: out/STUDY].
        #[arg(long, value_name = "DIR")]
        out: Option<PathBuf>,
        /// Also look for FMUs in this folder, besides the folder of the study and target/fmu. The
        /// option may be given several times.
        #[arg(long, value_name = "DIR")]
        fmu_dir: Vec<PathBuf>,
        /// Number of threads [default: one for each core].
        #[arg(long, value_name = "N", default_value_t = 0, hide_default_value = true)]
        jobs: usize,
        /// Run at most N cases of each run, for a quick look.
        #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
        members: Option<u64>,
        /// Run everything again, including what is finished.
        #[arg(long)]
        fresh: bool,
        /// Show neither progress nor summary.
        #[arg(long)]
        quiet: bool,
    },
    /// Fly thousands of cases of an experiment in which parameters vary, and write cases.parquet,
    /// summary.json and report.html: how often limits are broken, with which confidence, and the
    /// worst cases.
    ///
    /// Finished cases are kept. After an interruption the same command continues where it stopped.
    Campaign(campaign::Fly),
    /// Look for the worst case of a campaign, and write it as an experiment.
    Falsify(campaign::Falsify),
    /// Linearise an experiment at an instant of its run, and write the open loop as a discrete
    /// state-space model (JSON).
    ///
    /// Components with derivatives give them; of all others the responses to small changes are
    /// taken from a kept state and realised as a model.
    Linearise(linear::Linearise),
    /// Print the stability margins of an experiment at an instant of its run: gain, phase and delay
    /// of each signal, disk margins of each and of all together.
    Margins(linear::PrintMargins),
    /// Measure the frequency response of an experiment's loop in flight, with a sine added at each
    /// opened signal, and compare it with that of the linear model.
    Response(response::Response),
    /// Judge a run that the program at the other end of standard input and output flies, as the
    /// Python package does, and write the files that `run` writes.
    #[command(hide = true)]
    Judge {
        /// Experiment that is flown: a file, or the name of an experiment.
        experiment: PathBuf,
        /// Name of the law that is flown in place of the last FMU of --fmu.
        #[arg(long)]
        law: Option<String>,
        /// Folder for the results.
        #[arg(long, value_name = "DIR")]
        out: PathBuf,
        /// Also look for FMUs in this folder.
        #[arg(long, value_name = "DIR")]
        fmu_dir: Vec<PathBuf>,
        #[command(flatten)]
        overrides: arguments::Overrides,
    },
    /// Write an experiment as an SSP archive (System Structure and Parameterization 1.0), FMUs
    /// included.
    Pack {
        /// Experiment to pack: a file, or the name of an experiment that `list` shows.
        experiment: PathBuf,
        /// Path of the archive [default: EXPERIMENT.ssp].
        #[arg(long, value_name = "FILE")]
        out: Option<PathBuf>,
        /// Also look for FMUs in this folder, besides the folder of the experiment and target/fmu.
        /// The option may be given several times.
        #[arg(long, value_name = "DIR")]
        fmu_dir: Vec<PathBuf>,
        #[command(flatten)]
        overrides: arguments::Overrides,
        /// Write no connectors for outputs that are enumerations, because libcosim aborts if there
        /// is one.
        #[arg(long)]
        no_enumerations: bool,
        /// Replace the archive if it exists.
        #[arg(long)]
        force: bool,
    },
    /// Show the variables and capabilities of an FMU.
    Inspect {
        /// Path of the FMU.
        fmu: PathBuf,
        #[command(flatten)]
        filter: Filter,
        /// Print JSON, for other programs.
        #[arg(long)]
        json: bool,
        /// Report the faults of the FMU and of its library instead. The exit code is 1 if there are
        /// any.
        #[arg(long, conflicts_with_all = ["json", "pattern", "causality"])]
        check: bool,
    },
    /// Print an experiment, a study or a campaign with all that it extends, templates and lists
    /// expanded.
    Show {
        /// What to print: a file, or the name of an experiment, a study or a campaign.
        name: PathBuf,
    },
    /// Print the JSON Schema of a kind of file, by which editors complete and check such files.
    Schema {
        /// Kind of file that the schema describes.
        #[arg(value_enum)]
        kind: schema::FileKind,
    },
    /// Write a script that completes commands and options in a shell, for example `orchestrator
    /// completions bash`.
    Completions {
        /// Shell that the script is for.
        shell: clap_complete::Shell,
    },
    /// List experiments, studies, campaigns and FMUs.
    List {
        /// Folder to search [default: the current one, and those where experiments and FMUs are
        /// found from any folder].
        folder: Option<PathBuf>,
    },
}

fn main() -> ExitCode {
    if let Some(code) = isolated::serve() {
        return code;
    }
    let _watch = crash::watch();
    let arguments = Arguments::parse();
    // A study may have a thousand runs, and its report counts their warnings. The results table of
    // a campaign holds the messages of instances.
    let usual = match arguments.command {
        Command::Reproduce { .. } => "error",
        Command::Campaign(_) | Command::Falsify(_) => "warn,fmu_import=off",
        _ => "warn",
    };
    let filter = EnvFilter::try_from_default_env().unwrap_or_else(|_| EnvFilter::new(usual));
    tracing_subscriber::fmt()
        .with_env_filter(filter)
        .with_writer(Messages::default)
        .with_ansi(stderr().is_terminal())
        .without_time()
        .with_target(false)
        .init();

    let mut out = Plain(BufWriter::new(stdout()));
    let interrupt = Interrupt::default();
    let outcome = execute(arguments.command, &mut out, &interrupt)
        .and_then(|()| out.flush().map_err(Failure::from));
    let all_freed = isolated::all_freed();
    match outcome {
        Ok(()) if all_freed => ExitCode::SUCCESS,
        // The results are complete, but freeing an instance failed.
        Ok(()) => ExitCode::FAILURE,
        Err(error) if error.is_broken_pipe() => {
            // Output that could not be written must not be written again when the writer is
            // dropped.
            let _ = out.0.into_parts();
            ExitCode::SUCCESS
        }
        Err(error) => {
            // If standard error cannot be written either, there is nobody left to tell.
            let _ = writeln!(stderr(), "error: {}", plain(&error.to_string()));
            ExitCode::from(error.exit_code())
        }
    }
}

fn execute(command: Command, out: &mut impl Write, interrupt: &Interrupt) -> Result<(), Failure> {
    let takes_long = matches!(
        command,
        Command::Run { .. }
            | Command::Reproduce { .. }
            | Command::Campaign(_)
            | Command::Falsify(_)
            | Command::Linearise(_)
            | Command::Margins(_)
            | Command::Response(_)
            | Command::Pack { .. }
    );
    if takes_long {
        interrupt.listen()?;
    }
    match command {
        Command::Run {
            experiment,
            out: folder,
            fmu_dir,
            overrides,
            quiet,
            real_time,
            on_miss,
            priority,
            live,
            files,
            force,
        } => {
            let real_time = real_time.map(|factor| pacing::Settings { factor, on_miss, priority });
            let options = Options {
                out: folder,
                quiet,
                real_time,
                live,
                files,
                force,
                interrupt: interrupt.clone(),
            };
            let experiment = search::experiment(&experiment)?;
            run::run(&experiment, &overrides.into(), &fmu_dir, &options, out)
        }
        Command::Reproduce { study, out: folder, fmu_dir, jobs, members, fresh, quiet } => {
            let study = Study::load_with(&reproduce::find(&study)?, members)?;
            let interrupt = interrupt.clone();
            let options = reproduce::Options {
                out: folder,
                fmu_dirs: fmu_dir,
                jobs,
                fresh,
                quiet,
                interrupt,
            };
            let report = reproduce::reproduce(&study, &options)?;
            if !quiet {
                summary::reproduction(&report, out)?;
            }
            Ok(())
        }
        Command::Campaign(asked) => campaign::fly(&asked, out, interrupt),
        Command::Falsify(asked) => campaign::falsify(&asked, out, interrupt),
        Command::Linearise(asked) => linear::linearise(&asked, out, interrupt),
        Command::Margins(asked) => linear::margins(&asked, out, interrupt),
        Command::Response(asked) => response::respond(&asked, out, interrupt),
        Command::Judge { experiment, law, out: folder, fmu_dir, overrides } => {
            let experiment = search::experiment(&experiment)?;
            judge::judge(&experiment, &overrides.into(), law.as_deref(), &fmu_dir, &folder)
        }
        Command::Pack { experiment, out: archive, fmu_dir, overrides, no_enumerations, force } => {
            let archive = pack::Archive { path: archive, enumerations: !no_enumerations, force };
            pack::pack(&experiment, &overrides.into(), &fmu_dir, archive, out, interrupt)
        }
        Command::Inspect { fmu, check: true, .. } => inspect::check(&fmu, out),
        Command::Inspect { fmu, filter, json, check: false } => {
            inspect::inspect(&fmu, &filter, json, out)
        }
        Command::Show { name } => show::show(&name, out),
        Command::Schema { kind } => Ok(out.write_all(schema::text(kind).as_bytes())?),
        Command::Completions { shell } => {
            clap_complete::generate(shell, &mut Arguments::command(), "orchestrator", out);
            Ok(())
        }
        Command::List { folder } => list::list(folder.as_deref(), out),
    }
}
