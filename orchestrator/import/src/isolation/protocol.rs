//! Messages between the master and the process of an instance.

use crate::exchange::Layout;
use crate::log::LogMessage;
use fmi_master::description::Carrier;
use fmi_master::instance::CallFailure;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// First message: the library to be loaded.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct Setup {
    /// The instance's library.
    pub(super) library: PathBuf,
    pub(super) instance: InstanceArguments,
    /// What model exchange needs; `None` for co-simulation.
    pub(super) exchange: Option<Layout>,
    pub(super) limits: Limits,
    /// Folder of the unpacked archive, if it is one of FMI 3.0, whose description says how its
    /// values are transferred.
    pub(super) fmi3: Option<PathBuf>,
}

/// Arguments of fmi2Instantiate.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct InstanceArguments {
    pub(super) name: String,
    pub(super) guid: String,
    pub(super) resources: String,
}

/// Resources that the process of an instance may use.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(super) struct Limits {
    /// Number of bytes of memory that it may write.
    pub(super) memory: Option<u64>,
    /// Processor time, s.
    pub(super) cpu: Option<u64>,
    /// The only folder that it may write to; `None` if it may write anywhere and use the network.
    pub(super) folder: Option<PathBuf>,
}

/// Answer to [`Setup`].
#[derive(Debug, Serialize, Deserialize)]
pub(super) enum Ready {
    /// The library is loaded and the instance made. The texts say what is wrong with the version of
    /// FMI that the library names, and which limits the system does not support.
    Loaded { version_fault: Option<String>, without: Option<String>, messages: Vec<LogMessage> },
    /// The library cannot be loaded, as the system says.
    Unloadable(String),
    /// The instance refused.
    Refused { reason: String, messages: Vec<LogMessage> },
}

/// Calls that are made one after the other until one fails, and values that are read then.
#[derive(Debug, Default, Serialize, Deserialize)]
pub(super) struct Request {
    pub(super) sets: Vec<Set>,
    pub(super) action: Action,
    /// Lists of variables that are read from now on, in addition to those before.
    pub(super) reads: Vec<List>,
    /// Lists that are read only this time, and in place of the others.
    pub(super) once: Vec<List>,
}

#[derive(Debug, Serialize, Deserialize)]
pub(super) enum Set {
    Real(Vec<u32>, Vec<f64>),
    Integer(Vec<u32>, Vec<i32>),
    Boolean(Vec<u32>, Vec<i32>),
    Text(u32, String),
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) enum Action {
    #[default]
    Read,
    EnterInitialization {
        start: f64,
        stop: f64,
    },
    ExitInitialization,
    DoStep {
        time: f64,
        step: f64,
    },
    Terminate,
    Reset,
    /// Frees the instance and unloads the library; there is an answer, and the process ends.
    Free,
}

impl Action {
    /// Returns whether the lists of variables are read after it.
    pub(super) fn reads(self) -> bool {
        matches!(self, Self::Read | Self::DoStep { .. })
    }

    /// Returns the name of the call, as failures name it.
    pub(super) fn call(self) -> &'static str {
        match self {
            Self::Read => "get",
            Self::EnterInitialization { .. } => "enterInitializationMode",
            Self::ExitInitialization => "exitInitializationMode",
            Self::DoStep { .. } => "doStep",
            Self::Terminate => "terminate",
            Self::Reset => "reset",
            Self::Free => "freeInstance",
        }
    }
}

/// A list of variables of one type.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct List {
    pub(super) carrier: Carrier,
    pub(super) references: Vec<u32>,
}

impl List {
    /// Returns the number of bytes of its values.
    pub(super) fn size(&self) -> usize {
        let each = if self.carrier == Carrier::Real { 8 } else { 4 };
        each * self.references.len()
    }
}

/// Answer to a [`Request`]. Behind it follow the bytes of the values of the lists, if no call has
/// failed.
#[derive(Debug, Default, Serialize, Deserialize)]
pub(super) struct Reply {
    /// Failure of a set call or of the action, after which nothing is read.
    pub(super) failure: Option<CallFailure>,
    /// Lists that could not be read, by their places. Their values have no meaning.
    pub(super) unread: Vec<(usize, CallFailure)>,
    pub(super) messages: Vec<LogMessage>,
}
