//! An instance with its log: life cycle, steps and saved states.

use crate::interface::{Component, FATAL, FmuState, Interface, OK, Status};
use crate::{Fmu, Log, Message, c, ok};
use std::ptr::null_mut;
use std::sync::Arc;

/// An instance with its log. Dropping it frees the instance, whatever its state.
pub struct Instance {
    /// Functions of the library that holds the FMU.
    pub interface: Arc<Interface>,
    /// FMU to which the instance belongs.
    pub fmu: Fmu,
    /// Pointer `fmi2Component` of the instance.
    pub component: Component,
    pub(crate) log: Box<Log>,
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
        ok!(self, fmi2SetupExperiment(0, 0.0, 0.0, 0, 0.0));
        ok!(self, fmi2EnterInitializationMode());
    }

    /// Enters and leaves initialization mode.
    #[must_use]
    pub fn initialized(self) -> Self {
        self.enter_initialization();
        ok!(self, fmi2ExitInitializationMode());
        self
    }

    /// Performs a step with `fmi2DoStep`.
    pub fn step(&self, point: f64, size: f64) -> Status {
        c!(self, fmi2DoStep(self.component, point, size, 1))
    }

    /// Saves the state; the handle is freed with the instance.
    pub fn save(&self) -> FmuState {
        let mut state = null_mut();
        ok!(self, fmi2GetFMUstate(&mut state));
        assert!(!state.is_null());
        state
    }

    /// Returns to a saved state.
    #[track_caller]
    pub fn restore(&self, state: FmuState) {
        ok!(self, fmi2SetFMUstate(state));
    }

    /// Returns the present state as bytes.
    pub fn serialize(&self) -> Vec<u8> {
        let mut state = self.save();
        let mut size = 0;
        ok!(self, fmi2SerializedFMUstateSize(state, &mut size));
        let mut bytes = vec![0u8; size];
        ok!(self, fmi2SerializeFMUstate(state, bytes.as_mut_ptr().cast(), size));
        ok!(self, fmi2FreeFMUstate(&mut state));
        bytes
    }

    /// Makes a state from bytes with `fmi2DeSerializeFMUstate`.
    pub fn deserialize(&self, bytes: &[u8]) -> (Status, FmuState) {
        let mut state = null_mut();
        let (from, size) = (bytes.as_ptr().cast(), bytes.len());
        (c!(self, fmi2DeSerializeFMUstate(self.component, from, size, &mut state)), state)
    }
}
