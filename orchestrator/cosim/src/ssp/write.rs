//! Writes an experiment to an SSP archive.

use super::xml::{Xml, element, identifier, leaf, real};
use super::{FMU, OPEN_MODELICA, RUN_SETTINGS, STRUCTURE};
use crate::error::Error;
use crate::experiment::Coupling;
use crate::files;
use crate::interrupt::Interrupt;
use crate::system::{CheckedComponent, System};
use fmi_master::description::{InterfaceKind, Variable, VariableKind};
use fmi_master::quantity::Scaling;
use fmi_master::settings::SettingValue;
use fmi_master::wiring::Port;
use quick_xml::Writer;
use quick_xml::events::{BytesDecl, Event};
use std::collections::BTreeMap;
use std::fs;
use std::io::{self, Cursor, Write};
use std::ops::Deref;
use std::path::Path;
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, DateTime, ZipWriter};

const NAMESPACES: [(&str, &str); 3] = [
    ("xmlns:ssd", "http://ssp-standard.org/SSP1/SystemStructureDescription"),
    ("xmlns:ssc", "http://ssp-standard.org/SSP1/SystemStructureCommon"),
    ("xmlns:ssv", "http://ssp-standard.org/SSP1/SystemStructureParameterValues"),
];

/// The experiment that is written to an archive.
struct Source<'a> {
    system: &'a System,
    /// Whether outputs that are enumerations become connectors.
    enumerations: bool,
}

impl Deref for Source<'_> {
    type Target = System;

    fn deref(&self) -> &System {
        self.system
    }
}

/// Writes an experiment as an archive. Settings for which the standard has no place, above all the
/// step, are stored in annotations. Values that equal the FMU's start values are left out. Outputs
/// that are enumerations become connectors if `enumerations` is true. The same experiment always
/// gives the same bytes.
///
/// # Errors
/// Returns an error if a file cannot be read or written, or if the work was asked to end. Nothing
/// is left behind then.
pub fn pack(
    system: &System,
    enumerations: bool,
    path: &Path,
    interrupt: &Interrupt,
) -> Result<(), Error> {
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
    let structure = structure(&Source { system, enumerations }).map_err(Error::file(path))?;
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

fn resource(fmu: &Path) -> String {
    format!("resources/{}", fmu.file_name().unwrap_or_default().to_string_lossy())
}

fn structure(system: &Source) -> io::Result<Vec<u8>> {
    let mut xml = Writer::new_with_indent(Vec::new(), b' ', 2);
    xml.write_event(Event::Decl(BytesDecl::new("1.0", Some("UTF-8"), None)))?;
    let mut attributes = NAMESPACES.map(|(name, value)| (name, value.to_string())).to_vec();
    let stem = system.experiment.source.path.file_stem().unwrap_or_default();
    attributes.push(("name", identifier(&stem.to_string_lossy())));
    attributes.push(("version", "1.0".into()));
    attributes.push(("description", system.experiment.title.clone()));
    attributes.push(("generationTool", concat!("orchestrator ", env!("CARGO_PKG_VERSION")).into()));
    element(&mut xml, "ssd:SystemStructureDescription", &attributes, |xml| {
        element(xml, "ssd:System", &[("name", "system".into())], |xml| {
            element(xml, "ssd:Elements", &[], |xml| {
                (0..system.components.len()).try_for_each(|i| component(xml, system, i))
            })?;
            if !system.wires.is_empty() {
                element(xml, "ssd:Connections", &[], |xml| connections(xml, system))?;
            }
            element(xml, "ssd:Annotations", &[], |xml| {
                element(xml, "ssc:Annotation", &[("type", OPEN_MODELICA.into())], |xml| {
                    open_modelica(xml, system)
                })?;
                element(xml, "ssc:Annotation", &[("type", RUN_SETTINGS.into())], |xml| {
                    run_settings(xml, system)
                })
            })
        })?;
        enumerations(xml, system)?;
        units(xml, system)?;
        let experiment = &system.experiment.simulation;
        let time = [("startTime", real(experiment.start)), ("stopTime", real(experiment.stop))];
        leaf(xml, "ssd:DefaultExperiment", &time)
    })?;
    let mut bytes = xml.into_inner();
    bytes.push(b'\n');
    Ok(bytes)
}

/// Writes the step in the form of OMSimulator, which other importers read as well. From version 3
/// on it reads the attributes, where the name is that of its master for components that name none;
/// before, it reads the element.
fn open_modelica(xml: &mut Xml, system: &Source) -> io::Result<()> {
    let schema = "https://raw.githubusercontent.com/OpenModelica/OMSimulator/master/schema/oms.xsd";
    element(xml, "oms:Annotations", &[("xmlns:oms", schema.into())], |xml| {
        let solver = [
            ("name", "oms_ma_default".into()),
            ("method", "oms_ma".into()),
            ("fixedStepSize", real(system.clock.step())),
        ];
        element(xml, "oms:SimulationInformation", &solver, |xml| {
            let master = [
                ("description", "oms-ma".into()),
                ("stepSize", real(system.clock.step())),
                ("absoluteTolerance", "0.0001".into()),
                ("relativeTolerance", "0.0001".into()),
            ];
            leaf(xml, "oms:FixedStepMaster", &master)
        })
    })
}

/// Writes the settings that are needed to repeat the same run: step, coupling, order, periods,
/// recorded variables, and the section `[observe]`.
fn run_settings(xml: &mut Xml, system: &Source) -> io::Result<()> {
    let experiment = &system.experiment;
    let coupling = match experiment.simulation.coupling {
        Coupling::Sequential => "sequential",
        Coupling::Jacobi => "jacobi",
    };
    let mut attributes = vec![
        ("xmlns:run", "urn:orchestrator:run:1".into()),
        ("title", experiment.title.clone()),
        ("description", experiment.description.trim().to_string()),
        ("step", real(system.clock.step())),
        ("coupling", coupling.into()),
        ("recordEvery", experiment.record.every.to_string()),
    ];
    let ends_with = experiment.simulation.ends_with.clone();
    attributes.extend(ends_with.map(|name| ("endsWith", name)));
    element(xml, "run:Experiment", &attributes, |xml| {
        for CheckedComponent { name, every, interface, .. } in &system.components {
            let mut attributes = vec![("name", name.clone()), ("every", every.to_string())];
            if let InterfaceKind::ModelExchange { tolerance } = interface {
                attributes.push(("tolerance", format!("{tolerance:?}")));
            }
            leaf(xml, "run:Component", &attributes)?;
        }
        for column in &system.columns {
            leaf(xml, "run:Record", &[("variable", column.name.clone())])?;
        }
        let text = toml::to_string(&experiment.observe).map_err(io::Error::other)?;
        leaf(xml, "run:Observe", &[("toml", text)])
    })
}

fn component(xml: &mut Xml, system: &Source, index: usize) -> io::Result<()> {
    let implementation = match system.components[index].interface {
        InterfaceKind::CoSimulation => "CoSimulation",
        InterfaceKind::ModelExchange { .. } => "ModelExchange",
    };
    let attributes = [
        ("name", system.components[index].name.clone()),
        ("type", FMU.into()),
        ("source", resource(&system.components[index].fmu.path)),
        ("implementation", implementation.into()),
    ];
    element(xml, "ssd:Component", &attributes, |xml| {
        element(xml, "ssd:Connectors", &[], |xml| {
            connectors(system, index).try_for_each(|variable| connector(xml, system, variable))
        })?;
        parameters(xml, system, index)
    })
}

/// Returns the variables that become connectors: the connected inputs, and all outputs of a type
/// that a connector can have.
fn connectors<'a>(system: &'a Source, index: usize) -> impl Iterator<Item = &'a Variable> {
    let variables = &system.components[index].fmu.description.variables;
    let is_connected = move |position| {
        system.wires.iter().any(|w| w.to.component == index && w.to.variable == position)
    };
    variables.iter().enumerate().filter_map(move |(position, variable)| {
        match &*variable.causality {
            "input" if is_connected(position) => Some(variable),
            "output" => match &variable.kind {
                kind if kind.untransferred().is_some() => None,
                VariableKind::Enumeration { .. } => system.enumerations.then_some(variable),
                _ => Some(variable),
            },
            _ => None,
        }
    })
}

