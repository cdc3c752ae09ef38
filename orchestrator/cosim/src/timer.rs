//! A monotonic clock, and a way to wait for an instant on it.

use std::sync::LazyLock;
use std::time::{Duration, Instant};

/// A clock and a way to sleep until it reaches an instant. Instants are counted from the clock's
/// own origin.
pub trait Timer {
    /// Returns the current instant on the clock.
    fn now(&self) -> Duration;

    /// Sleeps until the instant. It never returns before it.
    fn sleep_until(&self, instant: Duration);
}

/// The system's monotonic clock.
#[derive(Clone, Copy, Debug, Default)]
pub struct Monotonic;

static ORIGIN: LazyLock<Instant> = LazyLock::new(Instant::now);

impl Timer for Monotonic {
    fn now(&self) -> Duration {
        ORIGIN.elapsed()
    }

    fn sleep_until(&self, instant: Duration) {
        while let Some(rest) = instant.checked_sub(self.now()).filter(|rest| !rest.is_zero()) {
            std::thread::sleep(rest);
        }
    }
}

#[cfg(test)]
pub(crate) mod fake {
    use super::{Duration, Timer};
    use std::cell::Cell;

    /// Shows the time that the test sets, and wakes up late by `jitter`.
    #[derive(Debug, Default)]
    pub(crate) struct Fake {
        pub(crate) now: Cell<Duration>,
        pub(crate) jitter: Duration,
    }

    impl Fake {
        pub(crate) fn pass(&self, time: Duration) {
            self.now.set(self.now.get() + time);
        }
    }

    impl Timer for Fake {
        fn now(&self) -> Duration {
            self.now.get()
        }

        fn sleep_until(&self, instant: Duration) {
            self.now.set(self.now.get().max(instant + self.jitter));
        }
    }
}
