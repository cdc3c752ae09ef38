//! What every controller that optimises shows of its solver.

use crate::law::Law;
use crate::table::{enumeration, number, sampled_inputs};
use crate::unit::Unit;
use control::report::{Report, Status};
use fmi2_export::Table;
use fmi2_export::table::{discrete_output, parameter};
use model_description::unit;
use serde::{Deserialize, Serialize};

const STATUSES: [(Status, &str, &str); 4] = [
    (Status::None, "none", "no optimisation yet"),
    (
        Status::Unconstrained,
        "unconstrained",
        "the unconstrained optimum, checked to satisfy every constraint",
    ),
    (Status::Constrained, "constrained", "the optimum of the cone programme"),
    (Status::Fallback, "fallback", "the previous plan, shifted, with the terminal law"),
];

/// The last optimisation's report as variables. The status is held as its 1-based item number.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct SolverOutputs {
    status: i32,
    cost: f64,
    iterations: i32,
    time: f64,
    solves: i32,
    fallbacks: i32,
}

impl From<&Report> for SolverOutputs {
    fn from(report: &Report) -> Self {
        Self {
            status: number(&STATUSES, &report.status),
            cost: report.cost,
            iterations: report.iterations.cast_signed(),
            time: report.time,
            solves: report.solves.cast_signed(),
            fallbacks: report.fallbacks.cast_signed(),
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
    let solves = sampled("solver.solves", "Optimisations so far");
    let fallbacks = sampled("solver.fallbacks", "Optimisations so far that did not succeed");
    let statuses = enumeration("SolverStatus", "How a plan came about", &STATUSES);
    table
        .enumeration(status, statuses, move |m| &mut solver(&mut m.law).status)
        .real(cost.real(), move |m| &mut solver(&mut m.law).cost)
        .real(time.real().unit(unit::time()).nominal(1e-3), move |m| &mut solver(&mut m.law).time)
        .integer(iterations, (None, None), move |m| &mut solver(&mut m.law).iterations)
        .integer(solves, (None, None), move |m| &mut solver(&mut m.law).solves)
        .integer(fallbacks, (None, None), move |m| &mut solver(&mut m.law).fallbacks)
}

/// How an optimisation is solved.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub(crate) struct SolverParameters {
    max_iterations: i32,
    pub(crate) exits: bool,
}

impl SolverParameters {
    /// With the exits, and at most so many iterations.
    pub(crate) fn new(max_iterations: u32) -> Self {
        Self { max_iterations: max_iterations.cast_signed(), exits: true }
    }

    pub(crate) fn max_iterations(self) -> u32 {
        self.max_iterations.max(0).cast_unsigned()
    }
}

/// Adds the parameters.
pub(crate) fn parameters<L: Law>(
    table: Table<Unit<L>>,
    solver: impl Fn(&mut L) -> &mut SolverParameters + Copy + Send + Sync + 'static,
) -> Table<Unit<L>> {
    let iterations = parameter("solver.maxIterations", "Iteration limit of the cone solver");
    let exits = parameter(
        "solver.exits",
        "Whether cheaper ways to the same optimum are tried first: the optimum without constraints, then parts of the horizon; \
         otherwise the cone programme of the whole horizon is solved each time",
    );
    table
        .integer(iterations, (Some(1), Some(1000)), move |m| &mut solver(&mut m.law).max_iterations)
        .boolean(exits, move |m| &mut solver(&mut m.law).exits)
}

/// A warning if an optimisation failed between the two reports.
pub(crate) fn warning(before: &Report, after: &Report) -> Option<&'static str> {
    (after.fallbacks > before.fallbacks).then_some(
        "the optimisation did not succeed: the previous plan with the terminal law is used (solver.fallbacks)",
    )
}
