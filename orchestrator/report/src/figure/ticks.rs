//! Positions of the marks of an axis, and their texts.

/// Number of marks without which nobody can read an axis.
const FEWEST: usize = 3;

/// Returns round values within a range, about `count` of them and at least three.
pub(super) fn linear(low: f64, high: f64, count: usize) -> Vec<f64> {
    // How many there are depends on where the range lies.
    let first = round_values(low, high, count);
    let finer = || [2, 4, 8].into_iter().map(|times| round_values(low, high, times * count.max(1)));
    if first.len() >= FEWEST { first } else { finer().find(|m| m.len() >= FEWEST).unwrap_or(first) }
}

fn round_values(low: f64, high: f64, count: usize) -> Vec<f64> {
    let rough = (high - low) / count.max(1) as f64;
    let decade = 10_f64.powf(rough.log10().floor());
    let step = [1.0, 2.0, 5.0, 10.0].into_iter().find(|one| one * decade >= rough * 0.999);
    let step = step.unwrap_or(10.0) * decade;
    let (first, last) = ((low / step - 1e-9).ceil(), (high / step + 1e-9).floor());
    // A range without an extent has no marks.
    if !(step > 0.0 && last - first < 100.0) {
        return Vec::new();
    }
    let count = (last - first) as i64;
    (0..=count).map(|k| (first + k as f64) * step).collect()
}

/// Returns the powers of ten within a range, with 2 and 5 times them if there are few, or else
/// round values.
pub(super) fn logarithmic(low: f64, high: f64) -> Vec<f64> {
    if !(low > 0.0 && high.is_finite()) {
        return Vec::new();
    }
    let (first, last) = (low.log10().floor() as i32, high.log10().ceil() as i32);
    let multiples: &[f64] = if last - first > 3 { &[1.0] } else { &[1.0, 2.0, 5.0] };
    let all =
        (first..=last).flat_map(|power| multiples.iter().map(move |m| m * 10_f64.powi(power)));
    let marks: Vec<f64> = all.filter(|value| (low..=high).contains(value)).collect();
    if marks.len() >= FEWEST { marks } else { linear(low, high, FEWEST) }
}

/// Largest number of letters of a mark without an exponent.
const LETTERS: usize = 7;

/// Writes the marks of an axis with the digits that distinguish them, without trailing zeros; with
/// exponents if they need many letters otherwise. Marks of a logarithmic axis, which has no
/// `range`, have digits of their own.
pub(super) fn labels(marks: &[f64], range: Option<f64>) -> Vec<String> {
    let marks: Vec<f64> = marks.iter().map(|mark| rounded(*mark, range.unwrap_or(*mark))).collect();
    let plain: Vec<String> = marks.iter().map(f64::to_string).collect();
    let texts = if plain.iter().any(|text| text.len() > LETTERS) {
        let exponent = |mark: &f64| if *mark == 0.0 { "0".into() } else { format!("{mark:e}") };
        marks.iter().map(exponent).collect()
    } else {
        plain
    };
    texts.iter().map(|text| text.replace('-', "\u{2212}")).collect()
}

/// Rounds a mark to a thousandth of the range or so.
fn rounded(mark: f64, range: f64) -> f64 {
    let power = |value: f64| value.abs().log10().floor();
    let digits = power(mark) - power(range) + 2.0;
    // The mark at zero may have been computed with an error.
    if digits.is_nan() || digits < -6.0 {
        return 0.0;
    }
    format!("{mark:.*e}", digits.clamp(0.0, 16.0) as usize).parse().unwrap_or(mark)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn marks_are_round_and_within_the_range() {
        assert_eq!(linear(-0.3, 10.2, 6), [0.0, 2.0, 4.0, 6.0, 8.0, 10.0]);
        assert_eq!(linear(0.0, 0.5, 5), [0.0, 0.1, 0.2, 0.30000000000000004, 0.4, 0.5]);
        let none: [f64; 0] = [];
        assert_eq!(linear(3.0, 3.0, 5), none);
        assert_eq!((logarithmic(0.0, 1.0), linear(0.0, f64::INFINITY, 5)), (vec![], vec![]));
        assert_eq!(logarithmic(0.3, 30.0), [0.5, 1.0, 2.0, 5.0, 10.0, 20.0]);
        assert_eq!(logarithmic(1e-3, 1e2), [1e-3, 1e-2, 1e-1, 1.0, 10.0, 100.0]);
    }

    #[test]
    fn every_axis_has_three_marks() {
        let mut low = -7.3;
        while low < 7.3 {
            for power in -3..4 {
                for count in [2, 3, 5, 8] {
                    let span = 1.37 * 10_f64.powi(power);
                    let marks = linear(low, low + span, count);
                    assert!((3..=4 * count).contains(&marks.len()), "{low} {span}: {marks:?}");
                    let from = low.exp();
                    let marks = logarithmic(from, from * (1.0 + span));
                    assert!((3..=20).contains(&marks.len()), "{from} {span}: {marks:?}");
                }
            }
            low += 0.0917;
        }
    }
}
