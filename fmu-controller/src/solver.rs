//! What every controller that optimises shows of its solver.

use crate::law::Law;
use crate::table::{enumeration, item, number, sampled_inputs, shown};
use crate::unit::Unit;
use control::mpc::{Method, Nonlinearity, SolverSettings};
use control::report::{Report, Status};
use fmi2_export::Table;
use fmi2_export::table::{discrete_output, parameter};
use model_description::unit;
use serde::{Deserialize, Serialize};

const STATUSES: [(Status, &str, &str); 7] = [
    (Status::None, "none", "no optimisation yet"),
    (
        Status::Unconstrained,
        "unconstrained",
        "the unconstrained optimum, checked to satisfy every constraint",
    ),
    (
        Status::TerminalBall,
        "terminalBall",
        "the optimum with the terminal ball alone, checked to satisfy every other constraint",
    ),
    (Status::Constrained, "constrained", "the optimum by the Riccati method"),
    (Status::Cone, "cone", "the optimum by the cone solver"),
    (Status::Fallback, "fallback", "the previous plan, shifted, with the terminal law"),
    (Status::Kept, "kept", "the previous plan as it is, which keeps the conditions of the guarantee"),
];

const METHODS: [(Method, &str, &str); 2] = [
    (
        Method::Riccati,
        "riccati",
        "interior point method on the Riccati recursion; the cone solver where it fails",
    ),
    (Method::Cone, "cone", "the cone solver Clarabel"),
];

const NONLINEARITIES: [(Nonlinearity, &str, &str); 2] = [
    (Nonlinearity::Exact, "exact", "the constraints as functions of the plan"),
    (Nonlinearity::Frozen, "frozen", "the constraints linearised about the previous plan"),
];

/// The last optimisation's report as variables. The status is held as its 1-based item number.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct SolverOutputs {
    status: i32,
    cost: f64,
    iterations: i32,
    residual: f64,
    time: f64,
    solves: i32,
    fallbacks: i32,
    exhausted: i32,
}

impl From<&Report> for SolverOutputs {
    fn from(report: &Report) -> Self {
        Self {
            status: number(&STATUSES, &report.status),
            cost: shown(report.cost),
            iterations: report.iterations.cast_signed(),
            residual: shown(report.residual),
            time: report.time,
            solves: report.solves.cast_signed(),
            fallbacks: report.fallbacks.cast_signed(),
            exhausted: report.exhausted.cast_signed(),
        }
    }
}

impl Default for SolverOutputs {
    fn default() -> Self {
        Self::from(&Report::default())
    }
}

/// Adds the outputs.
pub(crate) fn outputs<L: Law>(
    table: Table<Unit<L>>,
    solver: impl Fn(&mut L) -> &mut SolverOutputs + Copy + Send + Sync + 'static,
) -> Table<Unit<L>> {
    let sampled = |name: &str, text: &str| discrete_output(name, text).depends_on(sampled_inputs());
    let status = sampled("solver.status", "How the plan in force came about");
    let cost = sampled("solver.cost", "Optimal cost of the plan in force");
    let time = sampled("solver.time", "Wall-clock time of the last optimisation; differs from run to run");
    let iterations = sampled("solver.iterations", "Iterations of the last optimisation, over all its passes");
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
    let statuses = enumeration("SolverStatus", "How a plan came about", &STATUSES);
    table
        .enumeration(status, statuses, move |m| &mut solver(&mut m.law).status)
        .real(cost.real(), move |m| &mut solver(&mut m.law).cost)
        .real(time.real().unit(unit::time()).nominal(1e-3), move |m| &mut solver(&mut m.law).time)
        .integer(iterations, (None, None), move |m| &mut solver(&mut m.law).iterations)
        .real(residual.real().nominal(1e-8), move |m| &mut solver(&mut m.law).residual)
        .integer(solves, (None, None), move |m| &mut solver(&mut m.law).solves)
        .integer(fallbacks, (None, None), move |m| &mut solver(&mut m.law).fallbacks)
        .integer(exhausted, (None, None), move |m| &mut solver(&mut m.law).exhausted)
}

/// How an optimisation is solved. Enumerations are held as their 1-based item number.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub(crate) struct SolverParameters {
    method: i32,
    nonlinearity: i32,
    max_iterations: i32,
    exits: bool,
    time_budget: f64,
    iteration_budget: i32,
}

impl From<&SolverSettings> for SolverParameters {
    fn from(settings: &SolverSettings) -> Self {
        Self {
            method: number(&METHODS, &settings.method),
            nonlinearity: number(&NONLINEARITIES, &settings.nonlinearity),
            max_iterations: settings.max_iterations.cast_signed(),
            exits: settings.exits,
            time_budget: settings.time_budget,
            iteration_budget: settings.iteration_budget.cast_signed(),
        }
    }
}

impl SolverParameters {
    pub(crate) fn settings(self) -> SolverSettings {
        SolverSettings {
            method: item(&METHODS, self.method),
            nonlinearity: item(&NONLINEARITIES, self.nonlinearity),
            max_iterations: self.max_iterations.max(0).cast_unsigned(),
            exits: self.exits,
            time_budget: self.time_budget,
            iteration_budget: self.iteration_budget.max(0).cast_unsigned(),
        }
    }
}

#[cfg(test)]
impl SolverParameters {
    pub(crate) fn set_time_budget(&mut self, budget: f64) {
        self.time_budget = budget;
    }
}

/// Adds the parameters.
pub(crate) fn parameters<L: Law>(
    table: Table<Unit<L>>,
    solver: impl Fn(&mut L) -> &mut SolverParameters + Copy + Send + Sync + 'static,
) -> Table<Unit<L>> {
    let method =
        parameter("solver", "Which solver is asked first where the exits do not lead to the optimum");
    let nonlinearity = parameter(
        "solver.nonlinearity",
        "What the Riccati method is given; the cone solver is always given linearised constraints",
    );
    let iterations =
        parameter("solver.maxIterations", "Iteration limit of each solver in each of its passes");
    let exits = parameter(
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
        .enumeration(method, enumeration("Solver", "Solver of the optimisation", &METHODS), move |m| {
            &mut solver(&mut m.law).method
        })
        .enumeration(
            nonlinearity,
            enumeration("Nonlinearity", "What the Riccati method is given", &NONLINEARITIES),
            move |m| &mut solver(&mut m.law).nonlinearity,
        )
        .integer(iterations, (Some(1), Some(1000)), move |m| &mut solver(&mut m.law).max_iterations)
        .boolean(exits, move |m| &mut solver(&mut m.law).exits)
        .real(budget.real().unit(unit::time()).min(0.0).nominal(1e-3), move |m| {
            &mut solver(&mut m.law).time_budget
        })
        .integer(iterations_in_all, (Some(0), Some(100_000)), move |m| {
            &mut solver(&mut m.law).iteration_budget
        })
}

/// A warning if an optimisation failed between the two reports.
pub(crate) fn warning(before: &Report, after: &Report) -> Option<&'static str> {
    (after.fallbacks > before.fallbacks).then_some(
        "the optimisation did not succeed: the previous plan with the terminal law is used (solver.fallbacks)",
    )
}
