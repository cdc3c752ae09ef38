//! An instance of FMI 3.0 for co-simulation, with its modes.
//!
//! A unit with event mode is set in event mode, as its inputs jump at a communication point, and
//! leaves it when it is stepped. A step is cut at the events that the unit announces and where it
//! returns early. An event at the end of a step is handled at once by a unit without inputs.
//! Otherwise it waits for the inputs of that point, and is handled when the next step begins.

#![allow(unsafe_code)]

use super::functions::{InterfaceFunctions, StepFunctions, Truth};
use super::unit::Fmi3Unit;
use crate::fmi::Status;
use crate::halt;
use crate::library::put;
use fmi_master::forward;
use fmi_master::instance::{CallFailure, Instance, Outcome};
use fmi_master::quantity::rounded;

/// Part of a step, and time (s), by which a unit may round times.
const TOLERANCE: f64 = 1e-9;
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

/// An instance of FMI 3.0 for co-simulation.
pub(crate) struct StepInstance {
    unit: Fmi3Unit,
    functions: StepFunctions,
    present: Present,
    /// Start time, s.
    start: f64,
    /// Where it stood in the states that it keeps.
    kept: Vec<Present>,
}

impl StepInstance {
    /// Adds the modes to a new instance.
    pub(crate) fn new(unit: Fmi3Unit) -> Result<Self, String> {
        let InterfaceFunctions::CoSimulation(functions) = unit.calls.functions().interface else {
            return Err("is an instance for model exchange".into());
        };
        let (present, kept) = (NEW, Vec::new());
        Ok(Self { unit, functions, present, start: 0.0, kept })
    }

    fn through<R>(&mut self, call: impl FnOnce(&mut Fmi3Unit) -> R) -> R {
        call(&mut self.unit)
    }

    /// Sets variables, in event mode if the instance has it.
    fn set(&mut self, call: impl FnOnce(&mut Fmi3Unit) -> Outcome) -> Outcome {
        self.enter_event_mode()?;
        call(&mut self.unit)
    }

    /// Enters event mode, if the instance has it and steps.
    fn enter_event_mode(&mut self) -> Outcome {
        if self.unit.layout.has_events && self.present.mode == Mode::Step {
            self.unit.calls.call_plain("enterEventMode", self.functions.enter_event_mode)?;
            self.present.mode = Mode::Event;
        }
        Ok(())
    }

    /// Handles the event at a time (s), in event mode.
    fn update(&mut self, now: f64) -> Outcome {
        self.present.next_event = self.unit.calls.settle(now)?.next_event;
        self.present.is_due = false;
        Ok(())
    }

    /// Leaves event mode, after the event at this time (s) was handled.
    fn enter_step_mode(&mut self, now: f64) -> Outcome {
        if self.present.is_due {
            self.enter_event_mode()?;
        }
        if self.present.mode == Mode::Event {
            self.update(now)?;
            self.unit.calls.call_plain("enterStepMode", self.functions.enter_step_mode)?;
            self.present.mode = Mode::Step;
        }
        Ok(())
    }

    /// Makes a part of a step. Returns the time (s) that the instance has reached.
    fn do_part(&mut self, time: f64, step: f64) -> Result<f64, CallFailure> {
        let [mut event, mut ends, mut early] = [Truth::MIN; 3];
        let mut reached = f64::NAN;
        let do_step = self.functions.do_step;
        // SAFETY: the instance is alive, and the pointers are valid for the call.
        let status = self.unit.calls.status("doStep", |_, handle| unsafe {
            do_step(
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
        let [event, ends, early] = [event, ends, early].map(|truth| truth != 0);
        let is_discarded = status == Ok(Status::Discard);
        if is_discarded || (ends && matches!(status, Ok(Status::Ok | Status::Warning))) {
            let returned = if ends { "terminateSimulation" } else { "fmi3Discard" };
            return Err(self.unit.calls.stopped(ends, Some(reached), returned));
        }
        self.unit.calls.check("doStep", status)?;
        self.present.is_due = event && self.unit.layout.has_events;
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
    (TOLERANCE * step.min(1.0)).max(8.0 * f64::EPSILON * time.abs())
}

impl Instance for StepInstance {
    forward! { through: get_real, get_integer, get_boolean, terminate }
    forward! { set: set_real, set_integer, set_boolean, set_string }

    fn enter_initialization(&mut self, start: f64, stop: f64) -> Outcome {
        self.start = start;
        self.unit.enter_initialization(start, stop)
    }

    fn exit_initialization(&mut self) -> Outcome {
        self.unit.exit_initialization()?;
        let has_events = self.unit.layout.has_events;
        self.present.mode = if has_events { Mode::Event } else { Mode::Step };
        if has_events { self.update(self.start) } else { Ok(()) }
    }

    fn do_step(&mut self, time: f64, step: f64) -> Outcome {
        let (end, tolerance) = (time + step, tolerance(time, step));
        let (mut now, mut rest, mut idle) = (time, step, 0);
        for _ in 0..PARTS {
            halt::check()?;
            self.enter_step_mode(now)?;
            let next = self.present.next_event;
            let inside = next.filter(|next| *next > now && *next < end - tolerance);
            let reached = self.do_part(now, inside.map_or(rest, |next| next - now))?;
            self.present.is_due |= next.is_some_and(|next| next <= reached + tolerance);
            if reached >= end - tolerance {
                return if self.unit.layout.has_inputs {
                    Ok(())
                } else {
                    self.enter_step_mode(end)
                };
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

    fn reset(&mut self) -> Outcome {
        self.unit.reset()?;
        self.present = NEW;
        Ok(())
    }

    fn save(&mut self, number: usize) -> Outcome {
        self.unit.save(number)?;
        put(&mut self.kept, number, self.present);
        Ok(())
    }

    fn restore(&mut self, number: usize) -> Outcome {
        self.unit.restore(number)?;
        self.present = self.kept[number];
        Ok(())
    }
}
