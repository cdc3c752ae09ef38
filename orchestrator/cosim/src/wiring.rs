//! Resolves the names of connections and recorded variables into value references, once. A wrong
//! name is refused with its line in the file and the nearest right name.

use crate::document::Source;
use crate::error::Error;
use crate::experiment::Experiment;
use fmu_import::description::{Carrier, ModelDescription, Variable, VariableKind};
use fmu_import::names;
use fmu_import::quantity::Scaling;
use fmu_import::warnings::warn_once;
use std::collections::{BTreeSet, HashSet};
use std::fmt::Write as _;
use std::ops::Range;
use std::path::Path;
use toml::Spanned;

/// A component's name and its FMU's description. Its position in the list of parts is its index.
#[derive(Clone, Copy)]
pub struct Part<'a> {
    /// Name of the component in the experiment.
    pub name: &'a str,
    /// Model description of the component's FMU.
    pub description: &'a ModelDescription,
}

/// A variable of a component.
#[derive(Clone, Copy, Debug, Eq, Hash, PartialEq)]
pub struct Port {
    /// Index of the component.
    pub component: usize,
    /// Position of the variable in the model description.
    pub variable: usize,
    /// Value reference of the variable.
    pub reference: u32,
    /// Type in which the value of the variable is transferred.
    pub carrier: Carrier,
}

/// A connection of one output with one input.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wire {
    /// Output that the connection starts from.
    pub from: Port,
    /// Input that the connection ends at.
    pub to: Port,
    /// Conversion of real values on the way.
    pub scaling: Scaling,
}

/// A column of the results, which records one variable.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Column {
    /// Full name of the variable, `component.variable`.
    pub name: String,
    /// The variable that is recorded.
    pub port: Port,
}

/// One side of a connection, or a recorded variable, with its component.
struct Reference<'a> {
    source: &'a Source,
    span: Range<usize>,
    text: &'a str,
    component: usize,
    part: Part<'a>,
    /// FMU that replaces the experiment's one, if the command line names one.
    exchanged: Option<&'a str>,
    rest: &'a str,
}

impl<'a> Reference<'a> {
    fn new(
        text: &'a Spanned<String>,
        parts: &[Part<'a>],
        experiment: &'a Experiment,
    ) -> Result<Self, Error> {
        let source = &experiment.source;
        let span = text.span();
        let text = text.get_ref().as_str();
        let refuse = |message: String| source.error(&span, message);
        let (name, rest) = names::split(text).ok_or_else(|| {
            refuse(format!("\"{text}\" names no variable: write component.variable"))
        })?;
        let component = parts.iter().position(|part| part.name == name).ok_or_else(|| {
            let hint = names::hint(name, parts.iter().map(|part| part.name));
            refuse(format!("there is no component \"{name}\"{hint}"))
        })?;
        let used = experiment.components.get(name).filter(|used| used.is_exchanged);
        let exchanged = used.map(|used| used.fmu.get_ref().as_str());
        let part = parts[component];
        Ok(Self { source, span: span.clone(), text, component, part, exchanged, rest })
    }

    fn refuse(&self, message: impl Into<String>) -> Error {
        let mut message = message.into();
        // The line of the experiment was right for its own FMU.
        if let Some(fmu) = self.exchanged.and_then(|fmu| Path::new(fmu).file_stem()) {
            let (component, fmu) = (self.part.name, fmu.display());
            let _ = write!(message, "; --fmu {component}={fmu} replaces the experiment's FMU");
        }
        self.source.error(&self.span, message)
    }

    fn prefix(&self) -> Option<&'a str> {
        self.rest.strip_suffix('*')
    }

    fn unknown(&self, causality: &'a str) -> Error {
        let hint = names::hint(self.rest, self.part.description.names(causality));
        self.refuse(format!("\"{}\" has no {causality} \"{}\"{hint}", self.part.name, self.rest))
    }

    /// Finds the variable called `name`, which must have this causality.
    fn port(&self, name: &str, causality: &'a str) -> Result<Port, Error> {
        let (position, variable) =
            self.part.description.find(name).ok_or_else(|| self.unknown(causality))?;
        if variable.causality != causality {
            let hint = names::nearest(name, self.part.description.names(causality))
                .map_or(String::new(), |near| format!("; did you mean \"{near}\"?"));
            return Err(self.refuse(format!(
                "\"{}.{name}\" is of causality {}, not an {causality}{hint}",
                self.part.name, variable.causality
            )));
        }
        port(self.component, position, variable).ok_or_else(|| {
            self.refuse(format!(
                "\"{}.{name}\" is a text, which cannot be connected",
                self.part.name
            ))
        })
    }
}

