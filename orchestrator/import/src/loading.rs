//! Reads unpacked archives and makes instances of their libraries, in any process.

use crate::crash::Calling;
use crate::description;
use crate::error::with_causes;
use crate::exchange::{self, ContinuousModel, Exchange};
use crate::fmi3::{self, Fmi3Unit, Layout, StepInstance};
use crate::folder::TemporaryFolder;
use crate::functions::{Functions, Table as _};
use crate::library::FmuInstance;
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

/// An instance, with what is wrong with the version of FMI that its library names.
pub(crate) type Made = (Box<dyn Instance>, Option<String>);

/// Kind of an instance.
pub(crate) struct Kind {
    /// What FMI 3.0 calls the variables; `None` for an instance of FMI 2.0.
    pub(crate) fmi3: Option<Rc<Layout>>,
    /// What model exchange needs; `None` for co-simulation.
    pub(crate) exchange: Option<exchange::Layout>,
}

/// Loads a library into this process and makes an instance with this identifier and these
/// resources, the path of which ends in a separator. `folder` holds the unpacked archive, if it
/// would vanish otherwise.
pub(crate) fn loaded(
    file: &Path,
    kind: Kind,
    log: Rc<Log>,
    named: (&str, &str),
    folder: Option<Rc<TemporaryFolder>>,
) -> Result<Made, Refusal> {
    let unloadable = |error: libloading::Error| Refusal::Unloadable(with_causes(&error));
    let Kind { fmi3, exchange } = kind;
    let exchanges = exchange.is_some();
    // Loading runs code of the library as well.
    let loads = Calling::new(&log, "instantiate");
    if let Some(layout) = fmi3 {
        let functions = fmi3::Functions::load(file, exchanges).map_err(unloadable)?;
        drop(loads);
        let fault = functions.common().version_fault();
        let unit = Fmi3Unit::new(functions, layout, log, named, folder);
        let instance = unit.and_then(|unit| integrated(unit, exchange, StepInstance::new));
        return Ok((instance.map_err(Refusal::Refused)?, fault));
    }
    let functions = Functions::load(file, exchanges).map_err(unloadable)?;
    drop(loads);
    let fault = functions.common().version_fault();
    let unit = FmuInstance::new(functions, log, named, folder);
    let instance = unit.and_then(|unit| integrated(unit, exchange, Ok));
    Ok((instance.map_err(Refusal::Refused)?, fault))
}

/// Adds an integrator to an instance for model exchange, or what an instance for co-simulation
/// needs.
fn integrated<M: ContinuousModel + 'static, I: Instance + 'static>(
    model: M,
    exchange: Option<exchange::Layout>,
    stepped: impl FnOnce(M) -> Result<I, String>,
) -> Result<Box<dyn Instance>, String> {
    Ok(match exchange {
        Some(layout) => Box::new(Exchange::new(model, layout)),
        None => Box::new(stepped(model)?),
    })
}
