//! Writes an experiment to an SSP archive.

use super::{FMU, STRUCTURE};
use crate::error::Error;
use crate::experiment::{Coupling, OnInvalid, Simulation};
use crate::files;
use crate::interrupt::Interrupt;
use crate::system::{CheckedComponent, System};
use fmi_master::delay;
use fmi_master::description::{InterfaceKind, Variable, VariableKind};
use fmi_master::quantity::{Scaling, UnitDefinition};
use fmi_master::settings::{Setting, SettingValue};
use fmi_master::wiring::Port;
use fmu_import::xml::Element;
use std::collections::BTreeMap;
use std::fs;
use std::io::{Cursor, Write};
use std::path::Path;
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, DateTime, ZipWriter};

const NAMESPACES: [(&str, &str); 3] = [
    ("xmlns:ssd", "http://ssp-standard.org/SSP1/SystemStructureDescription"),
    ("xmlns:ssc", "http://ssp-standard.org/SSP1/SystemStructureCommon"),
    ("xmlns:ssv", "http://ssp-standard.org/SSP1/SystemStructureParameterValues"),
];

/// Writes an experiment as an archive, without the settings for which the standard has no place.
/// The same experiment always gives the same bytes.
///
/// # Errors
/// Returns an error if a file cannot be read or written, or if the work was asked to end. Nothing
/// is left behind then.
pub fn pack(system: &System, path: &Path, interrupt: &Interrupt) -> Result<(), Error> {
    let goes_on = || interrupt.asked().map_or(Ok(()), |request| Err(Error::Ended(request)));
    if let Some(table) = system.components.iter().find(|c| c.fmu.is_lookup_table()) {
        let name = &table.name;
        let message =
            format!("[components.{name}] is a lookup table, which other importers cannot run");
        return Err(system.experiment.source.error(&(0..0), message));
    }
    let mut entries: BTreeMap<String, Vec<u8>> = BTreeMap::new();
    for CheckedComponent { fmu, .. } in &system.components {
        entries.insert(resource(&fmu.path), fs::read(&fmu.path).map_err(Error::file(&fmu.path))?);
    }
    let structure = structure(system).document().map_err(Error::file(path))?;
    let options = SimpleFileOptions::default()
        .compression_method(CompressionMethod::Deflated)
        .last_modified_time(DateTime::default());
    // The archive is made in memory, so that a failure leaves no incomplete file.
    let mut archive = ZipWriter::new(Cursor::new(Vec::new()));
    let files =
        [(STRUCTURE, &structure)].into_iter().chain(entries.iter().map(|(n, c)| (n.as_str(), c)));
    for (name, content) in files {
        goes_on()?;
        archive.start_file(name, options).map_err(|error| Error::file(path)(error.into()))?;
        archive.write_all(content).map_err(Error::file(path))?;
    }
    let bytes = archive.finish().map_err(|error| Error::file(path)(error.into()))?.into_inner();
    goes_on()?;
    files::write(path, bytes)
}

/// Returns the names of the settings, beside the step, that an archive cannot hold.
pub fn lost(system: &System) -> Vec<&'static str> {
    let System { experiment, components, wires, .. } = system;
    let Simulation { coupling, ends_with, on_invalid, .. } = &experiment.simulation;
    let order = delay::order(&system.parts(), wires);
    let settings = [
        ("order", !order.into_iter().eq(0..components.len())),
        ("coupling", *coupling != Coupling::Sequential),
        ("every", components.iter().any(|component| component.every > 1)),
        ("ends_with", ends_with.is_some()),
        ("on_invalid", *on_invalid != OnInvalid::default()),
        ("[observe]", !experiment.observe.signals.is_empty()),
    ];
    settings.into_iter().filter(|(_, is_lost)| *is_lost).map(|(name, _)| name).collect()
}

fn resource(fmu: &Path) -> String {
    format!("resources/{}", fmu.file_name().unwrap_or_default().to_string_lossy())
}

/// Formats a number as the shortest text that reads back as the same number.
fn real(value: f64) -> String {
    format!("{value:?}")
}

