//! What follows from the table: which variables are calculated, states, derivatives, and who depends on whom.

use crate::ModelDescription;
use crate::variable::{Causality, Kind, Variable};

impl Variable {
    /// Whether the unit computes the variable; otherwise the importer sets it.
    pub fn is_calculated(&self) -> bool {
        !matches!(self.causality, Causality::Parameter | Causality::Input)
    }

    /// Name of the state this variable is the time derivative of.
    pub fn derivative_of(&self) -> Option<&str> {
        match &self.kind {
            Kind::Real { derivative_of, .. } => derivative_of.as_deref(),
            _ => None,
        }
    }
}

impl ModelDescription {
    /// Value reference of the variable `name`.
    pub fn position(&self, name: &str) -> Option<usize> {
        self.variables.iter().position(|variable| variable.name == name)
    }

    /// Continuous states and their derivatives as pairs of value references, in the order of the states in the table.
    pub fn states(&self) -> Vec<(usize, usize)> {
        let mut states: Vec<_> = self
            .variables
            .iter()
            .enumerate()
            .filter_map(|(derivative, variable)| {
                Some((self.position(variable.derivative_of()?)?, derivative))
            })
            .collect();
        states.sort_unstable();
        states
    }

    /// Whether directional derivatives are offered: exactly for units with continuous states.
    pub fn directional_derivatives(&self) -> bool {
        self.variables.iter().any(|variable| variable.derivative_of().is_some())
    }

    /// Value references of the inputs and states that the variable at `reference` depends on at an instant, ascending.
    /// A state depends on itself alone.
    pub(crate) fn dependencies(&self, reference: usize, states: &[(usize, usize)]) -> Vec<usize> {
        if states.iter().any(|&(state, _)| state == reference) {
            return vec![reference];
        }
        let names = &self.variables[reference].dependencies;
        let mut known: Vec<_> = names.iter().filter_map(|name| self.position(name)).collect();
        known.sort_unstable();
        known.dedup();
        known
    }

    /// The same at initialization, where the knowns are inputs and parameters: states follow from the parameters.
    pub(crate) fn initial_dependencies(&self, reference: usize, states: &[(usize, usize)]) -> Vec<usize> {
        let inputs = self.dependencies(reference, states);
        let known = |(i, variable): (usize, &Variable)| match variable.causality {
            Causality::Parameter => Some(i),
            Causality::Input => inputs.contains(&i).then_some(i),
            _ => None,
        };
        self.variables.iter().enumerate().filter_map(known).collect()
    }

    /// Value references of what initialization computes: calculated outputs, states and derivatives, ascending.
    pub(crate) fn initial_unknowns(&self, states: &[(usize, usize)]) -> Vec<usize> {
        let listed = |i: usize| {
            self.variables[i].causality == Causality::Output
                || states.iter().any(|&(state, derivative)| state == i || derivative == i)
        };
        (0..self.variables.len()).filter(|&i| listed(i)).collect()
    }
}
