//! Work on parts with several threads.

use parking_lot::Mutex;
use std::collections::BTreeMap;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;

/// Results of the parts, by their position.
#[derive(Debug)]
pub(crate) struct Worked<R, E> {
    /// Results of the parts that are finished.
    pub results: BTreeMap<usize, R>,
    /// Errors of the parts that failed.
    pub failures: BTreeMap<usize, E>,
}

/// Works on parts in their order. Each thread begins with a state of its own, because instances
/// stay in the thread that made them. After a failure that does not `go_on` no further part is
/// begun; parts that other threads are working on are finished.
pub(crate) fn on_parts<P: Sync, S, R: Send, E: Send>(
    parts: &[P],
    threads: usize,
    begin: impl Fn() -> Result<S, E> + Sync,
    work: impl Fn(&mut S, &P) -> Result<R, E> + Sync,
    goes_on: impl Fn(&E) -> bool + Sync,
) -> Worked<R, E> {
    let next = AtomicUsize::new(0);
    let results: Mutex<BTreeMap<usize, R>> = Mutex::default();
    let failures: Mutex<BTreeMap<usize, E>> = Mutex::default();
    let turn = || {
        let mut state = None;
        loop {
            let place = next.fetch_add(1, Ordering::Relaxed);
            let Some(part) = parts.get(place) else { break };
            let outcome = match &mut state {
                Some(state) => work(state, part),
                none => begin().and_then(|begun| work(none.insert(begun), part)),
            };
            match outcome {
                Ok(result) => {
                    results.lock().insert(place, result);
                }
                Err(error) => {
                    if !goes_on(&error) {
                        next.fetch_max(parts.len(), Ordering::Relaxed);
                    }
                    failures.lock().insert(place, error);
                }
            }
        }
    };
    thread::scope(|scope| {
        for _ in 0..threads.clamp(1, parts.len().max(1)) {
            scope.spawn(turn);
        }
    });
    Worked { results: results.into_inner(), failures: failures.into_inner() }
}
