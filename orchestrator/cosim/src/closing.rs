//! Work with the instances of a system in a closed process.

use crate::error::Error;
use crate::interrupt::Interrupt;
use crate::settings::is_file;
use crate::system::System;
use fmi_master::settings::SettingValue;
use fmu_import::isolation::{Closed, Closing, Ended};
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::ops::ControlFlow;
use std::path::PathBuf;

impl System {
    /// Returns what the closed process of the instances may use; `None` if they run in this one.
    pub fn closing(&self) -> Option<Closing> {
        let settings = self.components.iter().flat_map(|component| &component.settings);
        let file = |(name, value): (&str, &SettingValue)| match value {
            SettingValue::Text(path) if is_file(name) => Some(PathBuf::from(path)),
            _ => None,
        };
        // A thread that flies cases opens the archives again.
        let archives = self.components.iter().map(|component| component.fmu.path.clone());
        let files = settings.filter_map(|setting| file((&setting.name, &setting.value)));
        let files = files.chain(archives).collect();
        let folders = self.components.iter().filter_map(|component| component.fmu.folder());
        let folders = folders.map(PathBuf::from).collect();
        self.is_closed.then(|| Closing { folders, files, ..self.experiment.isolation.closing() })
    }

    /// Does work with the instances where they are to run: in a closed process, or in this one.
    ///
    /// # Errors
    /// Returns the error of the work, or that of an instance which ends or stops the process.
    pub fn apart<T: Serialize + DeserializeOwned>(
        &self,
        interrupt: &Interrupt,
        work: impl FnOnce() -> Result<T, Error>,
    ) -> Result<T, Error> {
        let Some(closing) = self.closing() else { return work() };
        let mut outcome = None;
        let hear = |message| {
            outcome = Some(message);
            ControlFlow::Continue(())
        };
        let begun = Closed::begin(&closing, |link| {
            let _ = link.send(&work());
        });
        begun
            .and_then(|mut closed| closed.hear(|| interrupt.signal(), hear))
            .map_err(|ended| self.ended(ended, interrupt))?;
        outcome.unwrap_or_else(|| Err(self.ended(Ended::silent(), interrupt)))
    }

    /// Returns the error for a closed process that has ended before its work was done, by itself or
    /// because it was asked to end and did not.
    pub fn ended(&self, ended: Ended, interrupt: &Interrupt) -> Error {
        let (component, time, failure) = match ended {
            Ended::Refused(reason) => {
                return Error::experiment(format!(
                    "{reason}: with --isolate=false it is not closed"
                ));
            }
            Ended::Failed(last) => (last.component, last.time, last.failure),
        };
        let named =
            |name: &String| self.components.iter().find(|component| component.name == *name);
        match component.as_ref().and_then(named) {
            Some(component) if failure.call == "instantiate" => {
                let (name, path) = (&component.name, component.fmu.path.clone());
                let message =
                    format!("the component \"{name}\" failed in instantiate: {}", failure.message);
                fmu_import::error::Error::Fmu { path, message }.into()
            }
            _ => {
                let component = component.unwrap_or_else(|| "an FMU".into());
                Error::Call { component, time, failure }.or(interrupt.asked())
            }
        }
    }
}
