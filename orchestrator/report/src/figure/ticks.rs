//! Where the marks of an axis stand, and what they say.

/// Returns round values within a range, about `count` of them.
pub(super) fn linear(low: f64, high: f64, count: usize) -> Vec<f64> {
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

/// Returns the powers of ten within a range, and 2 and 5 times them if there are few.
pub(super) fn logarithmic(low: f64, high: f64) -> Vec<f64> {
    if !(low > 0.0 && high.is_finite()) {
        return Vec::new();
    }
    let (first, last) = (low.log10().floor() as i32, high.log10().ceil() as i32);
    let multiples: &[f64] = if last - first > 3 { &[1.0] } else { &[1.0, 2.0, 5.0] };
    let all =
        (first..=last).flat_map(|power| multiples.iter().map(move |m| m * 10_f64.powi(power)));
    all.filter(|value| (low..=high).contains(value)).collect()
}

/// Writes a value with the digits that tell the marks of an axis apart, without trailing zeros.
pub(super) fn label(value: f64, range: f64) -> String {
    let decimals = (2.0 - range.abs().max(1e-12).log10().floor()).clamp(0.0, 12.0) as usize;
    let text = format!("{value:.decimals$}");
    let text =
        if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { &text };
    if text == "-0" { "0".into() } else { text.replace('-', "\u{2212}") }
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
    fn labels_are_as_short_as_they_can_be() {
        let labels = [(10.0, 50.0), (0.30000000000000004, 0.5), (-0.0, 1.0), (-2.5, 6.0)];
        assert_eq!(labels.map(|(value, range)| label(value, range)), ["10", "0.3", "0", "−2.5"]);
    }
}
