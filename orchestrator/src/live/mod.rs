//! A view of the run on the terminal while it is in progress, drawn by a thread of its own.
//!
//! At every communication point the master leaves a copy of the values, unless the view is just
//! reading the last one; it never waits for the view. [`scene`] holds what is shown, [`view`] draws
//! it, and [`log`] keeps messages meanwhile.

pub(crate) mod log;
pub(crate) mod scene;
pub(crate) mod view;

use crate::failure::Failure;
use cosim::error::Error;
use cosim::interrupt::{Interrupt, Request};
use cosim::pacing::pacer::Tally;
use cosim::run::{Observer, Sample};
use cosim_metrics::guarantee::GuaranteeRecord;
use fmu_import::crash;
use ratatui::DefaultTerminal;
use ratatui::crossterm::event::{self, Event, KeyCode, KeyEvent, KeyEventKind, KeyModifiers};
use scene::{Scene, Snapshot};
use std::cell::Cell;
use std::io::{self, IsTerminal, stdout};
use std::process;
use std::rc::Rc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::Duration;
use view::State;

/// Time between two pictures of the view.
const BETWEEN_PICTURES: Duration = Duration::from_millis(66);

/// A live view that is open as long as this value lives. Dropping it restores the terminal, also
/// after a panic.
pub(crate) struct Live {
    snapshot: Arc<Mutex<Snapshot>>,
    tally: Option<Rc<Cell<Tally>>>,
    /// Record of the guarantee. It is followed at every communication point, because the view does
    /// not see them all.
    guarantee: Option<GuaranteeRecord>,
    over: Arc<AtomicBool>,
    thread: Option<JoinHandle<io::Result<()>>>,
}

/// Checks that standard output is a terminal to draw on.
///
/// # Errors
/// Returns an error if standard output is no terminal.
pub(crate) fn check_terminal() -> Result<(), Error> {
    if stdout().is_terminal() {
        return Ok(());
    }
    Err(Error::experiment(
        "--live needs a terminal, but standard output is not one: run the command in a terminal, or leave out --live",
    ))
}

impl Live {
    /// Takes over the terminal and begins to draw. The keys q and Ctrl-C ask the run to end.
    ///
    /// # Errors
    /// Returns an error if there is no terminal to draw on, or if it cannot be prepared.
    pub(crate) fn start(
        scene: Scene,
        tally: Option<Rc<Cell<Tally>>>,
        interrupt: Interrupt,
    ) -> Result<Self, Failure> {
        check_terminal()?;
        let guarantee = scene.guarantee.clone().map(GuaranteeRecord::new);
        let mut live =
            Self { snapshot: Arc::default(), tally, guarantee, over: Arc::default(), thread: None };
        log::hold();
        let terminal = ratatui::try_init()?;
        let (shared, over) = (Arc::clone(&live.snapshot), Arc::clone(&live.over));
        let thread = thread::Builder::new().name("live view".into()).spawn(move || {
            let outcome = show(terminal, scene, &shared, &over, &interrupt);
            ratatui::restore();
            outcome
        })?;
        live.thread = Some(thread);
        Ok(live)
    }
}

impl Observer for Live {
    fn observe(&mut self, sample: &Sample) -> Result<(), Error> {
        if let Some(course) = &mut self.guarantee {
            course.observe(sample)?;
        }
        // The run does not wait for the view. If the view is reading, the copy is left at the next
        // communication point.
        if let Ok(mut snapshot) = self.snapshot.try_lock() {
            snapshot.time = Some(sample.time);
            snapshot.values.clear();
            snapshot.values.extend_from_slice(sample.values);
            snapshot.tally = self.tally.as_ref().map(|tally| tally.get());
            snapshot.guarantee.clone_from(&self.guarantee);
        }
        Ok(())
    }
}

impl Drop for Live {
    fn drop(&mut self) {
        self.over.store(true, Ordering::Relaxed);
        let outcome = self.thread.take().map(JoinHandle::join);
        if outcome.is_none() {
            // The thread could not be started, so the terminal is restored here.
            ratatui::restore();
        }
        log::release();
        match outcome {
            Some(Ok(Err(error))) => tracing::warn!("the live view ended early: {error}"),
            Some(Err(_)) => {
                tracing::warn!("the live view ended early because of a defect in this program");
            }
            _ => {}
        }
    }
}

/// Draws the view until the run is over.
fn show(
    mut terminal: DefaultTerminal,
    scene: Scene,
    shared: &Mutex<Snapshot>,
    over: &AtomicBool,
    interrupt: &Interrupt,
) -> io::Result<()> {
    let mut state = State::new(scene);
    let mut snapshot = Snapshot::default();
    while !over.load(Ordering::Relaxed) {
        snapshot.clone_from(&shared.lock().unwrap_or_else(PoisonError::into_inner));
        state.see(&snapshot);
        terminal.draw(|frame| view::draw(frame, &state))?;
        if event::poll(BETWEEN_PICTURES)?
            && let Event::Key(key) = event::read()?
            && let Some(request) = request(key)
        {
            if interrupt.asked().is_some() {
                // The user asked a second time, because an instance does not return from a call.
                ratatui::restore();
                log::release();
                crash::unwatch();
                process::exit(130);
            }
            interrupt.ask(request);
            state.ending = true;
        }
    }
    Ok(())
}

/// Translates a key into a request. While the view is shown, Ctrl-C is a key and not a signal.
fn request(key: KeyEvent) -> Option<Request> {
    if key.kind != KeyEventKind::Press {
        return None;
    }
    match (key.code, key.modifiers.contains(KeyModifiers::CONTROL)) {
        (KeyCode::Char('c'), true) => Some(Request::INTERRUPT),
        (KeyCode::Char('q'), false) => Some(Request::Quit),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use cosim_metrics::guarantee::GuaranteeSignals;

    #[test]
    fn q_and_control_c_end_the_run() {
        let key = |code, modifiers| request(KeyEvent::new(code, modifiers));
        assert_eq!(key(KeyCode::Char('q'), KeyModifiers::NONE), Some(Request::Quit));
        assert_eq!(key(KeyCode::Char('c'), KeyModifiers::CONTROL), Some(Request::INTERRUPT));
        assert_eq!(key(KeyCode::Char('c'), KeyModifiers::NONE), None);
        let release =
            KeyEvent::new_with_kind(KeyCode::Char('q'), KeyModifiers::NONE, KeyEventKind::Release);
        assert_eq!(request(release), None);
    }

    #[test]
    fn the_run_does_not_wait_while_the_view_reads() {
        let snapshot = Arc::new(Mutex::new(Snapshot { values: vec![0.0], ..Snapshot::default() }));
        let mut live = Live {
            snapshot: Arc::clone(&snapshot),
            tally: None,
            guarantee: Some(GuaranteeRecord::new(GuaranteeSignals::default())),
            over: Arc::default(),
            thread: None,
        };
        let sample = |time, values| Sample { tick: 0, time, last: false, values };
        let reading = snapshot.lock().unwrap();
        live.observe(&sample(1.0, &[7.0])).unwrap();
        live.observe(&sample(1.5, &[0.0])).unwrap();
        assert_eq!(reading.time, None);
        drop(reading);
        live.observe(&sample(2.0, &[7.0])).unwrap();
        let left = snapshot.lock().unwrap().clone();
        assert_eq!((left.time, left.values[0]), (Some(2.0), 7.0));
        // The view did not see the loss, but it is remembered.
        assert_eq!(left.guarantee.unwrap().lost.unwrap().time, 1.5);
        // This test opened no terminal, so there is none to restore.
        std::mem::forget(live);
    }
}
