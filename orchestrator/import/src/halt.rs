//! Requests to end the work of a thread's instances within their steps, where a step may last.

use fmi_master::instance::{CallFailure, Outcome};
use std::cell::RefCell;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

thread_local! {
    static SIGNAL: RefCell<Arc<AtomicUsize>> = RefCell::default();
}

/// Watches a number from now on, which is no longer 0 when the work is to end.
pub fn watch(signal: &Arc<AtomicUsize>) {
    SIGNAL.set(Arc::clone(signal));
}

/// Returns a failure if the work is to end.
pub(crate) fn check() -> Outcome {
    if SIGNAL.with_borrow(|signal| signal.load(Ordering::Relaxed)) == 0 {
        return Ok(());
    }
    Err(CallFailure::new("doStep", "the run was asked to end"))
}
