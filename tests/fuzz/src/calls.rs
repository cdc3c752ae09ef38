//! Calls of the C interface in any order, compared with a model of the standard's states.

#![allow(clippy::borrow_as_ptr, reason = "calls read better as in C")]

use crate::bytes::{Bytes, fmu};
use conformance::interface::{DISCARD, ERROR, EventInfo, FmuState, MODEL_EXCHANGE, OK, Status};
use conformance::table::{Row, State, TABLE, settable};
use conformance::{Instance, c};
use model_description::variable::VariableKind;
use std::ffi::{CStr, CString, c_int};
use std::ptr::{null, null_mut};

/// Largest number of calls of one input, so that no input takes long.
const CALLS: usize = 200;
/// Largest number of saved states that are kept at the same time.
const SAVED: usize = 8;

/// Model of an instance by the standard: its present state and its saved states.
struct Model {
    instance: Instance,
    fmu_type: c_int,
    state: State,
    saved: Vec<(FmuState, State)>,
    /// Time that the instance has reached, or NaN.
    time: f64,
}

/// Result of a call: its status, whether its arguments are as the standard demands, and the state
/// in which the standard leaves the instance after success.
struct Answer {
    status: Status,
    is_right: bool,
    next: State,
}

/// Calls functions of an FMU in any order with any values that are valid in C. Each answer must be
/// one that the standard allows in the state, and all results must be valid values.
pub fn calls(data: &[u8]) {
    let mut bytes = Bytes(data);
    let fmu = fmu(&mut bytes);
    let kinds = fmu.interfaces();
    let fmu_type = kinds[bytes.below(kinds.len())];
    let instance = fmu.instance(fmu_type);
    let state = State::Instantiated;
    let mut model = Model { instance, fmu_type, state, saved: Vec::new(), time: 0.0 };
    for _ in 0..CALLS {
        if bytes.0.is_empty() {
            break;
        }
        model.call(&TABLE[bytes.below(TABLE.len())], &mut bytes);
    }
}

impl Model {
    /// Makes one call and checks its answer.
    fn call(&mut self, row: &Row, bytes: &mut Bytes) {
        let &Row(name, ..) = row;
        let fmu = self.instance.fmu.clone();
        let before = self.state;
        self.instance.forget();
        let Answer { status, is_right, next } = self.ask(row, bytes);
        let texts: Vec<_> = self.instance.messages().into_iter().map(|said| said.text).collect();
        let what = format!("{}: {name} in {before:?} gave {status}: {texts:?}", fmu.name());
        assert!([OK, DISCARD, ERROR].contains(&status), "{what}");
        let is_offered =
            name != "fmi2GetDirectionalDerivative" || fmu.description.directional_derivatives();
        if !row.is_allowed(self.fmu_type, before) || !is_offered {
            assert_eq!(status, ERROR, "{what}");
        }
        assert!(is_right || status != OK, "{what}: the arguments are wrong");
        // Messages about discarded calls may be switched off.
        if status == ERROR {
            assert!(texts.last().is_some_and(|text| text.starts_with(name)), "{what}");
        }
        match status {
            OK => self.state = next,
            ERROR if !keeps_state(name) => self.state = State::Error,
            DISCARD if name == "fmi2DoStep" => {
                self.instance.ok(c!(self.instance, fmi2Reset(self.instance.component)));
                (self.state, self.time) = (State::Instantiated, 0.0);
            }
            _ => {}
        }
        let is_shown = !matches!(self.state, State::Instantiated | State::Error);
        if is_shown && name.starts_with("fmi2Get") && bytes.is(4) {
            self.look(&what);
        }
    }

    /// Looks at all values. Those that are not available put the instance into the error state, so
    /// it is brought back.
    fn look(&mut self, what: &str) {
        let saved_state = self.instance.save();
        let wrong = self.instance.wrong_value();
        assert!(wrong.is_none(), "{what}: then {wrong:?}");
        self.instance.restore(saved_state);
        let component = self.instance.component;
        self.instance.ok(c!(self.instance, fmi2FreeFMUstate(component, &mut { saved_state })));
    }

