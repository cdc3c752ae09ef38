//! Finding the model of a component that gives derivatives of continuous states.

use crate::components::Dynamics;
use crate::continuous::{Continuous, References};
use crate::fitting::{AT_LENGTH, DESCRIBED, delayed, describes, reduced};
use crate::identification::{Builder, CHANGES, Found};
use crate::responses::{Probe, Response, Scales, beginning};
use crate::windows::{COMPARED, longest_period, longest_response};
use fmi_master::instance::{CallFailure, Instance};
use fmi_master::quantity::rounded;

impl Builder<'_> {
    /// Returns the model by derivatives, if the component gives them and they describe its
    /// responses.
    pub(crate) fn continuous(
        &self,
        instance: &mut dyn Instance,
    ) -> Result<Option<Found>, CallFailure> {
        let [component] = self.components else { return Ok(None) };
        let checked = &self.system.components[*component];
        let description = &checked.fmu.description;
        if !checked.has("providesDirectionalDerivative") {
            return Ok(None);
        }
        let variables = &description.variables;
        let (states, derivatives): (Vec<usize>, Vec<usize>) = description.states().unzip();
        if states.is_empty() {
            return Ok(None);
        }
        let of = |positions: &[usize]| -> Vec<u32> {
            positions.iter().map(|position| variables[*position].reference).collect()
        };
        let (states_at, derivatives_at) = (of(&states), of(&derivatives));
        let inputs: Vec<u32> = self.inputs.iter().map(|port| port.reference).collect();
        let outputs: Vec<u32> = self.outputs.iter().map(|port| port.reference).collect();
        let references = References {
            states: &states_at,
            derivatives: &derivatives_at,
            inputs: &inputs,
            outputs: &outputs,
        };
        instance.restore(0)?;
        let Ok(found) = Continuous::of(instance, &references) else { return Ok(None) };
        // The states may be read, so that each of their responses can be compared.
        let scales = Scales {
            inputs: self.inputs.iter().map(|port| self.scale(port)).collect(),
            outputs: states
                .iter()
                .map(|position| variables[*position].nominal())
                .chain(self.outputs.iter().map(|port| self.scale(port)))
                .collect(),
        };
        let read: Vec<u32> = states_at.iter().chain(&outputs).copied().collect();
        let places = self.places();
        let probe = Probe {
            recorded: self.recorded,
            inputs: &places,
            outputs: &read,
            scales: &scales,
            change: CHANGES[0],
        };
        let (length, mut count) =
            (self.recorded.length, COMPARED + longest_period(self.recorded.length));
        let mut response = probe.responses(instance, 0, count)?;
        let begins = |response: &Response| beginning(&response.central);
        // A delay shows in some responses after it.
        while count < longest_response(length)
            && begins(&response).is_none_or(|begin| begin + COMPARED > count)
        {
            count = (2 * count).min(longest_response(length));
            response = probe.responses(instance, 0, count)?;
        }
        if response.sides.is_some() {
            return Ok(None);
        }
        let lags = &response.central;
        let at_once = lags.len().min(COMPARED);
        let found = if describes(&found, &lags[..at_once], &scales, length, DESCRIBED)
            && describes(&found, lags, &scales, length, AT_LENGTH)
        {
            found
        } else {
            let (found, whole) = delayed(found, lags, &scales, length);
            let compared = lags.len().min(whole + COMPARED);
            if !describes(&found, &lags[..compared], &scales, length, DESCRIBED) {
                return Ok(None);
            }
            found
        };
        let found = reduced(found, &states);
        let names = found.1.iter().map(|place| variables[states[*place]].name.clone()).collect();
        let note = format!(
            "{}: derivatives by fmi2GetDirectionalDerivative, {} of {} states, inputs act after {} s",
            self.system.components[*component].name,
            found.1.len(),
            states.len(),
            rounded(found.0.delay)
        );
        let model = self.of_dynamics(names, Dynamics::Continuous(found.0));
        Ok(Some(Found { model, sides: None, note, is_silent: false }))
    }
}
