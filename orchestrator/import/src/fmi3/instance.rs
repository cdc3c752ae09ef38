//! An instance of FMI 3.0, with its modes.
//!
//! A unit with event mode is set in event mode, as its inputs jump at a communication point, and
//! leaves it when it is stepped. A step is cut at the events that the unit announces and where it
//! returns early. An event at the end of a step is handled at once by a unit without inputs. Otherwise
//! it waits for the inputs of that point, and is handled when the next step begins.

#![allow(unsafe_code)]

use super::functions::{Functions, call};
use super::layout::{Arrays, Layout};
use super::values::Lists;
use crate::fmi::{Status, Text};
use crate::folder::TemporaryFolder;
use crate::functions::{c_texts, text_of};
use crate::library::{FmuInstance, foreign};
use crate::log::Log;
use crate::logs::{self, Listed};
use fmi_master::description::{Place, ScalarType};
use fmi_master::instance::{CallFailure, Instance, Outcome};
use fmi_master::quantity::rounded;
use std::rc::Rc;

/// Part of a step by which a time may be wrong.
const TOLERANCE: f64 = 1e-9;
/// Largest number of updates at an event.
const UPDATES: usize = 1000;
/// Largest number of parts of a step, and of those without progress.
const PARTS: usize = 1_000_000;
const IDLE: usize = 1000;

/// Where an instance stands.
#[derive(Clone, Copy)]
struct Present {
    mode: Mode,
    /// Whether an event is to be handled at the present time.
    is_due: bool,
    next_event: Option<f64>,
}

#[derive(Clone, Copy, PartialEq)]
enum Mode {
    /// Before the end of initialization.
    Initial,
    Event,
    Step,
}

const NEW: Present = Present { mode: Mode::Initial, is_due: false, next_event: None };

/// An instance of an FMU of FMI 3.0, in this process.
pub(crate) struct Fmi3Instance {
    unit: FmuInstance<Functions>,
    layout: Rc<Layout>,
    lists: Lists,
    present: Present,
    /// Start time, s.
    start: f64,
    /// Where it stood in the states that it keeps.
    kept: Vec<Present>,
}

impl Fmi3Instance {
    /// Makes an instance with the name in its log. The path of the `resources` ends in a separator.
    /// `folder` holds the unpacked archive, if it would vanish otherwise.
    pub(crate) fn new(
        functions: Functions,
        layout: Rc<Layout>,
        log: Rc<Log>,
        (token, resources): (&str, &str),
        folder: Option<Rc<TemporaryFolder>>,
    ) -> Result<Self, String> {
        let texts = c_texts([&log.component, token, resources])?;
        let [name, token, resources] = &texts;
        let listed = Listed::new(&log);
        // SAFETY: FMI 3.0 gives the function this type; the texts outlive the call, and the log is
        // kept alive as long as the instance.
        let handle = foreign(&log, "instantiate", || unsafe {
            (functions.instantiate)(
                name.as_ptr(),
                token.as_ptr(),
                resources.as_ptr(),
                false,
                true,
                layout.has_events,
                layout.has_events,
                std::ptr::null(),
                0,
                Rc::as_ptr(&log).cast_mut().cast(),
                logs::receive,
                std::ptr::null(),
            )
        });
        let unit = FmuInstance::made(handle, functions, None, listed, log, folder)?;
        let (lists, kept) = (Lists::default(), Vec::new());
        Ok(Self { unit, layout, lists, present: NEW, start: 0.0, kept })
    }

    /// Enters event mode, if the instance has it and steps.
    fn enter_event_mode(&mut self) -> Outcome {
        if self.layout.has_events && self.present.mode == Mode::Step {
            let function = self.unit.functions().enter_event_mode;
            self.unit.call_plain("enterEventMode", function)?;
            self.present.mode = Mode::Event;
        }
        Ok(())
    }

    /// Handles the event at a time (s), in event mode.
    fn update(&mut self, now: f64) -> Outcome {
        for _ in 0..UPDATES {
            let [mut again, mut ends, mut nominals, mut states, mut announces] = [false; 5];
            let mut next = f64::NAN;
            // SAFETY: the instance is alive, and the pointers are valid for the call.
            self.unit.call("updateDiscreteStates", |functions, handle| unsafe {
                (functions.update_discrete_states)(
                    handle,
                    &raw mut again,
                    &raw mut ends,
                    &raw mut nominals,
                    &raw mut states,
                    &raw mut announces,
                    &raw mut next,
                )
            })?;
            if ends {
                return Err(self.unit.stopped(true, Some(now), "terminateSimulation"));
            }
            if !again {
                self.present.is_due = false;
                self.present.next_event = announces.then_some(next);
                return Ok(());
            }
        }
        let text = format!("its event at t = {} s needs updates without end", rounded(now));
        Err(CallFailure::answer("updateDiscreteStates", text))
    }

