//! Structure that follows from the variable table: calculated variables, states, derivatives, and
//! dependencies.

use crate::ModelDescription;
use crate::variable::{Causality, Variable, VariableKind};

impl Variable {
    /// Whether the FMU computes the variable; otherwise the importer sets it.
    pub fn is_calculated(&self) -> bool {
        !matches!(self.causality, Causality::Parameter | Causality::Input)
    }

    /// Typical magnitude of the variable: what is declared, or 1.
    pub fn nominal(&self) -> f64 {
        match self.kind {
            VariableKind::Real { nominal: Some(nominal), .. } => nominal,
            _ => 1.0,
        }
    }

    /// Name of the state whose time derivative this variable is.
    pub fn derivative_of(&self) -> Option<&str> {
        match &self.kind {
            VariableKind::Real { derivative_of, .. } => derivative_of.as_deref(),
            _ => None,
        }
    }
}

/// Continuous states and their derivatives as pairs of positions among the variables, in the order of
/// the states.
pub fn states(variables: &[&Variable]) -> Vec<(usize, usize)> {
    let position = |name: &str| variables.iter().position(|variable| variable.name == name);
    let pair = |(derivative, variable): (usize, &&Variable)| {
        Some((position(variable.derivative_of()?)?, derivative))
    };
    let mut states: Vec<_> = variables.iter().enumerate().filter_map(pair).collect();
    states.sort_unstable();
    states
}

impl ModelDescription {
    /// Value reference of the variable `name`, if there is one.
    pub fn position(&self, name: &str) -> Option<usize> {
        self.variables.iter().position(|variable| variable.name == name)
    }

    /// Continuous states and their derivatives as pairs of value references, in the order of the
    /// states in the variable table.
    pub fn states(&self) -> Vec<(usize, usize)> {
        states(&self.variables.iter().collect::<Vec<_>>())
    }

    /// Whether the FMU provides directional derivatives, as exactly the FMUs with continuous states
    /// do.
    pub fn directional_derivatives(&self) -> bool {
        self.variables.iter().any(|variable| variable.derivative_of().is_some())
    }
    /// Value references, ascending, of the inputs and states on which the variable at `reference`
    /// depends at the same instant. A state depends on itself alone.
    pub fn dependencies(&self, reference: usize, states: &[(usize, usize)]) -> Vec<usize> {
        if states.iter().any(|&(state, _)| state == reference) {
            return vec![reference];
        }
        let names = &self.variables[reference].dependencies;
        let mut references: Vec<_> = names.iter().filter_map(|name| self.position(name)).collect();
        references.sort_unstable();
        references.dedup();
        references
    }
}

#[cfg(feature = "pack")]
impl ModelDescription {
    /// Value references, ascending, of the inputs and parameters on which the variable at
    /// `reference` depends at initialization, where the states follow from the parameters.
    pub(crate) fn initial_dependencies(
        &self,
        reference: usize,
        states: &[(usize, usize)],
    ) -> Vec<usize> {
        let inputs = self.dependencies(reference, states);
        let dependency = |(i, variable): (usize, &Variable)| match variable.causality {
            Causality::Parameter => Some(i),
            Causality::Input => inputs.contains(&i).then_some(i),
            _ => None,
        };
        self.variables.iter().enumerate().filter_map(dependency).collect()
    }

    /// Value references, ascending, of the unknowns of initialization: calculated outputs, states
    /// and derivatives.
    pub(crate) fn initial_unknowns(&self, states: &[(usize, usize)]) -> Vec<usize> {
        let listed = |i: usize| {
            self.variables[i].causality == Causality::Output
                || states.iter().any(|&(state, derivative)| state == i || derivative == i)
        };
        (0..self.variables.len()).filter(|&i| listed(i)).collect()
    }
}
