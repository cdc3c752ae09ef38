//! A model together with its integrator, as the master sees it.

use super::equations::Equations;
use super::events::{Events, MOST_EVENTS};
use super::model::{ContinuousModel, Layout, Refusal};
use super::rodas::{Point, Rodas, Step};
use crate::functions::{Completed, Table as _};
use crate::halt;
use crate::library::put;
use fmi_master::description::Carrier;
use fmi_master::forward;
use fmi_master::instance::{CallFailure, Instance, Outcome};
use fmi_master::quantity::rounded;
use std::collections::BTreeMap;
use std::fmt::Display;

/// Largest number of steps of the integrator and events within a communication step.
const MOST_STEPS: usize = 10_000_000;
/// Number of steps within which a state event must have been located.
const MOST_LOCATIONS: usize = 20;
/// Part of a step at either end within which the interpolation is as good as the ends, whose error it
/// has.
const NEAR: f64 = 1e-3;

/// Mode of the model.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
enum Mode {
    /// Before the end of initialization.
    #[default]
    Initialization,
    Event,
    ContinuousTime,
}

/// What changes during a simulation, beside the model itself.
#[derive(Clone)]
struct Progress {
    mode: Mode,
    /// Present time and states.
    point: Point,
    integrator: Rodas,
    events: Events,
    /// Values that were set last, by type and value reference.
    set: BTreeMap<(Carrier, u32), u64>,
}

/// A model together with its integrator.
pub(crate) struct Exchange<M> {
    model: M,
    layout: Layout,
    progress: Progress,
    /// Progress of the states that the model keeps, by their numbers.
    kept: Vec<Progress>,
}

impl<M: ContinuousModel> Exchange<M> {
    /// Adds an integrator to a new instance.
    pub(crate) fn new(mut model: M, layout: Layout) -> Self {
        model.unit().tolerance = Some(layout.tolerance);
        let progress = Progress::new(&layout);
        Self { model, layout, progress, kept: Vec::new() }
    }

    fn through<R>(&mut self, call: impl FnOnce(&mut M) -> R) -> R {
        call(&mut self.model)
    }

    /// Sets variables. Values that change after initialization are an event of the environment,
    /// because they jump.
    fn set<T: Copy>(
        &mut self,
        carrier: Carrier,
        (references, values): (&[u32], &[T]),
        bits: impl Fn(T) -> u64,
        call: impl FnOnce(&mut M) -> Outcome,
    ) -> Outcome {
        let mut has_changed = false;
        for (reference, value) in references.iter().zip(values) {
            let value = bits(*value);
            has_changed |= self.progress.set.insert((carrier, *reference), value) != Some(value);
        }
        if has_changed { self.set_in_event(call) } else { Ok(()) }
    }

    fn set_in_event(&mut self, call: impl FnOnce(&mut M) -> Outcome) -> Outcome {
        if self.progress.mode == Mode::ContinuousTime {
            self.model.unit().enter_event_mode()?;
            self.progress.mode = Mode::Event;
        }
        call(&mut self.model)
    }

    /// Integrates to the time `end`, s.
    fn integrate(&mut self, end: f64) -> Outcome {
        if self.progress.mode == Mode::Event {
            self.settle()?;
        }
        for _ in 0..MOST_STEPS {
            halt::check()?;
            let Progress { point, events, .. } = &self.progress;
            match events.next_within(end) {
                Some(event) if event <= point.time => self.event(&"a time event")?,
                None if end <= point.time => return Ok(()),
                event => self.advance(event.unwrap_or(end))?,
            }
        }
        let time = rounded(self.progress.point.time);
        let text = format!(
            "{MOST_STEPS} steps of the integration and events have only reached t = {time} s: a shorter communication step allows more"
        );
        Err(CallFailure::new("doStep", text))
    }

