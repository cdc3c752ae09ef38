//! Thins curves to the points that the pixels of a picture can show.

use std::ops::Range;

/// Number of pixel columns for which a curve keeps its smallest and its largest value.
const COLUMNS: usize = 1000;
/// Number of rows that are all shown, and of parts of a longer run of which some rows are.
const FRAMES: usize = 1500;
const PARTS: usize = 375;

/// Returns the rows of each pixel column; `None` if all rows can be kept.
fn columns(rows: usize) -> Option<impl Iterator<Item = Range<usize>>> {
    let edge = move |column: usize| column * rows / COLUMNS;
    (rows > 2 * COLUMNS).then(|| (0..COLUMNS).map(move |column| edge(column)..edge(column + 1)))
}

/// Returns the times of the values that [`values`] keeps.
pub(crate) fn times(time: &[f64]) -> Vec<f64> {
    let Some(columns) = columns(time.len()) else { return time.to_vec() };
    columns.flat_map(|rows| [time[rows.start], time[rows.end - 1]]).collect()
}

/// Returns the smallest and the largest value of each pixel column, in the order in which they
/// occur; all values if they are few.
pub(crate) fn values(values: &[f64]) -> Vec<f64> {
    let Some(columns) = columns(values.len()) else { return values.to_vec() };
    let extremes = |rows: Range<usize>| {
        let rank = |row: &usize| values[*row];
        let finite = || rows.clone().filter(|row| values[*row].is_finite());
        let by = |a: &usize, b: &usize| rank(a).total_cmp(&rank(b));
        match (finite().min_by(by), finite().max_by(by)) {
            (Some(low), Some(high)) => [values[low.min(high)], values[low.max(high)]],
            _ => [f64::NAN; 2],
        }
    };
    columns.flat_map(extremes).collect()
}

/// Returns the rows at which a vehicle is shown: of each even part of a run the first row and those
/// at which one of these quantities is largest, and the last row of the run.
pub(crate) fn frames(rows: usize, quantities: &[Vec<f64>]) -> Vec<usize> {
    let stride = if rows <= FRAMES { 1 } else { rows.div_ceil(PARTS) };
    let mut frames = Vec::new();
    for first in (0..rows).step_by(stride) {
        let part = first..rows.min(first + stride);
        let largest = |values: &Vec<f64>| {
            let later = |most: usize, row| if values[row] > values[most] { row } else { most };
            part.clone().filter(|row| values[*row].is_finite()).reduce(later)
        };
        frames.push(first);
        frames.extend(quantities.iter().filter_map(largest));
    }
    frames.extend(rows.checked_sub(1));
    frames.sort_unstable();
    frames.dedup();
    frames
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_short_curve_keeps_every_value() {
        let short: Vec<f64> = (0..2000).map(f64::from).collect();
        assert_eq!(values(&short), short);
        assert_eq!(times(&short), short);
    }

    #[test]
    fn a_peak_of_one_row_is_kept_and_gaps_stay_gaps() {
        let mut long = vec![0.0; 123_457];
        long[77_777] = 9.0;
        long[77_778] = -9.0;
        long[..500].fill(f64::NAN);
        let thinned = values(&long);
        assert_eq!(thinned.len(), 2 * COLUMNS);
        let peak = thinned.iter().position(|value| *value == 9.0).unwrap();
        assert_eq!(thinned[peak + 1], -9.0, "in the order in which they occur");
        assert!(thinned[0].is_nan() && !thinned[20].is_nan());
        let time: Vec<f64> = (0..long.len()).map(|row| row as f64).collect();
        let times = times(&time);
        assert!(times.is_sorted() && times.len() == thinned.len());
        assert!((times[peak] - 77_777.0).abs() < 124.0);
        assert_eq!(times.last(), time.last());
    }

    #[test]
    fn frames_have_the_ends_of_a_run_and_every_peak_of_one_row() {
        assert_eq!(frames(0, &[]), [0_usize; 0]);
        assert_eq!(frames(3, &[]), [0, 1, 2]);
        let (mut rate, mut lost) = (vec![1.0; 100_001], vec![0.0; 100_001]);
        rate[..300].fill(f64::NAN);
        (rate[77_777], lost[77_778], lost[5]) = (9.0, 1.0, 1.0);
        let many = frames(100_001, &[rate, lost]);
        assert!(many.len() <= PARTS + 5 && many.is_sorted());
        assert!([0, 5, 77_777, 77_778, 100_000].iter().all(|row| many.contains(row)));
    }
}
