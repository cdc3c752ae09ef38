//! The system of an SSP archive: its components, connections and parameter values, including those
//! of its subsystems.

use super::FMU;
use super::binding::{self, Given};
use super::value::{Passage, Unit};
use crate::experiment::Interface;
use fmi_master::quantity::UnitDefinition;
use fmu_import::description;
use fmu_import::xml::Element;
use std::collections::BTreeMap;
use std::path::Path;
use std::rc::Rc;

/// A component of the system or of one of its subsystems.
pub(super) struct SystemComponent {
    pub(super) name: String,
    /// Path of the component's FMU in the archive.
    pub(super) source: String,
    /// Interface that the structure demands.
    pub(super) interface: Option<Interface>,
}

/// A connector or a variable, given by the name of its component or subsystem and its own name.
/// The name of the outermost system is empty.
pub(super) type Node = (String, String);

/// A connector of a system or of a component.
pub(super) struct Connector {
    /// Kind of the connector: `input`, `parameter`, `output`, ….
    pub(super) kind: String,
    pub(super) unit: Option<Unit>,
    /// Number of elements along each dimension.
    pub(super) shape: Vec<usize>,
}

/// A connection as the archive writes it. Which of its ends gives the value follows from the kinds
/// of its connectors.
pub(super) struct Link {
    /// Name of the system that the connection belongs to.
    pub(super) system: String,
    pub(super) start: Node,
    pub(super) end: Node,
    pub(super) passage: Passage,
}

/// A system together with its subsystems.
#[derive(Default)]
pub(super) struct Structure {
    pub(super) components: Vec<SystemComponent>,
    pub(super) connectors: BTreeMap<Node, Connector>,
    pub(super) links: Vec<Link>,
    /// Values of parameters. Later ones have precedence: those of a system come after those of its
    /// elements, and each binding comes after the bindings before it.
    pub(super) values: Vec<Given>,
    /// Units of measure that the structure defines.
    units: Rc<[UnitDefinition]>,
}

impl Structure {
    pub(super) fn read(root: &Element, folder: &Path) -> Result<Self, String> {
        if root.name != "SystemStructureDescription" {
            return Err(format!("is a {}, not a SystemStructureDescription", root.name));
        }
        let mut structure = Self::default();
        let units = root.list("Units", "Unit").map(description::unit);
        structure.units = units.collect::<Result<_, _>>()?;
        structure.system(root.child("System").ok_or("has no System")?, "", folder)?;
        if structure.components.is_empty() {
            return Err("has no component that could be run: put FMUs into the system".into());
        }
        Ok(structure)
    }

    /// Returns the component that a node belongs to, if it does not belong to a system.
    pub(super) fn component_of(&self, node: &Node) -> Option<usize> {
        self.components.iter().position(|component| component.name == node.0)
    }

    /// Adds a system and its subsystems. The `path` is the name of the system, which is empty for
    /// the outermost one.
    fn system(&mut self, system: &Element, path: &str, folder: &Path) -> Result<(), String> {
        let inside = |name: &str| {
            let name = name.replace('.', "/");
            if path.is_empty() { name } else { format!("{path}/{name}") }
        };
        self.connectors(system, path)?;
        for element in system.child("Elements").map(|e| e.children.as_slice()).unwrap_or_default() {
            let name = inside(element.required("name")?);
            match element.name.as_str() {
                "System" => self.system(element, &name, folder)?,
                "Component" => self.component(element, name, folder)?,
                "SignalDictionaryReference" => {
                    return Err(format!(
                        "the element \"{name}\" refers to a signal dictionary, which is not \
                         supported: connect the components with one another instead"
                    ));
                }
                other => {
                    return Err(format!(
                        "the element \"{name}\" is a {other}, which is not supported: only \
                         components and systems are"
                    ));
                }
            }
        }
        for connection in system.list("Connections", "Connection") {
            let node = |side: &str| {
                // Some tools name the system itself by an empty text.
                let owner = connection.attribute(&format!("{side}Element"));
                let owner = owner.filter(|name| !name.is_empty()).map(inside);
                let mut name = connection.required(&format!("{side}Connector"))?.to_string();
                if let Some(indices) = connection.attribute(&format!("{side}Indices")) {
                    let indices: Vec<&str> = indices.split_whitespace().collect();
                    name = format!("{name}[{}]", indices.join(","));
                }
                Ok::<_, String>((owner.unwrap_or_else(|| path.to_string()), name))
            };
            self.links.push(Link {
                system: path.to_string(),
                start: node("start")?,
                end: node("end")?,
                passage: Passage::read(connection)?,
            });
        }
        binding::read(system, path, folder, &mut self.values, &self.units)
    }

    /// Adds the connectors of a system or a component.
    fn connectors(&mut self, element: &Element, owner: &str) -> Result<(), String> {
        for connector in element.list("Connectors", "Connector") {
            let node = (owner.to_string(), connector.required("name")?.to_string());
            let kind = connector.required("kind")?.to_string();
            let unit = connector.children.iter().find_map(|typed| typed.attribute("unit"));
            let (name, units) = (unit.map(String::from), Rc::clone(&self.units));
            let unit = name.map(|name| Unit { name, units, is_relative: false });
            let dimensions = connector.children.iter().filter(|child| child.name == "Dimension");
            let sizes = dimensions.map(|child| child.parsed("size", "a number of elements"));
            let shape = sizes.filter_map(Result::transpose).collect::<Result<_, _>>()?;
            self.connectors.insert(node, Connector { kind, unit, shape });
        }
        Ok(())
    }

    fn component(&mut self, element: &Element, name: String, folder: &Path) -> Result<(), String> {
        let refuse = |what: String| Err(format!("the component \"{name}\" {what}"));
        let kind = element.attribute("type").unwrap_or(FMU);
        if kind != FMU {
            return refuse(format!(
                "is of type {kind}, only FMUs are supported: write another system structure as a \
                 System within this one, and put tables of values into an FMU"
            ));
        }
        let interface = match element.attribute("implementation") {
            Some("ModelExchange") => Some(Interface::ModelExchange),
            Some("CoSimulation") => Some(Interface::CoSimulation),
            _ => None,
        };
        let Some(source) = element.attribute("source").filter(|source| !source.is_empty()) else {
            return refuse(
                "has no FMU: put one into the archive, and name it in the attribute source".into(),
            );
        };
        let source = binding::path(source)?;
        if self.components.iter().any(|other| other.name == name) {
            return refuse("is defined twice".into());
        }
        self.connectors(element, &name)?;
        binding::read(element, &name, folder, &mut self.values, &self.units)?;
        self.components.push(SystemComponent { name, source, interface });
        Ok(())
    }
}
