//! The FMUs that are linked into the module, as the master knows and calls them.

use fmi_export::linked::Linked;
use fmi_export::{Export, Failure};
use fmi_master::description::{ModelDescription, Variable, VariableKind};
use fmi_master::forward;
use fmi_master::instance::{CallFailure, Instance, Outcome};
use fmi_master::quantity::UnitDefinition;
use model_description::unit::Unit;
use model_description::variable::{self as exported, Causality, VariableKind as Exported};
use std::cell::RefCell;
use std::rc::Rc;
use std::sync::OnceLock;

/// An FMU that is linked into the module.
pub struct Fmu {
    /// Name of the FMU.
    pub name: &'static str,
    /// Export of the FMU by the module.
    pub export: Export,
    description: OnceLock<ModelDescription>,
}

impl Fmu {
    /// Makes the FMU of an export.
    pub const fn new(name: &'static str, export: Export) -> Self {
        Self { name, export, description: OnceLock::new() }
    }

    /// Makes an instance, with all parameters at their start values, whose warnings go here.
    pub fn instance(&self, warnings: &Warnings) -> Called {
        Called { linked: Linked::new(&self.export), warnings: Rc::clone(warnings) }
    }

    /// Returns the data of the FMU that a master needs, which others read in its XML.
    pub fn description(&self) -> &ModelDescription {
        self.description.get_or_init(|| description(Linked::new(&self.export).description()))
    }
}

fn description(model: &model_description::ModelDescription) -> ModelDescription {
    let states = model.states();
    let mut units: Vec<UnitDefinition> = vec![];
    for variable in &model.variables {
        if let Exported::Real { unit: Some(own), .. } = &variable.kind
            && units.iter().all(|other| other.name != own.name)
        {
            units.push(unit(own));
        }
    }
    let numbered = model.variables.iter().enumerate();
    let outputs = numbered.filter(|(_, variable)| variable.causality == Causality::Output);
    let dependencies = outputs.map(|(place, _)| (place, model.dependencies(place, &states)));
    ModelDescription {
        model_name: model.name.clone(),
        units,
        variables: (0..).zip(&model.variables).map(variable).collect(),
        dependencies: dependencies.collect(),
        ..ModelDescription::default()
    }
}

fn unit(unit: &Unit) -> UnitDefinition {
    let displays = unit.display.iter().map(|unit| (unit.name.clone(), unit.factor, 0.0)).collect();
    let exponents = [unit.kg, unit.m, unit.s, unit.ampere, unit.kelvin, 0, 0, unit.rad];
    let (name, exponents) = (unit.name.clone(), Some(exponents));
    UnitDefinition { name, exponents, factor: 1.0, offset: 0.0, displays }
}

fn variable((reference, variable): (u32, &exported::Variable)) -> Variable {
    let mut written = None;
    let kind = match &variable.kind {
        Exported::Real { unit, min, max, start, .. } => {
            written = start.map(|start| start.to_string());
            let (unit, min, max) = (unit.as_ref().map(|unit| unit.name.clone()), *min, *max);
            let (display_unit, nominal, is_relative) = (None, None, false);
            VariableKind::Real { unit, min, max, display_unit, nominal, is_relative }
        }
        Exported::Integer { min, max, .. } => VariableKind::Integer { min: *min, max: *max },
        Exported::Boolean { .. } => VariableKind::Boolean,
        Exported::Enumeration { enumeration_type, .. } => {
            let names = enumeration_type.items.iter().map(|(name, _)| name.clone());
            VariableKind::Enumeration { items: names.zip(1..).collect() }
        }
        Exported::String { .. } => VariableKind::String,
    };
    Variable {
        name: variable.name.clone(),
        reference,
        causality: variable.causality.name().into(),
        variability: variable.variability.name().into(),
        kind,
        start: written,
        is_optional: variable.is_optional,
        ..Variable::default()
    }
}

/// Warnings of all instances that are not delivered yet.
pub type Warnings = Rc<RefCell<Vec<String>>>;

/// An instance as the master calls it.
pub struct Called {
    linked: Linked,
    warnings: Warnings,
}

impl Called {
    fn call(&mut self, call: impl FnOnce(&mut Linked) -> Result<(), Failure>) -> Outcome {
        let outcome = call(&mut self.linked);
        self.warnings.borrow_mut().append(&mut self.linked.take_warnings());
        outcome.map_err(|failure| {
            let answer = CallFailure::answer("a call", failure.to_string());
            let Failure::Ended { time, .. } = failure else { return answer };
            CallFailure { ends: Some(time), ..answer }
        })
    }
}

impl Instance for Called {
    forward! {
        call:
        get_real, get_integer, get_boolean, set_real, set_integer, set_boolean, set_string, enter_initialization, exit_initialization, do_step,
    }
}
