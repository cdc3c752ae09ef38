//! Opens `.fmu` archives and makes co-simulation units of them, through `fmi-rs`.

use crate::archive;
use crate::description::ModelDescription;
use crate::error::{Error, UnitFailure};
use crate::unit::{CoSimulationUnit, Outcome};
use fmi_rs::fmi2::log::Logger;
use fmi_rs::fmi2::types::{fmi2Status, fmi2StatusKind, fmi2True};
use fmi_rs::fmi2::{CS, FMU2, PLATFORM};
use std::path::{Path, PathBuf};
use std::rc::Rc;
use std::sync::{Arc, Mutex, PoisonError};
use tempfile::TempDir;

/// An unpacked archive. Several units can be made of it.
pub struct Fmu {
    /// Where the archive is.
    pub path: PathBuf,
    /// What it says of itself.
    pub description: ModelDescription,
    folder: Rc<TempDir>,
}

impl Fmu {
    /// Unpacks an archive and reads its description.
    ///
    /// # Errors
    /// If the archive is unsafe or broken, or no FMI 2.0 FMU.
    pub fn open(path: &Path) -> Result<Self, Error> {
        let refuse = |message: String| Error::Fmu { path: path.to_path_buf(), message };
        let folder = archive::unpack(path)?;
        let text = std::fs::read_to_string(folder.path().join("modelDescription.xml"))
            .map_err(|source| refuse(format!("is no FMU, modelDescription.xml cannot be read: {source}")))?;
        let description = ModelDescription::parse(&text)
            .map_err(|reason| refuse(format!("modelDescription.xml: {reason}")))?;
        Ok(Self { path: path.to_path_buf(), description, folder: Rc::new(folder) })
    }

    /// The platforms there are binaries for, in FMI's names.
    pub fn platforms(&self) -> Vec<String> {
        let mut platforms: Vec<String> = std::fs::read_dir(self.folder.path().join("binaries"))
            .into_iter()
            .flatten()
            .flatten()
            .filter(|entry| entry.path().is_dir())
            .map(|entry| entry.file_name().to_string_lossy().into_owned())
            .collect();
        platforms.sort();
        platforms
    }

    /// Loads the library and makes a co-simulation unit called `name`.
    ///
    /// # Errors
    /// If the FMU has no binary for this platform or offers no co-simulation, if the library cannot be loaded, or if the
    /// FMU refuses.
    pub fn instantiate(&self, name: &str) -> Result<FmuUnit, Error> {
        let refuse = |message: String| Error::Fmu { path: self.path.clone(), message };
        let interface = self
            .description
            .co_simulation
            .as_ref()
            .ok_or_else(|| refuse("offers no co-simulation".into()))?;
        let platforms = self.platforms();
        if !platforms.iter().any(|platform| platform == PLATFORM) {
            let offered = if platforms.is_empty() { "none".into() } else { platforms.join(", ") };
            return Err(refuse(format!("has no binary for {PLATFORM}, only for: {offered}")));
        }

        let log = Arc::new(Log { component: name.to_string(), last: Mutex::default() });
        let unit = FMU2::<CS>::new(
            self.folder.path(),
            &interface.model_identifier,
            name,
            &self.description.guid,
            false,
            true,
            false,
            Arc::clone(&log) as Arc<dyn Logger>,
            !interface.has("canNotUseMemoryManagementFunctions"),
        )
        .map_err(|source| {
            let message = log.take().unwrap_or_else(|| source.to_string());
            refuse(format!("the component \"{name}\" could not be made of it: {message}"))
        })?;
        Ok(FmuUnit { unit, log, _folder: Rc::clone(&self.folder) })
    }
}

/// Passes an FMU's log messages on to `tracing`, and keeps the last one that tells of trouble.
struct Log {
    component: String,
    last: Mutex<Option<String>>,
}

impl Log {
    fn take(&self) -> Option<String> {
        self.last.lock().unwrap_or_else(PoisonError::into_inner).take()
    }
}

impl Logger for Log {
    fn log_call(&self, _: fmi2Status, _: &str) {}

