//! Reads an SSP archive as an experiment.

use super::{FMU, OPEN_MODELICA, OWN, STRUCTURE};
use crate::delay;
use crate::document::Source;
use crate::error::Error;
use crate::experiment::{
    Component, Connection, Coupling, Experiment, Observe, OnInvalid, Overrides, Record, Simulation,
};
use crate::system::Opened;
use crate::wiring::{self, Part};
use fmu_import::archive;
use fmu_import::error::Error as Import;
use fmu_import::fmu::Fmu;
use fmu_import::quantity::Scaling;
use fmu_import::xml::{self, Element};
use percent_encoding::percent_decode_str;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::rc::Rc;
use tempfile::TempDir;
use toml::{Spanned, Value};

/// An experiment that was read from an archive.
pub struct Loaded {
    /// The experiment; components of subsystems are called `subsystem/component`.
    pub experiment: Experiment,
    /// The opened FMUs of the archive.
    pub opened: Opened,
    /// The unpacked entries of the archive.
    pub entries: Entries,
}

/// The entries of an archive, unpacked until this goes.
pub struct Entries {
    path: PathBuf,
    folder: TempDir,
}

impl Entries {
    /// An error of one of its FMUs, with the names of the archive and of the entry.
    pub fn named(&self, error: Error) -> Error {
        of_entry(error, &self.path, self.folder.path())
    }
}

/// An FMU in an archive is called by the names of both, not by where it was unpacked.
fn of_entry(error: Error, archive: &Path, folder: &Path) -> Error {
    match error {
        Error::Import(Import::Fmu { path, message }) => {
            let (path, message) = match path.strip_prefix(folder) {
                Ok(entry) => (archive.to_path_buf(), format!("{}: {message}", entry.display())),
                Err(_) => (path, message),
            };
            Import::Fmu { path, message }.into()
        }
        error => error,
    }
}

/// Run settings that this program stored in the archive.
struct Own {
    title: String,
    description: String,
    step: f64,
    coupling: Coupling,
    /// Components with their periods, in their order.
    order: Vec<(String, u32)>,
    recorded: Vec<String>,
    record_every: u32,
    observe: Observe,
}

impl Own {
    fn read(element: &Element) -> Result<Self, String> {
        let count = |element: &Element, name: &str| {
            let text = element.required(name)?;
            text.parse::<u32>().map_err(|_| format!("{name}=\"{text}\" is no count"))
        };
        let coupling = match element.required("coupling")? {
            "gauss-seidel" => Coupling::GaussSeidel,
            "jacobi" => Coupling::Jacobi,
            other => return Err(format!("the coupling \"{other}\" is not known")),
        };
        let those = |name: &'static str| element.children.iter().filter(move |child| child.name == name);
        let observe = match element.child("Observe") {
            Some(stated) => {
                toml::from_str(stated.required("toml")?).map_err(|error| error.message().to_string())?
            }
            None => Observe::default(),
        };
        Ok(Self {
            title: element.required("title")?.to_string(),
            description: element.attribute("description").unwrap_or_default().to_string(),
            step: element.number("step")?.ok_or("the annotation of the run says no step")?,
            coupling,
            order: those("Component")
                .map(|child| Ok((child.required("name")?.to_string(), count(child, "every")?)))
                .collect::<Result<_, String>>()?,
            recorded: those("Record")
                .map(|child| child.required("variable").map(String::from))
                .collect::<Result<_, String>>()?,
            record_every: count(element, "recordEvery")?,
            observe,
        })
    }

    fn apply(self, experiment: &mut Experiment) -> Result<(), String> {
        (experiment.title, experiment.description) = (self.title, self.description);
        experiment.simulation.coupling = self.coupling;
        for (name, every) in &self.order {
            let component = experiment.components.get_mut(name);
            component
                .ok_or_else(|| format!("the annotation of the run: there is no component \"{name}\""))?
                .every = *every;
        }
        experiment.simulation.order = self.order.into_iter().map(|(name, _)| name).collect();
        let texts = self.recorded.into_iter().map(|name| Spanned::new(0..0, name));
        experiment.record = Record { variables: texts.collect(), every: self.record_every };
        experiment.observe = self.observe;
        Ok(())
    }
}

