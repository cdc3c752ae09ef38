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
    /// Sets the variable, which must have this type, and returns whether its value changed.
    fn put(self, model: &mut dyn ModelInstance, reference: usize) -> bool;
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
            fn put(self, model: &mut dyn ModelInstance, reference: usize) -> bool {
                let field = model.$field(reference).filter(|field| !field.same(&self));
                field.map(|field| *field = self).is_some()
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
    fn put(self, model: &mut dyn ModelInstance, reference: usize) -> bool {
        let changes = model.integer(reference) != Some(self);
        if changes {
            model.set_integer(reference, self);
        }
        changes
    }
}

impl Instance {
    /// Returns the position in the variable table. That of a variable beyond the table is not in
    /// it.
    fn position(&self, reference: u32) -> usize {
        (reference as usize).wrapping_sub(self.version.first_reference())
    }

    pub(super) fn variable(&self, reference: u32) -> Result<&Variable, Failure> {
        let variables = &self.description.variables;
        variables.get(self.position(reference)).ok_or_else(|| {
            let count = variables.len() + self.indicators.len();
            let last = self.version.first_reference() + count - 1;
            let fault = if self.is_beyond(reference) {
                "is the time or an event indicator: it can only be read, as Float64".into()
            } else {
                format!("does not exist: {last} is the last")
            };
            Failure::Error(format!("value reference {reference} {fault}"))
        })
    }

    /// Whether the reference is that of a variable which FMI 3.0 has beyond the variable table.
    fn is_beyond(&self, reference: u32) -> bool {
        let (position, end) = (self.position(reference), self.description.variables.len());
        position == usize::MAX || (end..end + self.indicators.len()).contains(&position)
    }

    /// Returns the time or an event indicator, or `None` if the reference is another variable's.
    pub(crate) fn beyond_table(&mut self, reference: u32) -> Result<Option<f64>, Failure> {
        if !self.is_beyond(reference) {
            return Ok(None);
        }
        if reference == 0 {
            return Ok(Some(self.progress.time));
        }
        self.refresh()?;
        self.model.event_indicators(&mut self.indicators);
        let index = self.position(reference) - self.description.variables.len();
        Ok(Some(self.indicators[index]))
    }

    /// Notes that an input was set, so that the outputs respond to the inputs.
    pub(super) fn note_input(&mut self) {
        self.stale |= self.progress.last_event != LastEvent::InputSet;
        self.progress.sets_inputs = true;
        self.progress.last_event = LastEvent::InputSet;
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
        let position = self.position(reference);
        T::look(self.model.as_mut(), position, |_| ()).ok_or_else(|| self.misfit::<T>(reference))
    }

