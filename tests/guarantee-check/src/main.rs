//! Checks the bounds of CRMPC's guarantee for given settings, and the plans that rest on them.
//!
//! ```text
//! cargo run --release -p reentry-guarantee-check -- --set delay=0.04 --set disturbance.bound=0.02
//! cargo run --release -p reentry-guarantee-check -- plans --flights 200
//! cargo run --release -p reentry-guarantee-check -- shipped orchestrator/experiments
//! ```

mod bounds;
mod plans;
#[cfg(feature = "shipped")]
mod shipped_files;

use bounds::Bounds;
use clap::{Parser, Subcommand};
use plans::Plans;
#[cfg(feature = "shipped")]
use shipped_files::ShippedFiles;
use std::process::ExitCode;

/// Checks every bound that the guarantee of CRMPC's robust set rests on, in interval arithmetic.
/// Settings that are not given are the published ones. The exit code is 0 if all bounds are true, 1
/// if one is not certain to be, 2 if the settings are refused.
#[derive(Parser)]
#[command(version, args_conflicts_with_subcommands = true)]
struct Arguments {
    #[command(subcommand)]
    command: Option<Command>,
    #[command(flatten)]
    bounds: Bounds,
}

#[derive(Subcommand)]
enum Command {
    /// Check plans that are recorded from random flights, with settings drawn over everything that
    /// the design accepts.
    Plans(Plans),
    /// Check plans for the settings of every experiment, study and campaign of a folder in which
    /// CRMPC can report that its guarantee is in force.
    #[cfg(feature = "shipped")]
    Shipped(ShippedFiles),
}

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    let outcome = match &arguments.command {
        None => arguments.bounds.run(),
        Some(Command::Plans(plans)) => plans.run(),
        #[cfg(feature = "shipped")]
        Some(Command::Shipped(files)) => files.run(),
    };
    match outcome {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::from(2)
        }
    }
}
