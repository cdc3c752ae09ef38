//! Functions that need no instance: the FMUs of a library and its version of the standard.

use crate::model_instance::Export;
use float_environment::in_default;
use std::ffi::{CString, c_char};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::ptr::null_mut;

/// Returns the descriptions of `exports` as a JSON list in memory of this library, or null if that
/// fails.
pub fn fmu_model_descriptions(exports: &[Export]) -> *mut c_char {
    let json = || {
        let descriptions: Vec<_> =
            exports.iter().map(|export| &*export.described().description).collect();
        CString::new(serde_json::to_vec(&descriptions).ok()?).ok()
    };
    let json = in_default(|| catch_unwind(AssertUnwindSafe(json)));
    json.ok().flatten().map_or(null_mut(), CString::into_raw)
}

pub unsafe fn fmu_free_model_descriptions(descriptions: *mut c_char) {
    if !descriptions.is_null() {
        // SAFETY: not null, so it came from `CString::into_raw` in fmu_model_descriptions, and the
        // caller gives it back only once.
        drop(unsafe { CString::from_raw(descriptions) });
    }
}

pub fn fmi2GetTypesPlatform() -> *const c_char {
    c"default".as_ptr()
}

pub fn fmi2GetVersion() -> *const c_char {
    c"2.0".as_ptr()
}
