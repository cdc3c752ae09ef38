//! Linear models of the components of a system.

use crate::continuous::Continuous;
use crate::model::Step;
use fmi_master::wiring::Port;

/// Response of a component to its inputs.
#[derive(Clone, Debug)]
pub enum Dynamics {
    /// By derivatives of its states.
    Continuous(Continuous),
    /// From step to step, with a period of several steps.
    Sampled(Vec<Step>),
}

/// A model of a component.
#[derive(Clone, Debug)]
pub struct Component {
    /// Name of the component.
    pub name: String,
    /// Number of communication steps in one of its steps.
    pub every: u64,
    /// Communication point of the first step of its period.
    pub first: u64,
    /// Its connected inputs that are real numbers.
    pub inputs: Vec<Port>,
    /// Its connected outputs that are real numbers.
    pub outputs: Vec<Port>,
    /// Names of its continuous states.
    pub states: Vec<String>,
    /// Response of the component.
    pub dynamics: Dynamics,
}

impl Component {
    /// Returns the period of the component, in communication points.
    pub(crate) fn period(&self) -> u64 {
        let steps = match &self.dynamics {
            Dynamics::Continuous(_) => 1,
            Dynamics::Sampled(steps) => steps.len() as u64,
        };
        self.every * steps
    }

    /// Returns the place of the step that begins at a communication point, or of the last one
    /// before it.
    pub(crate) fn phase(&self, tick: u64) -> usize {
        let Dynamics::Sampled(steps) = &self.dynamics else { return 0 };
        let count = steps.len() as u64;
        // Less than one of its steps lies between the beginning of the loop's period and the first
        // step of the component's.
        let steps = (tick + self.every * count - self.first) / self.every;
        (steps % count) as usize
    }

    /// Returns the number of states that the component has before a communication point.
    pub(crate) fn states_at(&self, tick: u64) -> usize {
        match &self.dynamics {
            Dynamics::Continuous(system) => system.a.nrows(),
            Dynamics::Sampled(steps) if tick.is_multiple_of(self.every) => {
                steps[self.phase(tick)].a.ncols()
            }
            Dynamics::Sampled(steps) => steps[self.phase(tick)].a.nrows(),
        }
    }

    /// Returns whether the outputs follow from the states alone.
    pub(crate) fn shows_states(&self) -> bool {
        matches!(&self.dynamics, Dynamics::Continuous(system) if system.d.amax() == 0.0)
    }

    /// Returns the names of the states before a communication point, and of the outputs that are
    /// held there.
    pub(crate) fn names(&self, tick: u64) -> Vec<String> {
        let state = |place: usize| {
            let known = self.states.get(place).cloned();
            known.unwrap_or_else(|| format!("memory[{}]", place + 1))
        };
        let mut names: Vec<String> = (0..self.states_at(tick)).map(state).collect();
        if !self.shows_states() {
            for kind in ["held", "held before"] {
                let outputs = 1..=self.outputs.len();
                names.extend(outputs.map(|output| format!("output[{output}] ({kind})")));
            }
        }
        names.into_iter().map(|name| format!("{}.{name}", self.name)).collect()
    }
}
