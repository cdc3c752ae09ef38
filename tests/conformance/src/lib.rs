//! An importer for testing. It opens the FMU libraries that cargo has built at run time and calls
//! them through the C interface of FMI 2.0.
//!
//! It uses only the description of an FMU and nothing of the crates that make the FMUs.
#![allow(unsafe_code)]
#![allow(clippy::borrow_as_ptr, reason = "calls read better as in C")]
#![allow(clippy::missing_panics_doc, reason = "a test fails by panicking")]
#![allow(
    clippy::not_unsafe_ptr_arg_deref,
    reason = "handles belong to the library and are not followed by the tests"
)]

pub mod interface;
pub mod table;

use interface::{
    CO_SIMULATION, Callbacks, Component, EventInfo, FATAL, Interface, Logger, OK, Status, Text,
};
use model_description::ModelDescription;
use model_description::variable::{Causality, Variability, Variable, VariableKind};
use std::ffi::{CStr, CString, c_int, c_void};
use std::path::PathBuf;
use std::ptr::{null, null_mut};
use std::sync::{Arc, Mutex};

/// Calls a function of the library to which an instance or FMU belongs:
/// `c!(instance, fmi2Reset(component))`.
#[macro_export]
macro_rules! c {
    ($on:expr, $function:ident($($argument:expr),* $(,)?)) => {{
        let function = $on.interface.$function;
        // SAFETY: every pointer that a test passes is null or valid for the duration of the call,
        // as the standard demands.
        #[allow(unsafe_code, clippy::macro_metavars_in_unsafe)]
        let result = unsafe { function($($argument),*) };
        result
    }};
}

/// Path of a crate's library, where cargo puts it for this program: beside it or in its folder
/// `deps`.
pub fn library(krate: &str) -> PathBuf {
    let file = format!("{}{krate}{}", std::env::consts::DLL_PREFIX, std::env::consts::DLL_SUFFIX);
    let program = std::env::current_exe().expect("the path of this program");
    let folders = program.ancestors().skip(1).take(2);
    let mut places =
        folders.flat_map(|folder| [folder.join("deps").join(&file), folder.join(&file)]);
    places
        .find(|path| path.is_file())
        .unwrap_or_else(|| panic!("{file} is not near {}", program.display()))
}

/// One FMU of a library.
#[derive(Clone)]
pub struct Fmu {
    /// Functions of the library that holds the FMU.
    pub interface: Arc<Interface>,
    /// Model description of the FMU.
    pub description: ModelDescription,
    guid: CString,
}

/// Opens the libraries and lists their FMUs, the plant first.
pub fn fmus() -> Vec<Fmu> {
    let open = |krate| {
        let path = library(krate);
        let interface = Arc::new(Interface::open(&path).unwrap_or_else(|error| panic!("{error}")));
        let descriptions = model_description::library::descriptions(&path)
            .unwrap_or_else(|error| panic!("{error}"));
        descriptions.into_iter().map(move |description| Fmu {
            interface: interface.clone(),
            guid: CString::new(description.guid()).expect("hexadecimal digits"),
            description,
        })
    };
    ["fmu_plant", "fmu_optimising", "fmu_feedback"].into_iter().flat_map(open).collect()
}

/// Returns the FMU with that name.
pub fn fmu(name: &str) -> Fmu {
    fmus().into_iter().find(|fmu| fmu.name() == name).unwrap_or_else(|| panic!("no FMU {name}"))
}

impl Fmu {
    /// Model name of the FMU.
    pub fn name(&self) -> &str {
        &self.description.name
    }

    /// GUID of the FMU as C text.
    pub fn guid(&self) -> &CStr {
        &self.guid
    }

    /// Interface types that the FMU supports.
    pub fn interfaces(&self) -> &[c_int] {
        if self.description.model_exchange {
            &[interface::MODEL_EXCHANGE, CO_SIMULATION]
        } else {
            &[CO_SIMULATION]
        }
    }

