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
    /// Watches `instance`, which is called `name`.
    pub(crate) fn around(
        instance: Box<dyn Instance>,
        name: &str,
        fmu: &Rc<Fmu>,
        on_invalid: OnInvalid,
    ) -> Box<dyn Instance> {
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
    fn invalid(&self, call: &'static str, kind: Carrier, reference: u32, value: &str) -> Outcome {
        let what = match kind {
            Carrier::Real => "not finite",
            Carrier::Integer => "no item of its enumeration",
            Carrier::Boolean => "neither true nor false",
        };
        let is_meant = |variable: &&Variable| {
            (Carrier::for_kind(&variable.kind), variable.reference) == (Some(kind), reference)
        };
        let variable = self.fmu.description.variables.iter().find(is_meant).map_or_else(
            || format!("variable {reference}"),
            |variable| format!("\"{}\"", variable.name),
        );
        if !self.warns {
            let remedy = "with on_invalid = \"warn\" in [simulation] the run continues";
            let message = format!("{variable} is {value}, which is {what}; {remedy}");
            return Err(CallFailure::answer(call, message));
        }
        warnings::warn(&format!("{}: {variable} is {what}", self.name));
        Ok(())
    }

    fn is_item(&self, reference: u32, value: i32) -> bool {
        let place = self.items.binary_search_by_key(&reference, |(reference, _)| *reference);
        place.map_or(true, |place| self.items[place].1.contains(&value))
    }
}

impl Instance for Watched {
    fn get_real(&mut self, references: &[u32], values: &mut [f64]) -> Outcome {
        self.instance.get_real(references, values)?;
        for (value, &reference) in values.iter().zip(references) {
            if !value.is_finite() {
                self.invalid("getReal", Carrier::Real, reference, &value.to_string())?;
            }
        }
        Ok(())
    }

    fn get_integer(&mut self, references: &[u32], values: &mut [i32]) -> Outcome {
        self.instance.get_integer(references, values)?;
        for (&value, &reference) in values.iter().zip(references) {
            if !self.is_item(reference, value) {
                self.invalid("getInteger", Carrier::Integer, reference, &value.to_string())?;
            }
        }
        Ok(())
    }

    fn get_boolean(&mut self, references: &[u32], values: &mut [i32]) -> Outcome {
        self.instance.get_boolean(references, values)?;
        for (value, &reference) in values.iter().zip(references) {
            if !matches!(value, 0 | 1) {
                self.invalid("getBoolean", Carrier::Boolean, reference, &value.to_string())?;
            }
        }
        Ok(())
    }

    forward! {
        inside:
        set_real, set_integer, set_boolean, set_string, enter_initialization, exit_initialization, do_step, terminate, reset, save, restore,
    }
}
