//! Conditions under which a variable has an effect.

use super::{Common, Entry, VariableTable};

impl<M> VariableTable<M> {
    /// Adds a condition to those of the variables whose names begin so.
    #[must_use]
    pub fn also_used_with(mut self, beginning: &str, condition: &str) -> Self {
        let named = |entry: &&mut Entry<M>| entry.variable.name.starts_with(beginning);
        for Entry { variable, .. } in self.entries.iter_mut().filter(named) {
            // The description ends with the condition.
            variable.description = format!("{} and {condition}", variable.description);
            variable.used_with = format!("{} and {condition}", variable.used_with);
        }
        self
    }
}

impl Common {
    /// Declares the [condition](model_description::condition) under which the variable has an
    /// effect. The importer is warned if it sets the variable without effect.
    #[must_use]
    pub fn used_with(mut self, condition: &str) -> Self {
        if !condition.is_empty() {
            self.0.description = format!("{}; used with {condition}", self.0.description);
            self.0.used_with = condition.into();
        }
        self
    }
}
