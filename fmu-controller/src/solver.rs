//! Solver parameters and outputs that all controllers with an optimisation share.

use control::mpc::{Method, Nonlinearity, SolverSettings};
use control::report::{SolverReport, SolverStatus};
use controller_export::table::{sampled_output, shown};
use controller_export::{ControllerFmu, Law};
use fmi2_export::table::parameter;
use fmi2_export::{Enumeration, VariableTable};
use model_description::unit;

static STATUSES: Enumeration<SolverStatus> = Enumeration {
    name: "SolverStatus",
    description: "Origin of the plan in force",
    items: &[
        (SolverStatus::None, "none", "no optimisation yet"),
        (
            SolverStatus::Unconstrained,
            "unconstrained",
            "optimum without constraints, checked to satisfy every constraint",
        ),
        (
            SolverStatus::TerminalConstraint,
            "terminalBall",
            "optimum with the terminal constraint only, checked to satisfy every other constraint",
        ),
        (SolverStatus::Constrained, "constrained", "optimum found by the Riccati method"),
        (SolverStatus::Cone, "cone", "optimum found by the cone solver"),
        (
            SolverStatus::Fallback,
            "fallback",
            "shifted previous plan, continued with the terminal law",
        ),
        (
            SolverStatus::Kept,
            "kept",
            "previous plan, which satisfies the conditions of the guarantee; no optimum that does was found",
        ),
    ],
};

static METHODS: Enumeration<Method> = Enumeration {
    name: "Solver",
    description: "Solver of the optimisation, used where the shortcuts do not find the optimum",
    items: &[
        (
            Method::Riccati,
            "riccati",
            "interior-point method on the Riccati recursion; the cone solver where this method fails",
        ),
        (Method::Cone, "cone", "cone solver Clarabel"),
    ],
};

static NONLINEARITIES: Enumeration<Nonlinearity> = Enumeration {
    name: "Nonlinearity",
    description: "Form of the constraints for the Riccati method; the cone solver always uses linearised ones",
    items: &[
        (Nonlinearity::Exact, "exact", "constraints as nonlinear functions of the plan"),
        (Nonlinearity::Frozen, "frozen", "constraints linearised at the previous plan"),
    ],
};

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
    let status = sampled("solver.status", STATUSES.description);
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
        .enumeration(status, &STATUSES, move |m| &mut solver(&mut m.law).status)
        .real(cost.real(), move |m| &mut solver(&mut m.law).cost)
        .real(time.real().unit(unit::time()).nominal(1e-3), move |m| &mut solver(&mut m.law).time)
        .integer(iterations, (None, None), move |m| &mut solver(&mut m.law).iterations)
        .real(residual.real().nominal(1e-8), move |m| &mut solver(&mut m.law).residual)
        .integer(solves, (None, None), move |m| &mut solver(&mut m.law).solves)
        .integer(fallbacks, (None, None), move |m| &mut solver(&mut m.law).fallbacks)
        .integer(exhausted, (None, None), move |m| &mut solver(&mut m.law).exhausted)
}

/// Adds the parameters of the solver.
pub(crate) fn parameters<L: Law>(
    table: VariableTable<ControllerFmu<L>>,
    solver: impl Fn(&mut L) -> &mut SolverSettings + Copy + Send + Sync + 'static,
) -> VariableTable<ControllerFmu<L>> {
    let method = parameter("solver", METHODS.description);
    let nonlinearity = parameter("solver.nonlinearity", NONLINEARITIES.description);
    let iterations = parameter(
        "solver.maxIterations",
        "Maximum number of iterations of each solver in each pass",
    );
    let shortcuts = parameter(
        "solver.exits",
        "Whether shortcuts to the same optimum are tried first: without constraints, with the terminal constraint only, then on windows of the horizon",
    );
    let budget = parameter(
        "solver.timeBudget",
        "Wall-clock time after which an optimisation starts no further iteration or solver; 0 for no limit; runs with a time budget are not reproducible",
    );
    let iteration_budget = parameter(
        "solver.iterationBudget",
        "Number of iterations, summed over all solvers and passes, after which an optimisation starts no further one; 0 for no limit; runs remain reproducible",
    );
    table
        .enumeration(method, &METHODS, move |m| &mut solver(&mut m.law).method)
        .enumeration(nonlinearity, &NONLINEARITIES, move |m| &mut solver(&mut m.law).nonlinearity)
        .integer(iterations, (Some(1), Some(1000)), move |m| &mut solver(&mut m.law).max_iterations)
        .boolean(shortcuts, move |m| &mut solver(&mut m.law).shortcuts)
        .real(budget.real().unit(unit::time()).min(0.0).nominal(1e-3), move |m| {
            &mut solver(&mut m.law).time_budget
        })
        .integer(iteration_budget, (Some(0), Some(100_000)), move |m| {
            &mut solver(&mut m.law).iteration_budget
        })
}

/// Returns a warning if an optimisation failed between the two reports.
pub(crate) fn warning(before: &SolverReport, after: &SolverReport) -> Option<&'static str> {
    (after.fallbacks > before.fallbacks).then_some(
        "the optimisation failed: the shifted previous plan with the terminal law is used (see solver.fallbacks)",
    )
}
