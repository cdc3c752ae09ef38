//! Loading of a built library to ask it for the descriptions of its FMUs.
#![allow(unsafe_code)]

use crate::{Error, ModelDescription};
use std::ffi::{CStr, c_char};
use std::path::Path;

/// Returns the descriptions of all FMUs in the library at `path`, in the order in which it exports
/// them.
///
/// The library must be built with `fmi-export`: `fmu_model_descriptions` returns a NUL-terminated
/// JSON list that the caller gives back to `fmu_free_model_descriptions`.
///
/// # Errors
/// Reports a file that cannot be opened, lacks one of the two functions, or does not return such a
/// list.
pub fn descriptions(path: &Path) -> Result<Vec<ModelDescription>, Error> {
    let lacking = |problem: String| Error::NoDescriptions { path: path.to_owned(), problem };
    // The system would search for a bare file name on its library path.
    let file =
        path.canonicalize().map_err(|source| Error::File { path: path.to_owned(), source })?;
    // SAFETY: opening runs the library's initializers. The user named the library as one to be
    // opened, and so vouches that they are sound.
    let library = unsafe { libloading::Library::new(&file) }
        .map_err(|source| Error::Open { path: path.to_owned(), source })?;
    // SAFETY: the type is that of the function which export_fmus! defines under this name.
    let describe =
        unsafe { library.get::<unsafe extern "C" fn() -> *mut c_char>(c"fmu_model_descriptions") }
            .map_err(|_| lacking("no function fmu_model_descriptions".into()))?;
    // SAFETY: the type is that of the function which export_fmus! defines under this name.
    let free =
        unsafe { library.get::<unsafe extern "C" fn(*mut c_char)>(c"fmu_free_model_descriptions") }
            .map_err(|_| lacking("no function fmu_free_model_descriptions".into()))?;
    // SAFETY: the function takes no arguments and has no preconditions, and the library is still
    // loaded.
    let text = unsafe { describe() };
    if text.is_null() {
        return Err(lacking("fmu_model_descriptions failed".into()));
    }
    // SAFETY: `text` is not null, and it is NUL-terminated and unchanged until it is freed below.
    let json = unsafe { CStr::from_ptr(text) }.to_bytes().to_vec();
    // SAFETY: the pointer came from `describe` of the same library and is given back only once.
    unsafe { free(text) };
    serde_json::from_slice(&json).map_err(|error| lacking(error.to_string()))
}