    /// Value references of the variables for which `is_chosen` holds.
    pub fn references(&self, is_chosen: impl Fn(&Variable) -> bool) -> Vec<u32> {
        let variables = self.description.variables.iter().zip(0..);
        variables
            .filter(|(variable, _)| is_chosen(variable))
            .map(|(_, reference)| reference)
            .collect()
    }

    /// Value reference of the variable with that name.
    pub fn reference(&self, name: &str) -> u32 {
        *self
            .references(|variable| variable.name == name)
            .first()
            .unwrap_or_else(|| panic!("no {name}"))
    }

    /// Value reference of a continuous input whose change affects every FMU.
    pub fn input(&self) -> u32 {
        let is_input = |name: &&str| {
            !self.references(|v| v.name == *name && v.causality == Causality::Input).is_empty()
        };
        let name = ["moment.y", "rate.q", "measured.gyroscope.y"].into_iter().find(is_input);
        self.reference(name.expect("one of these inputs"))
    }

    /// Value references of all calculated variables except wall-clock times.
    pub fn results(&self) -> Vec<u32> {
        self.references(|variable| {
            variable.is_calculated() && !variable.description.starts_with("Wall-clock time")
        })
    }

    /// Makes an instance whose folder of resources does not exist.
    pub fn instance(&self, fmu_type: c_int) -> Instance {
        let instance =
            self.instantiate(Some(c"it"), fmu_type, Some(&self.guid), Some(c"file:///nowhere"));
        assert!(!instance.component.is_null(), "{}: {:?}", self.name(), instance.messages());
        instance
    }

    /// Makes an instance with these arguments; its component is null if it was refused. The
    /// callbacks are freed as soon as the call returns, as some importers do.
    pub fn instantiate(
        &self,
        name: Option<&CStr>,
        fmu_type: c_int,
        guid: Option<&CStr>,
        resources: Option<&CStr>,
    ) -> Instance {
        let pointer = |text: Option<&CStr>| text.map_or(null(), CStr::as_ptr);
        let log: Box<Log> = Box::default();
        let callbacks = Box::new(callbacks(&log));
        let component = c!(
            self,
            fmi2Instantiate(
                pointer(name),
                fmu_type,
                pointer(guid),
                pointer(resources),
                &raw const *callbacks,
                0,
                1
            )
        );
        Instance { interface: self.interface.clone(), fmu: self.clone(), component, log }
    }
}

/// Message that the importer's logger received.
#[derive(Clone, Debug)]
pub struct Message {
    /// Status as passed to the logger.
    pub status: Status,
    /// Category as passed to the logger.
    pub category: String,
    /// Text of the message.
    pub text: String,
}

/// List in which messages are collected.
pub type Log = Mutex<Vec<Message>>;

extern "C" fn log(
    environment: *mut c_void,
    _instance: Text,
    status: Status,
    category: Text,
    message: Text,
) {
    // SAFETY: the environment is the log that `Instance` keeps alive, and the library passes
    // NUL-terminated texts that live during the call.
    let (log, [category, text]) = unsafe {
        let texts =
            [category, message].map(|text| CStr::from_ptr(text).to_string_lossy().into_owned());
        (&*environment.cast::<Log>(), texts)
    };
    log.lock().expect("no other thread panicked").push(Message { status, category, text });
}

/// Returns callbacks with a logger and nothing else.
pub fn callbacks(log_to: &Log) -> Callbacks {
    type Fixed = extern "C" fn(*mut c_void, Text, Status, Text, Text);
    // SAFETY: the two types differ only in the variadic part, and on the supported platforms a
    // variadic call without variadic arguments passes the fixed ones like any other call.
    let logger = unsafe { std::mem::transmute::<Fixed, Logger>(log) };
    Callbacks {
        logger: Some(logger),
        allocate_memory: None,
        free_memory: None,
        step_finished: None,
        component_environment: std::ptr::from_ref(log_to).cast_mut().cast(),
    }
}

