//! Solver parameters and outputs that all controllers with an optimisation share.

use control::mpc::{Method, Nonlinearity, SolverSettings};
use control::report::{SolverReport, SolverStatus};
use controller_export::table::{sampled_output, shown};
use controller_export::{ControllerFmu, Law};
use fmi2_export::table::parameter;
use fmi2_export::{Enumeration, Table};
use model_description::unit;

static STATUSES: Enumeration<SolverStatus> = Enumeration {
    name: "SolverStatus",
    description: "How a plan came about",
    items: &[
        (SolverStatus::None, "none", "no optimisation yet"),
        (
            SolverStatus::Unconstrained,
            "unconstrained",
            "the unconstrained optimum, checked to satisfy every constraint",
        ),
        (
            SolverStatus::TerminalConstraint,
            "terminalBall",
            "the optimum with the terminal ball alone, checked to satisfy every other constraint",
        ),
        (SolverStatus::Constrained, "constrained", "the optimum by the Riccati method"),
        (SolverStatus::Cone, "cone", "the optimum by the cone solver"),
        (SolverStatus::Fallback, "fallback", "the previous plan, shifted, with the terminal law"),
        (
            SolverStatus::Kept,
            "kept",
            "the previous plan as it is, which keeps the conditions of the guarantee",
        ),
    ],
};

static METHODS: Enumeration<Method> = Enumeration {
    name: "Solver",
    description: "Solver of the optimisation",
    items: &[
        (
            Method::Riccati,
            "riccati",
            "interior point method on the Riccati recursion; the cone solver where it fails",
        ),
        (Method::Cone, "cone", "the cone solver Clarabel"),
    ],
};

static NONLINEARITIES: Enumeration<Nonlinearity> = Enumeration {
    name: "Nonlinearity",
    description: "What the Riccati method is given",
    items: &[
        (Nonlinearity::Exact, "exact", "the constraints as functions of the plan"),
        (Nonlinearity::Frozen, "frozen", "the constraints linearised about the previous plan"),
    ],
};

/// Returns the report with finite numbers, as outputs require.
pub(crate) fn shown_report(report: &SolverReport) -> SolverReport {
    SolverReport { cost: shown(report.cost), residual: shown(report.residual), ..*report }
}

/// Adds the outputs of the solver.
pub(crate) fn outputs<L: Law>(
    table: Table<ControllerFmu<L>>,
    solver: impl Fn(&mut L) -> &mut SolverReport + Copy + Send + Sync + 'static,
) -> Table<ControllerFmu<L>> {
    let sampled = sampled_output;
    let status = sampled("solver.status", "How the plan in force came about");
    let cost = sampled("solver.cost", "Optimal cost of the plan in force");
    let time =
        sampled("solver.time", "Wall-clock time of the last optimisation; differs from run to run");
    let iterations =
        sampled("solver.iterations", "Iterations of the last optimisation, over all its passes");
    let residual = sampled(
        "solver.residual",
        "Residual of the conditions of optimality of the plan in force, relative; with the constraints as functions of the plan",
    );
    let solves = sampled("solver.solves", "Optimisations so far");
    let fallbacks = sampled("solver.fallbacks", "Optimisations so far that did not succeed");
    let exhausted = sampled(
        "solver.exhausted",
        "Optimisations so far that their budget of time or iterations ended early",
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
    table: Table<ControllerFmu<L>>,
    solver: impl Fn(&mut L) -> &mut SolverSettings + Copy + Send + Sync + 'static,
) -> Table<ControllerFmu<L>> {
    let method = parameter(
        "solver",
        "Which solver is asked first where the exits do not lead to the optimum",
    );
    let nonlinearity = parameter(
        "solver.nonlinearity",
        "What the Riccati method is given; the cone solver is always given linearised constraints",
    );
    let iterations =
        parameter("solver.maxIterations", "Iteration limit of each solver in each of its passes");
    let shortcuts = parameter(
        "solver.exits",
        "Whether cheaper ways to the same optimum are tried first: the optimum without constraints, that with the terminal ball alone, \
         then windows of the horizon; otherwise the whole horizon is solved each time",
    );
    let budget = parameter(
        "solver.timeBudget",
        "Wall-clock time of an optimisation after which no further iteration or solver is begun, 0 for none; runs with one do not repeat",
    );
    let iterations_in_all = parameter(
        "solver.iterationBudget",
        "Iterations of all solvers and passes of an optimisation after which none is begun any more, 0 for no limit; runs with one repeat",
    );
    table
        .enumeration(method, &METHODS, move |m| &mut solver(&mut m.law).method)
        .enumeration(nonlinearity, &NONLINEARITIES, move |m| &mut solver(&mut m.law).nonlinearity)
        .integer(iterations, (Some(1), Some(1000)), move |m| &mut solver(&mut m.law).max_iterations)
        .boolean(shortcuts, move |m| &mut solver(&mut m.law).shortcuts)
        .real(budget.real().unit(unit::time()).min(0.0).nominal(1e-3), move |m| {
            &mut solver(&mut m.law).time_budget
        })
        .integer(iterations_in_all, (Some(0), Some(100_000)), move |m| {
            &mut solver(&mut m.law).iteration_budget
        })
}

/// Returns a warning if an optimisation failed between the two reports.
pub(crate) fn warning(before: &SolverReport, after: &SolverReport) -> Option<&'static str> {
    (after.fallbacks > before.fallbacks).then_some(
        "the optimisation did not succeed: the previous plan with the terminal law is used (solver.fallbacks)",
    )
}
