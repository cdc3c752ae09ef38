//! Prints the description of an FMU, and checks it.

use crate::catalogue;
use crate::failure::Failure;
use clap::Args;
use cosim::error::Error;
use cosim::experiment::Process;
use cosim::search::named::{Kind, find};
use fmi_master::description::{Interface, ModelDescription, ScalarType, Variable, VariableKind};
use fmi_master::instance::CallFailure;
use fmi_master::names;
use fmi_master::quantity::UnitDefinition;
use fmu_import::description::CAUSALITIES;
use fmu_import::fmu::Fmu;
use fmu_import::isolation::{self, Closed, Closing, Ended};
use std::io::{self, Write, stdout};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use terminal_size::Width;
use textwrap::Options;

/// Options of `inspect`.
#[derive(Args)]
pub(crate) struct Inspect {
    /// FMU to show: a file, or the name of one that `list` shows.
    fmu: PathBuf,
    /// Show only these variables: a name, a pattern with *, or a part of a name. Without it all
    /// variables are shown.
    pattern: Option<String>,
    /// Print JSON, for other programs.
    #[arg(long)]
    pub(crate) json: bool,
    /// Report the faults of the FMU and of its library instead, or that it is sound. The exit
    /// code is 1 if there are any faults.
    #[arg(long, conflicts_with_all = ["json", "pattern"])]
    check: bool,
    #[command(flatten)]
    process: Process,
}

/// Prints the interfaces and platforms of an archive and its variables, or checks it.
///
/// # Errors
/// Returns an error if the archive is no FMU, if no variable fits the pattern, if a check finds
/// faults, or if the text cannot be written.
pub(crate) fn run(asked: &Inspect, out: &mut impl Write) -> Result<(), Failure> {
    let path = find(&asked.fmu, Kind::Fmu)?;
    if asked.check {
        return check(&path, asked.process, out);
    }
    if asked.process != Process::default() {
        let problem = "--isolate goes with --check, as nothing else runs the FMU";
        return Err(Error::experiment(problem).into());
    }
    let mut fmu = Fmu::open(&path)?;
    if let Some(pattern) = &asked.pattern {
        choose(&mut fmu.description, pattern)?;
    }
    if asked.json {
        catalogue::print(&fmu, out)?;
    } else {
        print(&fmu, out)?;
    }
    Ok(())
}

/// Removes the variables that do not fit a pattern.
fn choose(description: &mut ModelDescription, pattern: &str) -> Result<(), Error> {
    let part = pattern.to_lowercase();
    let fits = |variable: &Variable| {
        names::matches(pattern, &variable.name) || variable.name.to_lowercase().contains(&part)
    };
    let variables = std::mem::take(&mut description.variables);
    let (fitting, others): (Vec<_>, Vec<_>) = variables.into_iter().partition(fits);
    description.variables = fitting;
    if description.variables.is_empty() {
        let hint = names::hint(pattern, others.iter().map(|other| &*other.name));
        let model = &description.model_name;
        let problem = format!("{model} has no variable that fits \"{pattern}\"{hint}");
        return Err(Error::experiment(problem));
    }
    Ok(())
}

/// Checks the description of an archive and its library, which is loaded for this, and prints each
/// fault, or that the FMU is sound.
///
/// # Errors
/// Returns an error if there are faults, if the archive is no FMU at all, or if the
/// text cannot be written.
fn check(path: &Path, process: Process, out: &mut impl Write) -> Result<(), Failure> {
    let fmu = Fmu::open(path)?;
    let is_closed = process.isolate.unwrap_or_else(isolation::can_close);
    let faults = if is_closed { faults(&fmu)? } else { fmu.faults() };
    for fault in &faults {
        writeln!(out, "{}: {fault}", path.display())?;
    }
    match faults.len() {
        0 => {
            let (name, variables) = (&fmu.description.model_name, fmu.description.variables.len());
            let platforms = if fmu.is_lookup_table() {
                String::new()
            } else {
                format!(" for {}", fmu.platforms().join(", "))
            };
            Ok(writeln!(out, "{name}: sound, {variables} variables{platforms}")?)
        }
        count => Err(Failure::Faults { path: path.to_path_buf(), count }),
    }
}

/// Finds the faults of an FMU in a closed process.
fn faults(fmu: &Fmu) -> Result<Vec<String>, Error> {
    let folders = fmu.folder().map(PathBuf::from).into_iter().collect();
    let closing = Closing { folders, ..Closing::default() };
    let mut faults: Vec<String> = Vec::new();
    let begun = Closed::begin(&closing, |link| {
        let _ = link.send(&fmu.faults());
    });
    let hear = |found| {
        faults = found;
        ControlFlow::Continue(())
    };
    match begun.and_then(|mut closed| closed.hear(|| None, hear)) {
        Ok(()) => {}
        Err(Ended::Refused(reason)) => return Err(Error::experiment(reason)),
        Err(Ended::Failed(last)) => {
            let CallFailure { call, message, .. } = last.failure;
            faults.push(format!("its instance failed in {call}: {message}"));
        }
    }
    Ok(faults)
}

