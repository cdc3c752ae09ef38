//! Simulation time, counted in integer ticks.

use fmu_import::quantity::rounded;

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
            // Ten digits after the point tell the number apart from a whole one, and hide the
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
