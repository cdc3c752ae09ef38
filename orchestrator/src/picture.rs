//! Files of pictures and pages, whose form follows from their names.

use cosim::error::Error;
use std::ffi::OsStr;
use std::path::Path;

/// Returns which of these endings the name of a file has.
///
/// # Errors
/// Returns an error that names the option if it is none of them.
pub(crate) fn ending<'a>(path: &Path, option: &str, endings: &[&'a str]) -> Result<&'a str, Error> {
    let ending = path.extension().and_then(OsStr::to_str).map(str::to_ascii_lowercase);
    let asked = endings.iter().find(|other| ending.as_deref() == Some(**other));
    asked.copied().ok_or_else(|| {
        let (path, endings) = (path.display(), endings.join(" or ."));
        Error::experiment(format!("{option} {path}: the name must end with .{endings}"))
    })
}

/// Checks the name of a picture, if the option `--plot` gives one.
///
/// # Errors
/// Returns an error if the name does not end with `.svg`.
pub(crate) fn check(plot: Option<&Path>) -> Result<(), Error> {
    plot.map_or(Ok(()), |path| ending(path, "--plot", &["svg"]).map(drop))
}
