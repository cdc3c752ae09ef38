//! Content of a system, for inspection: variables, and connections with the time at which their
//! values are read.

use crate::system::System;
use fmi_master::delay::{self, Reading};
use fmi_master::description::Variable;
use fmi_master::names;
use fmi_master::wiring::{self, Port, Wire};

impl System {
    /// Returns the connections, and when the source of each is read.
    pub fn wires(&self) -> Vec<(Wire, Reading)> {
        delay::readings_of_wires(&self.parts(), &self.wires, self.experiment.simulation.coupling)
    }

    /// Returns the variables that a name denotes, as `component.variable` or `component.prefix.*`,
    /// in the order of the description. Texts are left out.
    pub fn ports(&self, pattern: &str) -> Vec<Port> {
        let Some((name, rest)) = names::split(pattern) else { return Vec::new() };
        let parts = self.parts();
        let Some(component) = parts.iter().position(|part| part.name == name) else {
            return Vec::new();
        };
        let variables = parts[component].description.variables.iter().enumerate();
        variables
            .filter(|(_, variable)| names::matches(rest, &variable.name))
            .filter_map(|(position, variable)| wiring::port(component, position, variable))
            .collect()
    }

    /// Returns the variable behind a port.
    pub fn variable_at(&self, port: Port) -> &Variable {
        &self.components[port.component].fmu.description.variables[port.variable]
    }

    /// Returns the full name of a variable, `component.variable`.
    pub fn name(&self, port: Port) -> String {
        format!("{}.{}", self.components[port.component].name, self.variable_at(port).name)
    }
}
