//! The solver's report as all controllers with an optimisation show it.

use control::report::SolverReport;
use controller_export::table::shown;

/// Returns the report with finite numbers, as outputs require.
pub(crate) fn shown_report(report: &SolverReport) -> SolverReport {
    SolverReport { cost: shown(report.cost), residual: shown(report.residual), ..*report }
}

/// Returns a warning if an optimisation failed between the two reports.
pub(crate) fn warning(before: &SolverReport, after: &SolverReport) -> Option<&'static str> {
    (after.fallbacks > before.fallbacks).then_some(
        "the optimisation failed: the shifted previous plan with the terminal law is used (see solver.fallbacks)",
    )
}
