//! Identification of the linear model of a component from the responses of its instance.

use crate::Matrix;
use crate::components::{Component, Dynamics};
use crate::fitting::deviation;
use crate::model::Step;
use crate::realisation::realise;
use crate::replay::Recorded;
use crate::responses::{Lags, Probe, Response, Scales, beginning, difference};
use crate::windows::{
    BLOCKS, COMPARED, LONGEST_TIME, MOST_BLOCKS, compared_steps, longest_period, longest_response,
};
use cosim::system::System;
use fmi_master::instance::{CallFailure, Instance};
use fmi_master::quantity::rounded;
use fmi_master::wiring::Port;
use std::ops::Range;

/// Most steps of the next period whose responses are compared with those of the first.
const AGAIN: usize = 4;
/// Difference of two periods up to which they count as equal, relative to the largest response, and
/// in relation to the least difference that any period leaves.
const EQUAL: f64 = 1e-6;
const AS_EQUAL: f64 = 3.0;
/// Difference of two periods, relative to the largest response, above which the response is not
/// periodic and there is no model, and above which the difference is mentioned.
const REPEATS: f64 = 0.1;
const DRIFTS: f64 = 0.01;
/// Changes of an input that are tried, in relation to its typical magnitude.
pub(crate) const CHANGES: [f64; 3] = [1e-5, 1e-7, 1e-9];
/// Difference between a model and the response over `LONGEST_TIME`, relative to the largest
/// response of a variable, from which the model does not describe the motion.
const DEVIATES: f64 = 0.05;
/// Least share of the largest response that a state of a model must add.
const SMALLEST: f64 = 1e-9;
/// The same for a pair. An allocator ends its iterations anywhere near the optimum, and what the
/// effectors do on their way from one end to the next is noise.
const SMALLEST_OF_PAIR: f64 = 1e-3;

/// The model of a component, those for changes to one side, if they differ, and a note on them.
pub struct Found {
    /// The model of the component.
    pub model: Component,
    /// The models for increases and for decreases of the inputs.
    pub sides: Option<[Component; 2]>,
    /// One line on how the model was found.
    pub note: String,
    /// Whether no output responds to an input, so that the model has none of its motion.
    pub is_silent: bool,
}

/// Returns the responses to a change of this size at each of some steps, with so many lags.
type Respond<'r> = dyn FnMut(f64, Range<usize>, usize) -> Result<Vec<Response>, CallFailure> + 'r;

/// The change that fits a component.
struct Trial {
    /// Its size, in relation to the typical magnitude of an input.
    change: f64,
    /// Number of steps after which the responses repeat.
    period: usize,
    /// Largest error of the responses, with the difference that the period leaves.
    error: f64,
    /// Share by which a response depends on the size of the change.
    depends: f64,
}

/// The responses from which a model is built.
struct Measured {
    /// Responses to changes at each step of the period.
    phases: Vec<Response>,
    /// Number of blocks of the Hankel matrix.
    blocks: usize,
    /// Size of responses, relative to the largest, that does not count.
    tolerance: f64,
    /// Share by which the responses of the next period differ.
    drift: f64,
}

/// Builds the model of a component.
pub struct Builder<'a> {
    /// System that the component is part of.
    pub system: &'a System,
    /// Indices of its components: one, or two that are taken as one.
    pub components: &'a [usize],
    /// Communication point of the first recorded step.
    pub first: u64,
    /// Its inputs as they were in the loop.
    pub recorded: &'a Recorded,
    /// Its connected inputs that are real numbers.
    pub inputs: Vec<Port>,
    /// Its connected outputs that are real numbers.
    pub outputs: Vec<Port>,
}

