//! Asks a built library for the descriptions of its units.
#![allow(unsafe_code)]

use crate::{Error, ModelDescription};
use std::ffi::{CStr, c_char};
use std::path::Path;

/// Descriptions of all units in the library at `path`, in the order in which it exports them.
///
/// The library is one built with `fmi2-export`: `fmu_model_descriptions` returns a NUL-terminated JSON list that the
/// caller hands back to `fmu_free_model_descriptions`.
///
/// # Errors
/// If the file cannot be opened, lacks one of the two functions, or answers with something else.
pub fn descriptions(path: &Path) -> Result<Vec<ModelDescription>, Error> {
    let lacking = |problem: String| Error::NoDescriptions { path: path.to_owned(), problem };
    // A bare file name would be searched for on the system's library path.
    let file = path.canonicalize().map_err(|source| Error::File { path: path.to_owned(), source })?;
    // SAFETY: initializers of the library run; the user names the library as one to be opened.
    let library = unsafe { libloading::Library::new(&file) }
        .map_err(|source| Error::Open { path: path.to_owned(), source })?;
    // SAFETY: the type is that of the function which export_fmus! defines under this name.
    let describe = unsafe { library.get::<unsafe extern "C" fn() -> *mut c_char>(c"fmu_model_descriptions") }
        .map_err(|_| lacking("no function fmu_model_descriptions".into()))?;
    // SAFETY: as above.
    let free = unsafe { library.get::<unsafe extern "C" fn(*mut c_char)>(c"fmu_free_model_descriptions") }
        .map_err(|_| lacking("no function fmu_free_model_descriptions".into()))?;
    // SAFETY: takes no arguments.
    let text = unsafe { describe() };
    if text.is_null() {
        return Err(lacking("fmu_model_descriptions failed".into()));
    }
    // SAFETY: not null, and NUL-terminated until it is freed below.
    let json = unsafe { CStr::from_ptr(text) }.to_bytes().to_vec();
    // SAFETY: the pointer came from `describe` and is given back once.
    unsafe { free(text) };
    serde_json::from_slice(&json).map_err(|error| lacking(error.to_string()))
}
