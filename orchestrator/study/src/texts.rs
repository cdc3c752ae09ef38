//! Formats numbers for a page.

use crate::results::Numbers;
use sweep::texts::trimmed;

/// Formats a number with as many digits as papers print.
pub(crate) fn shown(value: f64) -> String {
    let magnitude = value.abs();
    let text = if value == 0.0 {
        "0".into()
    } else if !value.is_finite() {
        value.to_string()
    } else if !(1e-3..1e5).contains(&magnitude) {
        format!("{value:.3e}")
    } else {
        // The tables of the papers have four places after the point; small numbers get more, to
        // keep three significant digits.
        let digits =
            (4 - magnitude.log10().floor() as i32).clamp(0, if magnitude < 0.1 { 6 } else { 4 });
        let digits = if magnitude < 0.1 { digits - 2 } else { digits } as usize;
        trimmed(value, digits)
    };
    // A line is not broken at this sign.
    text.replace('-', "−")
}

pub(crate) fn signed(value: f64) -> String {
    let sign = if value < 0.0 { "−" } else { "+" };
    format!("{sign}{}", shown(value.abs()))
}

pub(crate) fn several(numbers: &Numbers) -> String {
    if numbers.0.is_empty() {
        return "–".into();
    }
    let mean = shown(numbers.mean());
    if !numbers.vary() {
        return mean;
    }
    let (low, high) = numbers.extent();
    // With this space a wide table breaks a line before the range, not within it.
    format!("{mean} [{},\u{a0}{}]", shown(low), shown(high))
}

/// Formats fractions as differences in per cent, or as ratios where a percentage says little.
pub(crate) fn difference(fractions: &Numbers) -> String {
    let (low, high) = fractions.extent();
    if low > -0.9 && high < 1.0 {
        return percent(fractions);
    }
    let times = Numbers(fractions.0.iter().map(|fraction| 1.0 + fraction).collect());
    format!("{}\u{a0}times", several(&times))
}

fn percent(fractions: &Numbers) -> String {
    let one = |fraction: f64| {
        let sign = if fraction < 0.0 { "−" } else { "+" };
        format!("{sign}{:.1}", 100.0 * fraction.abs())
    };
    let mean = format!("{}\u{a0}%", one(fractions.mean()));
    if !fractions.vary() {
        return mean;
    }
    let (low, high) = fractions.extent();
    format!("{mean} [{},\u{a0}{}]", one(low), one(high))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_shown_as_papers_print_them() {
        for (value, text) in [
            (1.6055, "1.6055"),
            (0.3552, "0.3552"),
            (116.8, "116.8"),
            (12_345.6, "12346"),
            (0.08511, "0.0851"),
            (0.23413, "0.2341"),
            (2e-5, "2.000e−5"),
            (-0.0123, "−0.0123"),
            (100.0, "100"),
        ] {
            assert_eq!(shown(value), text);
        }
    }

    #[test]
    fn several_numbers_show_their_mean_and_extent() {
        assert_eq!(several(&Numbers(vec![1.0, 1.0])), "1");
        assert_eq!(several(&Numbers(vec![1.0, 2.0])), "1.5 [1,\u{a0}2]");
        assert_eq!(several(&Numbers(Vec::new())), "–");
        assert_eq!(difference(&Numbers(vec![-0.342])), "−34.2\u{a0}%");
        assert_eq!(difference(&Numbers(vec![-0.998])), "0.002\u{a0}times");
        assert_eq!(difference(&Numbers(vec![2.5])), "3.5\u{a0}times");
    }
}
