//! The orchestrator: runs the command of the command line, and ends with its exit code.

mod accepted;
mod arguments;
mod campaign;
mod catalogue;
mod command_line;
mod examples;
mod failure;
mod flight;
mod inspect;
mod judge;
mod list;
mod margins;
mod pack;
mod picture;
mod plain;
mod plot;
mod reproduce;
mod run;
mod schema;
mod show;
mod summary;

use command_line::Command;
use cosim::interrupt::Interrupt;
use failure::Failure;
use fmu_import::crash;
use fmu_import::isolation::Messages;
use fmu_import::law::{self, Printed};
use plain::{Plain, plain};
use serde_json::json;
use std::io::{BufWriter, Write, stderr, stdout};
use std::process::ExitCode;
use tracing_subscriber::EnvFilter;

fn main() -> ExitCode {
    let _watch = crash::watch();
    let arguments = command_line::parse();
    // A study may have a thousand runs, and its report counts their warnings. The results of a study
    // and of a campaign hold the messages of instances.
    let usual = match arguments.command {
        Command::Reproduce(_) => "error,fmu_import=off",
        Command::Campaign(_) => "warn,fmu_import=off",
        _ => "warn",
    };
    let filter = EnvFilter::try_from_default_env().unwrap_or_else(|_| EnvFilter::new(usual));
    tracing_subscriber::fmt()
        .with_env_filter(filter)
        .with_writer(|| Messages)
        // A message that cannot be written is lost, but the run continues.
        .log_internal_errors(false)
        // A closed process's messages pass a filter that lets no such letters through.
        .with_ansi(false)
        .without_time()
        .with_target(false)
        .init();

    let out: Box<dyn Write> = if arguments.command.law().is_some() {
        if let Err(error) = law::begin() {
            let _ = writeln!(stderr(), "error: standard output cannot be redirected: {error}");
            return ExitCode::FAILURE;
        }
        Box::new(Printed)
    } else {
        Box::new(stdout())
    };
    let mut out = Plain(BufWriter::new(out));
    let interrupt = Interrupt::default();
    let answers_in_json = arguments.command.answers_in_json();
    let outcome = execute(arguments.command, &mut out, &interrupt)
        .and_then(|()| out.flush().map_err(Failure::from));
    // Those that killed processes have left.
    fmu_import::folder::remove_left();
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) if error.is_broken_pipe() => {
            // Output that could not be written must not be written again when the writer is
            // dropped.
            let _ = out.0.into_parts();
            ExitCode::SUCCESS
        }
        Err(error) => {
            if answers_in_json {
                let (message, code) = (error.to_string(), error.exit_code());
                let answer = json!({ "error": plain(&message), "exit_code": code });
                let _ = writeln!(out, "{answer:#}");
            }
            // If standard error cannot be written either, there is nobody left to tell.
            let _ = writeln!(stderr(), "error: {}", plain(&error.to_string()));
            ExitCode::from(error.exit_code())
        }
    }
}

fn execute(command: Command, out: &mut impl Write, interrupt: &Interrupt) -> Result<(), Failure> {
    if command.takes_long() {
        interrupt.listen()?;
    }
    match command {
        Command::Run(asked) => run::run(&asked, out, interrupt),
        Command::Reproduce(asked) => reproduce::reproduce(asked, out, interrupt),
        Command::Plot(asked) => plot::plot(&asked, out),
        Command::Campaign(asked) => campaign::fly(&asked, out, interrupt),
        Command::Margins(asked) => margins::print(&asked, out, interrupt),
        Command::Judge { experiment, out: folder, fmu_dir } => {
            judge::judge(&experiment, &fmu_dir, &folder)
        }
        Command::Pack(asked) => pack::pack(&asked, out, interrupt),
        Command::Inspect(asked) => inspect::run(&asked, out),
        Command::Show { name } => show::show(&name, out),
        Command::Schema { kind } => Ok(out.write_all(schema::text(kind).as_bytes())?),
        Command::List { folder, json } => list::list(folder.as_deref(), json, out),
    }
}