    /// Leaves event mode, after the event at this time (s) was handled.
    fn enter_step_mode(&mut self, now: f64) -> Outcome {
        if self.present.is_due {
            self.enter_event_mode()?;
        }
        if self.present.mode == Mode::Event {
            self.update(now)?;
            self.unit.call_plain("enterStepMode", self.unit.functions().enter_step_mode)?;
            self.present.mode = Mode::Step;
        }
        Ok(())
    }

    /// Makes a part of a step. Returns the time (s) that the instance has reached.
    fn do_part(&mut self, time: f64, step: f64) -> Result<f64, CallFailure> {
        let [mut event, mut ends, mut early] = [false; 3];
        let mut reached = f64::NAN;
        // SAFETY: the instance is alive, and the pointers are valid for the call.
        let status = self.unit.status("doStep", |functions, handle| unsafe {
            (functions.do_step)(
                handle,
                time,
                step,
                true,
                &raw mut event,
                &raw mut ends,
                &raw mut early,
                &raw mut reached,
            )
        });
        let is_discarded = status == Ok(Status::Discard);
        if is_discarded || (ends && matches!(status, Ok(Status::Ok | Status::Warning))) {
            let returned = if ends { "terminateSimulation" } else { "fmi3Discard" };
            return Err(self.unit.stopped(ends, Some(reached), returned));
        }
        self.unit.check("doStep", status)?;
        self.present.is_due = event && self.layout.has_events;
        // The instance may have rounded the time.
        let (end, slack) = (time + step, tolerance(time, step));
        if !early {
            return Ok(end);
        }
        if (time - slack..=end + slack).contains(&reached) {
            return Ok(reached.clamp(time, end));
        }
        let [from, reached] = [time, reached].map(rounded);
        let text = format!("its step from t = {from} s ended early at t = {reached} s");
        Err(CallFailure::answer("doStep", text))
    }
}

/// Returns the difference below which two times of a step are the same, s.
fn tolerance(time: f64, step: f64) -> f64 {
    (TOLERANCE * step).max(4.0 * f64::EPSILON * time.abs())
}

impl Instance for Fmi3Instance {
    fn get_real(&mut self, references: &[u32], values: &mut [f64]) -> Outcome {
        self.lists.get(&mut self.unit, &self.layout, references, values)
    }

    fn get_integer(&mut self, references: &[u32], values: &mut [i32]) -> Outcome {
        self.lists.get(&mut self.unit, &self.layout, references, values)
    }

    fn get_boolean(&mut self, references: &[u32], values: &mut [i32]) -> Outcome {
        self.lists.get(&mut self.unit, &self.layout, references, values)
    }

    fn set_real(&mut self, references: &[u32], values: &[f64]) -> Outcome {
        self.enter_event_mode()?;
        self.lists.set(&mut self.unit, &self.layout, references, values)
    }

    fn set_integer(&mut self, references: &[u32], values: &[i32]) -> Outcome {
        self.enter_event_mode()?;
        self.lists.set(&mut self.unit, &self.layout, references, values)
    }

    fn set_boolean(&mut self, references: &[u32], values: &[i32]) -> Outcome {
        self.enter_event_mode()?;
        self.lists.set(&mut self.unit, &self.layout, references, values)
    }

    fn set_string(&mut self, reference: u32, value: &str) -> Outcome {
        self.enter_event_mode()?;
        let Place { reference, element, length, .. } = self.layout.place(reference);
        let [gets, sets] = [false, true].map(|sets| call(ScalarType::String, sets));
        let Functions { get, set, .. } = self.unit.functions();
        let [get, set] = [get, set].map(|functions| functions[ScalarType::String as usize]);
        let (Some(get), Some(set)) = (get, set) else {
            return Err(CallFailure::new(sets, "its library sets no texts"));
        };
        let mut texts: Vec<Text> = vec![std::ptr::null(); length];
        if length > 1 {
            // SAFETY: the instance is alive, and there is room for all elements.
            self.unit.call(gets, |_, handle| unsafe {
                get(handle, &raw const reference, 1, texts.as_mut_ptr().cast(), length)
            })?;
        }
        let mut others: Vec<String> = texts.into_iter().map(text_of).collect();
        others[element] = value.to_string();
        let copies = others.iter().map(|text| c_texts([text]));
        let copies = copies.collect::<Result<Vec<_>, _>>();
        let copies = copies.map_err(|message| CallFailure::new(sets, message))?;
        let mut texts: Vec<Text> = copies.iter().map(|[text]| text.as_ptr()).collect();
        // SAFETY: the instance is alive, and all elements are there.
        self.unit.call(sets, |_, handle| unsafe {
            set(handle, &raw const reference, 1, texts.as_mut_ptr().cast(), length)
        })
    }