pub(crate) fn port(component: usize, position: usize, variable: &Variable) -> Option<Port> {
    let carrier = Carrier::for_kind(&variable.kind)?;
    Some(Port { component, variable: position, reference: variable.reference, carrier })
}

/// Resolves the connections of an experiment.
///
/// # Errors
/// Returns an error if a name does not exist, a causality is wrong, types or units do not match, or
/// an input is connected twice. It also returns one if an input is neither connected, nor given a
/// value, nor declared to stay unconnected.
pub(crate) fn wires(experiment: &Experiment, parts: &[Part]) -> Result<Vec<Wire>, Error> {
    let mut wires: Vec<Wire> = Vec::new();
    for connection in &experiment.connections {
        let from = Reference::new(&connection.from, parts, experiment)?;
        let to = Reference::new(&connection.to, parts, experiment)?;
        let pairs: Vec<(String, String)> = match (from.prefix(), to.prefix()) {
            (None, None) => vec![(from.rest.to_string(), to.rest.to_string())],
            (Some(from_prefix), Some(to_prefix)) => expand(&from, from_prefix, &to, to_prefix)?,
            _ => {
                return Err(to.refuse(format!(
                    "\"{}\" and \"{}\" must both end in * or neither",
                    from.text, to.text
                )));
            }
        };
        let mut converts = false;
        for (output, input) in pairs {
            let (start, end) = (from.port(&output, "output")?, to.port(&input, "input")?);
            let conversion = check_match(start, end, &from, &output, &to, &input)?;
            converts |= conversion != Scaling::default();
            if conversion != Scaling::default() && !connection.convert_units {
                return Err(to.refuse(format!(
                    "the units of \"{}.{output}\" and \"{}.{input}\" measure the same quantity on another scale: \
                     write convert_units = true in this connection",
                    from.part.name, to.part.name
                )));
            }
            let wire = Wire { from: start, to: end, scaling: conversion.then(connection.scaling) };
            if wire.scaling != Scaling::default() && start.carrier != Carrier::Real {
                return Err(to.refuse(format!(
                    "\"{}.{input}\" is no real number: it cannot be scaled",
                    to.part.name
                )));
            }
            if wires.iter().any(|other| other.to == wire.to) {
                return Err(
                    to.refuse(format!("the input \"{}.{input}\" is connected twice", to.part.name))
                );
            }
            wires.push(wire);
        }
        // An SSP archive has no such key.
        if connection.convert_units && !converts && !connection.to.span().is_empty() {
            warn_once(format!(
                "{}: convert_units has no effect on the connection to \"{}\", whose units are equal",
                experiment.source.path.display(),
                to.text
            ));
        }
    }
    if !experiment.leaves_inputs_open {
        check_unconnected(experiment, parts, &wires)?;
    }
    Ok(wires)
}

/// Lists the pairs of names that two patterns stand for: an output behind the first prefix is
/// paired with the variable of the same name behind the second prefix, if there is one.
fn expand(
    from: &Reference,
    from_prefix: &str,
    to: &Reference,
    to_prefix: &str,
) -> Result<Vec<(String, String)>, Error> {
    let outputs: Vec<&str> = from
        .part
        .description
        .names("output")
        .filter_map(|name| name.strip_prefix(from_prefix))
        .collect();
    if outputs.is_empty() {
        return Err(from.unknown("output"));
    }
    let pairs: Vec<_> = outputs
        .iter()
        .map(|rest| (format!("{from_prefix}{rest}"), format!("{to_prefix}{rest}")))
        .filter(|(_, input)| to.part.description.find(input).is_some())
        .collect();
    if pairs.is_empty() {
        return Err(
            if to.part.description.names("input").any(|name| name.starts_with(to_prefix)) {
                to.refuse(format!("\"{}\" and \"{}\" have no name in common", from.text, to.text))
            } else {
                to.unknown("input")
            },
        );
    }
    Ok(pairs)
}