/// Converts a text to an identifier, because some importers require every name to be one.
fn identifier(text: &str) -> String {
    let mut name: String =
        text.chars().map(|c| if c.is_ascii_alphanumeric() || c == '_' { c } else { '_' }).collect();
    if !name.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_') {
        name.insert(0, '_');
    }
    name
}

/// Makes an element that only holds others, if there are any.
fn listed(name: &str, elements: impl IntoIterator<Item = Element>) -> Option<Element> {
    let elements: Vec<Element> = elements.into_iter().collect();
    (!elements.is_empty()).then(|| Element::new(name, []).holding(elements))
}

fn structure(system: &System) -> Element {
    let stem = system.experiment.source.path.file_stem().unwrap_or_default();
    let about = [
        ("name", identifier(&stem.to_string_lossy())),
        ("version", "1.0".into()),
        ("description", system.experiment.title.clone()),
        ("generationTool", concat!("orchestrator ", env!("CARGO_PKG_VERSION")).into()),
    ];
    let namespaces = NAMESPACES.map(|(name, value)| (name, value.to_string()));
    let components = system.components.iter().enumerate();
    let elements = components.map(|(index, each)| component(system, index, each));
    let content = listed("ssd:Elements", elements).into_iter();
    let content = content.chain(listed("ssd:Connections", connections(system)));
    let simulation = &system.experiment.simulation;
    let times = [("startTime", real(simulation.start)), ("stopTime", real(simulation.stop))];
    Element::new("ssd:SystemStructureDescription", namespaces.into_iter().chain(about))
        .holding([Element::new("ssd:System", [("name", "system".into())]).holding(content)])
        .holding(listed("ssd:Units", units(system).into_values().map(unit)))
        .holding([Element::new("ssd:DefaultExperiment", times)])
}

fn component(system: &System, index: usize, component: &CheckedComponent) -> Element {
    let implementation = match component.interface {
        InterfaceKind::CoSimulation => "CoSimulation",
        InterfaceKind::ModelExchange { .. } => "ModelExchange",
    };
    let attributes = [
        ("name", component.name.clone()),
        ("type", FMU.into()),
        ("source", resource(&component.fmu.path)),
        ("implementation", implementation.into()),
    ];
    let connectors = Element::new("ssd:Connectors", []);
    Element::new("ssd:Component", attributes)
        .holding([connectors.holding(connectors_of(system, index).map(connector))])
        .holding(bindings(component))
}

/// Returns the variables that become connectors: those that are connected, and all outputs of a
/// type that a connector can have but for enumerations, with which some importers end.
fn connectors_of(system: &System, index: usize) -> impl Iterator<Item = &Variable> {
    let variables = &system.components[index].fmu.description.variables;
    let is_connected = move |position| {
        let mut ends = system.wires.iter().flat_map(|wire| [&wire.from, &wire.to]);
        ends.any(|end| (end.component, end.variable) == (index, position))
    };
    let is_shown = |variable: &Variable| {
        variable.causality == "output"
            && variable.kind.untransferred().is_none()
            && !matches!(variable.kind, VariableKind::Enumeration { .. })
    };
    let fits = move |(position, variable): &(usize, &Variable)| {
        is_connected(*position) || is_shown(variable)
    };
    variables.iter().enumerate().filter(fits).map(|(_, variable)| variable)
}

/// Writes a connector. That of an enumeration has the type of its variable, without one of its own.
fn connector(variable: &Variable) -> Element {
    let attributes = [("name", variable.name.clone()), ("kind", variable.causality.to_string())];
    let unit = match &variable.kind {
        VariableKind::Real { unit, .. } => unit.clone().map(|unit| ("unit", unit)),
        _ => None,
    };
    let kind = Element::new(&format!("ssc:{}", variable.kind.name()), unit);
    let is_typed = !matches!(variable.kind, VariableKind::Enumeration { .. });
    Element::new("ssd:Connector", attributes).holding(is_typed.then_some(kind))
}

