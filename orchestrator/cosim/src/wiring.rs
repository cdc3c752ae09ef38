//! Resolves the names of connections and recorded variables into value references, once. A wrong
//! name is refused with its line in the file and the nearest right name.

use crate::document::Source;
use crate::error::Error;
use crate::experiment::Experiment;
use fmi_master::description::Carrier;
use fmi_master::names;
use fmi_master::quantity::Scaling;
use fmi_master::wiring::{Fault, Part, Port, Wire, Written, connect, port};
use std::collections::{BTreeSet, HashSet};
use std::fmt::Write as _;
use std::ops::Range;
use std::path::Path;
use toml::Spanned;

/// A column of the results, which records one variable.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Column {
    /// Full name of the variable, `component.variable`.
    pub name: String,
    /// The variable that is recorded.
    pub port: Port,
}

/// One side of a connection, or a recorded variable, with its place in the file.
struct Reference<'a> {
    source: &'a Source,
    span: Range<usize>,
    written: Written<'a>,
    /// FMU that replaces the experiment's one, if the command line names one.
    exchanged: Option<&'a str>,
}

impl<'a> Reference<'a> {
    fn new(
        text: &'a Spanned<String>,
        parts: &[Part<'a>],
        experiment: &'a Experiment,
    ) -> Result<Self, Error> {
        let source = &experiment.source;
        let span = text.span();
        let written = Written::new(text.get_ref(), parts);
        let written = written.map_err(|message| source.error(&span, message))?;
        let used = experiment.components.get(written.part.name).filter(|used| used.is_exchanged);
        let exchanged = used.map(|used| used.fmu.get_ref().as_str());
        Ok(Self { source, span, written, exchanged })
    }

    fn refuse(&self, mut message: String) -> Error {
        // The line of the experiment was right for its own FMU.
        if let Some(fmu) = self.exchanged.and_then(|fmu| Path::new(fmu).file_stem()) {
            let (component, fmu) = (self.written.part.name, fmu.display());
            let _ = write!(message, "; --fmu {component}={fmu} replaces the experiment's FMU");
        }
        self.source.error(&self.span, message)
    }
}

/// Resolves the connections of an experiment.
///
/// # Errors
/// Returns an error if a name does not exist, a causality is wrong, types or units do not match, or
/// an input is connected twice. It also returns one if an input is neither connected, nor given a
/// value, nor declared to stay unconnected.
pub(crate) fn wires(experiment: &Experiment, parts: &[Part]) -> Result<Vec<Wire>, Error> {
    let mut wires: Vec<Wire> = Vec::new();
    let name = |port: Port| {
        let Part { name, description } = parts[port.component];
        format!("\"{name}.{}\"", description.variables[port.variable].name)
    };
    for connection in &experiment.connections {
        let from = Reference::new(&connection.from, parts, experiment)?;
        let to = Reference::new(&connection.to, parts, experiment)?;
        let connected = connect(&from.written, &to.written, connection.scaling).map_err(
            |fault| match fault {
                Fault::From(message) => from.refuse(message),
                Fault::To(message) => to.refuse(message),
            },
        )?;
        for wire in connected {
            let input = name(wire.to);
            if wire.scaling != Scaling::default() && wire.from.carrier != Carrier::Real {
                return Err(to.refuse(format!("{input} is no real number: it cannot be scaled")));
            }
            if wires.iter().any(|other| other.to == wire.to) {
                return Err(to.refuse(format!("the input {input} is connected twice")));
            }
            wires.push(wire);
        }
    }
    if !experiment.leaves_inputs_open {
        check_unconnected(experiment, parts, &wires)?;
    }
    Ok(wires)
}

fn check_unconnected(experiment: &Experiment, parts: &[Part], wires: &[Wire]) -> Result<(), Error> {
    for (index, part) in parts.iter().enumerate() {
        let component = &experiment.components[part.name];
        let connected: BTreeSet<usize> = wires
            .iter()
            .filter(|wire| wire.to.component == index)
            .map(|wire| wire.to.variable)
            .collect();
        let inputs: Vec<(usize, &str)> = part
            .description
            .variables
            .iter()
            .enumerate()
            .filter(|(_, variable)| variable.causality == "input")
            .map(|(position, variable)| (position, variable.name.as_str()))
            .collect();

        for pattern in &component.unconnected {
            let text = pattern.get_ref();
            let refuse = |message| Err(experiment.source.error(&pattern.span(), message));
            let elements = part.description.elements(text);
            let is_meant = |position: &usize, name: &str| {
                names::matches(text, name) || elements.contains(position)
            };
            let meant = inputs.iter().filter(|(position, name)| is_meant(position, name));
            let mut meant = meant.peekable();
            // The pattern "*" may match no input at all.
            if meant.peek().is_none() && text != "*" && !component.is_exchanged {
                let hint = names::hint(text, inputs.iter().map(|(_, name)| *name));
                return refuse(format!("\"{}\" has no input \"{text}\"{hint}", part.name));
            }
            if let Some((_, name)) = meant.find(|(position, _)| connected.contains(position)) {
                return refuse(format!(
                    "the input \"{}.{name}\" is listed as unconnected, but is connected",
                    part.name
                ));
            }
        }

        let open = |(position, name): &&(usize, &str)| {
            !connected.contains(position)
                && !part.description.variables[*position].is_optional
                && !component.parameters.contains_key(*name)
                && !component.unconnected.iter().any(|pattern| {
                    let text = pattern.get_ref();
                    names::matches(text, name) || part.description.elements(text).contains(position)
                })
        };
        let open: Vec<&str> = inputs.iter().filter(open).map(|(_, name)| *name).collect();
        if component.is_exchanged && !open.is_empty() {
            tracing::warn!(
                "inputs of \"{}\" stay at their start value: {}",
                part.name,
                open.join(", ")
            );
            continue;
        }
        if !open.is_empty() {
            return Err(experiment.source.error(
                &(0..0),
                format!(
                    "inputs of \"{name}\" are not connected: {list}. Connect them, give them a value in \
                     [components.{name}.parameters], or leave them at their start value with this line in \
                     [components.{name}]: unconnected = [{patterns}]",
                    name = part.name,
                    list = open.join(", "),
                    patterns = names::patterns(&open, &inputs.iter().map(|(_, name)| *name)),
                ),
            ));
        }
    }
    Ok(())
}

/// Resolves the recorded variables. A pattern matches inputs, outputs and local variables; a
/// parameter is recorded only if it is named in full, and a text never is. The name of an array
/// stands for its elements.
///
/// # Errors
/// Returns an error if a name does not exist, a pattern matches nothing, or a variable is a text.
pub(crate) fn columns(experiment: &Experiment, parts: &[Part]) -> Result<Vec<Column>, Error> {
    let (mut columns, mut missing) = (Vec::<Column>::new(), Vec::new());
    let mut seen: HashSet<Port> = HashSet::new();
    for text in &experiment.record.variables {
        let reference = Reference::new(text, parts, experiment)?;
        let Written { component, part, rest, .. } = reference.written;
        let is_pattern = reference.written.prefix().is_some();
        let before = columns.len();
        let mut meant = 0;
        let elements = part.description.elements(rest);
        for (position, variable) in part.description.variables.iter().enumerate() {
            if !(names::matches(rest, &variable.name) || elements.contains(&position))
                || (is_pattern && !matches!(&*variable.causality, "input" | "output" | "local"))
            {
                continue;
            }
            if let Some(port) = port(component, position, variable) {
                meant += 1;
                if seen.insert(port) {
                    columns.push(Column { name: format!("{}.{}", part.name, variable.name), port });
                }
            } else if !is_pattern {
                let what = variable.kind.untransferred().unwrap_or_default();
                return Err(reference.refuse(format!(
                    "\"{}\" is {what}, which cannot be recorded",
                    reference.written.text
                )));
            }
        }
        if meant == 0 && columns.len() == before {
            if experiment.components[part.name].is_exchanged {
                missing.push(text.get_ref().as_str());
                continue;
            }
            let names = part.description.variables.iter().map(|v| v.name.as_str());
            let hint = names::hint(rest.trim_end_matches(".*"), names);
            return Err(
                reference.refuse(format!("\"{}\" has no variable \"{}\"{hint}", part.name, rest))
            );
        }
    }
    if !missing.is_empty() {
        tracing::warn!(
            "these variables are not recorded, because the exchanged FMUs do not have them: {}",
            missing.join(", ")
        );
    }
    Ok(columns)
}
