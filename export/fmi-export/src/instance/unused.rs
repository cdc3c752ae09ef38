//! Settings that have no effect under the other settings, of which the importer is warned.

use super::Instance;
use crate::types::Interface;
use model_description::condition::{Value, holds};
use model_description::variable::Causality;
use std::sync::Arc;

impl Instance {
    /// Returns the value of a variable as conditions compare it.
    fn value(&mut self, reference: usize) -> Option<Value> {
        let model = self.model.as_mut();
        if let Some(number) = model.integer(reference) {
            return Some(self.description.variables[reference].kind.value_of(number));
        }
        let number = model.real(reference).map(|number| Value::Number(*number));
        let truth = || model.boolean(reference).map(|truth| Value::Text(truth.to_string()));
        let value = number.or_else(truth);
        value.or_else(|| model.string(reference).map(|text| Value::Text(text.clone())))
    }

    /// Returns the variables of this causality that act under a condition and do not have their
    /// start value.
    fn changed(&mut self, causality: Causality) -> Vec<usize> {
        let description = Arc::clone(&self.description);
        let variables = description.variables.iter().enumerate();
        let conditional = variables.filter(|(_, variable)| {
            variable.causality == causality && !variable.used_with.is_empty()
        });
        conditional
            .filter(|(reference, variable)| self.value(*reference) != variable.kind.start_value())
            .map(|(reference, _)| reference)
            .collect()
    }

    /// Notes the inputs that the importer has set like parameters. Those that it sets in
    /// initialization mode may come from other instances.
    pub(super) fn note_set_inputs(&mut self) {
        self.set_inputs = self.changed(Causality::Input);
    }

    /// Warns of settings that have no effect, once for all with the same condition.
    pub(super) fn warn_of_unused(&mut self) {
        let description = Arc::clone(&self.description);
        let variables = &description.variables;
        let mut set = std::mem::take(&mut self.set_inputs);
        set.extend(self.changed(Causality::Parameter));
        let is_stepped = self.interface == Interface::CoSimulation;
        let mut unused: Vec<(&str, Vec<&str>)> = Vec::new();
        for variable in set.into_iter().map(|reference| &variables[reference]) {
            let condition = variable.used_with.as_str();
            let value = |position| self.value(position).unwrap_or(Value::Number(f64::NAN));
            if let Some((_, names)) = unused.iter_mut().find(|(other, _)| *other == condition) {
                names.push(&variable.name);
            } else if !holds(condition, is_stepped, variables, value) {
                unused.push((condition, vec![&variable.name]));
            }
        }
        for (condition, names) in unused {
            let (verb, subject) =
                if names.len() == 1 { ("has", "it is") } else { ("have", "they are") };
            self.warn(&format!(
                "{} {verb} no effect: {subject} used with {condition}",
                names.join(", ")
            ));
        }
    }
}
