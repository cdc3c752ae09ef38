//! Reads unpacked archives and makes instances of their libraries, in any process.

use crate::description;
use crate::error::with_causes;
use crate::exchange;
use crate::fmi3::{self, Fmi3Instance, Layout};
use crate::folder::TemporaryFolder;
use crate::functions::Functions;
use crate::log::Log;
use crate::xml;
use fmi_master::description::ModelDescription;
use fmi_master::instance::Instance;
use std::path::Path;
use std::rc::Rc;

/// Reads the description in an unpacked archive.
///
/// # Errors
/// Returns a line that says what is wrong with the file.
pub(crate) fn read_description(folder: &Path) -> Result<ModelDescription, String> {
    let bytes = std::fs::read(folder.join("modelDescription.xml")).map_err(|source| {
        format!("is not an FMU, because modelDescription.xml cannot be read: {source}")
    })?;
    xml::decode(&bytes)
        .and_then(|text| description::parse(&text))
        .map_err(|reason| format!("modelDescription.xml: {reason}"))
}

/// Why there is no instance.
pub(crate) enum Refusal {
    /// The system could not load the library, for this reason.
    Unloadable(String),
    /// The instance refused, for this reason.
    Refused(String),
}

/// Kind of an instance.
pub(crate) enum Kind {
    /// One of FMI 2.0, with what model exchange needs if it is one for model exchange.
    Fmi2(Option<exchange::Layout>),
    /// One of FMI 3.0 for co-simulation.
    Fmi3(Rc<Layout>),
}

/// Loads a library into this process and makes an instance with this identifier and these
/// resources. Returns it with what is wrong with the version of FMI that the library names.
pub(crate) fn loaded(
    file: &Path,
    kind: Kind,
    log: Rc<Log>,
    named: (&str, &str),
    folder: Option<Rc<TemporaryFolder>>,
) -> Result<(Box<dyn Instance>, Option<String>), Refusal> {
    let unloadable = |error: libloading::Error| Refusal::Unloadable(with_causes(&error));
    match kind {
        Kind::Fmi2(layout) => {
            let functions = Functions::load(file, layout.is_some()).map_err(unloadable)?;
            let fault = functions.version_fault();
            let instance = exchange::fmi2::instantiate(functions, log, named, folder, layout);
            Ok((instance.map_err(Refusal::Refused)?, fault))
        }
        Kind::Fmi3(layout) => {
            let functions = fmi3::Functions::load(file).map_err(unloadable)?;
            let fault = functions.version_fault();
            let instance = Fmi3Instance::new(functions, layout, log, named, folder);
            Ok((Box::new(instance.map_err(Refusal::Refused)?), fault))
        }
    }
}