/// An instance with its log. Dropping it frees the instance, whatever its state.
pub struct Instance {
    /// Functions of the library that holds the FMU.
    pub interface: Arc<Interface>,
    /// FMU to which the instance belongs.
    pub fmu: Fmu,
    /// Pointer `fmi2Component` of the instance.
    pub component: Component,
    log: Box<Log>,
}

impl Drop for Instance {
    fn drop(&mut self) {
        c!(self, fmi2FreeInstance(self.component));
        if !std::thread::panicking() {
            let fatal = self.messages().into_iter().find(|message| message.status == FATAL);
            assert!(fatal.is_none(), "a panic reached the C interface: {fatal:?}");
        }
    }
}

/// Bits of all calculated variables of an instance, in order.
pub type Bits = Vec<u64>;

impl Instance {
    /// Returns all messages that the logger received.
    pub fn messages(&self) -> Vec<Message> {
        self.log.lock().expect("no other thread panicked").clone()
    }

    /// Deletes all messages of the log.
    pub fn forget(&self) {
        self.log.lock().expect("no other thread panicked").clear();
    }

    /// Asserts that the call succeeded.
    #[track_caller]
    pub fn ok(&self, status: Status) {
        assert_eq!(status, OK, "{}: {:?}", self.fmu.name(), self.messages().last());
    }

    /// Asserts that the call was refused with the status `expected`, and that the last message
    /// holds all of `parts`.
    #[track_caller]
    pub fn refused(&self, status: Status, expected: Status, parts: &[&str]) {
        let messages = self.messages();
        let last = messages.last().map_or("", |message| &message.text);
        assert_eq!(status, expected, "{}: {last}", self.fmu.name());
        for part in parts {
            assert!(last.contains(part), "{}: no '{part}' in '{last}'", self.fmu.name());
        }
    }

    /// Enters initialization mode, with start time 0 s and no stop time.
    pub fn enter_initialization(&self) {
        self.ok(c!(self, fmi2SetupExperiment(self.component, 0, 0.0, 0.0, 0, 0.0)));
        self.ok(c!(self, fmi2EnterInitializationMode(self.component)));
    }

    /// Enters and leaves initialization mode.
    #[must_use]
    pub fn initialized(self) -> Self {
        self.enter_initialization();
        self.ok(c!(self, fmi2ExitInitializationMode(self.component)));
        self
    }

    /// Sets a Real variable to a value.
    pub fn set_real(&self, reference: u32, value: f64) -> Status {
        c!(self, fmi2SetReal(self.component, &reference, 1, &value))
    }

    /// Returns the value of a Real variable.
    #[track_caller]
    pub fn real(&self, reference: u32) -> f64 {
        let mut value = f64::NAN;
        self.ok(c!(self, fmi2GetReal(self.component, &reference, 1, &mut value)));
        value
    }

    /// Sets an enumeration to the item with that name.
    pub fn choose(&self, name: &str, item: &str) {
        let reference = self.fmu.reference(name);
        let VariableKind::Enumeration { enumeration_type, .. } =
            &self.fmu.description.variables[reference as usize].kind
        else {
            panic!("{name} is not an enumeration");
        };
        let numbered = enumeration_type.items.iter().zip(1..);
        let value: c_int =
            numbered.filter(|((name, _), _)| name == item).map(|(_, i)| i).next().expect("an item");
        self.ok(c!(self, fmi2SetInteger(self.component, &reference, 1, &value)));
    }

    /// Sets a String variable to a value.
    pub fn set_string(&self, name: &str, value: &CStr) -> Status {
        let value = value.as_ptr();
        c!(self, fmi2SetString(self.component, &self.fmu.reference(name), 1, &value))
    }

    /// Performs a step with `fmi2DoStep`.
    pub fn step(&self, point: f64, size: f64) -> Status {
        c!(self, fmi2DoStep(self.component, point, size, 1))
    }