impl Builder<'_> {
    pub(crate) fn scale(&self, port: &Port) -> f64 {
        self.system.variable_at(*port).nominal()
    }

    pub(crate) fn of_dynamics(&self, states: Vec<String>, dynamics: Dynamics) -> Component {
        let components = self.components.iter().map(|index| &self.system.components[*index]);
        let names: Vec<&str> = components.map(|component| component.name.as_str()).collect();
        Component {
            name: names.join(" and "),
            every: u64::from(self.system.components[self.components[0]].every),
            first: self.first,
            inputs: self.inputs.clone(),
            outputs: self.outputs.clone(),
            states,
            dynamics,
        }
    }

    /// Returns whether an instance that kept the state before the first recorded step under number
    /// 0 has different slopes to both sides there.
    ///
    /// # Errors
    /// Returns an error if the instance fails.
    pub fn has_edge(&self, instance: &mut dyn Instance) -> Result<bool, CallFailure> {
        let (scales, references, places) = (self.scales(), self.references(), self.places());
        let probe = Probe {
            recorded: self.recorded,
            inputs: &places,
            outputs: &references,
            scales: &scales,
            change: CHANGES[0],
        };
        Ok(probe.responses(instance, 0, COMPARED)?.sides.is_some())
    }

    /// Returns whether a component has continuous states, whose motion may be slow beside the
    /// steps.
    fn moves(&self) -> bool {
        let components = self.components.iter().map(|index| &self.system.components[*index]);
        components.into_iter().any(|one| one.fmu.description.states().next().is_some())
    }

    /// Returns the smallest size of its responses that counts, in relation to the largest.
    fn smallest(&self) -> f64 {
        if self.components.len() > 1 { SMALLEST_OF_PAIR } else { SMALLEST }
    }

    pub(crate) fn scales(&self) -> Scales {
        Scales {
            inputs: self.inputs.iter().map(|port| self.scale(port)).collect(),
            outputs: self.outputs.iter().map(|port| self.scale(port)).collect(),
        }
    }

    fn references(&self) -> Vec<u32> {
        self.outputs.iter().map(|port| port.reference).collect()
    }

    /// Finds the model of the component from an instance that kept the state before the first
    /// recorded step under number 0.
    ///
    /// # Errors
    /// Returns an error if the instance fails.
    pub fn find(&self, instance: &mut dyn Instance) -> Result<Found, CallFailure> {
        let longest = longest_period(self.recorded.length);
        self.recorded.keep(instance, 2 * longest)?;
        if let Some(found) = self.continuous(instance)? {
            return Ok(found);
        }
        let (scales, references, places) = (self.scales(), self.references(), self.places());
        let probe = |change: f64| Probe {
            recorded: self.recorded,
            inputs: &places,
            outputs: &references,
            scales: &scales,
            change,
        };
        let Some(late) = self.late(&probe(CHANGES[0]), instance)? else {
            return Ok(self.silent());
        };
        let mut respond = |change: f64, steps: Range<usize>, count: usize| {
            steps.map(|first| probe(change).responses(instance, first, count)).collect()
        };
        let trial = self.trial(&mut respond, longest, late + COMPARED)?;
        let measured = self.measured(&mut respond, &trial, longest, late)?;
        Ok(self.sampled(&measured, &trial, &scales))
    }

    /// Finds the size of the change that fits the component, from `count` lags after each step, and
    /// the period after which its responses repeat, which is at most `longest`. A law that is not
    /// smooth needs a small change, and one that iterates a larger one.
    fn trial(
        &self,
        respond: &mut Respond,
        longest: usize,
        count: usize,
    ) -> Result<Trial, CallFailure> {
        let mut best = Trial { change: 0.0, period: 1, error: f64::INFINITY, depends: 0.0 };
        let mut firsts: Vec<Response> = Vec::new();
        for change in CHANGES {
            // A change that leaves next to nothing is as good as any. Of the others one response
            // shows whether the component is smooth.
            let is_found = best.error <= EQUAL;
            let responses = respond(change, 0..if is_found { 1 } else { 2 * longest }, count)?;
            if !is_found {
                let (period, difference) = period(&responses, longest, self.smallest());
                let error = responses.iter().map(|one| one.error).fold(difference, f64::max);
                if error < best.error || best.change == 0.0 {
                    best = Trial { change, period, error, ..best };
                }
            }
            firsts.extend(responses.into_iter().next());
        }
        // The same response with every size of the change, if the component is smooth.
        let depends = firsts.windows(2).map(|pair| difference(pair, 1)).fold(0.0, f64::max);
        Ok(Trial { depends, ..best })
    }

    /// Measures the responses of a period, with as many lags as a model needs that describes the
    /// motion.
    fn measured(
        &self,
        respond: &mut Respond,
        &Trial { change, period, .. }: &Trial,
        longest: usize,
        late: usize,
    ) -> Result<Measured, CallFailure> {
        let again = period + period.min(AGAIN);
        let count = compared_steps(self.recorded.length).max(late + COMPARED);
        let long = respond(change, 0..1, count)?;
        // The memory of a component takes as many steps to show as it is long.
        let may_grow = late > 0 || !self.moves();
        let most = ((self.recorded.rows.len() - again) / 2).min(MOST_BLOCKS);
        let mut blocks = BLOCKS.max(2 * period);
        loop {
            let mut phases = respond(change, 0..again, 2 * blocks)?;
            let error = phases.iter().map(|phase| phase.error).fold(0.0, f64::max);
            let drift = difference(&phases, period);
            if drift > REPEATS {
                return Err(without_model(format!(
                    "responses to a change of its inputs do not repeat within {longest} steps of {} s, but differ by {:.0} %: it has no linear model here, or a longer period, which a longer step can cover",
                    self.recorded.length,
                    1e2 * drift
                )));
            }
            phases.truncate(period);
            let tolerance = self.smallest().max(drift).max(error * 10.0);
            let measured = Measured { phases, blocks, tolerance, drift };
            let deviation = deviation(&measured.realised(&central), central(&long[0]));
            if deviation <= DEVIATES {
                return Ok(measured);
            }
            if !may_grow || blocks >= most {
                return Err(without_model(format!(
                    "a linear model is {:.0} % off the response to a change within {LONGEST_TIME} s: steps of {} s show too little of the motion, or it is not linear here",
                    1e2 * deviation,
                    self.recorded.length
                )));
            }
            blocks = (2 * blocks).min(most);
        }
    }

    /// Builds the model from the measured responses, and those for increases and for decreases of
    /// the inputs if they differ.
    fn sampled(&self, measured: &Measured, trial: &Trial, scales: &Scales) -> Found {
        let model = |lags: &dyn Fn(&Response) -> &Lags| {
            let steps = measured.realised(lags);
            steps.into_iter().map(|step| scaled(step, scales)).collect::<Vec<Step>>()
        };
        let component = |steps| self.of_dynamics(Vec::new(), Dynamics::Sampled(steps));
        let side = |side: usize| {
            component(model(&move |phase| {
                phase.sides.as_ref().map_or(&phase.central, |sides| &sides[side])
            }))
        };
        let steps = model(&central);
        let states = steps.iter().map(|step| step.a.ncols()).max().unwrap_or(0);
        let found = component(steps);
        let Trial { period, .. } = trial;
        let repeats = format!(
            "{}: responses to changes of inputs, which repeat after {period} steps of {} s, {states} states",
            found.name, self.recorded.length
        );
        let has_edge = measured.phases.iter().any(|phase| phase.sides.is_some());
        Found {
            model: found,
            sides: has_edge.then(|| [side(0), side(1)]),
            note: note(repeats, trial, measured.drift),
            is_silent: false,
        }
    }

    /// Returns the lag at which the last output responds to a change, 0 if it is soon; `None` if
    /// none of them responds.
    fn late(
        &self,
        probe: &Probe,
        instance: &mut dyn Instance,
    ) -> Result<Option<usize>, CallFailure> {
        let length = self.recorded.length;
        // A component may look at its inputs at some steps only.
        for first in 0..longest_period(length) {
            let response = probe.responses(instance, first, longest_response(length))?;
            if let Some(lag) = beginning(&response.central) {
                return Ok(Some(if lag < COMPARED { 0 } else { lag }));
            }
        }
        Ok(None)
    }

    /// Returns the model of a component that does not respond.
    fn silent(&self) -> Found {
        let none = Matrix::zeros(0, 0);
        let (outputs, inputs) = (self.outputs.len(), self.inputs.len());
        let step = Step {
            b: Matrix::zeros(0, inputs),
            c: Matrix::zeros(outputs, 0),
            d: Matrix::zeros(outputs, inputs),
            a: none,
        };
        let model = self.of_dynamics(Vec::new(), Dynamics::Sampled(vec![step]));
        let note = format!(
            "{}: does not respond to changes of its inputs within {} s: it may delay them for longer, or round or hold its outputs",
            model.name,
            rounded(longest_response(self.recorded.length) as f64 * self.recorded.length)
        );
        Found { model, sides: None, note, is_silent: true }
    }

    /// Returns the places of the inputs among the recorded ones.
    pub(crate) fn places(&self) -> Vec<usize> {
        let place = |port: &Port| self.recorded.ports.iter().position(|other| other == port);
        self.inputs.iter().filter_map(place).collect()
    }
}