/// Reads an archive. The stop time and the step come from `overrides`, or else from the archive and from what its FMUs propose
/// (the smallest step). The order of the components is the one without delay, where there is one.
///
/// # Errors
/// If the archive is faulty, or needs what this program does not support: components other than
/// FMUs for co-simulation, mappings of parameters, or signal dictionaries.
pub fn load(path: &Path, overrides: &Overrides) -> Result<Loaded, Error> {
    let folder = archive::unpack(path)?;
    let refuse = |message: String| Error::from(Import::Fmu { path: path.to_path_buf(), message });
    let bytes = std::fs::read(folder.path().join(STRUCTURE))
        .map_err(|error| refuse(format!("is no SSP archive, {STRUCTURE} cannot be read: {error}")))?;
    let in_structure = |message: String| refuse(format!("{STRUCTURE}: {message}"));
    let text = xml::decode(&bytes).map_err(in_structure)?;
    let root = Element::parse(&text).map_err(in_structure)?;
    let structure = Structure::read(&root, folder.path()).map_err(in_structure)?;

    let mut opened = Opened::default();
    for component in &structure.components {
        let fmu = structure.folder.join(&component.source);
        if !opened.contains_key(&fmu) {
            let unit = Fmu::open(&fmu).map_err(|error| of_entry(error.into(), path, folder.path()))?;
            opened.insert(fmu.clone(), Rc::new(unit));
        }
    }
    let of = |component: &Found| &opened[&structure.folder.join(&component.source)].description;

    let system = root.child("System");
    let annotation = |kind: &str| {
        let mut all = system.into_iter().flat_map(|system| system.list("Annotations", "Annotation"));
        all.find(|annotation| annotation.attribute("type") == Some(kind))
    };
    let own = annotation(OWN).and_then(|annotation| annotation.child("Experiment"));
    let own = own.map(Own::read).transpose().map_err(in_structure)?;
    let master = annotation(OPEN_MODELICA)
        .and_then(|annotation| annotation.child("Annotations"))
        .and_then(|all| all.child("SimulationInformation"))
        .and_then(|information| information.child("FixedStepMaster"));
    let common = master.map_or(Ok(None), |master| master.number("stepSize")).map_err(in_structure)?;

    let experiment = root.child("DefaultExperiment");
    let time = |name| experiment.map_or(Ok(None), |e| e.number(name)).map_err(in_structure);
    let stop = overrides.stop.map_or_else(|| time("stopTime"), |stop| Ok(Some(stop)))?;
    let proposed = structure.components.iter().filter_map(|component| of(component).default_experiment.step);
    let stated = own.as_ref().map(|own| own.step).or(common);
    let step = overrides.step.or(stated).or(proposed.reduce(f64::min));
    let simulation = Simulation {
        on_invalid: OnInvalid::default(),
        start: time("startTime")?.unwrap_or(0.0),
        stop: stop.ok_or_else(|| refuse("has no stop time: give --stop".into()))?,
        step: step.ok_or_else(|| refuse("none of its FMUs proposes a step: give --step".into()))?,
        coupling: Coupling::GaussSeidel,
        order: structure.components.iter().map(|component| component.name.clone()).collect(),
    };
    let text_of = |text: String| Spanned::new(0..0, text);
    let recorded = structure.components.iter().flat_map(|component| {
        let seen =
            |causality| of(component).names(causality).map(|name| format!("{}.{name}", component.name));
        seen("input").chain(seen("output")).collect::<Vec<_>>()
    });
    let texts = |name: &String| {
        // A text can be neither recorded nor shown.
        wiring::find(name, &parts(&structure.components, &opened, &structure.folder)).is_some()
    };
    let mut experiment = Experiment {
        title: root.attribute("name").unwrap_or("system").to_string(),
        description: root.attribute("description").unwrap_or_default().to_string(),
        simulation,
        components: structure
            .components
            .iter()
            .map(|c| (c.name.clone(), c.component(&structure.folder)))
            .collect(),
        connections: structure.connections,
        record: Record { variables: recorded.filter(texts).map(text_of).collect(), every: 1 },
        observe: Observe::default(),
        leaves_inputs_open: true,
        assigned: BTreeSet::new(),
        unplaced: Vec::new(),
        source: Source::plain(path, text),
    };
    let parts = parts(&structure.components, &opened, &structure.folder);
    let wires = wiring::wires(&experiment, &parts)?;
    experiment.simulation.order =
        delay::order(&parts, &wires).into_iter().map(|index| parts[index].name.to_string()).collect();
    if let Some(own) = own {
        own.apply(&mut experiment).map_err(in_structure)?;
    }
    experiment.apply(overrides)?;
    Ok(Loaded { experiment, opened, entries: Entries { path: path.to_path_buf(), folder } })
}

fn parts<'a>(components: &'a [Found], opened: &'a Opened, folder: &Path) -> Vec<Part<'a>> {
    let part = |component: &'a Found| Part {
        name: &component.name,
        description: &opened[&folder.join(&component.source)].description,
    };
    components.iter().map(part).collect()
}

