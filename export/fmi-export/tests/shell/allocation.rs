//! Test that a step and the calls around it allocate no memory.
#![allow(unsafe_code)]

use crate::counting::COUNT;
use crate::{fmi2, lag};
use fmi_export::types::FmiStatus;
use std::ffi::CString;
use std::ptr::null;

#[test]
fn a_step_allocates_nothing() {
    let guid = CString::new(fmi_export::describe::<lag::Lag>().guid()).unwrap();
    let references = [9u32, 10, 12, 13];
    let mut values = [0.0; 4];
    // SAFETY: every pointer is null or points to valid memory for the duration of its call.
    unsafe {
        let c = fmi2::fmi2Instantiate(c"it".as_ptr(), 1, guid.as_ptr(), null(), null(), 0, 0);
        assert!(!c.is_null());
        let mut look = || fmi2::fmi2GetReal(c, references.as_ptr(), 4, values.as_mut_ptr());
        // A reset keeps the room that the first steps need.
        for _ in 0..2 {
            assert_eq!(fmi2::fmi2EnterInitializationMode(c), FmiStatus::Ok);
            assert_eq!(fmi2::fmi2ExitInitializationMode(c), FmiStatus::Ok);
            // The first calculation may enlarge buffers that are kept.
            assert_eq!(look(), FmiStatus::Ok);
            let before = COUNT.get();
            for k in 0..10 {
                assert_eq!(fmi2::fmi2SetReal(c, &9, 1, &f64::from(k)), FmiStatus::Ok);
                assert_eq!(fmi2::fmi2SetRealInputDerivatives(c, &9, 1, &1, &0.5), FmiStatus::Ok);
                assert_eq!(fmi2::fmi2DoStep(c, f64::from(k) * 0.1, 0.1, 1), FmiStatus::Ok);
                assert_eq!(look(), FmiStatus::Ok);
            }
            assert_eq!(COUNT.get(), before);
            // A reset allocates, which shows that the counter works.
            assert_eq!(fmi2::fmi2Reset(c), FmiStatus::Ok);
            assert!(COUNT.get() > before);
        }
        fmi2::fmi2FreeInstance(c);
    }
}