/// Collects the enumerations of the connectors, each once. Each is named after the first variable
/// of that type.
fn kinds<'a>(system: &'a Source) -> Vec<(String, &'a [(String, i32)])> {
    let mut kinds: Vec<(String, &'a [(String, i32)])> = Vec::new();
    for (index, CheckedComponent { fmu, .. }) in system.components.iter().enumerate() {
        for variable in connectors(system, index) {
            if let VariableKind::Enumeration { items } = &variable.kind
                && !kinds.iter().any(|(_, listed)| *listed == items.as_slice())
            {
                let name = identifier(&format!("{}_{}", fmu.description.model_name, variable.name));
                kinds.push((name, items));
            }
        }
    }
    kinds
}

fn enumerations(xml: &mut Xml, system: &Source) -> io::Result<()> {
    let kinds = kinds(system);
    if kinds.is_empty() {
        return Ok(());
    }
    element(xml, "ssd:Enumerations", &[], |xml| {
        kinds.iter().try_for_each(|(name, items)| {
            element(xml, "ssc:Enumeration", &[("name", name.clone())], |xml| {
                items.iter().try_for_each(|(item, value)| {
                    leaf(xml, "ssc:Item", &[("name", item.clone()), ("value", value.to_string())])
                })
            })
        })
    })
}

fn connector(xml: &mut Xml, system: &Source, variable: &Variable) -> io::Result<()> {
    let attributes = [("name", variable.name.clone()), ("kind", variable.causality.to_string())];
    element(xml, "ssd:Connector", &attributes, |xml| {
        let unit = match &variable.kind {
            VariableKind::Real { unit: Some(unit), .. } => vec![("unit", unit.clone())],
            VariableKind::Enumeration { items } => {
                let kinds = kinds(system).into_iter();
                let same = kinds.filter(|(_, listed)| *listed == items.as_slice());
                same.map(|(name, _)| ("name", name)).collect()
            }
            _ => Vec::new(),
        };
        leaf(xml, &format!("ssc:{}", variable.kind.name()), &unit)
    })
}

fn parameters(xml: &mut Xml, system: &Source, index: usize) -> io::Result<()> {
    let CheckedComponent { name, fmu, settings, .. } = &system.components[index];
    let description = &fmu.description;
    let start_of =
        |name: &str| description.find(name).and_then(|(_, variable)| variable.start.as_deref());
    let differs = |name: &str, value: &SettingValue| match value {
        SettingValue::Real(value) => {
            start_of(name).and_then(|start| start.parse().ok()) != Some(*value)
        }
        SettingValue::Integer(value) | SettingValue::Item(_, value) => {
            start_of(name).and_then(|start| start.parse().ok()) != Some(*value)
        }
        SettingValue::Boolean(value) => {
            start_of(name) != Some(if *value { "true" } else { "false" })
        }
        SettingValue::Text(value) => start_of(name) != Some(value),
    };
    let set: Vec<_> = settings.iter().filter(|s| differs(&s.name, &s.value)).collect();
    if set.is_empty() {
        return Ok(());
    }
    element(xml, "ssd:ParameterBindings", &[], |xml| {
        element(xml, "ssd:ParameterBinding", &[], |xml| {
            element(xml, "ssd:ParameterValues", &[], |xml| {
                let name = identifier(&format!("{name}_values"));
                element(
                    xml,
                    "ssv:ParameterSet",
                    &[("version", "1.0".into()), ("name", name)],
                    |xml| {
                        element(xml, "ssv:Parameters", &[], |xml| {
                            set.iter().try_for_each(|setting| {
                                element(
                                    xml,
                                    "ssv:Parameter",
                                    &[("name", setting.name.clone())],
                                    |xml| {
                                        let (kind, value) = typed(&setting.value);
                                        leaf(xml, kind, &[("value", value)])
                                    },
                                )
                            })
                        })
                    },
                )
            })
        })
    })
}

fn typed(value: &SettingValue) -> (&'static str, String) {
    match value {
        SettingValue::Real(value) => ("ssv:Real", real(*value)),
        SettingValue::Integer(value) => ("ssv:Integer", value.to_string()),
        SettingValue::Item(name, _) => ("ssv:Enumeration", name.clone()),
        SettingValue::Boolean(value) => ("ssv:Boolean", value.to_string()),
        SettingValue::Text(text) => ("ssv:String", text.clone()),
    }
}

fn connections(xml: &mut Xml, system: &Source) -> io::Result<()> {
    let parts = system.parts();
    system.wires.iter().try_for_each(|wire| {
        let names = |port: &Port| {
            let part = parts[port.component];
            (part.name.to_string(), part.description.variables[port.variable].name.clone())
        };
        let ((start, from), (end, to)) = (names(&wire.from), names(&wire.to));
        let mut attributes = vec![
            ("startElement", start),
            ("startConnector", from),
            ("endElement", end),
            ("endConnector", to),
        ];
        if wire.scaling == Scaling::default() {
            return leaf(xml, "ssd:Connection", &attributes);
        }
        // The conversion is written here, so that all importers convert in the same way.
        attributes.push(("suppressUnitConversion", "true".into()));
        element(xml, "ssd:Connection", &attributes, |xml| {
            let linear =
                [("factor", real(wire.scaling.factor)), ("offset", real(wire.scaling.offset))];
            leaf(xml, "ssc:LinearTransformation", &linear)
        })
    })
}

/// Writes the definitions of the units that connectors have.
fn units(xml: &mut Xml, system: &Source) -> io::Result<()> {
    let mut units = BTreeMap::new();
    for (index, CheckedComponent { fmu, .. }) in system.components.iter().enumerate() {
        for variable in connectors(system, index) {
            let VariableKind::Real { unit: Some(unit), .. } = &variable.kind else { continue };
            if let Some(defined) =
                fmu.description.units.iter().find(|defined| defined.name == *unit)
            {
                units.entry(unit.as_str()).or_insert(defined);
            }
        }
    }
    if units.is_empty() {
        return Ok(());
    }
    element(xml, "ssd:Units", &[], |xml| {
        units.values().try_for_each(|unit| {
            element(xml, "ssc:Unit", &[("name", unit.name.clone())], |xml| {
                let mut attributes = Vec::new();
                for (base, exponent) in ["kg", "m", "s", "A", "K", "mol", "cd", "rad"]
                    .into_iter()
                    .zip(unit.exponents.unwrap_or_default())
                {
                    if exponent != 0 {
                        attributes.push((base, exponent.to_string()));
                    }
                }
                if unit.factor != 1.0 {
                    attributes.push(("factor", real(unit.factor)));
                }
                if unit.offset != 0.0 {
                    attributes.push(("offset", real(unit.offset)));
                }
                leaf(xml, "ssc:BaseUnit", &attributes)
            })
        })
    })
}