    /// Makes a step of the integrator, which ends at an event or at the time `stop` (s) at last.
    fn advance(&mut self, stop: f64) -> Outcome {
        let (point, indicator) = self.step_to_event(stop)?;
        self.progress.point = point;
        let mut completed = Completed::default();
        if self.layout.needs_completed_step {
            completed = self.model.unit().complete_step()?;
        }
        if completed.terminates {
            let time = self.progress.point.time;
            return Err(self.model.unit().ending(time));
        }
        match indicator {
            Some(indicator) => {
                let count = self.layout.indicators;
                self.event(&format_args!("event indicator {} of {count}", indicator + 1))
            }
            None if completed.enters_event_mode => self.event(&"a step event"),
            None => Ok(()),
        }
    }
}

fn bits(value: i32) -> u64 {
    value.cast_unsigned().into()
}

impl Progress {
    fn new(layout: &Layout) -> Self {
        Self {
            mode: Mode::default(),
            point: Point::default(),
            integrator: Rodas::new(layout.tolerance),
            events: Events::default(),
            set: BTreeMap::new(),
        }
    }
}

impl<M: ContinuousModel> Exchange<M> {
    /// Makes a step of the integrator, which ends at the first state event, or at the time `stop`
    /// (s) at last. Returns its end and the indicator of the event.
    ///
    /// The interpolation within a step is exact at its ends only, to the tolerance. An event far
    /// from both is therefore located again in a step that ends shortly after it. What is found near
    /// an end is carried out at the interpolated states, where the indicator has its new sign, so
    /// that no event comes again because of rounding.
    fn step_to_event(&mut self, stop: f64) -> Result<(Point, Option<usize>), CallFailure> {
        let Progress { point, integrator, events, .. } = &mut self.progress;
        let nominals = integrator.nominals.clone();
        let mut equations = Equations { model: &mut self.model, layout: &self.layout, nominals };
        let (mut until, mut trials) = (stop, 0);
        loop {
            trials += 1;
            let next = integrator.next;
            let step = if point.states.is_empty() {
                equations.place(until, &[]).map_err(Refusal::failure)?;
                Step::empty(point, until)
            } else {
                integrator.step(&mut equations, point, until)?
            };
            until = match equations.event(events, &step) {
                Ok(None) => return Ok((step.end, None)),
                Ok(Some((instant, indicator))) => {
                    let part = step.part(instant);
                    let is_near = !(NEAR..=1.0 - NEAR).contains(&part);
                    if is_near || trials == MOST_LOCATIONS {
                        let mut event = step.end.clone();
                        step.interpolate(instant, &mut event);
                        equations.place(instant, &event.states).map_err(Refusal::failure)?;
                        return Ok((event, Some(indicator)));
                    }
                    instant.max(point.time + (1.0 + 0.5 * NEAR) * (instant - point.time))
                }
                // The step may reach beyond an event.
                Err(Refusal::Discarded(failure)) if trials < MOST_LOCATIONS => {
                    let middle = f64::midpoint(point.time, step.end.time);
                    if middle <= point.time {
                        return Err(failure);
                    }
                    middle
                }
                Err(refusal) => return Err(refusal.failure()),
            };
            integrator.next = next;
        }
    }

    fn event(&mut self, cause: &dyn Display) -> Outcome {
        let time = self.progress.point.time;
        if self.progress.events.is_stuck(time) {
            let text = format!(
                "{MOST_EVENTS} events in a row without an advance in time, the last one at t = {} s by {cause}: the model chatters",
                rounded(time)
            );
            return Err(CallFailure::new("enterEventMode", text));
        }
        self.model.unit().enter_event_mode()?;
        self.progress.mode = Mode::Event;
        self.settle()
    }

    /// Updates the discrete states until they settle, and returns to continuous-time mode.
    fn settle(&mut self) -> Outcome {
        let is_first = self.progress.mode == Mode::Initialization;
        let info = self.model.unit().settle(self.progress.point.time)?;
        self.progress.events.next_time = info.next_event;
        self.resume(is_first || info.changes_states, is_first || info.changes_nominals)
    }

