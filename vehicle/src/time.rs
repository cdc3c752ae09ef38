//! Comparison of times and ticks. The time of a tick is start + k · period with an integer k and is
//! never accumulated.

use crate::error::Error;

/// Instants closer than this count as equal: relative to their size, or in s for times below 1 s.
pub const TOLERANCE: f64 = 1e-9;
/// Instants further apart than this (s) never count as equal, however large they are.
const LONGEST: f64 = 1e-4;
/// An instant and a tick further apart than this fraction of the period never count as equal.
const SHARE_OF_PERIOD: f64 = 0.1;
/// Rounding error of times, relative to their size.
const ROUNDING: f64 = 4.0 * f64::EPSILON;

/// Distance (s) within which another instant counts as equal to `time` (s).
pub fn tolerance(time: f64) -> f64 {
    (TOLERANCE * time.abs().max(1.0)).min(LONGEST).max(ROUNDING * time.abs())
}

/// Distance (s) within which a tick, one every `period` (s), counts as being at `time` (s).
/// Importers accumulate time, so the distance grows with it, but never so far that one tick is
/// taken for the next.
pub fn tick_tolerance(time: f64, period: f64) -> f64 {
    (TOLERANCE * time.abs().max(1.0)).min(SHARE_OF_PERIOD * period)
}

/// Refuses an experiment that starts at a time whose rounding error is as large as the tolerance of
/// ticks.
///
/// # Errors
/// Names the start time and the period.
pub fn check_resolution(start: f64, period: f64) -> Result<(), Error> {
    let latest = SHARE_OF_PERIOD * period / ROUNDING;
    if start.abs() <= latest {
        return Ok(());
    }
    let problem = format!(
        "= {start} s is too large to tell apart ticks with a period of {period} s; start between -{latest:.1e} s and {latest:.1e} s"
    );
    Err(Error::parameter("start time", problem))
}

/// Number of the last tick at or before `time` (s), counted from 0 at `start`.
pub fn tick(time: f64, start: f64, period: f64) -> i64 {
    ((time - start + tick_tolerance(time, period)) / period).floor() as i64
}

/// Time of the tick with this number, s.
pub fn tick_time(tick: i64, start: f64, period: f64) -> f64 {
    start + tick as f64 * period
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_found_from_either_side_of_rounding_at_unix_time_too() {
        let late = [1e-4, 1e-3, 0.01, 0.04, 0.2].map(|period| (1.7e9, period, 0.85));
        for (start, period, share) in late.into_iter().chain([(0.1, 0.04, 0.975)]) {
            check_resolution(start, period).unwrap();
            for k in 0..100_000 {
                let time = tick_time(k, start, period);
                assert_eq!(tick(time, start, period), k);
                assert_eq!(tick(time.next_down(), start, period), k);
                assert_eq!(tick(time + share * period, start, period), k, "{period}");
            }
        }
    }
}
