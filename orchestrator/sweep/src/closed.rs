//! Work on parts in a closed process.

use crate::threads::{self, Worked};
use cosim::interrupt::Interrupt;
use cosim::system::System;
use fmu_import::isolation::{Closed, Closing, Ended};
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::collections::BTreeMap;
use std::ops::ControlFlow;

/// Returns what a closed process of all these systems may use; `None` if none of them is closed.
pub(crate) fn closing(systems: &[System]) -> Option<Closing> {
    systems.iter().filter_map(System::closing).reduce(|mut all, other| {
        all.folders.extend(other.folders);
        all.files.extend(other.files);
        all
    })
}

/// Works on parts as [`threads::on_parts`] does, with threads in a closed process if one is asked
/// for. Results are `kept` in this one. If an instance ends or stops the closed process, the part
/// fails, and another process works on what is left.
#[expect(clippy::too_many_arguments, reason = "each is part of what a part goes through")]
pub(crate) fn on_parts<P: Sync, S, R, K: Send, E>(
    parts: &[P],
    mut count: usize,
    (closing, interrupt): (Option<&Closing>, &Interrupt),
    begin: impl Fn() -> Result<S, E> + Sync,
    work: impl Fn(&mut S, &P) -> Result<R, E> + Sync,
    keep: impl Fn(&P, R) -> Result<K, E> + Sync,
    failed: impl Fn(&P, Ended) -> E,
    goes_on: impl Fn(&E) -> bool + Sync,
) -> Worked<K, E>
where
    R: Serialize + DeserializeOwned,
    E: Serialize + DeserializeOwned + Send,
{
    let Some(closing) = closing else {
        let work = |state: &mut S, part: &P| keep(part, work(state, part)?);
        return threads::on_parts(parts, count, begin, work, goes_on);
    };
    let mut worked = Worked { results: BTreeMap::new(), failures: BTreeMap::new() };
    let mut left: Vec<usize> = (0..parts.len()).collect();
    while !left.is_empty() && interrupt.asked().is_none() {
        let mut is_over = false;
        let begun = Closed::begin(closing, |link| {
            let link = &*link;
            let fly = |state: &mut S, place: &usize| {
                link.begin_part(*place);
                let result = work(state, &parts[*place])?;
                // The supervisor has its own reason not to listen any more.
                let _ = link.send(&(*place, Ok::<R, E>(result)));
                Ok(())
            };
            let done = threads::on_parts(&left, count, &begin, fly, &goes_on);
            for (at, error) in done.failures {
                let _ = link.send(&(left[at], Err::<R, E>(error)));
            }
        });
        let mut there = left.clone();
        let hear = |(place, result): (usize, Result<R, E>)| {
            if let Some(at) = there.iter().position(|left| *left == place) {
                there.swap_remove(at);
                match result.and_then(|result| keep(&parts[place], result)) {
                    Ok(kept) => drop(worked.results.insert(place, kept)),
                    Err(error) => {
                        is_over |= !goes_on(&error);
                        worked.failures.insert(place, error);
                    }
                }
            }
            if is_over { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        };
        let ended = begun.and_then(|mut closed| closed.hear(|| interrupt.signal(), hear));
        left.retain(|place| there.contains(place));
        let Err(ended) = ended else { break };
        let part = match &ended {
            Ended::Failed(last) => last.part.filter(|part| left.contains(part)),
            Ended::Refused(_) => None,
        };
        let is_failed = matches!(ended, Ended::Failed(_)) && interrupt.asked().is_none();
        if part.is_none() && count > 1 && is_failed {
            // Alone, a part shows whether it is the one.
            count = 1;
            continue;
        }
        let Some(place) = part.or(left.first().copied()) else { break };
        let error = failed(&parts[place], ended);
        is_over |= !goes_on(&error);
        worked.failures.insert(place, error);
        left.retain(|other| *other != place);
        if is_over {
            break;
        }
    }
    worked
}