    /// Returns the bits of the variables, read with one call per type.
    pub fn bits(&self, references: &[u32]) -> Bits {
        let variables = &self.fmu.description.variables;
        let mut bits = vec![0; references.len()];
        let places_of = |is_chosen: fn(&VariableKind) -> bool| -> (Vec<usize>, Vec<u32>) {
            let numbered = references.iter().copied().enumerate();
            numbered
                .filter(|&(_, reference)| is_chosen(&variables[reference as usize].kind))
                .unzip()
        };
        let (places, list) = places_of(|kind| matches!(kind, VariableKind::Real { .. }));
        let mut reals = vec![0.0; list.len()];
        self.ok(c!(
            self,
            fmi2GetReal(self.component, list.as_ptr(), list.len(), reals.as_mut_ptr())
        ));
        for (&place, value) in places.iter().zip(reals) {
            bits[place] = value.to_bits();
        }
        let (places, list) = places_of(|kind| {
            matches!(kind, VariableKind::Integer { .. } | VariableKind::Enumeration { .. })
        });
        let mut integers = vec![0; list.len()];
        self.ok(c!(
            self,
            fmi2GetInteger(self.component, list.as_ptr(), list.len(), integers.as_mut_ptr())
        ));
        for (&place, value) in places.iter().zip(integers) {
            bits[place] = value as u64;
        }
        let (places, list) = places_of(|kind| matches!(kind, VariableKind::Boolean { .. }));
        let mut booleans = vec![0; list.len()];
        self.ok(c!(
            self,
            fmi2GetBoolean(self.component, list.as_ptr(), list.len(), booleans.as_mut_ptr())
        ));
        for (&place, value) in places.iter().zip(booleans) {
            bits[place] = value as u64;
        }
        let (places, list) = places_of(|kind| matches!(kind, VariableKind::String { .. }));
        let mut texts = vec![null(); list.len()];
        self.ok(c!(
            self,
            fmi2GetString(self.component, list.as_ptr(), list.len(), texts.as_mut_ptr())
        ));
        for (&place, text) in places.iter().zip(texts) {
            // SAFETY: the call succeeded, so the text is NUL-terminated and lives until the next
            // fmi2GetString.
            bits[place] = unsafe { CStr::from_ptr(text) }
                .to_bytes()
                .iter()
                .fold(7, |sum: u64, &byte| sum.wrapping_mul(257).wrapping_add(u64::from(byte)));
        }
        bits
    }

    /// Returns the first variable whose value is none: not finite, no item of its enumeration, or
    /// neither true nor false.
    pub fn wrong_value(&self) -> Option<String> {
        let component = self.component;
        let variables = &self.fmu.description.variables;
        for (variable, reference) in variables.iter().zip(0_u32..) {
            let (mut real, mut whole) = (0.0, 0);
            let is_wrong = match &variable.kind {
                VariableKind::Real { .. } => {
                    let status = c!(self, fmi2GetReal(component, &reference, 1, &mut real));
                    status == OK && !real.is_finite()
                }
                VariableKind::Enumeration { enumeration_type, .. } => {
                    let status = c!(self, fmi2GetInteger(component, &reference, 1, &mut whole));
                    status == OK
                        && !(1..).zip(&enumeration_type.items).any(|(item, _)| item == whole)
                }
                VariableKind::Boolean { .. } => {
                    let status = c!(self, fmi2GetBoolean(component, &reference, 1, &mut whole));
                    status == OK && !(0..=1).contains(&whole)
                }
                VariableKind::Integer { .. } | VariableKind::String { .. } => false,
            };
            if is_wrong {
                return Some(format!("{} = {real}, {whole}", variable.name));
            }
        }
        None
    }

    /// Value of the input at a tick of [`Instance::drive`]: small, and different at every tick.
    pub fn input_at(&self, tick: u32) -> f64 {
        let name = &self.fmu.description.variables[self.fmu.input() as usize].name;
        let size = if name == "moment.y" { 1e3 } else { 1e-4 };
        size * f64::from(tick)
    }

