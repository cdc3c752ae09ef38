//! How a campaign is flown: folder, threads, files, and from where it can be ended.

use cosim::interrupt::Interrupt;
use std::path::PathBuf;

/// Options of a campaign.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// Folder for the results; `out/<campaign>` if it is not given.
    pub out: Option<PathBuf>,
    /// Number of threads; 0 means one for each core.
    pub jobs: usize,
    /// Whether cases that are kept already are flown again.
    pub fresh: bool,
    /// Whether the progress display is suppressed.
    pub quiet: bool,
    /// Whether the table is written as CSV as well.
    pub csv: bool,
    /// Interrupt through which the work can be ended from outside.
    pub interrupt: Interrupt,
}
