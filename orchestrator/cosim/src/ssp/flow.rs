//! Follows connections and parameter values through the connectors of systems, to the variables of
//! the FMUs.

use super::binding::Given;
use super::structure::{Connector, Link, Node, Structure};
use super::value::{Passage, Quantity, Unit};
use crate::experiment::Connection;
use fmi_master::description::{Variable, VariableKind};
use fmi_master::quantity::Scaling;
use fmi_master::wiring::Part;
use fmu_import::description::indices;
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
    start: Node,
    passage: &'a Passage,
}

/// The connections by their ends, and the values that are known at connectors and variables.
struct Flow<'a> {
    structure: &'a Structure,
    parts: &'a [Part<'a>],
    edges: BTreeMap<Node, Edge<'a>>,
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
    let ends: BTreeSet<&Node> = flow.edges.keys().chain(flow.values.keys()).collect();
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

    /// Returns a connector, or the array to which an element belongs.
    fn connector(&self, node: &Node) -> Option<&'a Connector> {
        let array = || (node.0.clone(), node.1.split('[').next().unwrap_or_default().to_string());
        let connectors = &self.structure.connectors;
        connectors.get(node).or_else(|| connectors.get(&array()))
    }

    /// Returns the unit that a component's FMU gives its variable.
    fn unit_of_variable(&self, node: &Node) -> Option<Unit> {
        let kind = &self.variable(node)?.kind;
        let description = self.parts[self.structure.component_of(node)?].description;
        let unit = Unit {
            name: kind.unit()?.to_string(),
            units: description.units.as_slice().into(),
            is_relative: false,
        };
        Some(unit.relative(kind.is_relative()))
    }

    /// Returns the unit of the values at a node: that of its connector, otherwise that of its
    /// variable, and for a system that of the connectors inside which it is connected to, if they
    /// have one in common.
    fn unit(&self, node: &Node) -> Option<Unit> {
        let is_relative = self.variable(node).is_some_and(|variable| variable.kind.is_relative());
        let declared = self.connector(node).and_then(|connector| connector.unit.clone());
        let declared = declared.map(|unit| unit.relative(is_relative));
        let declared = declared.or_else(|| self.unit_of_variable(node));
        if declared.is_some() || self.structure.component_of(node).is_some() {
            return declared;
        }
        let links = self.structure.links.iter().filter(|link| link.system == node.0);
        let others = links.filter_map(|link| match (&link.start, &link.end) {
            (start, end) if start == node => Some(end),
            (start, end) if end == node => Some(start),
            _ => None,
        });
        let inside = others.filter(|other| other.0 != node.0);
        let units: Vec<Unit> = inside.filter_map(|other| self.unit(other)).collect();
        let is_same =
            |unit: &Unit| Unit::scaling(units.first(), Some(unit)) == Ok(Scaling::default());
        units.iter().all(is_same).then(|| units.first().cloned()).flatten()
    }

    /// Returns whether a value comes into the connection at this connector of it, and `None` if
    /// that is not known. A system gives what it receives from outside to its elements.
    fn gives(&self, node: &Node, link: &Link) -> Option<bool> {
        let kind = match self.variable(node) {
            Some(variable) => &*variable.causality,
            None => self.connector(node)?.kind.as_str(),
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
            for (start, end) in self.pairs(link) {
                let sides = (self.gives(&start, link), self.gives(&end, link));
                let is_reversed =
                    matches!(sides, (Some(false), Some(true) | None) | (None, Some(true)));
                let (start, end) = if is_reversed { (end, start) } else { (start, end) };
                let name = dotted(&end);
                if self.edges.insert(end, Edge { start, passage: &link.passage }).is_some() {
                    return Err(format!("{name} is connected twice"));
                }
            }
        }
        Ok(())
    }

    /// Returns the ends of a connection, of arrays element by element.
    fn pairs(&self, link: &Link) -> Vec<(Node, Node)> {
        let [start, end] = [&link.start, &link.end];
        let named = |node: &Node, indices: &str| (node.0.clone(), format!("{}{indices}", node.1));
        match (self.indices(start), self.indices(end)) {
            (Some(indices), other) | (other @ None, Some(indices))
                if other.as_ref().is_none_or(|other| *other == indices) =>
            {
                indices.iter().map(|each| (named(start, each), named(end, each))).collect()
            }
            _ => vec![(start.clone(), end.clone())],
        }
    }

    /// Returns the indices of the elements of an array, such as `[1,2]`.
    fn indices(&self, node: &Node) -> Option<Vec<String>> {
        if let Some(component) = self.structure.component_of(node) {
            let description = self.parts[component].description;
            let elements = &description.variables[description.elements(&node.1)];
            let indices = elements.iter().map(|element| element.name[node.1.len()..].to_string());
            return Some(indices.collect()).filter(|indices: &Vec<_>| !indices.is_empty());
        }
        let shape = &self.structure.connectors.get(node)?.shape;
        let count = shape.iter().product();
        (!shape.is_empty()).then(|| (0..count).map(|number| indices(number, shape)).collect())
    }

    /// Gives the values to the variables and connectors of their names.
    fn bind(&mut self, path: &Path) -> Result<(), String> {
        let mut left_out: BTreeMap<&str, Vec<String>> = BTreeMap::new();
        for given in &self.structure.values {
            let nodes = self.targets(given);
            if nodes.is_empty() {
                let name = dotted(&(given.owner.clone(), given.name.clone()));
                left_out.entry(&given.file).or_default().push(name);
            }
            for node in nodes {
                let quantity = given
                    .passage
                    .apply(given.quantity.clone(), self.unit(&node))
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
            tracing::warn!(
                "{}: {file}: these values are left out, because there are no such variables: \
                 {names}{more}",
                path.display()
            );
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
        variables.chain(self.of_systems().filter(|node| dotted(node) == name).cloned()).collect()
    }

    /// Returns the connectors of systems.
    fn of_systems(&self) -> impl Iterator<Item = &'a Node> {
        let structure = self.structure;
        structure.connectors.keys().filter(|node| structure.component_of(node).is_none())
    }

    /// Returns the way of a value against its direction: from the variable where it ends to the
    /// component, or the outermost connector, where it begins.
    fn way<'b>(&'b self, end: &'b Node) -> Result<Vec<&'b Node>, String> {
        let mut way = vec![end];
        while let Some(edge) = self.edges.get(way[way.len() - 1]) {
            way.push(&edge.start);
            if self.structure.component_of(&edge.start).is_some() {
                break;
            }
            if way.len() > self.edges.len() + 1 {
                return Err(format!("the connection to {} leads in a circle", dotted(end)));
            }
        }
        Ok(way)
    }

    fn connection(&self, way: &[&Node]) -> Result<Connection, String> {
        let (start, last) = (way[way.len() - 1], way[0]);
        let of_connection =
            |end: &Node, fault| format!("the connection to {} {fault}", dotted(end));
        let mut unit = self.unit(start);
        let between = |from: Option<Unit>, to: Option<&Unit>| {
            Unit::scaling(from.as_ref(), to).map_err(|fault| of_connection(last, fault))
        };
        let mut scaling = between(self.unit_of_variable(start), unit.as_ref())?;
        for end in way[..way.len() - 1].iter().rev() {
            let next = self.unit(end);
            let own = self.edges[*end].passage.scaling(unit.as_ref(), next.as_ref());
            scaling = scaling.then(own.map_err(|fault| of_connection(end, fault))?);
            unit = next.or(unit);
        }
        scaling = scaling.then(between(unit, self.unit_of_variable(last).as_ref())?);
        let name = |node: &Node| Spanned::new(0..0, format!("{}.{}", node.0, node.1));
        let (from, to, scaling) = (name(start), name(last), Some(scaling));
        Ok(Connection { from, to, scaling })
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
                .apply(quantity, self.unit(end))
                .map_err(|fault| format!("\"{}\": {fault}", dotted(end)))?;
        }
        quantity = quantity
            .converted(self.unit_of_variable(way[0]))
            .map_err(|fault| format!("\"{}\": {fault}", dotted(way[0])))?;
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