/// Determines how values of the output are converted to values of the input, by their units.
fn check_match(
    start: Port,
    end: Port,
    from: &Reference,
    output: &str,
    to: &Reference,
    input: &str,
) -> Result<Scaling, Error> {
    let names = format!("\"{}.{output}\" and \"{}.{input}\"", from.part.name, to.part.name);
    let (a, b) = (
        &from.part.description.variables[start.variable].kind,
        &to.part.description.variables[end.variable].kind,
    );
    match (a, b) {
        (VariableKind::Real { unit: a, .. }, VariableKind::Real { unit: b, .. }) => from
            .part
            .description
            .conversion(a.as_deref(), to.part.description, b.as_deref())
            .map_err(|difference| {
                to.refuse(format!("the units of {names} do not match: {difference}"))
            }),
        (VariableKind::Enumeration { items: a }, VariableKind::Enumeration { items: b })
            if a != b =>
        {
            Err(to.refuse(format!("{names} are enumerations of different items")))
        }
        _ if a.name() == b.name() => Ok(Scaling::default()),
        _ => Err(to.refuse(format!(
            "the types of {names} do not match: {} against {}",
            a.name(),
            b.name()
        ))),
    }
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
            let mut meant = inputs.iter().filter(|(_, name)| names::matches(text, name)).peekable();
            // The pattern "*" may stand for no input at all.
            if meant.peek().is_none() && text != "*" && !component.is_exchanged {
                let hint = names::hint(text, inputs.iter().map(|(_, name)| *name));
                return refuse(format!("\"{}\" has no input \"{text}\"{hint}", part.name));
            }
            if let Some((_, name)) = meant.find(|(position, _)| connected.contains(position)) {
                return refuse(format!(
                    "the input \"{}.{name}\" is said to be unconnected, but is connected",
                    part.name
                ));
            }
        }

        let open = |(position, name): &&(usize, &str)| {
            !connected.contains(position)
                && !component.parameters.contains_key(*name)
                && !component
                    .unconnected
                    .iter()
                    .any(|pattern| names::matches(pattern.get_ref(), name))
        };
        let open: Vec<&str> = inputs.iter().filter(open).map(|(_, name)| *name).collect();
        if component.is_exchanged && !open.is_empty() {
            warn_once(format!(
                "inputs of \"{}\" stay at their start value: {}",
                part.name,
                open.join(", ")
            ));
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

/// Resolves the recorded variables. A pattern stands for inputs, outputs and local variables; a
/// parameter is recorded only if it is named in full, and a text never is.
///
/// # Errors
/// Returns an error if a name does not exist, a pattern stands for nothing, or a variable is a
/// text.
pub(crate) fn columns(experiment: &Experiment, parts: &[Part]) -> Result<Vec<Column>, Error> {
    let (mut columns, mut missing) = (Vec::<Column>::new(), Vec::new());
    let mut seen: HashSet<Port> = HashSet::new();
    for text in &experiment.record.variables {
        let reference = Reference::new(text, parts, experiment)?;
        let (component, part) = (reference.component, reference.part);
        let is_pattern = reference.prefix().is_some();
        let before = columns.len();
        let mut meant = 0;
        for (position, variable) in part.description.variables.iter().enumerate() {
            if !names::matches(reference.rest, &variable.name)
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
                return Err(reference.refuse(format!(
                    "\"{}\" is a text, which cannot be recorded",
                    reference.text
                )));
            }
        }
        if meant == 0 && columns.len() == before {
            if experiment.components[part.name].is_exchanged {
                missing.push(text.get_ref().as_str());
                continue;
            }
            let names = part.description.variables.iter().map(|v| v.name.as_str());
            let hint = names::hint(reference.rest.trim_end_matches(".*"), names);
            return Err(reference.refuse(format!(
                "\"{}\" has no variable \"{}\"{hint}",
                part.name, reference.rest
            )));
        }
    }
    if !missing.is_empty() {
        warn_once(format!(
            "these variables are not recorded, because the exchanged FMUs do not have them: {}",
            missing.join(", ")
        ));
    }
    Ok(columns)
}

/// Finds one variable by its full name, if it exists.
pub(crate) fn find(path: &str, parts: &[Part]) -> Option<Port> {
    let (name, rest) = names::split(path)?;
    let component = parts.iter().position(|part| part.name == name)?;
    let (position, variable) = parts[component].description.find(rest)?;
    port(component, position, variable)
}