fn print(fmu: &Fmu, out: &mut impl Write) -> io::Result<()> {
    let d = &fmu.description;
    if fmu.is_lookup_table() {
        writeln!(out, "{}", d.model_name)?;
    } else {
        writeln!(out, "{} (FMI {})", d.model_name, d.fmi_version)?;
    }
    let width = width();
    let mut line = |label: &str, text: &str| {
        if text.is_empty() {
            return Ok(());
        }
        let label = format!("  {label:<16} ");
        wrapped(text, [&label, &" ".repeat(label.len())], width, out)
    };
    line("description", &d.description)?;
    line("version", &d.version)?;
    line("generated by", &d.generation_tool)?;
    line(if d.is_fmi3() { "token" } else { "GUID" }, &d.guid)?;
    line("platforms", &fmu.platforms().join(", "))?;
    let interface = |i: &Option<Interface>| {
        i.as_ref().map_or(String::new(), |i| {
            format!("{}: {}", i.model_identifier, i.capabilities.join(", "))
        })
    };
    line("co-simulation", &interface(&d.co_simulation))?;
    line("model exchange", &interface(&d.model_exchange))?;
    if d.model_exchange.is_some() {
        let (states, indicators) = (d.derivatives.len(), d.event_indicators);
        let counts = format!("continuous states: {states}, event indicators: {indicators}");
        line("integration", &counts)?;
    }
    line("scheduled", &interface(&d.scheduled_execution))?;
    let experiment = &d.default_experiment;
    let named = [
        ("start", experiment.start, " s"),
        ("stop", experiment.stop, " s"),
        ("step", experiment.step, " s"),
        ("tolerance", experiment.tolerance, ""),
    ];
    let proposed: Vec<String> = named
        .iter()
        .filter_map(|(name, value, unit)| value.map(|v| format!("{name} {v:?}{unit}")))
        .collect();
    line("experiment", &proposed.join(", "))?;

    let mut unknown: Vec<&str> = d.variables.iter().map(|v| &*v.causality).collect();
    unknown.retain(|causality| !CAUSALITIES.contains(causality));
    unknown.sort_unstable();
    unknown.dedup();
    for causality in CAUSALITIES.into_iter().chain(unknown) {
        let variables: Vec<&Variable> =
            d.variables.iter().filter(|variable| variable.causality == causality).collect();
        if variables.is_empty() {
            continue;
        }
        writeln!(out, "\n{} ({})", causality.escape_default(), variables.len())?;
        for variable in variables {
            let first = format!("{}  {}", variable.name, facts(d, variable));
            wrapped(first.trim_end(), ["  ", MARGIN], width, out)?;
            wrapped(&variable.description, [MARGIN; 2], width, out)?;
        }
    }
    Ok(())
}

/// Margin of what is said of a variable below its name.
const MARGIN: &str = "      ";

/// Width of printed texts where there is no terminal.
const WIDTH: usize = 80;

/// Returns the width to which texts are wrapped.
pub(crate) fn width() -> usize {
    let columns = terminal_size::terminal_size_of(stdout());
    columns.map_or(WIDTH, |(Width(columns), _)| usize::from(columns).clamp(40, 120))
}

/// Writes a text in lines of this width, with these margins of the first line and of the others.
pub(crate) fn wrapped(
    text: &str,
    [first, others]: [&str; 2],
    width: usize,
    out: &mut impl Write,
) -> io::Result<()> {
    let options = Options::new(width).initial_indent(first).subsequent_indent(others);
    let lines = if text.is_empty() { Vec::new() } else { textwrap::wrap(text, options) };
    lines.iter().try_for_each(|line| writeln!(out, "{line}"))
}

/// Returns type, start value, unit and variability of a variable, as far as they say something.
fn facts(description: &ModelDescription, variable: &Variable) -> String {
    let mut start = variable.start.clone().unwrap_or_default();
    let place = description.place(variable);
    let mut kind = variable.type_name(place);
    match &variable.kind {
        VariableKind::Real { unit, display_unit, .. } => {
            if place.is_none_or(|place| place.scalar == ScalarType::Float64) {
                kind.clear();
            }
            let unit = unit.as_deref().unwrap_or_default();
            let display = display_unit.as_deref().filter(|display| *display != unit);
            let converted = display.and_then(|display| {
                let units = description.units_of(&variable.kind);
                Some(format!("{} {display}", shown(&units, unit, display, &start)?))
            });
            let own = format!("{start} {unit}").trim().to_string();
            start = match (converted, display) {
                (Some(converted), _) => format!("{converted} ({own})"),
                (None, Some(display)) => format!("{own} ({display})"),
                (None, None) => own,
            };
        }
        VariableKind::Enumeration { items } => {
            let names: Vec<&str> = items.iter().map(|(name, _)| name.as_str()).collect();
            kind = format!("{{{}}}", names.join(", "));
            if let Some((name, _)) = items.iter().find(|(_, value)| start == value.to_string()) {
                start.clone_from(name);
            }
        }
        VariableKind::Clock { interval } => kind = format!("{kind}, {interval}"),
        _ => {}
    }
    let facts = [start, variable.variability.to_string(), kind];
    facts.into_iter().filter(|fact| !fact.is_empty()).collect::<Vec<_>>().join(", ")
}

/// Converts a start value to its display unit, rounded to the digits that people read.
fn shown(units: &[UnitDefinition], unit: &str, display: &str, start: &str) -> Option<f64> {
    let unit = units.iter().find(|defined| defined.name == unit)?;
    let (_, factor, offset) = unit.displays.iter().find(|(name, ..)| name == display)?;
    let value = factor * start.parse::<f64>().ok()? + offset;
    format!("{value:.6}").parse().ok()
}
