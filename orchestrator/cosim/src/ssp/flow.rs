//! Follows connections and parameter values through the connectors of systems, to the variables of
//! the FMUs.

use super::binding::Given;
use super::structure::{Link, Node, Structure};
use super::value::{Passage, Quantity};
use crate::experiment::Connection;
use fmi_master::description::{Variable, VariableKind};
use fmi_master::names;
use fmi_master::quantity::{Scaling, UnitDefinition};
use fmi_master::wiring::Part;
use fmu_import::warnings::warn_once;
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use toml::{Spanned, Value};

/// Number of names that a warning lists.
const LISTED: usize = 5;

/// What the connections and parameter values mean for the FMUs.
pub(super) struct Resolved {
    pub(super) connections: Vec<Connection>,
    /// Values of the variables of each component, by name.
    pub(super) parameters: Vec<BTreeMap<String, Value>>,
}

/// A connection with the connector that gives the value, without the one that it ends at.
struct Edge<'a> {
    start: &'a Node,
    passage: &'a Passage,
}

/// The connections by their ends, and the values that are known at connectors and variables.
struct Flow<'a> {
    structure: &'a Structure,
    parts: &'a [Part<'a>],
    edges: BTreeMap<&'a Node, Edge<'a>>,
    values: BTreeMap<Node, Quantity>,
}

/// Finds the connections between components, and the values of their variables. Warns of values
/// that belong to no variable, which SSP ignores. The archive is called `path` in warnings.
///
/// # Errors
/// Returns an error if a connector is connected twice or in a circle, or if a value cannot be
/// converted.
pub(super) fn resolve(
    structure: &Structure,
    parts: &[Part],
    path: &Path,
) -> Result<Resolved, String> {
    let (edges, values) = (BTreeMap::new(), BTreeMap::new());
    let mut flow = Flow { structure, parts, edges, values };
    flow.connect()?;
    flow.bind(path)?;

    let parameters = vec![BTreeMap::new(); parts.len()];
    let mut resolved = Resolved { connections: Vec::new(), parameters };
    let ends: BTreeSet<&Node> = flow.edges.keys().copied().chain(flow.values.keys()).collect();
    for end in ends {
        let Some(component) = structure.component_of(end) else { continue };
        let way = flow.way(end)?;
        let start = way[way.len() - 1];
        if way.len() > 1 && structure.component_of(start).is_some() {
            resolved.connections.push(flow.connection(&way)?);
        } else if let Some(value) = flow.value(&way)? {
            resolved.parameters[component].insert(end.1.clone(), value);
        }
    }
    Ok(resolved)
}