    #[allow(clippy::too_many_lines, reason = "a table")]
    fn ask(&mut self, row: &Row, bytes: &mut Bytes) -> Answer {
        let &Row(name, call, ..) = row;
        let i = &self.instance;
        let (it, fmu) = (i.component, &i.fmu);
        let mut next = self.state;
        let mut is_right = true;
        /// Gets the values of drawn references.
        macro_rules! get {
            ($function:ident, $kind:ident, $empty:expr, $is_valid:expr) => {{
                let references = bytes.references(fmu, $kind);
                let (n, mut values) = (references.len(), vec![$empty; references.len()]);
                let status = c!(i, $function(it, references.as_ptr(), n, values.as_mut_ptr()));
                is_right = values.iter().all($is_valid);
                status
            }};
        }
        /// Sets drawn references to drawn values.
        macro_rules! set {
            ($function:ident, $kind:ident, $draw:ident, $is_valid:expr) => {{
                let references = bytes.references(fmu, $kind);
                let values: Vec<_> = references.iter().map(|_| bytes.$draw()).collect();
                is_right = self.are_settable(&references) && values.iter().all($is_valid);
                c!(i, $function(it, references.as_ptr(), values.len(), values.as_ptr()))
            }};
        }
        let status = match name {
            "fmi2SetupExperiment" => {
                let (with_stop, start, stop) = (bytes.is(4), bytes.real(), bytes.real());
                let start = if bytes.is(4) { start } else { 0.0 };
                is_right = start.is_finite() && !(with_stop && (stop.is_nan() || stop < start));
                let status =
                    c!(i, fmi2SetupExperiment(it, 0, 0.0, start, c_int::from(with_stop), stop));
                if status == OK {
                    self.time = start;
                }
                status
            }
            "fmi2SetDebugLogging" => {
                let names = [c"logAll", c"logEvents", c"nothing"].map(CStr::as_ptr);
                c!(i, fmi2SetDebugLogging(it, bytes.whole() & 1, bytes.below(4), names.as_ptr()))
            }
            "fmi2Reset" => {
                next = State::Instantiated;
                self.time = 0.0;
                call(i, null_mut())
            }
            "fmi2GetReal" => get!(fmi2GetReal, is_real, f64::NAN, |value: &f64| value.is_finite()),
            "fmi2GetInteger" => get!(fmi2GetInteger, is_whole, 0, |_: &c_int| true),
            "fmi2GetBoolean" => get!(fmi2GetBoolean, is_boolean, 0, |value| [0, 1].contains(value)),
            "fmi2GetString" => {
                get!(fmi2GetString, is_string, null(), |value: &*const _| !value.is_null())
            }
            "fmi2SetReal" => set!(fmi2SetReal, is_real, real, |value: &f64| value.is_finite()),
            "fmi2SetInteger" => set!(fmi2SetInteger, is_whole, whole, |_: &c_int| true),
            "fmi2SetBoolean" => {
                set!(fmi2SetBoolean, is_boolean, whole, |value| [0, 1].contains(value))
            }
            "fmi2SetString" => {
                let references = bytes.references(fmu, is_string);
                let text = CString::new(vec![1 + bytes.byte() % 255; bytes.below(40)]);
                let text = text.expect("no zero");
                let values = vec![text.as_ptr(); references.len()];
                is_right = self.are_settable(&references);
                c!(i, fmi2SetString(it, references.as_ptr(), values.len(), values.as_ptr()))
            }
            "fmi2GetFMUstate" => {
                if self.saved.len() == SAVED {
                    let (mut old, _) = self.saved.swap_remove(0);
                    i.ok(c!(i, fmi2FreeFMUstate(it, &mut old)));
                }
                let mut handle = null_mut();
                let status = c!(i, fmi2GetFMUstate(it, &mut handle));
                if status == OK {
                    self.saved.push((handle, self.state));
                }
                status
            }
            "fmi2SetFMUstate" => {
                let (handle, saved) = self.handle(bytes);
                is_right = saved.is_some();
                next = saved.unwrap_or(next);
                self.time = f64::NAN;
                let status = call(i, handle);
                // Only an instance that has been initialized reports its time.
                if status == OK && next == State::StepComplete {
                    c!(i, fmi2GetRealStatus(it, 2, &mut self.time));
                }
                status
            }
            "fmi2FreeFMUstate" => {
                let (mut handle, saved) = self.handle(bytes);
                is_right = saved.is_some() || handle.is_null();
                let freed = handle;
                let status = c!(i, fmi2FreeFMUstate(it, &mut handle));
                if status == OK {
                    assert!(handle.is_null());
                    self.saved.retain(|(handle, _)| *handle != freed);
                }
                status
            }
            "fmi2SerializedFMUstateSize" | "fmi2SerializeFMUstate" => {
                let (handle, saved) = self.handle(bytes);
                is_right = saved.is_some();
                call(i, handle)
            }
            "fmi2DeSerializeFMUstate" => {
                let mut state = i.serialize();
                if bytes.is(2) {
                    let place = bytes.below(state.len());
                    state[place] ^= 1 << (bytes.byte() % 8);
                    is_right = false;
                }
                let (status, mut handle) = i.deserialize(&state);
                if status == OK {
                    i.ok(c!(i, fmi2FreeFMUstate(it, &mut handle)));
                }
                status
            }
            "fmi2GetDirectionalDerivative" => {
                let unknowns = bytes.references(fmu, is_real);
                let knowns = bytes.references(fmu, is_real);
                let seed: Vec<_> = knowns.iter().map(|_| bytes.real()).collect();
                let mut values = vec![0.0; unknowns.len()];
                let (nu, nk) = (unknowns.len(), knowns.len());
                let (u, k) = (unknowns.as_ptr(), knowns.as_ptr());
                let to = values.as_mut_ptr();
                c!(i, fmi2GetDirectionalDerivative(it, u, nu, k, nk, seed.as_ptr(), to))
            }
            "fmi2SetTime" => {
                let time = bytes.real();
                is_right = time.is_finite();
                c!(i, fmi2SetTime(it, time))
            }
            "fmi2SetContinuousStates" => {
                let n = fmu.description.states().len();
                let states: Vec<_> = (0..n).map(|_| bytes.real()).collect();
                is_right = states.iter().all(|state| state.is_finite());
                c!(i, fmi2SetContinuousStates(it, states.as_ptr(), n))
            }
            "fmi2NewDiscreteStates" => {
                let mut event = EventInfo::default();
                let status = c!(i, fmi2NewDiscreteStates(it, &mut event));
                is_right = event.next_event_time.is_finite();
                status
            }
            "fmi2SetRealInputDerivatives" => {
                let references = bytes.references(fmu, is_real);
                let orders: Vec<_> = references.iter().map(|_| bytes.whole()).collect();
                let values: Vec<_> = references.iter().map(|_| bytes.real()).collect();
                is_right = self.are_settable(&references)
                    && orders.iter().all(|order| *order > 0)
                    && values.iter().all(|value| value.is_finite());
                let (n, vr) = (references.len(), references.as_ptr());
                c!(i, fmi2SetRealInputDerivatives(it, vr, n, orders.as_ptr(), values.as_ptr()))
            }
            "fmi2DoStep" => {
                let at = if bytes.is(16) { bytes.real() } else { self.time };
                let size = match bytes.byte() {
                    0..=63 => fmu.description.default_experiment.step,
                    64..=79 => bytes.real(),
                    _ => f64::from(bytes.byte()) * 0.01,
                };
                is_right = at.is_finite() && size.is_finite() && size >= 0.0;
                let status = i.step(at, size);
                if status == OK {
                    self.time = (at + size).max(self.time);
                }
                status
            }
            _ => {
                next = state_after(name, self.fmu_type).unwrap_or(next);
                call(i, null_mut())
            }
        };
        Answer { status, is_right, next }
    }

