//! Protects an experiment from instances that crash, never answer, or take all memory.

use super::Component;
use crate::search;
use fmu_import::fmu::Fmu;
use fmu_import::isolation::{self, Isolation};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;
use std::time::Duration;

/// Processes of instances and their limits. Keys that are left out keep their defaults.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, JsonSchema, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Protection {
    /// Run every instance in a process of its own (true), or all of them in this process (false).
    /// By default the instances of this project's FMUs that lie beside the program, or in a folder
    /// that the command line names, share its process.
    pub isolate: Option<bool>,
    /// Time within which an instance in a process of its own must answer each call, s [default:
    /// 60].
    pub call_timeout: Option<f64>,
    /// Memory that an instance in a process of its own may write, MiB; 0 means no limit [default:
    /// 4096].
    pub memory: Option<u64>,
    /// Processor time that an instance in a process of its own may take, s [default: no limit].
    pub cpu: Option<u64>,
    /// Run every instance in a closed process of its own, which can read the system's libraries and
    /// write in the folder of its archive, and reach nothing else. This works on Linux only; other
    /// systems refuse to run instances then.
    pub sandbox: Option<bool>,
}

impl Protection {
    /// Takes over the values that `other` gives.
    pub(super) fn apply(&mut self, other: &Self) {
        self.isolate = other.isolate.or(self.isolate);
        self.call_timeout = other.call_timeout.or(self.call_timeout);
        self.memory = other.memory.or(self.memory);
        self.cpu = other.cpu.or(self.cpu);
        self.sandbox = other.sandbox.or(self.sandbox);
    }

    /// Checks that the time limit of calls is in its range.
    ///
    /// # Errors
    /// Returns a line that names the value if it is not.
    pub fn check(&self) -> Result<(), String> {
        match self.call_timeout {
            Some(seconds) if !(1e-3..=1e6).contains(&seconds) => {
                Err(format!("call_timeout = {seconds}: it must be from 0.001 to 1e6 s"))
            }
            _ => Ok(()),
        }
    }

    /// Returns the keys of `[isolation]` that are given and have no effect, provided that some
    /// instance has a process of its own, or that none has.
    pub(crate) fn idle(&self, has_processes: bool) -> Vec<&'static str> {
        let keys = [
            ("isolate", self.isolate.is_some() && self.sandbox == Some(true)),
            ("call_timeout", self.call_timeout.is_some() && !has_processes),
            ("memory", self.memory.is_some() && !has_processes),
            ("cpu", self.cpu.is_some() && !has_processes),
        ];
        keys.into_iter().filter(|(_, is_idle)| *is_idle).map(|(key, _)| key).collect()
    }

    /// Returns whether a component gets a process of its own. By default FMUs share the process of
    /// the program if they declare that this project's fmu-pack made them, and if they lie in a
    /// folder of the program or in one of `fmu_dirs`, which the command line names: the declaration
    /// alone proves nothing, and others do not write to these folders.
    pub fn isolates(&self, component: &Component, fmu: &Fmu, fmu_dirs: &[PathBuf]) -> bool {
        if fmu.is_lookup_table() {
            return false;
        }
        let asked = component.isolate.or(self.isolate);
        // A sandbox is a process of its own. Where it is impossible, the instance is refused.
        self.sandbox == Some(true)
            || isolation::is_enabled()
                && asked.unwrap_or_else(|| {
                    !(fmu.is_made_by_fmu_pack() && search::is_installed(&fmu.path, fmu_dirs))
                })
    }

    /// Returns the limits that the process of an instance gets.
    pub fn limits(&self) -> Isolation {
        let usual = Isolation::default();
        let timeout = self.call_timeout.map(Duration::try_from_secs_f64);
        Isolation {
            call_timeout: timeout.and_then(Result::ok).unwrap_or(usual.call_timeout),
            memory: match self.memory {
                None => usual.memory,
                Some(0) => None,
                Some(mib) => Some(mib.saturating_mul(1 << 20)),
            },
            cpu: self.cpu,
            sandbox: self.sandbox.unwrap_or(usual.sandbox),
        }
    }
}
