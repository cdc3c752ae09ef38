//! A step and the calls around it allocate nothing.
#![allow(unsafe_code, clippy::borrow_as_ptr)]

#[path = "../examples/lag/model.rs"]
#[allow(unreachable_pub)]
mod lag;

use fmi2_export::types::Status;
use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::ffi::CString;
use std::ptr::null;

fmi2_export::export_fmus!(lag::Lag);

thread_local! {
    static COUNT: Cell<usize> = const { Cell::new(0) };
}

/// The system's allocator, counting per thread.
struct Counting;

// SAFETY: everything is passed on to the system's allocator.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        COUNT.set(COUNT.get() + 1);
        // SAFETY: the caller's promise is passed on.
        unsafe { System.alloc(layout) }
    }
    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: the caller's promise is passed on.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

#[test]
fn a_step_allocates_nothing() {
    let guid = CString::new(fmi2_export::describe::<lag::Lag>().guid()).unwrap();
    let references = [9u32, 10, 12, 13];
    let mut values = [0.0; 4];
    // SAFETY: all pointers are null or valid during their calls.
    unsafe {
        let c = fmi2::fmi2Instantiate(c"it".as_ptr(), 1, guid.as_ptr(), null(), null(), 0, 0);
        assert!(!c.is_null());
        assert_eq!(fmi2::fmi2EnterInitializationMode(c), Status::Ok);
        assert_eq!(fmi2::fmi2ExitInitializationMode(c), Status::Ok);
        // The first calculation may grow what it keeps.
        assert_eq!(fmi2::fmi2GetReal(c, references.as_ptr(), 4, values.as_mut_ptr()), Status::Ok);
        let before = COUNT.get();
        for k in 0..10 {
            assert_eq!(fmi2::fmi2SetReal(c, &9, 1, &f64::from(k)), Status::Ok);
            assert_eq!(fmi2::fmi2SetRealInputDerivatives(c, &9, 1, &1, &0.5), Status::Ok);
            assert_eq!(fmi2::fmi2DoStep(c, f64::from(k) * 0.1, 0.1, 1), Status::Ok);
            assert_eq!(fmi2::fmi2GetReal(c, references.as_ptr(), 4, values.as_mut_ptr()), Status::Ok);
        }
        assert_eq!(COUNT.get(), before);
        // The counter counts.
        assert_eq!(fmi2::fmi2Reset(c), Status::Ok);
        assert!(COUNT.get() > before);
        fmi2::fmi2FreeInstance(c);
    }
}
