//! Values of variables, and their partial derivatives.

use super::Instance;
use crate::call::{Outcome, State, error};
use crate::model::{Failure, LastEvent};
use crate::model_instance::ModelInstance;
use crate::pointer::Room;
use crate::scalar::Scalar;
use crate::types::Interface;
use model_description::variable::{Causality, Variable};
use std::ffi::CString;
use std::mem;

/// Access to the variables of an instance by the type of their value.
pub(crate) trait Typed: Scalar {
    /// Returns the result of `look` for the variable's value, or `None` if the variable has another
    /// type.
    fn look<R>(
        model: &mut dyn ModelInstance,
        reference: usize,
        look: impl FnOnce(&Self) -> R,
    ) -> Option<R>;
    /// Sets the variable, which must have this type.
    fn put(self, model: &mut dyn ModelInstance, reference: usize);
}

macro_rules! typed {
    ($($type:ty: $field:ident),*) => {$(
        impl Typed for $type {
            fn look<R>(
                model: &mut dyn ModelInstance,
                reference: usize,
                look: impl FnOnce(&Self) -> R,
            ) -> Option<R> {
                model.$field(reference).map(|value| look(value))
            }
            fn put(self, model: &mut dyn ModelInstance, reference: usize) {
                if let Some(field) = model.$field(reference) {
                    *field = self;
                }
            }
        }
    )*};
}

typed!(f64: real, bool: boolean, String: string);

impl Typed for i32 {
    fn look<R>(
        model: &mut dyn ModelInstance,
        reference: usize,
        look: impl FnOnce(&Self) -> R,
    ) -> Option<R> {
        model.integer(reference).map(|value| look(&value))
    }
    fn put(self, model: &mut dyn ModelInstance, reference: usize) {
        model.set_integer(reference, self);
    }
}

impl Instance {
    pub(super) fn variable(&self, reference: u32) -> Result<&Variable, Failure> {
        let variables = &self.description.variables;
        variables.get(reference as usize).ok_or_else(|| {
            let last = variables.len() - 1;
            Failure::Error(format!(
                "value reference {reference} does not exist: {last} is the last"
            ))
        })
    }

    /// Says why there is no field of type `T` for the value reference.
    fn misfit<T: Typed>(&self, reference: u32) -> Failure {
        match self.variable(reference) {
            Ok(Variable { name, .. }) => Failure::Error(format!(
                "'{name}' (value reference {reference}) is not of type {}",
                T::TYPE
            )),
            Err(failure) => failure,
        }
    }

    pub(super) fn expect_type<T: Typed>(&mut self, reference: u32) -> Outcome {
        T::look(self.model.as_mut(), reference as usize, |_| ())
            .ok_or_else(|| self.misfit::<T>(reference))
    }

    /// Gives the values of the variables to `sink`, each with its position in `references`.
    pub(crate) fn get<T: Typed>(
        &mut self,
        references: &[u32],
        mut sink: impl FnMut(usize, &T),
    ) -> Outcome {
        let calculated = |&reference: &u32| {
            self.description.variables.get(reference as usize).is_some_and(Variable::is_calculated)
        };
        if references.iter().any(calculated) {
            self.refresh()?;
        }
        for (i, &reference) in references.iter().enumerate() {
            let variable = self.description.variables.get(reference as usize);
            let shown = T::look(self.model.as_mut(), reference as usize, |value| {
                let problem = variable.and_then(|variable| value.unpresentable(&variable.kind));
                if problem.is_none() {
                    sink(i, value);
                }
                problem
            });
            match shown {
                Some(None) => (),
                Some(Some(problem)) => return Err(self.not_presentable(reference, problem)),
                None => return Err(self.misfit::<T>(reference)),
            }
        }
        Ok(())
    }

    /// Reports a calculated value that cannot be given out. In model exchange it is only discarded,
    /// as it may come from an integrator's trial state.
    fn not_presentable(&self, reference: u32, problem: &str) -> Failure {
        let name = self.variable(reference).map_or("", |variable| &variable.name);
        let text = format!("'{name}' {problem}");
        match self.interface {
            Interface::ModelExchange => Failure::Discard(text),
            Interface::CoSimulation => Failure::Error(text),
        }
    }