    /// Returns to continuous-time mode, and reads what may have changed.
    fn resume(&mut self, has_states: bool, has_nominals: bool) -> Outcome {
        let Layout { states, names, indicators, .. } = &self.layout;
        self.model.unit().enter_continuous_time_mode()?;
        let Progress { mode, point, integrator, events, .. } = &mut self.progress;
        *mode = Mode::ContinuousTime;
        point.states.resize(states.len(), 0.0);
        point.rests.resize(states.len(), 0.0);
        point.derivatives.resize(states.len(), 0.0);
        if !states.is_empty() {
            if has_states {
                self.model.unit().states(&mut point.states)?;
                point.rests.fill(0.0);
                finite("getContinuousStates", "the state", names, &point.states, point.time)?;
            }
            if has_nominals {
                integrator.nominals.resize(states.len(), 1.0);
                self.model.unit().nominals(&mut integrator.nominals)?;
                let usable = |nominal: f64| nominal.is_finite() && nominal > 0.0;
                integrator.nominals.iter_mut().filter(|n| !usable(**n)).for_each(|n| *n = 1.0);
            }
            self.model.unit().derivatives(&mut point.derivatives).map_err(Refusal::failure)?;
            let (call, values) = (M::Functions::DERIVATIVES, &point.derivatives);
            finite(call, "the derivative of", names, values, point.time)?;
        }
        integrator.next = f64::INFINITY;
        let mut values = vec![0.0; *indicators];
        if *indicators > 0 {
            self.model.unit().indicators(&mut values).map_err(Refusal::failure)?;
        }
        events.is_positive = values.iter().map(|value| *value > 0.0).collect();
        Ok(())
    }
}

/// Checks that values of a unit for its states are finite at a time, s.
fn finite(call: &'static str, kind: &str, names: &[String], values: &[f64], time: f64) -> Outcome {
    match names.iter().zip(values).find(|(_, value)| !value.is_finite()) {
        None => Ok(()),
        Some((name, value)) => {
            let text = format!("{kind} \"{name}\" is {value} at t = {} s", rounded(time));
            Err(CallFailure::answer(call, text))
        }
    }
}

impl<M: ContinuousModel> Instance for Exchange<M> {
    forward! { through: get_real, get_integer, get_boolean, terminate }

    fn set_real(&mut self, references: &[u32], values: &[f64]) -> Outcome {
        let set = |model: &mut M| model.set_real(references, values);
        self.set(Carrier::Real, (references, values), f64::to_bits, set)
    }

    fn set_integer(&mut self, references: &[u32], values: &[i32]) -> Outcome {
        let set = |model: &mut M| model.set_integer(references, values);
        self.set(Carrier::Integer, (references, values), bits, set)
    }

    fn set_boolean(&mut self, references: &[u32], values: &[i32]) -> Outcome {
        let set = |model: &mut M| model.set_boolean(references, values);
        self.set(Carrier::Boolean, (references, values), bits, set)
    }

    fn set_string(&mut self, reference: u32, value: &str) -> Outcome {
        self.set_in_event(|model| model.set_string(reference, value))
    }

    fn enter_initialization(&mut self, start: f64, stop: f64) -> Outcome {
        self.progress.point.time = start;
        self.model.enter_initialization(start, stop)
    }

    fn exit_initialization(&mut self) -> Outcome {
        self.model.exit_initialization()?;
        self.settle()
    }

    fn do_step(&mut self, time: f64, step: f64) -> Outcome {
        self.progress.events.begin(step);
        self.integrate(time + step)
    }

    fn reset(&mut self) -> Outcome {
        self.progress = Progress::new(&self.layout);
        self.model.reset()
    }

    fn save(&mut self, number: usize) -> Outcome {
        self.model.save(number)?;
        put(&mut self.kept, number, self.progress.clone());
        Ok(())
    }

    fn restore(&mut self, number: usize) -> Outcome {
        self.model.restore(number)?;
        // The model has checked the number.
        if let Some(kept) = self.kept.get(number) {
            self.progress = kept.clone();
        }
        Ok(())
    }
}
