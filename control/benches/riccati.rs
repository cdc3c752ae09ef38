//! Time of the Riccati method alone, on CRMPC's first problem of Chai 2022 with its reference at
//! rest: the exact norm constraints of rates and moment, and the terminal constraint.
//!
//! The method stops after a given number of iterations. The difference between two of these times,
//! per iteration, is the time of one: norm constraints with derivatives, one factorisation,
//! predictor and corrector. The rest is the start. The unconstrained sweeps, whose factors are
//! known beforehand, are measured for comparison.

#[path = "../tests/harness/mod.rs"]
mod harness;

use control::Crmpc;
use control::crmpc::Constraints;
use control::mpc::Budget;
use control::mpc::constraints::LinearisedConstraints;
use control::mpc::lq::Unconstrained;
use control::mpc::problem::{End, Problem, Solution, Start};
use control::mpc::riccati::Riccati;
use control::mpc::{self, Chain, Cost, per_axis};
use criterion::{BatchSize, Criterion, criterion_group, criterion_main};
use harness::norm_constraints::Sets;
use harness::settings;
use nalgebra::Vector3;
use std::hint::black_box;
use vehicle::scenario::Scenario;

fn riccati(criterion: &mut Criterion) {
    let settings = settings(Constraints::Robust);
    let (n, h) = (settings.horizon, settings.period_optimisation);
    let crmpc = Crmpc::new(settings).unwrap();
    let design = crmpc.design();
    let chain = Chain::new(h);
    // Cost (10), sampled.
    let [p1, p2, p3, p4, p5, p6] = settings.p;
    let cost = Cost {
        state: [Vector3::new(p1, p2, p3) * h, Vector3::new(p4, p5, p6) * h],
        input: Vector3::from(settings.q) * h,
        end: per_axis(&design.g),
    };
    let scenario = Scenario::crmpc2022();
    let reference = (scenario.reference).at(0.0).angles;
    let start = [scenario.initial_angles - reference, Vector3::zeros()];
    let affine = vec![[Vector3::zeros(); 2]; n];
    let sets = Sets {
        body: settings.body,
        printed: false,
        bounds: (settings.limit_rate, settings.limit_moment),
    };
    let radius = design.paper.map(|paper| paper.epsilon1.min(paper.epsilon2));
    let end = || End { weight: &cost.end, slope: [Vector3::zeros(); 2], radius };

    let mut unconstrained = Unconstrained::new(n, &chain, &cost);
    let mut cold = Solution::new(n);
    criterion.bench_function("unconstrained sweeps", |bencher| {
        bencher.iter(|| unconstrained.solve(black_box(&start), &affine, &mut cold.trajectory));
    });

    let mut linearised = LinearisedConstraints::new(n);
    linearised.set(&sets, &cold.trajectory, 0);
    iterations(criterion, "exact", &cold, || Problem {
        chain: &chain,
        cost: &cost,
        start: Start::Fixed(start),
        affine: &affine,
        constraints: &sets,
        end: end(),
    });
    iterations(criterion, "linearised", &cold, || Problem {
        chain: &chain,
        cost: &cost,
        start: Start::Fixed(start),
        affine: &affine,
        constraints: &linearised,
        end: end(),
    });
}

fn iterations<'a, C: mpc::Constraints<2> + 'a>(
    criterion: &mut Criterion,
    name: &str,
    cold: &Solution<2>,
    problem: impl Fn() -> Problem<'a, 2, C>,
) {
    let problem = problem();
    let mut group = criterion.benchmark_group(name);
    for (name, most) in
        [("1 iteration", 1), ("2 iterations", 2), ("3 iterations", 3), ("to the optimum", 50)]
    {
        let mut riccati = Riccati::new(problem.affine.len(), most);
        let outcome =
            riccati.solve(&problem, &mut cold.clone(), 0, false, &mut Budget::unlimited(), None);
        // With fewer iterations the benchmark's name would be wrong.
        assert!(outcome.solved() == (most == 50), "{outcome:?}");
        group.bench_function(name, |bencher| {
            bencher.iter_batched_ref(
                || cold.clone(),
                |solution| {
                    riccati.solve(&problem, solution, 0, false, &mut Budget::unlimited(), None)
                },
                BatchSize::SmallInput,
            );
        });
    }
    group.finish();
}

criterion_group!(benches, riccati);
criterion_main!(benches);