    fn enter_initialization(&mut self, start: f64, stop: f64) -> Outcome {
        self.start = start;
        // SAFETY: the instance is alive, and the function has the type FMI gives it.
        self.unit.call("enterInitializationMode", |functions, handle| unsafe {
            (functions.enter_initialization_mode)(handle, false, 0.0, start, true, stop)
        })
    }

    fn exit_initialization(&mut self) -> Outcome {
        let function = self.unit.functions().exit_initialization_mode;
        self.unit.call_plain("exitInitializationMode", function)?;
        self.present.mode = if self.layout.has_events { Mode::Event } else { Mode::Step };
        if self.layout.has_events { self.update(self.start) } else { Ok(()) }
    }

    fn do_step(&mut self, time: f64, step: f64) -> Outcome {
        let (end, tolerance) = (time + step, tolerance(time, step));
        let (mut now, mut rest, mut idle) = (time, step, 0);
        for _ in 0..PARTS {
            self.enter_step_mode(now)?;
            let next = self.present.next_event;
            let inside = next.filter(|next| *next > now + tolerance && *next < end - tolerance);
            let reached = self.do_part(now, inside.map_or(rest, |next| next - now))?;
            self.present.is_due |= next.is_some_and(|next| next <= reached + tolerance);
            if reached >= end - tolerance {
                return if self.layout.has_inputs { Ok(()) } else { self.enter_step_mode(end) };
            }
            idle = if reached > now { 0 } else { idle + 1 };
            if idle > IDLE {
                break;
            }
            (now, rest) = (reached, end - reached);
        }
        let text = format!(
            "its step makes no progress: it has events without end at t = {} s",
            rounded(now)
        );
        Err(CallFailure::answer("doStep", text))
    }

    fn terminate(&mut self) -> Outcome {
        self.unit.call_plain("terminate", self.unit.functions().terminate)
    }

    fn reset(&mut self) -> Outcome {
        self.unit.call_plain("reset", self.unit.functions().reset)?;
        self.present = NEW;
        Ok(())
    }

    fn save(&mut self, number: usize) -> Outcome {
        self.unit.keep(number)?;
        match self.kept.get_mut(number) {
            Some(kept) => *kept = self.present,
            None => self.kept.push(self.present),
        }
        Ok(())
    }

    fn restore(&mut self, number: usize) -> Outcome {
        self.unit.go_back(number)?;
        self.present = self.kept[number];
        Ok(())
    }

    fn directional_derivative(
        &mut self,
        unknown: &[u32],
        known: &[u32],
        seed: &[f64],
        added: &mut [f64],
    ) -> Outcome {
        let call = "getDirectionalDerivative";
        assert_eq!((known.len(), unknown.len()), (seed.len(), added.len()), "one value for each");
        let Some(function) = self.unit.functions().directional_derivative else {
            return Err(CallFailure::new(call, "its library computes no derivatives"));
        };
        let arrays = |variables: &[u32]| -> Arrays {
            variables.iter().map(|variable| self.layout.place(*variable)).collect()
        };
        let (unknowns, knowns) = (arrays(unknown), arrays(known));
        let mut seeds = vec![0.0; knowns.count];
        for (place, seed) in knowns.elements.iter().zip(seed) {
            seeds[*place] += seed;
        }
        let mut all = vec![0.0; unknowns.count];
        // SAFETY: the instance is alive, and all arrays have the lengths that are passed.
        self.unit.call(call, |_, handle| unsafe {
            function(
                handle,
                unknowns.references.as_ptr(),
                unknowns.references.len(),
                knowns.references.as_ptr(),
                knowns.references.len(),
                seeds.as_ptr(),
                seeds.len(),
                all.as_mut_ptr(),
                all.len(),
            )
        })?;
        for (added, place) in added.iter_mut().zip(&unknowns.elements) {
            *added = all[*place];
        }
        Ok(())
    }
}
