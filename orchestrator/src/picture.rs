//! Files of pictures, whose form follows from their names.

use cosim::error::Error;
use cosim_report::figure::{Figure, png, svg};
use std::ffi::OsStr;
use std::path::Path;

/// Form of a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Form {
    /// Vectors, for papers.
    Svg,
    /// Pixels.
    Png,
    /// A page with the vehicle in motion, which only recorded runs have.
    Page,
}

impl Form {
    /// Forms of a figure.
    const FIGURE: [Self; 2] = [Self::Svg, Self::Png];
    /// Forms of recorded runs.
    pub(crate) const RUNS: [Self; 3] = [Self::Svg, Self::Png, Self::Page];

    fn ending(self) -> &'static str {
        match self {
            Self::Svg => "svg",
            Self::Png => "png",
            Self::Page => "html",
        }
    }

    /// Returns the one of these forms that the name of a file asks for by its ending.
    ///
    /// # Errors
    /// Returns an error that names the option if it is none of them.
    pub(crate) fn of(path: &Path, option: &str, forms: &[Self]) -> Result<Self, Error> {
        let ending = path.extension().and_then(OsStr::to_str).map(str::to_ascii_lowercase);
        let asked = forms.iter().find(|form| ending.as_deref() == Some(form.ending()));
        asked.copied().ok_or_else(|| {
            let endings: Vec<String> =
                forms.iter().map(|form| format!(".{}", form.ending())).collect();
            let (last, others) = endings.split_last().expect("there is a form");
            Error::experiment(format!(
                "{option} {}: the name must end with {} or {last}, which selects the format",
                path.display(),
                others.join(", ")
            ))
        })
    }
}

/// Returns the file of a figure and its form, if the option `--plot` names one.
///
/// # Errors
/// Returns an error if the ending of its name belongs to no form of a figure.
pub(crate) fn asked(plot: Option<&Path>) -> Result<Option<(&Path, Form)>, Error> {
    plot.map(|path| Ok((path, Form::of(path, "--plot", &Form::FIGURE)?))).transpose()
}

/// Writes a figure as PNG if the name of the file says so, or else as SVG.
///
/// # Errors
/// Returns an error if the file cannot be written.
pub(crate) fn write(figure: &Figure, form: Form, path: &Path) -> Result<(), Error> {
    match form {
        Form::Png => png::write(&svg::text(figure), path),
        Form::Svg | Form::Page => svg::write(figure, path),
    }
}
