//! Finding the linear model of a component from what its instance answers.

use crate::Matrix;
use crate::components::{Component, Dynamics};
use crate::fitting::deviation;
use crate::model::Step;
use crate::realisation::realise;
use crate::replay::Recorded;
use crate::responses::{Lags, Probe, Response, Scales, beginning};
use crate::windows::{
    BLOCKS, COMPARED, LONGEST_TIME, MOST_BLOCKS, compared_steps, longest_period, longest_response,
};
use cosim::system::System;
use cosim::wiring::Port;
use fmu_import::instance::{CallFailure, Instance};
use fmu_import::quantity::rounded;

/// Most steps of the next period whose responses are held against those of the first.
const AGAIN: usize = 4;
/// Difference of two periods up to which they count as equal, relative to the largest response, and
/// in relation to the least difference that any period leaves.
const EQUAL: f64 = 1e-6;
const AS_EQUAL: f64 = 3.0;
/// Difference of two periods, relative to the largest response, above which it is not periodic
/// and there is no model, and from which it is told.
const REPEATS: f64 = 0.1;
const DRIFTS: f64 = 0.01;
/// Changes of an input that are tried, in relation to its typical magnitude.
pub(crate) const CHANGES: [f64; 3] = [1e-5, 1e-7, 1e-9];
/// Difference between a model and the response over `LONGEST_TIME`, relative to the largest
/// response of a variable, from which the model does not describe the motion.
const DEVIATES: f64 = 0.05;
/// What a state of a model must add to the responses, relative to the largest.
const SMALLEST: f64 = 1e-9;
/// The same for a pair. An allocator ends its iterations anywhere near the optimum, and what the
/// effectors do on their way from one end to the next is noise.
const SMALLEST_OF_PAIR: f64 = 1e-3;

/// What is found of a component: its model, those for changes to one side, if they differ, and what
/// to know of it.
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

    /// Returns what counts in its responses, in relation to the largest.
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
        // A law that is not smooth wants a small change, and one that iterates a larger one.
        let mut best: Option<(f64, usize, f64)> = None;
        let mut trials: Vec<Response> = Vec::new();
        for change in CHANGES {
            // A change that leaves next to nothing is as good as any. Of the others one response
            // tells whether the component is smooth.
            let is_found = best.is_some_and(|(_, _, least)| least <= EQUAL);
            let short: Vec<Response> = (0..if is_found { 1 } else { 2 * longest })
                .map(|first| probe(change).responses(instance, first, late + COMPARED))
                .collect::<Result<_, _>>()?;
            if !is_found {
                let (period, difference) = period(&short, longest, self.smallest());
                let worst = short.iter().map(|response| response.error).fold(difference, f64::max);
                if best.is_none_or(|(_, _, least)| worst < least) {
                    best = Some((change, period, worst));
                }
            }
            trials.extend(short.into_iter().next());
        }
        // The same response with every size of the change, if the component is smooth.
        let depends = trials.windows(2).map(|pair| difference(pair, 1)).fold(0.0, f64::max);
        let Some((change, period, _)) = best else { unreachable!("there are changes to try") };
        let again = period + period.min(AGAIN);
        let count = compared_steps(self.recorded.length).max(late + COMPARED);
        let measured = probe(change).responses(instance, 0, count)?;
        // What a component remembers of its inputs takes as many steps to show as it remembers.
        let may_grow = late > 0 || !self.moves();
        let most = ((self.recorded.rows.len() - again) / 2).min(MOST_BLOCKS);
        let mut blocks = BLOCKS.max(2 * period);
        let (phases, tolerance, drift) = loop {
            let phases: Vec<Response> = (0..again)
                .map(|first| probe(change).responses(instance, first, 2 * blocks))
                .collect::<Result<_, _>>()?;
            let error = phases.iter().map(|phase| phase.error).fold(0.0, f64::max);
            let drift = difference(&phases, period);
            if drift > REPEATS {
                return Err(CallFailure::answer(
                    "linearise",
                    format!(
                        "responses to a change of its inputs do not repeat within {longest} steps of {} s, but differ by {:.0} %: it has no linear model here, or a longer period than that, which takes fewer of a longer step",
                        self.recorded.length,
                        1e2 * drift
                    ),
                ));
            }
            let tolerance = self.smallest().max(drift).max(error * 10.0);
            let deviation = deviation(
                &realised(&phases[..period], &central, blocks, tolerance),
                &measured.central,
            );
            if deviation <= DEVIATES {
                break (phases, tolerance, drift);
            }
            if !may_grow || blocks >= most {
                return Err(CallFailure::answer(
                    "linearise",
                    format!(
                        "a linear model is {:.0} % off the response to a change within {LONGEST_TIME} s: steps of {} s show too little of the motion, or it is not linear here",
                        1e2 * deviation,
                        self.recorded.length
                    ),
                ));
            }
            blocks = (2 * blocks).min(most);
        };
        let model = |lags: &dyn Fn(&Response) -> &Lags| {
            let steps = realised(&phases[..period], lags, blocks, tolerance);
            let steps = steps.into_iter().map(|step| scaled(step, &scales)).collect();
            self.of_dynamics(Vec::new(), Dynamics::Sampled(steps))
        };
        let has_edge = phases[..period].iter().any(|phase| phase.sides.is_some());
        let side = |side: usize| {
            model(&move |phase| phase.sides.as_ref().map_or(&phase.central, |sides| &sides[side]))
        };
        let found = model(&central);
        let Dynamics::Sampled(steps) = &found.dynamics else { unreachable!("built above") };
        let states = steps.iter().map(|step| step.a.ncols()).max().unwrap_or(0);
        let repeats = format!(
            "{}: responses to changes of inputs, which repeat after {period} steps of {} s, {states} states",
            found.name, self.recorded.length
        );
        let note = note(repeats, period, drift, (depends, change));
        let sides = has_edge.then(|| [side(0), side(1)]);
        Ok(Found { model: found, sides, note, is_silent: false })
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

/// Continues the note on a model with what it leaves out: responses `drift` by a share from one
/// period to the next, and differ by the share `depends` with the size of the `change`.
fn note(mut note: String, period: usize, drift: f64, (depends, change): (f64, f64)) -> String {
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

/// Realises the steps of a period from their responses.
fn realised(
    phases: &[Response],
    lags: &dyn Fn(&Response) -> &Lags,
    blocks: usize,
    tolerance: f64,
) -> Vec<Step> {
    let lags: Vec<Lags> = phases.iter().map(|phase| lags(phase).clone()).collect();
    realise(&lags, blocks, tolerance)
}

/// Returns the difference of the responses at steps one period apart, relative to the largest.
fn difference(phases: &[Response], period: usize) -> f64 {
    let norm = |lags: &Lags| lags.iter().map(Matrix::amax).fold(0.0, f64::max);
    let largest = phases.iter().map(|phase| norm(&phase.central)).fold(f64::MIN_POSITIVE, f64::max);
    let pairs = phases.iter().zip(&phases[period..]);
    let differences = pairs.map(|(a, b)| {
        let lags = a.central.iter().zip(&b.central);
        lags.map(|(a, b)| (a - b).amax()).fold(0.0, f64::max)
    });
    differences.fold(0.0, f64::max) / largest
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