/// A component of the system or of one of its subsystems.
struct Found {
    name: String,
    /// Path of the component's FMU in the archive.
    source: String,
    parameters: BTreeMap<String, Value>,
}

impl Found {
    fn component(&self, folder: &Path) -> Component {
        let value = |(name, value): (&String, &Value)| (name.clone(), Spanned::new(0..0, value.clone()));
        Component {
            fmu: Spanned::new(0..0, folder.join(&self.source).to_string_lossy().into_owned()),
            every: 1,
            unconnected: Vec::new(),
            parameters: self.parameters.iter().map(value).collect(),
            is_exchanged: false,
        }
    }
}

/// A connector: name of the component or of the subsystem, and its own.
type Node = (String, String);

/// A connection that ends at a connector.
#[derive(Clone)]
struct Edge {
    start: Node,
    converts: bool,
    scaling: Scaling,
}

/// A system with its subsystems in one.
struct Structure {
    folder: PathBuf,
    components: Vec<Found>,
    connections: Vec<Connection>,
}

/// Collects components, connections and values while the systems are traversed.
#[derive(Default)]
struct Walk {
    components: Vec<Found>,
    edges: BTreeMap<Node, Edge>,
    /// Values of systems, by the full name of what they are for.
    parameters: Vec<(String, Value)>,
}

impl Structure {
    fn read(root: &Element, folder: &Path) -> Result<Self, String> {
        if root.name != "SystemStructureDescription" {
            return Err(format!("is a {}, not a SystemStructureDescription", root.name));
        }
        let system = root.child("System").ok_or("has no System")?;
        let mut walk = Walk::default();
        walk.system(system, "", folder)?;
        for (name, value) in std::mem::take(&mut walk.parameters) {
            let owner = walk.components.iter_mut().find_map(|component| {
                let rest =
                    name.strip_prefix(&component.name.replace('/', "."))?.strip_prefix('.')?.to_string();
                Some((component, rest))
            });
            let (component, variable) = owner
                .ok_or_else(|| format!("the parameter \"{name}\" of a system belongs to no component"))?;
            component.parameters.insert(variable, value);
        }
        let connections = walk.connections()?;
        Ok(Self { folder: folder.to_path_buf(), components: walk.components, connections })
    }
}

impl Walk {
    /// `path` is the name of the system, empty for the outermost.
    fn system(&mut self, system: &Element, path: &str, folder: &Path) -> Result<(), String> {
        let inside = |name: &str| if path.is_empty() { name.to_string() } else { format!("{path}/{name}") };
        for (name, value) in parameters(system, folder)? {
            self.parameters.push((inside(&name).replace('/', "."), value));
        }
        for element in system.child("Elements").map(|e| e.children.as_slice()).unwrap_or_default() {
            let name = inside(&element.required("name")?.replace('.', "/"));
            match element.name.as_str() {
                "System" => self.system(element, &name, folder)?,
                "Component" => self.component(element, name, folder)?,
                other => return Err(format!("the element \"{name}\" is a {other}, which is not supported")),
            }
        }
        for connection in system.list("Connections", "Connection") {
            let node = |element: &str, connector: &str| {
                let owner = connection.attribute(element).map(|name| inside(&name.replace('.', "/")));
                Ok::<_, String>((
                    owner.unwrap_or_else(|| path.to_string()),
                    connection.required(connector)?.to_string(),
                ))
            };
            let (start, end) = (node("startElement", "startConnector")?, node("endElement", "endConnector")?);
            if let Some(mapping) =
                connection.children.iter().find(|child| child.name.ends_with("MappingTransformation"))
            {
                return Err(format!(
                    "the connection to {}.{} has a {}, which is not supported",
                    end.0, end.1, mapping.name
                ));
            }
            let mut scaling = Scaling::default();
            if let Some(linear) = connection.child("LinearTransformation") {
                scaling.factor = linear.number("factor")?.unwrap_or(1.0);
                scaling.offset = linear.number("offset")?.unwrap_or(0.0);
            }
            let converts = !matches!(connection.attribute("suppressUnitConversion"), Some("true" | "1"));
            if self.edges.contains_key(&end) {
                return Err(format!("{}.{} is connected twice", end.0, end.1));
            }
            self.edges.insert(end, Edge { start, converts, scaling });
        }
        Ok(())
    }

