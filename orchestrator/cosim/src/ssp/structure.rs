//! The system of an SSP archive: its components, connections and parameter values, including those
//! of its subsystems.

use super::FMU;
use crate::experiment::{Component, Connection};
use fmi_master::quantity::Scaling;
use fmu_import::archive;
use fmu_import::xml::{self, Element};
use percent_encoding::percent_decode_str;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use toml::{Spanned, Value};

/// A component of the system or of one of its subsystems.
pub(super) struct SystemComponent {
    pub(super) name: String,
    /// Path of the component's FMU in the archive.
    pub(super) source: String,
    pub(super) parameters: BTreeMap<String, Value>,
}

impl SystemComponent {
    pub(super) fn component(&self, folder: &Path) -> Component {
        let value =
            |(name, value): (&String, &Value)| (name.clone(), Spanned::new(0..0, value.clone()));
        Component {
            fmu: Spanned::new(0..0, folder.join(&self.source).to_string_lossy().into_owned()),
            every: 1,
            unconnected: Vec::new(),
            parameters: self.parameters.iter().map(value).collect(),
            isolate: None,
            is_exchanged: false,
        }
    }
}

/// A connector, given by the name of its component or subsystem and its own name. The name of the
/// outermost system is empty.
type Node = (String, String);

/// A connection, without the connector that it ends at.
#[derive(Clone)]
struct Edge {
    start: Node,
    converts: bool,
    scaling: Scaling,
}

/// A system into which its subsystems have been merged.
pub(super) struct Structure {
    pub(super) folder: PathBuf,
    pub(super) components: Vec<SystemComponent>,
    pub(super) connections: Vec<Connection>,
}

/// Collects components, connections and values while the systems are traversed.
#[derive(Default)]
struct Walk {
    components: Vec<SystemComponent>,
    edges: BTreeMap<Node, Edge>,
    /// Parameter values that belong to systems, by the full name of the variable.
    parameters: Vec<(String, Value)>,
}

impl Structure {
    pub(super) fn read(root: &Element, folder: &Path) -> Result<Self, String> {
        if root.name != "SystemStructureDescription" {
            return Err(format!("is a {}, not a SystemStructureDescription", root.name));
        }
        let system = root.child("System").ok_or("has no System")?;
        let mut walk = Walk::default();
        walk.system(system, "", folder)?;
        for (name, value) in std::mem::take(&mut walk.parameters) {
            let owner = walk.components.iter_mut().find_map(|component| {
                let rest = name
                    .strip_prefix(&component.name.replace('/', "."))?
                    .strip_prefix('.')?
                    .to_string();
                Some((component, rest))
            });
            let (component, variable) = owner.ok_or_else(|| {
                format!("the parameter \"{name}\" of a system belongs to no component")
            })?;
            component.parameters.insert(variable, value);
        }
        let connections = walk.connections()?;
        Ok(Self { folder: folder.to_path_buf(), components: walk.components, connections })
    }
}

impl Walk {
    /// Adds a system and its subsystems. The `path` is the name of the system, which is empty for
    /// the outermost one.
    fn system(&mut self, system: &Element, path: &str, folder: &Path) -> Result<(), String> {
        let inside =
            |name: &str| if path.is_empty() { name.to_string() } else { format!("{path}/{name}") };
        for (name, value) in parameters(system, folder)? {
            self.parameters.push((inside(&name).replace('/', "."), value));
        }
        for element in system.child("Elements").map(|e| e.children.as_slice()).unwrap_or_default() {
            let name = inside(&element.required("name")?.replace('.', "/"));
            match element.name.as_str() {
                "System" => self.system(element, &name, folder)?,
                "Component" => self.component(element, name, folder)?,
                other => {
                    return Err(format!(
                        "the element \"{name}\" is a {other}, which is not supported"
                    ));
                }
            }
        }
        for connection in system.list("Connections", "Connection") {
            let node = |element: &str, connector: &str| {
                let owner =
                    connection.attribute(element).map(|name| inside(&name.replace('.', "/")));
                Ok::<_, String>((
                    owner.unwrap_or_else(|| path.to_string()),
                    connection.required(connector)?.to_string(),
                ))
            };
            let (start, end) =
                (node("startElement", "startConnector")?, node("endElement", "endConnector")?);
            if let Some(mapping) = connection
                .children
                .iter()
                .find(|child| child.name.ends_with("MappingTransformation"))
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
            let converts =
                !matches!(connection.attribute("suppressUnitConversion"), Some("true" | "1"));
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
            return refuse("needs model exchange: only co-simulation is supported".into());
        }
        let source = file(element.required("source")?)?;
        let parameters = parameters(element, folder)?.into_iter().collect();
        if self.components.iter().any(|other| other.name == name) {
            return refuse("is defined twice".into());
        }
        self.components.push(SystemComponent { name, source, parameters });
        Ok(())
    }

    /// Returns the connections between components, with the connectors of systems left out.
    fn connections(&self) -> Result<Vec<Connection>, String> {
        let is_component =
            |node: &Node| self.components.iter().any(|component| component.name == node.0);
        let mut connections = Vec::new();
        for (end, edge) in self.edges.iter().filter(|(end, _)| is_component(end)) {
            let (mut edge, mut steps) = (edge.clone(), 0);
            // The connection is followed from its end back to the component that the value comes
            // from. There is none if the value comes from outside.
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

/// Returns the parameter values that are bound to a component or a system, in their order.
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
            None => {
                binding.child("ParameterValues").and_then(|values| values.child("ParameterSet"))
            }
            Some(source) => {
                let source = file(source)?;
                let fault = |message: String| format!("{source}: {message}");
                let bytes = std::fs::read(folder.join(&source))
                    .map_err(|error| fault(error.to_string()))?;
                loaded =
                    xml::decode(&bytes).and_then(|text| Element::parse(&text)).map_err(fault)?;
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
    let fault = |what: &str| format!("the parameter \"{name}\" = \"{text}\" is not a valid {what}");
    Ok(match typed.name.as_str() {
        "Real" => {
            let number: f64 = text.trim().parse().map_err(|_| fault("real number"))?;
            match typed.attribute("unit") {
                // The value is converted by the units of the FMU, like a text in an experiment.
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
        other => {
            return Err(format!(
                "the parameter \"{name}\" is of type {other}, which is not supported"
            ));
        }
    })
}

/// Converts the URI of a file to its path in the archive.
fn file(uri: &str) -> Result<String, String> {
    let path =
        percent_decode_str(uri).decode_utf8().map_err(|_| format!("\"{uri}\" is not UTF-8"))?;
    match archive::unsafe_name(&path) {
        Some(reason) => Err(format!("the file \"{}\" {reason}", path.escape_default())),
        None => Ok(path.into_owned()),
    }
}
