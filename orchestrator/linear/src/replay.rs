//! Running one component alone, from a state that it kept and with the inputs that it had in the
//! loop.

use fmi_master::description::Carrier;
use fmi_master::instance::{CallFailure, Instance, Outcome};
use fmi_master::wiring::Port;

/// The inputs of a component at its steps, as they were in the loop.
#[derive(Clone, Debug, Default)]
pub struct Recorded {
    /// Inputs of every type, in the order of the values.
    pub ports: Vec<Port>,
    /// Values at each step.
    pub rows: Vec<Vec<f64>>,
    /// Times at which the steps begin, s.
    pub times: Vec<f64>,
    /// Length of a step, s.
    pub length: f64,
}

/// A change of one input for the length of one step.
#[derive(Clone, Copy, Debug)]
pub struct Change {
    /// Place of the input among the recorded ones.
    pub place: usize,
    /// Change of its value.
    pub by: f64,
}

impl Recorded {
    /// Steps an instance from the state that it kept before step `first`, with a change of an input
    /// at that step. Returns the values of the variables after each of `count` steps.
    ///
    /// # Errors
    /// Returns an error if the instance fails.
    pub fn run(
        &self,
        instance: &mut dyn Instance,
        first: usize,
        count: usize,
        change: Option<Change>,
        outputs: &[u32],
    ) -> Result<Vec<Vec<f64>>, CallFailure> {
        instance.restore(first)?;
        let mut values = Vec::with_capacity(count);
        for step in first..first + count {
            let change = change.filter(|_| step == first);
            self.set(instance, step, change)?;
            instance.do_step(self.times[step], self.length)?;
            let mut row = vec![0.0; outputs.len()];
            if !outputs.is_empty() {
                instance.get_real(outputs, &mut row)?;
            }
            values.push(row);
        }
        Ok(values)
    }

    /// Steps an instance from the state that it kept under number 0, and lets it keep its state
    /// before each of the first `count` steps under the step's number.
    ///
    /// # Errors
    /// Returns an error if the instance fails.
    pub fn keep(&self, instance: &mut dyn Instance, count: usize) -> Outcome {
        instance.restore(0)?;
        for step in 0..count {
            instance.save(step)?;
            self.set(instance, step, None)?;
            instance.do_step(self.times[step], self.length)?;
        }
        Ok(())
    }

    fn set(&self, instance: &mut dyn Instance, step: usize, change: Option<Change>) -> Outcome {
        for carrier in [Carrier::Real, Carrier::Integer, Carrier::Boolean] {
            let meant = || {
                let ports = self.ports.iter().enumerate();
                ports.filter(move |(_, port)| port.carrier == carrier)
            };
            let references: Vec<u32> = meant().map(|(_, port)| port.reference).collect();
            if references.is_empty() {
                continue;
            }
            let added = |place: usize| match change {
                Some(change) if change.place == place => change.by,
                _ => 0.0,
            };
            let values = meant().map(|(place, _)| self.rows[step][place] + added(place));
            if carrier == Carrier::Real {
                instance.set_real(&references, &values.collect::<Vec<f64>>())?;
                continue;
            }
            let values: Vec<i32> = values.map(|value| value as i32).collect();
            if carrier == Carrier::Integer {
                instance.set_integer(&references, &values)?;
            } else {
                instance.set_boolean(&references, &values)?;
            }
        }
        Ok(())
    }
}