    /// Gives the values of the variables to `sink`, each with its position in `references`.
    pub(crate) fn get<T: Typed>(
        &mut self,
        references: &[u32],
        mut sink: impl FnMut(usize, &T),
    ) -> Outcome {
        let calculated = |&reference: &u32| {
            let variable = self.description.variables.get(self.position(reference));
            variable.is_some_and(Variable::is_calculated)
        };
        if references.iter().any(calculated) {
            self.refresh()?;
        }
        for (i, &reference) in references.iter().enumerate() {
            let position = self.position(reference);
            let variable = self.description.variables.get(position);
            let shown = T::look(self.model.as_mut(), position, |value| {
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
        let at_rest = self.interface == Interface::CoSimulation
            && matches!(self.progress.state, State::StepComplete | State::EventMode);
        if at_rest && !references.is_empty() {
            // Parameters cannot be set in these states, so these are inputs.
            self.note_input();
        }
        for (i, &reference) in references.iter().enumerate() {
            let value = value(i).map_err(Failure::Error)?;
            let position = self.position(reference);
            let changes = value.put(self.model.as_mut(), position);
            if !self.take_as_state(position) && changes {
                self.stale = true;
                if self.description.variables[position].causality == Causality::Parameter {
                    self.progress.initialized = false;
                }
            }
        }
        Ok(())
    }

    /// Takes the value of a variable as the state, if it is one. Returns whether it is.
    fn take_as_state(&mut self, position: usize) -> bool {
        let Some(place) = self.states.iter().position(|state| state.0 == position) else {
            return false;
        };
        self.model.continuous_states(&mut self.trial);
        self.trial[place] = *self.model.real(position).expect("only a Real is a state");
        self.model.set_continuous_states(&self.trial);
        self.stale = true;
        true
    }

    /// Checks that a variable may be set now: in continuous-time mode also a state. A discrete Real
    /// input is accepted in that mode too, although the standard has it set in event mode, because
    /// FMPy sets all inputs whenever it asks for event indicators. It has no effect until the next
    /// event.
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
            _ if state == State::ContinuousTimeMode
                && self.states.iter().any(|state| {
                    std::ptr::eq(&raw const self.description.variables[state.0], variable)
                }) =>
            {
                Ok(())
            }
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

    /// Gives the derivatives of the unknowns in the direction `seed`, or, if `adjoint`, those with
    /// respect to the knowns of the unknowns' sum with the weights `seed`.
    pub(crate) fn derivatives_along(
        &mut self,
        (unknowns, knowns): (&[u32], &[u32]),
        seed: &[f64],
        mut derivative: Room<f64>,
        adjoint: bool,
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
            let position = self.position(reference);
            let is_state = self.states.iter().any(|&(state, _)| state == position);
            if variable.causality != Causality::Input && !is_state {
                return error(format!("'{}' is neither an input nor a state", variable.name));
            }
        }
        self.refresh()?;
        let mut sums = vec![0.0; if adjoint { knowns.len() } else { unknowns.len() }];
        for (column, &known) in knowns.iter().enumerate() {
            for (row, slope) in self.slopes(unknowns, self.position(known))?.enumerate() {
                let (place, weight) = if adjoint { (column, row) } else { (row, column) };
                sums[place] += slope * seed[weight];
            }
        }
        sums.into_iter().enumerate().for_each(|(i, sum)| derivative.put(i, sum));
        Ok(())
    }

    /// Returns the partial derivatives of the unknowns with respect to a state or an input:
    /// differences of fourth order.
    fn slopes(
        &mut self,
        unknowns: &[u32],
        known: usize,
    ) -> Result<impl Iterator<Item = f64> + use<>, Failure> {
        let h = 1e-3 * self.description.variables[known].nominal();
        let before = self.model.real(known).map_or(0.0, |value| *value);
        let mut values = [-2.0, -1.0, 1.0, 2.0].map(|steps| (before + steps * h, Vec::new()));
        for (value, shown) in &mut values {
            value.put(self.model.as_mut(), known);
            self.take_as_state(known);
            let result = self.model.calculate(self.progress.time, self.progress.last_event);
            for unknown in unknowns {
                let reference = self.position(*unknown);
                shown.push(self.model.real(reference).map_or(0.0, |value| *value));
            }
            before.put(self.model.as_mut(), known);
            self.take_as_state(known);
            self.stale = true;
            result?;
        }
        let [far_below, below, above, far_above] = values.map(|(_, shown)| shown);
        Ok((0..unknowns.len()).map(move |i| {
            (8.0 * (above[i] - below[i]) - (far_above[i] - far_below[i])) / (12.0 * h)
        }))
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Setting, Stops};
    use super::*;
    use crate::logger::Logger;
    use crate::model_instance::Export;
    use crate::prelude::*;
    use model_description::Version;

    /// The equation x' = u − x³.
    #[derive(Default, Serialize, Deserialize, Declared)]
    struct Cubic {
        /// Input.
        #[setting(input, nominal = 10.0)]
        u: f64,
        /// State.
        #[setting(output, start = 2.0)]
        x: f64,
        /// Time derivative of the state.
        #[setting(output, derivative = "x", depends_on = ["u", "x"])]
        rate: f64,
    }

    impl Model for Cubic {
        fn description() -> Description<Self> {
            Description::new("Cubic", "Cubic decay", VariableTable::new(|model| model))
        }

        fn new() -> Self {
            settings::start()
        }

        fn calculate(&mut self, _time: f64, _last: LastEvent) -> Result<(), Failure> {
            self.rate = self.u - self.x.powi(3);
            Ok(())
        }
    }

    #[test]
    fn oracle_differences_are_the_partial_derivatives() {
        let export = Export::new::<Cubic>();
        let described = export.described();
        let setting = Setting {
            guid: described.guid.clone(),
            version: Version::Fmi2,
            interface: Interface::ModelExchange,
            stops: Stops::default(),
            logger: Logger::of_warnings(),
            resources: None,
        };
        let mut instance = Instance::new(&export, described.description.clone(), setting);
        for (unknown, known, exact) in [(2, 0, 1.0), (2, 1, -12.0), (1, 1, 1.0), (1, 0, 0.0)] {
            let mut slopes = instance.slopes(&[unknown], known).unwrap();
            let derivative = slopes.next().unwrap();
            assert!((derivative - exact).abs() < 1e-9, "{unknown} by {known}: {derivative}");
        }
        assert_eq!(instance.model.real(1).copied(), Some(2.0));
    }
}
