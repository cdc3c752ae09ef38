//! An instance of an FMU that is linked into the same program: the same calls with the same checks
//! as through the C interface, but by name and without pointers. It is what a program uses that
//! cannot open libraries, such as one in a browser.
//!
//! ```ignore
//! let mut plant = Linked::new(&Export::new::<ReentryPlant>());
//! plant.set("disturbance.seed", &Value::Integer(2))?;
//! plant.initialize(0.0, 50.0)?;
//! plant.step(0.0, 0.04)?;
//! ```

use crate::call::{Call, Outcome, error, table};
use crate::instance::{Instance, Setting};
use crate::logger::Logger;
use crate::model::Failure;
use crate::model_instance::{Described, Export};
use crate::types::Interface;
use model_description::ModelDescription;
use model_description::variable::Variable;
use std::sync::Arc;

/// Value of a variable.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    /// Value of a Real variable, in its unit.
    Real(f64),
    /// Value of an Integer variable, or number of an item of an Enumeration, counted from 1.
    Integer(i32),
    /// Value of a Boolean variable.
    Boolean(bool),
    /// Value of a String variable.
    Text(String),
}

/// An instance for co-simulation.
pub struct Linked {
    instance: Instance,
    description: Arc<ModelDescription>,
}

impl Linked {
    /// Makes an instance of the FMU, with all parameters at their start values.
    pub fn new(export: &Export) -> Self {
        let Described { guid, description } = export.described();
        let setting = Setting {
            guid: guid.clone(),
            interface: Interface::CoSimulation,
            logger: Logger::of_warnings(),
            resources: None,
        };
        let instance = Instance::new(export, description.clone(), setting);
        Self { instance, description: description.clone() }
    }

    /// Returns the description of the FMU.
    pub fn description(&self) -> &ModelDescription {
        &self.description
    }

    /// Returns the value reference of the variable with this name, and the variable.
    pub fn find(&self, name: &str) -> Option<(u32, &Variable)> {
        let mut numbered = (0..).zip(&self.description.variables);
        numbered.find(|(_, variable)| variable.name == name)
    }

    /// Sets a parameter or an input.
    ///
    /// # Errors
    /// Names the variable if it does not exist, has another type, may not be set now, or does not
    /// allow the value.
    pub fn set(&mut self, name: &str, value: &Value) -> Result<(), Failure> {
        let Some((reference, _)) = self.find(name) else {
            return error(format!("{} has no variable '{name}'", self.description.name));
        };
        let one = &[reference];
        match value {
            Value::Real(value) => {
                self.call(&table::SET_REAL, |instance| instance.set(one, |_| Ok(*value)))
            }
            Value::Integer(value) => {
                self.call(&table::SET_INTEGER, |instance| instance.set(one, |_| Ok(*value)))
            }
            Value::Boolean(value) => {
                self.call(&table::SET_BOOLEAN, |instance| instance.set(one, |_| Ok(*value)))
            }
            Value::Text(value) => {
                self.call(&table::SET_STRING, |instance| instance.set(one, |_| Ok(value.clone())))
            }
        }
    }

    /// Sets Real variables by their value references.
    ///
    /// # Errors
    /// As [`Self::set`].
    pub fn set_reals(&mut self, references: &[u32], values: &[f64]) -> Result<(), Failure> {
        self.call(&table::SET_REAL, |instance| instance.set(references, |i| Ok(values[i])))
    }

    /// Reads Real variables by their value references.
    ///
    /// # Errors
    /// Names a variable that has another type or no finite value, or says what could not be
    /// computed.
    pub fn reals(&mut self, references: &[u32], values: &mut [f64]) -> Result<(), Failure> {
        self.call(&table::GET_REAL, |instance| {
            instance.get::<f64>(references, |i, value| values[i] = *value)
        })
    }

    /// Reads an Integer or Enumeration variable by its value reference.
    ///
    /// # Errors
    /// As [`Self::reals`].
    pub fn integer(&mut self, reference: u32) -> Result<i32, Failure> {
        let mut read = 0;
        self.call(&table::GET_INTEGER, |instance| {
            instance.get::<i32>(&[reference], |_, value| read = *value)
        })?;
        Ok(read)
    }

    /// Initializes the instance for an experiment from `start` to `stop` (both s).
    ///
    /// # Errors
    /// Names the parameter at fault.
    pub fn initialize(&mut self, start: f64, stop: f64) -> Result<(), Failure> {
        self.call(&table::SETUP_EXPERIMENT, |instance| {
            instance.setup_experiment(start, Some(stop), None)
        })?;
        self.call(&table::ENTER_INITIALIZATION_MODE, |instance| {
            instance.enter_initialization_mode();
            Ok(())
        })?;
        self.call(&table::EXIT_INITIALIZATION_MODE, Instance::exit_initialization_mode)
    }

    /// Performs a step of the length `size` from the communication point `point` (both s).
    ///
    /// # Errors
    /// Says why the step failed, or why the simulation ends within it.
    pub fn step(&mut self, point: f64, size: f64) -> Result<(), Failure> {
        self.call(&table::DO_STEP, |instance| instance.do_step(point, size))
    }

    /// Returns the warnings since the last call of this function.
    pub fn take_warnings(&mut self) -> Vec<String> {
        self.instance.logger().take()
    }

    fn call(&mut self, call: &Call, body: impl FnOnce(&mut Instance) -> Outcome) -> Outcome {
        self.instance.permit(call)?;
        body(&mut self.instance)
    }
}
