//! The command line: commands, their arguments and help texts.

use crate::{campaign, examples, inspect, margins, pack, plot, reproduce, run, schema};
use clap::{Arg, CommandFactory, FromArgMatches, Parser, Subcommand};
use std::path::PathBuf;

/// Runs experiments with FMUs of FMI 2.0 and 3.0, for co-simulation or model exchange.
///
/// The exit code is 0 if all went well, 1 if a run failed, 2 for bad usage or a bad experiment, 3
/// if the attitude was lost as the experiment defines it, and 130, 143 or 129 if Ctrl-C, SIGTERM or
/// SIGHUP ended the run. Log messages go to standard error; the environment variable RUST_LOG
/// chooses how many there are (error, warn, info, debug).
///
/// Experiments and FMUs are also looked for beside the program and in the folders of the
/// environment variable ORCHESTRATOR_PATH.
#[derive(Parser)]
#[command(version, name = "orchestrator", max_term_width = 80)]
pub(crate) struct Arguments {
    #[command(subcommand)]
    pub(crate) command: Command,
}

/// Returns the definition of the command line.
pub(crate) fn definition() -> clap::Command {
    // A negative number is the value of its option, which is then blamed for it.
    let with_negative_values = |argument: Arg| {
        let is_option = !argument.is_positional() && argument.get_action().takes_values();
        argument.allow_negative_numbers(is_option)
    };
    Arguments::command().mut_subcommands(|command| {
        let examples = (!command.is_hide_set()).then(|| examples::of(command.get_name()));
        command.mut_args(with_negative_values).after_help(examples.unwrap_or_default())
    })
}

/// Reads the command line. Help is printed, and faults end the program.
pub(crate) fn parse() -> Arguments {
    let mut definition = definition();
    let matches = definition.get_matches_mut();
    Arguments::from_arg_matches(&matches)
        .unwrap_or_else(|error| error.format(&mut definition).exit())
}

/// Commands of the program.
#[derive(Subcommand)]
pub(crate) enum Command {
    /// Run an experiment and write results.csv, results.json, metrics.json and plot.svg.
    ///
    /// With --real-time the run keeps in step with the wall clock; the summary and metrics.json show
    /// how well it did. Ctrl-C, SIGTERM and SIGHUP end a run and keep its results.
    Run(run::Run),
    /// Draw recorded runs over one another, as a picture or as a page with the vehicle in motion.
    ///
    /// Each panel has curves of one unit, six at most. Units are those in which the FMUs and the
    /// experiment display values.
    Plot(plot::Plot),
    /// Repeat a paper's comparison and write report.html, with figures, tables and a verdict on
    /// each claim.
    ///
    /// Finished parts are kept. After an interruption the same command continues where it stopped.
    Reproduce(reproduce::Reproduce),
    /// Fly thousands of cases of an experiment in which parameters vary, and write cases.parquet,
    /// summary.json and report.html: how often limits are broken, with what confidence, and the
    /// worst cases. With --worst look for the worst case.
    ///
    /// Finished cases are kept. After an interruption the same command continues where it stopped.
    Campaign(campaign::Fly),
    /// Print the stability margins of an experiment at an instant of its run: gain, phase and delay
    /// of each signal, disk margins of each and of all together.
    ///
    /// The loop is opened at the signals, and its responses to small changes are taken from the
    /// kept state of the run.
    Margins(margins::PrintMargins),
    /// Judge a run that the program at the other end of standard input and output has flown, as
    /// the Python package does, and write the files that `run` writes.
    #[command(hide = true)]
    Judge {
        /// Experiment that was flown.
        experiment: PathBuf,
        /// Folder for the results.
        #[arg(long, value_name = "DIR")]
        out: PathBuf,
        /// Also look for FMUs in this folder.
        #[arg(long, value_name = "DIR")]
        fmu_dir: Vec<PathBuf>,
    },
    /// Write an experiment as an SSP archive (System Structure and Parameterization 1.0), FMUs
    /// included.
    Pack(pack::Pack),
    /// Show the variables and capabilities of an FMU.
    Inspect(inspect::Inspect),
    /// Print an experiment, a study or a campaign with all that it extends, and with lists
    /// expanded.
    Show {
        /// File to print, or the name of an experiment, a study or a campaign.
        name: PathBuf,
    },
    /// Print the JSON Schema of a kind of file, by which editors complete and check such files.
    #[command(hide = true)]
    Schema {
        /// Kind of file that the schema describes.
        #[arg(value_enum)]
        kind: schema::FileKind,
    },
    /// List experiments, studies, campaigns and FMUs by the names that the other commands take.
    List {
        /// Folder to search [default: those beside the program and in ORCHESTRATOR_PATH].
        folder: Option<PathBuf>,
        /// Print JSON with the file of each, for other programs.
        #[arg(long)]
        json: bool,
    },
}

impl Command {
    /// Returns whether the command may take so long that it can be interrupted.
    pub(crate) fn takes_long(&self) -> bool {
        matches!(
            self,
            Self::Run(_)
                | Self::Reproduce(_)
                | Self::Campaign(_)
                | Self::Margins(_)
                | Self::Pack(_)
        )
    }

    /// Returns the law in another program that gives the moment.
    pub(crate) fn law(&self) -> Option<&str> {
        let overrides = match self {
            Self::Run(asked) => &asked.subject.overrides,
            Self::Pack(asked) => &asked.subject.overrides,
            Self::Margins(asked) => &asked.subject.overrides,
            Self::Campaign(asked) => &asked.overrides,
            _ => return None,
        };
        overrides.law.as_deref()
    }

    /// Returns whether standard output is to hold JSON, errors included.
    pub(crate) fn answers_in_json(&self) -> bool {
        match self {
            Self::Margins(asked) => asked.json,
            Self::Inspect(asked) => asked.json,
            Self::List { json, .. } => *json,
            _ => false,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Commands with an option for folders of FMUs load them. A hidden one is for programs that
    /// have loaded the same FMUs already.
    #[test]
    fn whatever_loads_fmus_can_do_so_in_a_closed_process() {
        let definition = definition();
        let has = |command: &clap::Command, name: &str| {
            command.get_arguments().any(|argument| argument.get_id() == name)
        };
        let loading: Vec<&clap::Command> = definition
            .get_subcommands()
            .filter(|command| has(command, "fmu_dir") || has(command, "fmu"))
            .filter(|command| !command.is_hide_set())
            .collect();
        assert_eq!(loading.len(), 6);
        for command in loading {
            assert!(has(command, "isolate"), "{} has no --isolate", command.get_name());
        }
    }
}
