//! Numbers formatted for readers.

/// Formats a share as percent.
pub fn percent(share: f64) -> String {
    format!("{} %", short(100.0 * share))
}

/// Formats a number with four significant digits.
pub fn short(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return format!("{value}");
    }
    let text = if (1e-3..1e6).contains(&value.abs()) {
        let digits = (3 - value.abs().log10().floor() as i32).max(0) as usize;
        trimmed(value, digits)
    } else {
        format!("{value:.3e}")
    };
    text.replace('-', "−")
}

/// Formats a number with at most so many digits after the point.
pub fn trimmed(value: f64, digits: usize) -> String {
    let text = format!("{value:.digits$}");
    if text.contains('.') {
        text.trim_end_matches('0').trim_end_matches('.').to_string()
    } else {
        text
    }
}