impl<'a> Flow<'a> {
    fn variable(&self, node: &Node) -> Option<&'a Variable> {
        let component = self.structure.component_of(node)?;
        self.parts[component].description.find(&node.1).map(|(_, variable)| variable)
    }

    fn unit(&self, node: &Node) -> Option<&'a str> {
        match self.variable(node) {
            Some(Variable { kind: VariableKind::Real { unit, .. }, .. }) => unit.as_deref(),
            Some(_) => None,
            None => self.structure.connectors.get(node)?.unit.as_deref(),
        }
    }

    /// Returns the units for values at a node. Those of an FMU have precedence over those of the
    /// archive.
    fn units(&self, node: &Node) -> Vec<UnitDefinition> {
        let component = self.structure.component_of(node);
        let own = component.map_or(&[][..], |index| &self.parts[index].description.units);
        own.iter().chain(&self.structure.units).cloned().collect()
    }

    /// Returns whether a value comes into the connection at this connector of it, and `None` if
    /// that is not known. A system gives what it receives from outside to its elements.
    fn gives(&self, node: &Node, link: &Link) -> Option<bool> {
        let kind = match self.variable(node) {
            Some(variable) => &*variable.causality,
            None => self.structure.connectors.get(node)?.kind.as_str(),
        };
        let from_outside = match kind {
            "input" | "parameter" => true,
            "output" | "calculatedParameter" | "local" => false,
            _ => return None,
        };
        Some(from_outside == (node.0 == link.system))
    }

    fn connect(&mut self) -> Result<(), String> {
        for link in &self.structure.links {
            let sides = (self.gives(&link.start, link), self.gives(&link.end, link));
            let is_reversed =
                matches!(sides, (Some(false), Some(true) | None) | (None, Some(true)));
            let (start, end) =
                if is_reversed { (&link.end, &link.start) } else { (&link.start, &link.end) };
            let edge = Edge { start, passage: &link.passage };
            if self.edges.insert(end, edge).is_some() {
                return Err(format!("{} is connected twice", dotted(end)));
            }
        }
        Ok(())
    }

    /// Gives the values to the variables and connectors of their names.
    fn bind(&mut self, path: &Path) -> Result<(), String> {
        let mut left_out: BTreeMap<&str, Vec<String>> = BTreeMap::new();
        for given in &self.structure.values {
            let nodes = self.targets(given);
            if nodes.is_empty() {
                let names = left_out.entry(&given.file).or_default();
                let near = if names.len() < LISTED { self.nearest(given) } else { None };
                let near = near.map(|near| format!(" (did you mean \"{near}\"?)"));
                let name = dotted(&(given.owner.clone(), given.name.clone()));
                names.push(format!("{name}{}", near.unwrap_or_default()));
            }
            for node in nodes {
                let (unit, units) = (self.unit(&node), self.units(&node));
                let quantity = given
                    .passage
                    .apply(given.quantity.clone(), unit, &units)
                    .map_err(|fault| format!("\"{}\": {fault}", dotted(&node)))?;
                self.values.insert(node, quantity);
            }
        }
        for (file, names) in left_out {
            let more = match names.len() {
                0..=LISTED => String::new(),
                count => format!(" and {} more", count - LISTED),
            };
            let names = names[..names.len().min(LISTED)].join(", ");
            warn_once(format!(
                "{}: {file}: these values are left out, because there are no such variables: \
                 {names}{more}",
                path.display()
            ));
        }
        Ok(())
    }

    /// Returns the variables and connectors that the name of a value stands for. There may be
    /// several, because names of systems and components may contain dots.
    fn targets(&self, given: &Given) -> Vec<Node> {
        let own = (given.owner.clone(), given.name.clone());
        if self.structure.component_of(&own).is_some() {
            return self.variable(&own).map(|_| own).into_iter().collect();
        }
        let name = dotted(&own);
        let variables = self.structure.components.iter().filter_map(|component| {
            let rest = name.strip_prefix(&component.name.replace('/', "."))?.strip_prefix('.')?;
            let node = (component.name.clone(), rest.to_string());
            self.variable(&node).map(|_| node)
        });
        let connectors = self.structure.connectors.keys().filter(|node| dotted(node) == name);
        variables.chain(connectors.cloned()).collect()
    }

    fn nearest(&self, given: &Given) -> Option<String> {
        let own = self.parts.iter().find(|part| part.name == given.owner);
        let parts = own.map_or(self.parts, std::slice::from_ref);
        let all = parts.iter().flat_map(|part| {
            let kinds = ["parameter", "input"].into_iter();
            let variables = kinds.flat_map(|kind| part.description.names(kind));
            variables.map(|name| dotted(&(part.name.to_string(), name.to_string())))
        });
        let connectors = self.structure.connectors.keys().filter(|_| own.is_none()).map(dotted);
        let all: Vec<String> = all.chain(connectors).collect();
        let wrong = dotted(&(given.owner.clone(), given.name.clone()));
        names::nearest(&wrong, all.iter().map(String::as_str)).map(String::from)
    }

    /// Returns the way of a value against its direction: from the variable where it ends to the
    /// component, or the outermost connector, where it begins.
    fn way<'b>(&'b self, end: &'b Node) -> Result<Vec<&'b Node>, String> {
        let mut way = vec![end];
        while let Some(edge) = self.edges.get(way[way.len() - 1]) {
            way.push(edge.start);
            if self.structure.component_of(edge.start).is_some() {
                break;
            }
            if way.len() > self.edges.len() + 1 {
                return Err(format!("the connection to {} leads in a circle", dotted(end)));
            }
        }
        Ok(way)
    }

    fn connection(&self, way: &[&Node]) -> Result<Connection, String> {
        let (mut scaling, mut converts) = (Scaling::default(), true);
        for end in way[..way.len() - 1].iter().rev() {
            let passage = self.edges[*end].passage;
            let own = passage.scaling();
            let own = own.map_err(|fault| format!("the connection to {} {fault}", dotted(end)))?;
            scaling = scaling.then(own);
            converts &= passage.converts;
        }
        let name = |node: &Node| Spanned::new(0..0, format!("{}.{}", node.0, node.1));
        let from = name(way[way.len() - 1]);
        Ok(Connection { from, to: name(way[0]), convert_units: converts, scaling })
    }

    /// Returns the value that comes to the beginning of a way, if one is known. The value of the
    /// outermost connector counts.
    fn value(&self, way: &[&Node]) -> Result<Option<Value>, String> {
        let Some(first) = way.iter().rposition(|node| self.values.contains_key(*node)) else {
            return Ok(None);
        };
        let mut quantity = self.values[way[first]].clone();
        for end in way[..first].iter().rev() {
            let passage = self.edges[*end].passage;
            quantity = passage
                .apply(quantity, self.unit(end), &self.units(end))
                .map_err(|fault| format!("\"{}\": {fault}", dotted(end)))?;
        }
        // Enumerations may be written as their numbers.
        let kind = self.variable(way[0]).map(|variable| &variable.kind);
        if let (Some(VariableKind::Enumeration { items }), Value::Integer(number)) =
            (kind, &quantity.value)
            && let Some((name, _)) = items.iter().find(|(_, value)| i64::from(*value) == *number)
        {
            return Ok(Some(Value::String(name.clone())));
        }
        Ok(Some(quantity.value))
    }
}

/// Returns the name of a connector or a variable as SSP writes it.
fn dotted((owner, name): &Node) -> String {
    if owner.is_empty() { name.clone() } else { format!("{}.{name}", owner.replace('/', ".")) }
}