    /// Sets all variables, or none if one value is refused.
    pub(crate) fn set<T: Typed + std::fmt::Debug>(
        &mut self,
        references: &[u32],
        value: impl Fn(usize) -> Result<T, String>,
    ) -> Outcome {
        for (i, &reference) in references.iter().enumerate() {
            self.expect_type::<T>(reference)?;
            let variable = self.variable(reference)?;
            self.settable(variable)?;
            let name = &variable.name;
            let value =
                value(i).map_err(|problem| Failure::Error(format!("'{name}': {problem}")))?;
            if let Some(problem) = value.problem(&variable.kind) {
                return error(format!("'{name}' = {value:?} {problem}; it keeps its value"));
            }
        }
        if self.progress.state == State::StepComplete && !references.is_empty() {
            // Parameters cannot be set in this state, so these are inputs.
            self.stale |= self.progress.last_event != LastEvent::InputSet;
            self.progress.last_event = LastEvent::InputSet;
        }
        for (i, &reference) in references.iter().enumerate() {
            let value = value(i).map_err(Failure::Error)?;
            let same =
                T::look(self.model.as_mut(), reference as usize, |before| before.same(&value));
            if same != Some(true) {
                value.put(self.model.as_mut(), reference as usize);
                self.stale = true;
                if self.description.variables[reference as usize].causality == Causality::Parameter
                {
                    self.progress.initialized = false;
                }
            }
        }
        Ok(())
    }

    /// Checks that a variable may be set now. A discrete Real input is accepted in continuous-time
    /// mode too, although the standard has it set in event mode, because FMPy sets all inputs
    /// whenever it asks for event indicators. It has no effect until the next event.
    fn settable(&self, variable: &Variable) -> Outcome {
        let name = &variable.name;
        let state = self.progress.state;
        match variable.causality {
            Causality::Parameter
                if !matches!(state, State::Instantiated | State::InitializationMode) =>
            {
                error(format!(
                    "'{name}' is a fixed parameter: it can be set before and in initialization mode only"
                ))
            }
            Causality::Parameter | Causality::Input => Ok(()),
            _ => error(format!("'{name}' is calculated by the FMU and cannot be set")),
        }
    }

    /// Returns texts that stay valid for the importer until the next call of this function.
    pub(crate) fn get_strings(&mut self, references: &[u32]) -> Result<&[CString], Failure> {
        let mut strings = mem::take(&mut self.strings);
        strings.clear();
        self.get::<String>(references, |_, text| {
            strings.push(CString::new(text.replace('\0', " ")).unwrap_or_default());
        })?;
        self.strings = strings;
        Ok(&self.strings)
    }

    pub(crate) fn directional_derivative(
        &mut self,
        unknowns: &[u32],
        knowns: &[u32],
        seed: &[f64],
        mut derivative: Room<f64>,
    ) -> Outcome {
        if self.states.is_empty() {
            return error("this FMU provides no directional derivatives");
        }
        for &reference in unknowns {
            self.expect_type::<f64>(reference)?;
            let variable = self.variable(reference)?;
            if !variable.is_calculated() {
                return error(format!(
                    "'{}' is a parameter or an input, so it has no derivative",
                    variable.name
                ));
            }
        }
        for &reference in knowns {
            self.expect_type::<f64>(reference)?;
            let variable = self.variable(reference)?;
            let is_state = self.states.iter().any(|&(state, _)| state == reference as usize);
            if variable.causality != Causality::Input && !is_state {
                return error(format!("'{}' is neither an input nor a state", variable.name));
            }
        }
        self.refresh()?;
        let time = self.progress.time;
        for (i, &unknown) in unknowns.iter().enumerate() {
            let mut sum = 0.0;
            for (&known_variable, seed) in knowns.iter().zip(seed) {
                let (unknown, known_variable) = (unknown as usize, known_variable as usize);
                sum += self.model.partial_derivative(time, unknown, known_variable)? * seed;
            }
            derivative.put(i, sum);
        }
        Ok(())
    }
}