    fn log_message(&self, status: fmi2Status, category: &str, message: &str) {
        let (component, message) = (&self.component, message.trim_end());
        match status {
            fmi2Status::Ok | fmi2Status::Pending => tracing::info!("{component}: [{category}] {message}"),
            fmi2Status::Warning => tracing::warn!("{component}: [{category}] {message}"),
            fmi2Status::Discard | fmi2Status::Error | fmi2Status::Fatal => {
                tracing::error!("{component}: [{category}] {message}");
                *self.last.lock().unwrap_or_else(PoisonError::into_inner) = Some(message.to_string());
            }
        }
    }
}

/// A unit made of an FMU.
pub struct FmuUnit {
    unit: Arc<FMU2<CS>>,
    log: Arc<Log>,
    _folder: Rc<TempDir>,
}

impl FmuUnit {
    #[inline]
    fn check(&mut self, call: &'static str, status: fmi2Status) -> Outcome {
        match status {
            fmi2Status::Ok | fmi2Status::Warning => Ok(()),
            _ => Err(self.failure(call, status)),
        }
    }

    #[cold]
    fn failure(&mut self, call: &'static str, status: fmi2Status) -> UnitFailure {
        if status == fmi2Status::Fatal {
            // No function of the FMU may be called any more, not even fmi2FreeInstance: keep the instance for ever.
            std::mem::forget(Arc::clone(&self.unit));
        }
        let mut message = self.log.take().unwrap_or_else(|| "no message in its log".into());
        if status == fmi2Status::Discard && call == "doStep" {
            let mut time = 0.0;
            let status = self.unit.getRealStatus(&fmi2StatusKind::LastSuccessfulTime, &mut time);
            if status == fmi2Status::Ok {
                message = format!("{message}; it got as far as t = {time} s");
            }
        }
        if status == fmi2Status::Pending {
            message = "it wants to step asynchronously, which is not supported".into();
        }
        UnitFailure { call, message: format!("{message} ({status:?})") }
    }
}

impl CoSimulationUnit for FmuUnit {
    #[inline]
    fn get_real(&mut self, references: &[u32], values: &mut [f64]) -> Outcome {
        let status = self.unit.getReal(references, values);
        self.check("getReal", status)
    }

    fn get_integer(&mut self, references: &[u32], values: &mut [i32]) -> Outcome {
        let status = self.unit.getInteger(references, values);
        self.check("getInteger", status)
    }

    fn get_boolean(&mut self, references: &[u32], values: &mut [i32]) -> Outcome {
        let status = self.unit.getBoolean(references, values);
        self.check("getBoolean", status)
    }

    #[inline]
    fn set_real(&mut self, references: &[u32], values: &[f64]) -> Outcome {
        let status = self.unit.setReal(references, values);
        self.check("setReal", status)
    }

    fn set_integer(&mut self, references: &[u32], values: &[i32]) -> Outcome {
        let status = self.unit.setInteger(references, values);
        self.check("setInteger", status)
    }

    fn set_boolean(&mut self, references: &[u32], values: &[i32]) -> Outcome {
        let status = self.unit.setBoolean(references, values);
        self.check("setBoolean", status)
    }

    fn set_string(&mut self, reference: u32, value: &str) -> Outcome {
        let status = self.unit.setString(&[reference], &[value]);
        self.check("setString", status)
    }

    fn enter_initialization(&mut self, start: f64, stop: f64) -> Outcome {
        let status = self.unit.setupExperiment(None, start, Some(stop));
        self.check("setupExperiment", status)?;
        let status = self.unit.enterInitializationMode();
        self.check("enterInitializationMode", status)
    }

    fn exit_initialization(&mut self) -> Outcome {
        let status = self.unit.exitInitializationMode();
        self.check("exitInitializationMode", status)
    }

    #[inline]
    fn do_step(&mut self, time: f64, step: f64) -> Outcome {
        let status = self.unit.doStep(time, step, fmi2True);
        self.check("doStep", status)
    }

    fn terminate(&mut self) -> Outcome {
        let status = self.unit.terminate();
        self.check("terminate", status)
    }
}
