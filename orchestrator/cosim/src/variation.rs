//! Runs of one system that differ in the values of parameters: the instances are made once and
//! reset between two runs.

use crate::error::Error;
use crate::interrupt::Interrupt;
use crate::run::Run;
use crate::system::System;
use fmi_master::delay::{self, Doubt};
use fmi_master::description::{Carrier, Variable, VariableKind};
use fmi_master::names;
use fmi_master::quantity;
use fmi_master::settings::{self, Setting};
use toml::Value;

pub use fmi_master::settings::SettingValue;

/// A parameter, or an input without a connection, of a system's component.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Target {
    component: usize,
    /// Position of the variable in the description of the component.
    variable: usize,
}

impl System {
    /// Finds the parameter, or the input without a connection, `component.variable`.
    ///
    /// # Errors
    /// Returns an error if there is no such variable, or if it cannot be set.
    pub fn target(&self, path: &str) -> Result<Target, String> {
        let parts = self.parts();
        let (name, rest) = names::split(path)
            .ok_or_else(|| format!("\"{path}\" is not of the form component.parameter"))?;
        let component = parts.iter().position(|part| part.name == name).ok_or_else(|| {
            let hint = names::hint(name, parts.iter().map(|part| part.name));
            format!("there is no component \"{name}\"{hint}")
        })?;
        let variable = settings::position(rest, component, parts[component], &self.wires, true)?;
        Ok(Target { component, variable })
    }

    /// Returns the variable of a target.
    pub fn variable(&self, target: Target) -> &Variable {
        &self.components[target.component].fmu.description.variables[target.variable]
    }

    /// Converts a value to the type and the unit of a target.
    ///
    /// # Errors
    /// Returns an error if the value is of the wrong type, outside the variable's limits, or in a
    /// unit that does not fit.
    pub fn value(&self, target: Target, written: &Value) -> Result<SettingValue, String> {
        settings::value(written, self.variable(target), self.parts()[target.component])
    }

    /// Converts a number with a unit to the unit of a target, whose limits it need not keep.
    ///
    /// # Errors
    /// Returns an error if the text is no number with a unit that fits.
    pub fn number(&self, target: Target, text: &str) -> Result<f64, String> {
        let kind @ VariableKind::Real { unit, .. } = &self.variable(target).kind else {
            return Err(format!("\"{text}\" is no number"));
        };
        let description = &self.components[target.component].fmu.description;
        quantity::convert(text, unit.as_deref(), &description.units_of(kind))
    }

    /// Returns the texts that are set, which may name files.
    pub fn texts(&self) -> Vec<String> {
        let settings = self.components.iter().flat_map(|component| &component.settings);
        let text = |setting: &Setting| match &setting.value {
            SettingValue::Text(text) => Some(text.clone()),
            _ => None,
        };
        settings.filter_map(text).collect()
    }

    /// Returns what a target refers to in its instance, which is the same for all aliases of a
    /// variable.
    pub fn referent(&self, target: Target) -> impl PartialEq + use<> {
        let variable = self.variable(target);
        (target.component, variable.reference, Carrier::for_kind(&variable.kind))
    }

    /// Returns the value that a target has in this system: that of the experiment, or else the
    /// start value of the FMU. There is none if the FMU does not state it, or if it is not of type
    /// Real.
    pub fn nominal(&self, target: Target) -> Option<f64> {
        let variable = self.variable(target);
        let mut settings = self.components[target.component].settings.iter();
        let setting = settings.find(|setting| setting.name == variable.name);
        match setting.map(|setting| &setting.value) {
            Some(SettingValue::Real(value)) => Some(*value),
            Some(_) => None,
            None => variable.start.as_ref()?.parse().ok(),
        }
    }

    /// Creates, sets and initializes the instances as [`Self::start`] does, with other values for
    /// some targets.
    ///
    /// # Errors
    /// Returns an error if an instance cannot be made or initialized.
    pub fn start_varied(
        &self,
        changes: &[(Target, SettingValue)],
        interrupt: &Interrupt,
    ) -> Result<Run, Error> {
        self.start_with(&self.varied(changes), interrupt)
    }

    /// Resets the instances of a run that this system has made, and sets and initializes them for
    /// another one.
    ///
    /// # Errors
    /// Returns an error if a call of an instance fails.
    pub fn restart(&self, run: &mut Run, changes: &[(Target, SettingValue)]) -> Result<(), Error> {
        run.master.reset()?;
        run.master.set_parameters(&self.varied(changes))?;
        Ok(run.master.initialize()?)
    }

    /// Returns a doubt for each component whose control law is designed for another loop delay, with
    /// these changes of the settings.
    pub fn doubts(&self, changes: &[(Target, SettingValue)]) -> Vec<Doubt> {
        delay::doubts(&self.parts(), &self.varied(changes), &self.loops, self.clock.step())
    }

    /// Returns the settings of all components with the changes made to them.
    fn varied(&self, changes: &[(Target, SettingValue)]) -> Vec<Vec<Setting>> {
        let mut settings = self.settings();
        for (target, value) in changes {
            let variable = self.variable(*target);
            let of_component = &mut settings[target.component];
            match of_component.iter_mut().find(|setting| setting.name == variable.name) {
                Some(setting) => setting.value = value.clone(),
                None => of_component.push(Setting {
                    name: variable.name.clone(),
                    reference: variable.reference,
                    value: value.clone(),
                }),
            }
        }
        settings
    }
}
