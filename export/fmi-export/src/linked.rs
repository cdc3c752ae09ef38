//! An instance of an FMU that is linked into the same program: the same calls with the same checks
//! as through the C interface, but without pointers. It is for programs that cannot open libraries,
//! such as one in a browser.
//!
//! ```ignore
//! let mut plant = Linked::new(&Export::new::<ReentryPlant>());
//! plant.set_integer(&[SEED], &[2])?;
//! plant.enter_initialization(0.0, 50.0)?;
//! plant.exit_initialization()?;
//! plant.do_step(0.0, 0.04)?;
//! ```

use crate::call::{Call, Outcome, table};
use crate::instance::{Instance, Setting, Stops};
use crate::logger::Logger;
use crate::model::Failure;
use crate::model_instance::{Described, Export};
use crate::types::Interface;
use model_description::{ModelDescription, Version};
use std::sync::Arc;

/// Defines how variables of a type are read and set: type of the values in a call, and of those in
/// the model, with the conversion to it.
macro_rules! access {
    ($($type:ty: $get:ident $get_call:ident, $set:ident $set_call:ident, $model:ty = $into:expr;)*) => {$(
        /// Reads variables of this type by their value references.
        ///
        /// # Errors
        /// Names a variable that has another type or no valid value, or says what could not be
        /// computed.
        pub fn $get(&mut self, references: &[u32], values: &mut [$type]) -> Result<(), Failure> {
            self.call(&table::$get_call, |instance| {
                instance.get::<$model>(references, |i, value| values[i] = (*value).into())
            })
        }

        /// Sets variables of this type by their value references: all of them, or none if one is
        /// refused.
        ///
        /// # Errors
        /// Names a variable that has another type, may not be set now, or does not allow the value.
        pub fn $set(&mut self, references: &[u32], values: &[$type]) -> Result<(), Failure> {
            let into: fn($type) -> $model = $into;
            self.call(&table::$set_call, |instance| instance.set(references, |i| Ok(into(values[i]))))
        }
    )*};
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
            version: Version::Fmi2,
            interface: Interface::CoSimulation,
            stops: Stops::default(),
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

    access! {
        f64: get_real GET_REAL, set_real SET_REAL, f64 = |value| value;
        i32: get_integer GET_INTEGER, set_integer SET_INTEGER, i32 = |value| value;
        // 0 and 1, as FMI transfers them.
        i32: get_boolean GET_BOOLEAN, set_boolean SET_BOOLEAN, bool = |value| value != 0;
    }

    /// Sets a String variable by its value reference.
    ///
    /// # Errors
    /// Names a variable that has another type or may not be set now.
    pub fn set_string(&mut self, reference: u32, value: &str) -> Result<(), Failure> {
        self.call(&table::SET_STRING, |instance| {
            instance.set(&[reference], |_| Ok(value.to_string()))
        })
    }

    /// Enters initialization mode for an experiment from `start` to `stop` (both s).
    ///
    /// # Errors
    /// Says which of the times cannot be.
    pub fn enter_initialization(&mut self, start: f64, stop: f64) -> Result<(), Failure> {
        self.call(&table::SETUP_EXPERIMENT, |instance| {
            instance.setup_experiment(start, Some(stop), None)
        })?;
        self.call(&table::ENTER_INITIALIZATION_MODE, |instance| {
            instance.enter_initialization_mode();
            Ok(())
        })
    }

    /// Leaves initialization mode, after which steps can be performed.
    ///
    /// # Errors
    /// Names the parameter at fault.
    pub fn exit_initialization(&mut self) -> Result<(), Failure> {
        self.call(&table::EXIT_INITIALIZATION_MODE, Instance::exit_initialization_mode)
    }

    /// Performs a step of the length `size` from the communication point `point` (both s).
    ///
    /// # Errors
    /// Says why the step failed, or why the simulation ends within it.
    pub fn do_step(&mut self, point: f64, size: f64) -> Result<(), Failure> {
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
