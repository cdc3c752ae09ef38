//! Watches the values that an instance gives. A value that is not finite, no item of its
//! enumeration, or neither true nor false would otherwise spread through the loop and look like a
//! result.

use fmi_master::description::{Carrier, Variable, VariableKind};
use fmi_master::forward;
use fmi_master::instance::{CallFailure, Instance, Outcome};
use fmu_import::fmu::Fmu;
use fmu_import::warnings;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::rc::Rc;

/// Action taken if an instance gives an invalid value.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, JsonSchema, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum OnInvalid {
    /// The value ends the run with an error.
    #[default]
    Error,
    /// A warning is printed once for each variable.
    Warn,
    /// The value is passed on without a check.
    Allow,
}

/// An instance whose output values are watched.
pub(crate) struct Watched {
    instance: Box<dyn Instance>,
    name: String,
    /// FMU of the instance, with the names of the variables.
    fmu: Rc<Fmu>,
    /// Value references of the enumerations, sorted, with the values of their items.
    items: Vec<(u32, Vec<i32>)>,
    warns: bool,
}

impl Watched {
    /// Watches `instance`, which is called `name`. With [`OnInvalid::Allow`] the instance is
    /// returned unchanged.
    pub(crate) fn around(
        instance: Box<dyn Instance>,
        name: &str,
        fmu: &Rc<Fmu>,
        on_invalid: OnInvalid,
    ) -> Box<dyn Instance> {
        if on_invalid == OnInvalid::Allow {
            return instance;
        }
        let of_items = |variable: &Variable| {
            let items: Vec<i32> = variable.kind.items().iter().map(|(_, value)| *value).collect();
            matches!(variable.kind, VariableKind::Enumeration { .. })
                .then_some((variable.reference, items))
        };
        let mut items: Vec<_> = fmu.description.variables.iter().filter_map(of_items).collect();
        items.sort();
        Box::new(Self {
            instance,
            name: name.to_string(),
            fmu: fmu.clone(),
            items,
            warns: on_invalid == OnInvalid::Warn,
        })
    }

    fn inside(&mut self, call: impl FnOnce(&mut dyn Instance) -> Outcome) -> Outcome {
        call(self.instance.as_mut())
    }

    #[cold]
    fn invalid(
        &self,
        call: &'static str,
        carrier: Carrier,
        reference: u32,
        value: &str,
        what: &str,
    ) -> Outcome {
        let is_meant = |variable: &&Variable| {
            (Carrier::for_kind(&variable.kind), variable.reference) == (Some(carrier), reference)
        };
        let variable = self.fmu.description.variables.iter().find(is_meant).map_or_else(
            || format!("variable {reference}"),
            |variable| format!("\"{}\"", variable.name),
        );
        if !self.warns {
            let remedy = "with --on-invalid warn the run continues";
            return Err(CallFailure::answer(
                call,
                format!("{variable} is {value}, which is {what}; {remedy}"),
            ));
        }
        warnings::warn(&format!("{}: {variable} is {what}", self.name));
        Ok(())
    }
}

impl Instance for Watched {
    fn get_real(&mut self, references: &[u32], values: &mut [f64]) -> Outcome {
        self.instance.get_real(references, values)?;
        for (value, &reference) in values.iter().zip(references) {
            if !value.is_finite() {
                self.invalid(
                    "getReal",
                    Carrier::Real,
                    reference,
                    &value.to_string(),
                    "not finite",
                )?;
            }
        }
        Ok(())
    }

    fn get_integer(&mut self, references: &[u32], values: &mut [i32]) -> Outcome {
        self.instance.get_integer(references, values)?;
        if self.items.is_empty() {
            return Ok(());
        }
        for (value, &reference) in values.iter().zip(references) {
            let place = self.items.binary_search_by_key(&reference, |(reference, _)| *reference);
            if place.is_ok_and(|place| !self.items[place].1.contains(value)) {
                let what = "no item of its enumeration";
                self.invalid("getInteger", Carrier::Integer, reference, &value.to_string(), what)?;
            }
        }
        Ok(())
    }

    fn get_boolean(&mut self, references: &[u32], values: &mut [i32]) -> Outcome {
        self.instance.get_boolean(references, values)?;
        for (value, &reference) in values.iter().zip(references) {
            if !matches!(value, 0 | 1) {
                let what = "neither true nor false";
                self.invalid("getBoolean", Carrier::Boolean, reference, &value.to_string(), what)?;
            }
        }
        Ok(())
    }

    forward! {
        inside:
        set_real, set_integer, set_boolean, set_string, enter_initialization, exit_initialization, do_step, terminate, reset, save, restore, directional_derivative,
    }
}
