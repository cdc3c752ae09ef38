//! Solver outputs that all controllers with an optimisation share.

use control::report::{SolverReport, SolverStatus};
use controller_export::table::{sampled_output, shown};
use controller_export::{ControllerFmu, Law};
use fmi_export::VariableTable;
use settings::Choice;

/// Returns the report with finite numbers, as outputs require.
pub(crate) fn shown_report(report: &SolverReport) -> SolverReport {
    SolverReport { cost: shown(report.cost), residual: shown(report.residual), ..*report }
}

/// Adds the outputs of the solver.
pub(crate) fn outputs<L: Law>(
    table: VariableTable<ControllerFmu<L>>,
    solver: impl Fn(&mut L) -> &mut SolverReport + Copy + Send + Sync + 'static,
) -> VariableTable<ControllerFmu<L>> {
    let sampled = sampled_output;
    let status = sampled("solver.status", SolverStatus::TEXT);
    let cost = sampled("solver.cost", "Cost of the plan in force");
    let time = sampled("solver.time", "Wall-clock time of the last optimisation; not reproducible");
    let iterations = sampled(
        "solver.iterations",
        "Number of iterations in the last optimisation, summed over all solvers and passes",
    );
    let residual = sampled(
        "solver.residual",
        "Relative residual of the optimality conditions for the plan in force, evaluated with the nonlinear constraints",
    );
    let solves = sampled("solver.solves", "Number of optimisations so far");
    let fallbacks = sampled("solver.fallbacks", "Number of optimisations so far that failed");
    let exhausted = sampled(
        "solver.exhausted",
        "Number of optimisations so far that were ended early by the time or iteration budget",
    );
    table
        .choice(status, move |m| &mut solver(&mut m.law).status)
        .real(cost.real(), move |m| &mut solver(&mut m.law).cost)
        .real(time.real().unit("s").nominal(1e-3), move |m| &mut solver(&mut m.law).time)
        .integer(iterations, (None, None), move |m| &mut solver(&mut m.law).iterations)
        .real(residual.real().nominal(1e-8), move |m| &mut solver(&mut m.law).residual)
        .integer(solves, (None, None), move |m| &mut solver(&mut m.law).solves)
        .integer(fallbacks, (None, None), move |m| &mut solver(&mut m.law).fallbacks)
        .integer(exhausted, (None, None), move |m| &mut solver(&mut m.law).exhausted)
}

/// Returns a warning if an optimisation failed between the two reports.
pub(crate) fn warning(before: &SolverReport, after: &SolverReport) -> Option<&'static str> {
    (after.fallbacks > before.fallbacks).then_some(
        "the optimisation failed: the shifted previous plan with the terminal law is used (see solver.fallbacks)",
    )
}
