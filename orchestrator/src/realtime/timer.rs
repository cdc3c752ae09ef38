//! A monotonic clock that can be waited on.

use std::time::Duration;

/// A clock and a way to sleep until it shows an instant; instants are counted from an origin of its own.
pub trait Timer {
    /// The instant it is now.
    fn now(&self) -> Duration;

    /// Returns not before the instant, and as soon after as the system can.
    fn sleep_until(&self, instant: Duration);
}

/// The system's monotonic clock.
#[derive(Clone, Copy, Debug, Default)]
pub struct Monotonic;

#[cfg(target_os = "linux")]
mod system {
    use super::{Duration, Monotonic, Timer};
    use rustix::thread::{ClockId, Timespec, clock_nanosleep_absolute, set_current_timer_slack};
    use std::num::NonZeroU64;

    impl Timer for Monotonic {
        fn now(&self) -> Duration {
            // The clock starts when the system does: it is never negative.
            Duration::try_from(rustix::time::clock_gettime(ClockId::Monotonic)).unwrap_or_default()
        }

        fn sleep_until(&self, instant: Duration) {
            let Ok(until) = Timespec::try_from(instant) else { return };
            // A signal ends the sleep early.
            while clock_nanosleep_absolute(ClockId::Monotonic, &until) == Err(rustix::io::Errno::INTR) {}
        }
    }

    /// Asks the system not to delay this thread's wake-ups in order to join them with others'.
    pub fn wake_up_sharply() {
        if let Err(error) = set_current_timer_slack(NonZeroU64::new(1)) {
            tracing::debug!("the timer slack stays as it is: {error}");
        }
    }
}

#[cfg(not(target_os = "linux"))]
mod system {
    use super::{Duration, Monotonic, Timer};
    use std::sync::LazyLock;
    use std::time::Instant;

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

    /// Nothing to ask for on this system.
    pub fn wake_up_sharply() {}
}

pub use system::wake_up_sharply;

#[cfg(test)]
pub(crate) mod fake {
    use super::{Duration, Timer};
    use std::cell::Cell;

    /// Shows what it is told to, and wakes up late by `jitter`.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_one_is_woken_before_the_instant() {
        let timer = Monotonic;
        for microseconds in [0, 1, 100, 3000] {
            let instant = timer.now() + Duration::from_micros(microseconds);
            timer.sleep_until(instant);
            assert!(timer.now() >= instant);
        }
        // One that is past.
        timer.sleep_until(Duration::ZERO);
    }
}