    /// Whether each variable may be set now.
    fn are_settable(&self, references: &[u32]) -> bool {
        let description = &self.instance.fmu.description;
        references.iter().all(|reference| settable(description, *reference, self.state))
    }

    /// A handle of a saved state with the state, or an invalid one.
    fn handle(&self, bytes: &mut Bytes) -> (FmuState, Option<State>) {
        match bytes.byte() {
            0..=15 => (null_mut(), None),
            16..=31 => (std::ptr::without_provenance_mut(16), None),
            _ if self.saved.is_empty() => (null_mut(), None),
            _ => {
                let (handle, state) = self.saved[bytes.below(self.saved.len())];
                (handle, Some(state))
            }
        }
    }
}

/// State to which a function without arguments leads, if it is one that leads to another state.
fn state_after(name: &str, fmu_type: c_int) -> Option<State> {
    Some(match name {
        "fmi2EnterInitializationMode" => State::InitializationMode,
        "fmi2ExitInitializationMode" if fmu_type == MODEL_EXCHANGE => State::EventMode,
        "fmi2ExitInitializationMode" => State::StepComplete,
        "fmi2Terminate" => State::Terminated,
        "fmi2EnterEventMode" => State::EventMode,
        "fmi2EnterContinuousTimeMode" => State::ContinuousTimeMode,
        _ => return None,
    })
}

fn is_real(kind: &VariableKind) -> bool {
    matches!(kind, VariableKind::Real { .. })
}

fn is_boolean(kind: &VariableKind) -> bool {
    matches!(kind, VariableKind::Boolean { .. })
}

fn is_string(kind: &VariableKind) -> bool {
    matches!(kind, VariableKind::String { .. })
}

fn is_whole(kind: &VariableKind) -> bool {
    matches!(kind, VariableKind::Integer { .. } | VariableKind::Enumeration { .. })
}

/// Whether an error of a function leaves the instance in its state.
fn keeps_state(name: &str) -> bool {
    name.contains("FMUstate") || name == "fmi2SetDebugLogging"
}