    /// Runs co-simulation with the proposed step over `ticks` and a moving input. Returns the
    /// results at each tick, read after the inputs of this tick were set.
    pub fn drive(&self, ticks: std::ops::Range<u32>) -> Vec<Bits> {
        let h = self.fmu.description.default_experiment.step;
        let (input, results) = (self.fmu.input(), self.fmu.results());
        let mut rows = vec![];
        for tick in ticks {
            self.ok(self.set_real(input, self.input_at(tick)));
            rows.push(self.bits(&results));
            self.ok(self.step(f64::from(tick) * h, h));
        }
        rows
    }

    /// Runs model exchange with Euler steps of the proposed length, each from event mode to event
    /// mode. Returns the results at each tick.
    pub fn integrate(&self, ticks: std::ops::Range<u32>) -> Vec<Bits> {
        let h = self.fmu.description.default_experiment.step;
        let n = self.fmu.description.states().len();
        let (mut x, mut derivatives) = (vec![0.0; n], vec![0.0; n]);
        let mut indicators = vec![0.0; self.fmu.description.event_indicators];
        let (component, input, results) = (self.component, self.fmu.input(), self.fmu.results());
        let mut rows = vec![];
        for tick in ticks {
            self.ok(self.set_real(input, self.input_at(tick)));
            let mut info = EventInfo::default();
            self.ok(c!(self, fmi2NewDiscreteStates(component, &mut info)));
            assert_eq!((info.new_discrete_states_needed, info.terminate_simulation), (0, 0));
            self.ok(c!(self, fmi2EnterContinuousTimeMode(component)));
            self.ok(c!(self, fmi2GetContinuousStates(component, x.as_mut_ptr(), n)));
            self.ok(c!(self, fmi2GetDerivatives(component, derivatives.as_mut_ptr(), n)));
            for (x, derivative) in x.iter_mut().zip(&derivatives) {
                *x += h * derivative;
            }
            self.ok(c!(self, fmi2SetTime(component, f64::from(tick + 1) * h)));
            self.ok(c!(self, fmi2SetContinuousStates(component, x.as_ptr(), n)));
            self.ok(c!(
                self,
                fmi2GetEventIndicators(component, indicators.as_mut_ptr(), indicators.len())
            ));
            let (mut event, mut end) = (-1, -1);
            self.ok(c!(self, fmi2CompletedIntegratorStep(component, 1, &mut event, &mut end)));
            self.ok(c!(self, fmi2EnterEventMode(component)));
            let mut row = self.bits(&results);
            row.extend(indicators.iter().map(|indicator| indicator.to_bits()));
            rows.push(row);
        }
        rows
    }

    /// Saves the state; the handle is freed with the instance.
    pub fn save(&self) -> interface::FmuState {
        let mut state = null_mut();
        self.ok(c!(self, fmi2GetFMUstate(self.component, &mut state)));
        assert!(!state.is_null());
        state
    }

    /// Returns to a saved state.
    #[track_caller]
    pub fn restore(&self, state: interface::FmuState) {
        self.ok(c!(self, fmi2SetFMUstate(self.component, state)));
    }

    /// Returns the present state as bytes.
    pub fn serialize(&self) -> Vec<u8> {
        let mut state = self.save();
        let mut size = 0;
        self.ok(c!(self, fmi2SerializedFMUstateSize(self.component, state, &mut size)));
        let mut bytes = vec![0u8; size];
        self.ok(c!(
            self,
            fmi2SerializeFMUstate(self.component, state, bytes.as_mut_ptr().cast(), size)
        ));
        self.ok(c!(self, fmi2FreeFMUstate(self.component, &mut state)));
        bytes
    }

    /// Makes a state from bytes with `fmi2DeSerializeFMUstate`.
    pub fn deserialize(&self, bytes: &[u8]) -> (Status, interface::FmuState) {
        let mut state = null_mut();
        let (from, size) = (bytes.as_ptr().cast(), bytes.len());
        (c!(self, fmi2DeSerializeFMUstate(self.component, from, size, &mut state)), state)
    }
}

/// Whether a variable is a Real that may change at any time.
pub fn is_continuous_real(variable: &Variable) -> bool {
    matches!(variable.kind, VariableKind::Real { .. })
        && variable.variability == Variability::Continuous
}
