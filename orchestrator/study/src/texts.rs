//! Formats numbers for a page.

use crate::results::Numbers;
use sweep::texts::shown;

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
