//! Protects an experiment from instances that crash, never answer, or do harm.

use fmu_import::isolation::Closing;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::time::Duration;

/// The process of a run's instances and its limits. Keys that are left out keep their defaults.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, JsonSchema, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Protection {
    /// Run the instances in a closed process (true), or in that of the program (false). By default
    /// the process is closed unless all FMUs are this project's own and lie beside the program, or
    /// in a folder that the command line names. Only Linux can close a process.
    pub isolate: Option<bool>,
    /// Time within which an instance in a closed process must answer each call, s [default: 60].
    pub call_timeout: Option<f64>,
    /// Memory that a closed process may write, MiB; 0 means no limit [default: 4096].
    pub memory: Option<u64>,
    /// Processor time that a closed process may take, s [default: no limit].
    pub cpu: Option<u64>,
}

impl Protection {
    /// Checks that the limits are in their ranges.
    ///
    /// # Errors
    /// Returns a line that names the value if one is not.
    pub(crate) fn check(&self) -> Result<(), String> {
        match (self.call_timeout, self.cpu) {
            (Some(seconds), _) if !(1e-3..=1e6).contains(&seconds) => {
                Err(format!("call_timeout = {seconds}: it must be from 0.001 to 1e6 s"))
            }
            (_, Some(0)) => Err("cpu = 0: it must be at least 1 s".into()),
            _ => Ok(()),
        }
    }

    /// Returns the keys that have an effect on a closed process only and are given.
    pub(crate) fn limits(&self) -> impl Iterator<Item = &'static str> {
        let keys = [
            ("call_timeout", self.call_timeout.is_some()),
            ("memory", self.memory.is_some()),
            ("cpu", self.cpu.is_some()),
        ];
        keys.into_iter().filter(|(_, is_given)| *is_given).map(|(key, _)| key)
    }

    /// Returns the limits that a closed process gets.
    pub(crate) fn closing(&self) -> Closing {
        let usual = Closing::default();
        let timeout = self.call_timeout.map(Duration::from_secs_f64);
        let memory = match self.memory {
            None => usual.memory,
            Some(0) => None,
            Some(mib) => Some(mib.saturating_mul(1 << 20)),
        };
        let call_timeout = timeout.unwrap_or(usual.call_timeout);
        Closing { call_timeout, memory, cpu: self.cpu, ..usual }
    }
}
