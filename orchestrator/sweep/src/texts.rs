//! Numbers formatted for readers.

/// Formats a share as percent.
pub fn percent(share: f64) -> String {
    format!("{} %", shown(100.0 * share))
}

/// Formats a number with as many digits as papers print.
pub fn shown(value: f64) -> String {
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
        let text = format!("{value:.digits$}");
        let is_fraction = text.contains('.');
        text.trim_end_matches(|c| is_fraction && c == '0').trim_end_matches('.').to_string()
    };
    // A line is not broken at this sign.
    text.replace('-', "−")
}