/// Continues the note on a model with what it leaves out: responses that `drift` by a share from
/// one period to the next, and that depend on the size of the change.
fn note(mut note: String, &Trial { change, period, depends, .. }: &Trial, drift: f64) -> String {
    if drift > DRIFTS {
        let share = 1e2 * drift;
        note = format!(
            "{note}; those of the next {period} differ by {share:.1} %, and states that count for less are left out"
        );
    }
    if depends > DRIFTS {
        note = format!(
            "{note}; they depend on the size of the change, by {:.1} % from {:.0e} to {:.0e} of the typical magnitudes: the model is that of {change:.0e}",
            1e2 * depends,
            CHANGES[0],
            CHANGES[CHANGES.len() - 1]
        );
    }
    note
}

fn central(response: &Response) -> &Lags {
    &response.central
}

impl Measured {
    /// Realises the steps of the period from these of their responses.
    fn realised(&self, lags: &dyn Fn(&Response) -> &Lags) -> Vec<Step> {
        let lags: Vec<Lags> = self.phases.iter().map(|phase| lags(phase).clone()).collect();
        realise(&lags, self.blocks, self.tolerance)
    }
}

fn without_model(message: String) -> CallFailure {
    CallFailure::answer("linearise", message)
}

/// Finds the period after which the responses repeat, in steps, and the difference that it leaves.
/// Differences up to `noise` do not count.
fn period(responses: &[Response], longest: usize, noise: f64) -> (usize, f64) {
    let differences: Vec<f64> =
        (1..=longest).map(|period| difference(&responses[..longest + period], period)).collect();
    let least = differences.iter().copied().fold(f64::INFINITY, f64::min);
    let equal = EQUAL.max(noise).max(AS_EQUAL * least);
    let place = differences.iter().position(|difference| *difference <= equal).unwrap_or(0);
    (place + 1, differences[place])
}

/// Converts a step in typical magnitudes to one in the units of the variables.
fn scaled(step: Step, scales: &Scales) -> Step {
    let Step { a, mut b, mut c, mut d } = step;
    for (column, scale) in scales.inputs.iter().enumerate() {
        b.column_mut(column).scale_mut(1.0 / scale);
        d.column_mut(column).scale_mut(1.0 / scale);
    }
    for (row, scale) in scales.outputs.iter().enumerate() {
        c.row_mut(row).scale_mut(*scale);
        d.row_mut(row).scale_mut(*scale);
    }
    Step { a, b, c, d }
}