/// Writes the values of a component. One that equals the start value is written as well, because
/// setting it may have an effect of its own; but not an item of an enumeration, as importers such as
/// libcosim read none.
fn bindings(component: &CheckedComponent) -> Option<Element> {
    let is_written = |setting: &&Setting| {
        let start = component.fmu.description.find(&setting.name);
        let start = start.and_then(|(_, variable)| variable.start.as_deref()?.parse().ok());
        !matches!(setting.value, SettingValue::Item(_, value) if start == Some(value))
    };
    let parameter = |setting: &Setting| {
        let (kind, value) = match &setting.value {
            SettingValue::Real(value) => ("ssv:Real", real(*value)),
            SettingValue::Integer(value) => ("ssv:Integer", value.to_string()),
            SettingValue::Item(name, _) => ("ssv:Enumeration", name.clone()),
            SettingValue::Boolean(value) => ("ssv:Boolean", value.to_string()),
            SettingValue::Text(text) => ("ssv:String", text.clone()),
        };
        Element::new("ssv:Parameter", [("name", setting.name.clone())])
            .holding([Element::new(kind, [("value", value)])])
    };
    let parameters = component.settings.iter().filter(is_written).map(parameter);
    let name = identifier(&format!("{}_values", component.name));
    let set = listed("ssv:Parameters", parameters).map(|parameters| {
        Element::new("ssv:ParameterSet", [("version", "1.0".into()), ("name", name)])
            .holding([parameters])
    });
    let within = ["ssd:ParameterValues", "ssd:ParameterBinding", "ssd:ParameterBindings"];
    within.into_iter().fold(set, |content, name| listed(name, content))
}

fn connections(system: &System) -> impl Iterator<Item = Element> {
    let parts = system.parts();
    system.wires.iter().map(move |wire| {
        let names = |port: &Port| {
            let part = parts[port.component];
            (part.name.to_string(), part.description.variables[port.variable].name.clone())
        };
        let ((start, from), (end, to)) = (names(&wire.from), names(&wire.to));
        let ends = [
            ("startElement", start),
            ("startConnector", from),
            ("endElement", end),
            ("endConnector", to),
        ];
        if wire.scaling == Scaling::default() {
            return Element::new("ssd:Connection", ends);
        }
        // The conversion is written here, so that all importers convert in the same way.
        let suppressed = [("suppressUnitConversion", "true".into())];
        let Scaling { factor, offset } = wire.scaling;
        let linear = [("factor", real(factor)), ("offset", real(offset))];
        Element::new("ssd:Connection", ends.into_iter().chain(suppressed))
            .holding([Element::new("ssc:LinearTransformation", linear)])
    })
}

/// Returns the definitions of the units that connectors have.
fn units(system: &System) -> BTreeMap<&str, &UnitDefinition> {
    let mut units = BTreeMap::new();
    for (index, CheckedComponent { fmu, .. }) in system.components.iter().enumerate() {
        for variable in connectors_of(system, index) {
            let VariableKind::Real { unit: Some(unit), .. } = &variable.kind else { continue };
            let defined = fmu.description.units.iter().find(|defined| defined.name == *unit);
            if let Some(defined) = defined {
                units.entry(unit.as_str()).or_insert(defined);
            }
        }
    }
    units
}

fn unit(unit: &UnitDefinition) -> Element {
    let bases = ["kg", "m", "s", "A", "K", "mol", "cd", "rad"].into_iter();
    let exponents = bases.zip(unit.exponents.unwrap_or_default());
    let exponents = exponents.filter(|(_, exponent)| *exponent != 0);
    let factor = (unit.factor != 1.0).then(|| ("factor", real(unit.factor)));
    let offset = (unit.offset != 0.0).then(|| ("offset", real(unit.offset)));
    let attributes = exponents.map(|(base, exponent)| (base, exponent.to_string()));
    Element::new("ssc:Unit", [("name", unit.name.clone())])
        .holding([Element::new("ssc:BaseUnit", attributes.chain(factor).chain(offset))])
}
