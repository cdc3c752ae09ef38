//! Comparing curves of different runs, whose times differ.

/// Returns whether a curve passes through all points of another one.
pub(super) fn covers(curve: (&Vec<f64>, &Vec<f64>), other: (&Vec<f64>, &Vec<f64>)) -> bool {
    let magnitude = other
        .1
        .iter()
        .filter(|value| value.is_finite())
        .fold(0.0, |most, value| f64::max(most, value.abs()));
    let passes = |(time, value): (&f64, &f64)| match at(curve.0, curve.1, *time) {
        Some(there) => (there - value).abs() <= 1e-6 * magnitude || !value.is_finite(),
        None => false,
    };
    other.0.iter().zip(other.1).all(passes)
}

/// Returns the value of a curve at a time by linear interpolation; `None` beyond its ends.
fn at(times: &[f64], values: &[f64], time: f64) -> Option<f64> {
    let after = times.partition_point(|other| *other < time);
    let (end, value) = (*times.get(after)?, *values.get(after)?);
    if end == time {
        return Some(value);
    }
    let before = after.checked_sub(1)?;
    let share = (time - times[before]) / (end - times[before]);
    Some(values[before] + share * (value - values[before]))
}