    fn component(&mut self, element: &Element, name: String, folder: &Path) -> Result<(), String> {
        let refuse = |what: String| Err(format!("the component \"{name}\" {what}"));
        let kind = element.attribute("type").unwrap_or(FMU);
        if kind != FMU {
            return refuse(format!("is of type {kind}: only FMUs are supported"));
        }
        if element.attribute("implementation") == Some("ModelExchange") {
            return refuse("wants model exchange: only co-simulation is supported".into());
        }
        let source = file(element.required("source")?)?;
        let parameters = parameters(element, folder)?.into_iter().collect();
        if self.components.iter().any(|other| other.name == name) {
            return refuse("is there twice".into());
        }
        self.components.push(Found { name, source, parameters });
        Ok(())
    }

    /// The connections of components, straight through the connectors of systems.
    fn connections(&self) -> Result<Vec<Connection>, String> {
        let is_component = |node: &Node| self.components.iter().any(|component| component.name == node.0);
        let mut connections = Vec::new();
        for (end, edge) in self.edges.iter().filter(|(end, _)| is_component(end)) {
            let (mut edge, mut steps) = (edge.clone(), 0);
            // From the end back to the component that everything comes from; none, if it comes from outside.
            while !is_component(&edge.start) {
                let Some(before) = self.edges.get(&edge.start) else { break };
                edge = Edge {
                    start: before.start.clone(),
                    converts: before.converts && edge.converts,
                    scaling: before.scaling.then(edge.scaling),
                };
                steps += 1;
                if steps > self.edges.len() {
                    return Err(format!("the connection to {}.{} leads in a circle", end.0, end.1));
                }
            }
            if is_component(&edge.start) {
                let name = |node: &Node| Spanned::new(0..0, format!("{}.{}", node.0, node.1));
                connections.push(Connection {
                    from: name(&edge.start),
                    to: name(end),
                    convert_units: edge.converts,
                    scaling: edge.scaling,
                });
            }
        }
        Ok(connections)
    }
}

/// The parameter values bound to a component or a system, in their order.
fn parameters(element: &Element, folder: &Path) -> Result<Vec<(String, Value)>, String> {
    let mut values = Vec::new();
    for binding in element.list("ParameterBindings", "ParameterBinding") {
        if binding.child("ParameterMapping").is_some() {
            return Err("has a mapping of parameters, which is not supported".into());
        }
        if binding.attribute("sourceBase").is_some_and(|base| base != "SSD") {
            return Err("has parameters inside of an FMU, which is not supported".into());
        }
        let prefix = binding.attribute("prefix").unwrap_or_default();
        let loaded;
        let set = match binding.attribute("source") {
            None => binding.child("ParameterValues").and_then(|values| values.child("ParameterSet")),
            Some(source) => {
                let source = file(source)?;
                let fault = |message: String| format!("{source}: {message}");
                let bytes = std::fs::read(folder.join(&source)).map_err(|error| fault(error.to_string()))?;
                loaded = xml::decode(&bytes).and_then(|text| Element::parse(&text)).map_err(fault)?;
                Some(&loaded)
            }
        };
        let set = set.ok_or("has a ParameterBinding without values")?;
        for parameter in set.list("Parameters", "Parameter") {
            values.push((format!("{prefix}{}", parameter.required("name")?), value(parameter)?));
        }
    }
    Ok(values)
}

fn value(parameter: &Element) -> Result<Value, String> {
    let name = parameter.required("name")?;
    let typed = parameter.children.iter().find(|child| child.name != "Annotations");
    let typed = typed.ok_or_else(|| format!("the parameter \"{name}\" has no value"))?;
    let text = typed.required("value")?;
    let fault = |what: &str| format!("the parameter \"{name}\" = \"{text}\" is no {what}");
    Ok(match typed.name.as_str() {
        "Real" => {
            let number: f64 = text.trim().parse().map_err(|_| fault("real number"))?;
            match typed.attribute("unit") {
                // Converted like the text of an experiment, by the units of the FMU.
                Some(unit) => Value::String(format!("{number:?} {unit}")),
                None => Value::Float(number),
            }
        }
        "Integer" => Value::Integer(text.trim().parse().map_err(|_| fault("integer"))?),
        "Boolean" => match text.trim() {
            "true" | "1" => Value::Boolean(true),
            "false" | "0" => Value::Boolean(false),
            _ => return Err(fault("boolean")),
        },
        "String" | "Enumeration" => Value::String(text.to_string()),
        other => return Err(format!("the parameter \"{name}\" is of type {other}, which is not supported")),
    })
}

/// A file of the archive by its URI.
fn file(uri: &str) -> Result<String, String> {
    let path = percent_decode_str(uri).decode_utf8().map_err(|_| format!("\"{uri}\" is not UTF-8"))?;
    match archive::unsafe_name(&path) {
        Some(reason) => Err(format!("the file \"{}\" {reason}", path.escape_default())),
        None => Ok(path.into_owned()),
    }
}
