//! Simulation time, counted in integer ticks.

use crate::quantity::rounded;

/// A clock with the communication points `start + k · step`, which are never accumulated; the last
/// one is `stop` itself.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Clock {
    start: f64,
    step: f64,
    stop: f64,
    ticks: u64,
}

impl Clock {
    /// Creates a clock from `start` to `stop` with steps of `step`, all in s.
    ///
    /// # Errors
    /// Returns an error if `stop` is not a whole, positive number of steps after `start`.
    pub fn new(start: f64, stop: f64, step: f64) -> Result<Self, String> {
        if !(step > 0.0 && step.is_finite()) {
            return Err(format!("step = {step} s must be positive and finite"));
        }
        if !(start.is_finite() && stop.is_finite()) {
            return Err(format!("start = {start} s and stop = {stop} s must be finite"));
        }
        let exact = (stop - start) / step;
        let ticks = exact.round();
        if ticks < 1.0 {
            return Err(format!(
                "stop = {stop} s must be at least one step of {step} s after start = {start} s"
            ));
        }
        if (exact - ticks).abs() > 1e-9 * ticks.max(1.0) {
            // Ten digits after the point distinguish the number from a whole one, and hide the
            // rounding.
            let shown = format!("{exact:.10}");
            let shown = shown.trim_end_matches('0');
            let (below, above) =
                (rounded(start + exact.floor() * step), rounded(start + exact.ceil() * step));
            return Err(format!(
                "stop = {stop} s is {shown} steps of {step} s after start = {start} s: \
                 choose a whole number of steps, {below} s or {above} s"
            ));
        }
        Ok(Self { start, step, stop, ticks: ticks as u64 })
    }

    /// Returns the number of steps from start to stop.
    pub fn ticks(&self) -> u64 {
        self.ticks
    }

    /// Returns the time at a tick, s.
    pub fn time(&self, tick: u64) -> f64 {
        if tick == self.ticks { self.stop } else { self.start + tick as f64 * self.step }
    }

    /// Returns whether an instance that steps at every n-th tick begins a step at this tick; it
    /// must end by the stop time.
    pub fn begins(&self, tick: u64, every: u32) -> bool {
        let every = u64::from(every);
        tick.is_multiple_of(every) && tick + every <= self.ticks
    }

    /// Returns the length of a step of `every` ticks that begins at this tick, s. The last one ends
    /// exactly at the stop time, if an instance adds time and length: whole steps may miss it by
    /// their rounding. Where no sum is the stop time, it ends as shortly before it as possible.
    pub fn length(&self, tick: u64, every: u32) -> f64 {
        let (time, whole) = (self.time(tick), self.whole(every));
        if tick + u64::from(every) != self.ticks || time + whole == self.stop {
            return whole;
        }
        let rest = self.stop - time;
        let by = [rest.next_up(), rest].into_iter().find(|by| time + by <= self.stop);
        by.unwrap_or(rest.next_down())
    }

    /// Returns the length of `every` ticks, s.
    pub fn whole(&self, every: u32) -> f64 {
        f64::from(every) * self.step
    }

    /// Returns the time that an instance whose steps are all whole does not pass: the stop time, or
    /// where the rounding of its last step takes it.
    pub fn end(&self, every: u32) -> f64 {
        let last = self.ticks.saturating_sub(u64::from(every));
        let end = self.time(last) + self.whole(every);
        if self.begins(last, every) { end.max(self.stop) } else { self.stop }
    }

    /// Returns the length of one communication step, s.
    pub fn step(&self) -> f64 {
        self.step
    }

    /// Returns the start time of the simulation, s.
    pub fn start(&self) -> f64 {
        self.start
    }

    /// Returns the stop time of the simulation, s.
    pub fn stop(&self) -> f64 {
        self.stop
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn oracle_a_million_ticks_do_not_drift() {
        let clock = Clock::new(0.0, 40_000.0, 0.04).unwrap();
        assert_eq!(clock.ticks(), 1_000_000);
        assert_eq!(clock.time(1_000_000), 40_000.0);
        for tick in [1_u64, 3, 333_333, 999_999] {
            // The time is the double nearest to the exact rational number tick/25, or a neighbour
            // of it.
            let exact = tick as f64 / 25.0;
            assert!((clock.time(tick) - exact).abs() <= exact * f64::EPSILON);
        }
    }

    #[test]
    fn stops_between_ticks_are_refused_with_both_numbers() {
        let message = Clock::new(0.0, 50.01, 0.04).unwrap_err();
        assert!(
            message.contains("50.01") && message.contains("0.04") && message.contains("50.04"),
            "{message}"
        );
        let message = Clock::new(0.0, 0.35, 0.1).unwrap_err();
        assert!(message.contains("0.3 s or 0.4 s"), "{message}");
        assert!(Clock::new(0.0, 1.0, 0.3).is_err());
        assert!(Clock::new(0.0, 0.3, 0.1).is_ok());
        assert!(Clock::new(1.0, 1.0, 0.1).is_err());
        assert!(Clock::new(2.0, 1.0, 0.1).is_err());
        assert!(Clock::new(0.0, 1.0, 0.0).is_err());
        assert!(Clock::new(0.0, f64::NAN, 0.1).is_err());
    }

    proptest::proptest! {
        /// An instance that adds time and length ends at the stop time, or one place before it
        /// where no sum of two numbers is the stop time. Whole steps never pass the announced stop
        /// time.
        #[test]
        fn oracle_the_last_step_ends_at_the_stop_time(ticks in 1u64..5000, every in 1u32..6, step in 1e-3f64..2.0, start in -50.0f64..50.0, places in 1i32..5) {
            // Numbers as people write them, and their sum with all its digits.
            let short = |value: f64| (value * 10f64.powi(places)).round() / 10f64.powi(places);
            let (start, step) = (short(start), short(step).max(10f64.powi(-places)));
            let written = format!("{:.4}", start + ticks as f64 * step).parse().unwrap();
            let clock = Clock::new(start, written, step).unwrap();
            for tick in (0..ticks).filter(|tick| clock.begins(*tick, every)) {
                let end = clock.time(tick) + clock.length(tick, every);
                let whole = clock.time(tick) + clock.whole(every);
                proptest::prop_assert!(end <= written && whole <= clock.end(every));
                let is_last = tick + u64::from(every) == ticks;
                let misses = if is_last { written - end } else { end - whole };
                proptest::prop_assert!(misses.abs() <= written.abs().max(start.abs()) * f64::EPSILON / 2.0);
                proptest::prop_assert!(!is_last || start.abs() > 0.5 * written.abs() || end == written);
            }
        }

        #[test]
        fn whole_numbers_of_steps_are_taken_exactly(ticks in 1u64..2_000_000, step in 1e-4f64..10.0, start in -10.0f64..10.0) {
            let stop = start + ticks as f64 * step;
            let clock = Clock::new(start, stop, step).unwrap();
            proptest::prop_assert_eq!(clock.ticks(), ticks);
            proptest::prop_assert_eq!(clock.time(0), start);
            proptest::prop_assert_eq!(clock.time(ticks), stop);
            proptest::prop_assert!(clock.time(ticks - 1) < stop);
        }
    }
}
