//! Comparison of times and ticks: t = start + k · period with an integer k, never accumulated.

/// Instants closer than this are one, relative to their size or absolute in s below 1 s.
pub const TOLERANCE: f64 = 1e-9;

/// The distance (s) below which another instant is the same as `time` (s).
pub fn tolerance(time: f64) -> f64 {
    TOLERANCE * time.abs().max(1.0)
}

/// Number of the last tick at or before `time` (s), counted from 0 at `start`.
pub fn tick(time: f64, start: f64, period: f64) -> i64 {
    ((time - start + tolerance(time)) / period).floor() as i64
}

/// Time of a tick, s.
pub fn tick_time(tick: i64, start: f64, period: f64) -> f64 {
    start + tick as f64 * period
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_found_from_either_side_of_rounding() {
        for k in 0..100_000 {
            let time = tick_time(k, 0.1, 0.04);
            assert_eq!(tick(time, 0.1, 0.04), k);
            assert_eq!(tick(time.next_down(), 0.1, 0.04), k);
            assert_eq!(tick(time + 0.039, 0.1, 0.04), k);
        }
    }

    #[test]
    fn an_accumulated_clock_hits_the_same_ticks() {
        let mut time = 0.0;
        for k in 0..100_000 {
            assert_eq!(tick(time, 0.0, 0.04), k);
            time += 0.04;
        }
    }
}
