//! Optimisations that take long, and those that a budget ends: starts far from the reference,
//! disturbed starts, and infeasible problems.

use crate::harness::draws::Case;
use crate::prelude::*;
use control::linearise::InverseKinematics;
use proptest::prelude::*;

fn crmpc(constraints: Constraints) -> Crmpc {
    Crmpc::new(settings(constraints)).unwrap()
}

fn has_optimum(report: &SolverReport) -> bool {
    !matches!(report.status, SolverStatus::None | SolverStatus::Fallback | SolverStatus::Kept)
}

/// Returns the rows of the list for `law`: seed, and iterations of the three optimisations.
fn listed(law: &str) -> Vec<(u64, [u32; 3])> {
    let number = |text: &str| text.parse::<u32>().unwrap();
    include_str!("data/worst_draws.csv")
        .lines()
        .filter_map(|line| line.strip_prefix(law)?.strip_prefix(','))
        .map(|line| {
            let mut fields = line.split(',');
            let seed = fields.next().unwrap().parse().unwrap();
            (seed, std::array::from_fn(|_| number(fields.next().unwrap())))
        })
        .collect()
}

/// The list was made by
/// `cargo run --release -p reentry-control --example worst_time -- list LAW 200000 20000`.
fn assert_takes_no_more<C: Optimising>(name: &str, law: &mut C) {
    let rows = listed(name);
    assert_eq!(rows.len(), 40);
    for (seed, most) in rows {
        let reports = Case::random(seed, 1.0).optimise(law, 1);
        for (report, most) in reports.iter().zip(most) {
            assert!(has_optimum(report), "{name}, seed {seed}: {report:?}");
            assert!(report.iterations <= most, "{name}, seed {seed}: more than {most}: {report:?}");
        }
    }
}

#[test]
fn regress_the_longest_of_20000_random_optimisations_take_no_more_iterations() {
    assert_takes_no_more("robust", &mut crmpc(Constraints::Robust));
    assert_takes_no_more("paper", &mut crmpc(Constraints::Paper));
    assert_takes_no_more("dlmpc", &mut Dlmpc::new(dlmpc::Settings::published()).unwrap());
}

#[test]
fn every_optimum_of_the_paper_from_a_random_start_shows_that_it_is_one() {
    // With these seeds a first guess once violated the chain, and so did the resulting trajectory.
    let mut seeds = vec![2480, 7527, 8436, 13191, 32585, 33560, 38426, 38433];
    seeds.extend(0..2000);
    let parts: Vec<&[u64]> = seeds.chunks(100).collect();
    let optimise = |part: &&[u64]| {
        let law = &mut crmpc(Constraints::Paper);
        let steps_of =
            |&seed: &u64| Case::random(seed, 1.0).optimise(law, 1).map(|report| (seed, report));
        part.iter().flat_map(steps_of).collect::<Vec<_>>()
    };
    for (seed, report) in in_parallel(&parts, optimise).concat() {
        assert!(has_optimum(&report) && report.residual <= 2e-6, "seed {seed}: {report:?}");
    }
}

#[test]
fn oracle_where_no_optimisation_is_begun_no_moment_keeps_the_rates() {
    let scenario = Scenario::crmpc2022();
    let settings = settings(Constraints::Robust);
    let (h, reference) = (settings.period_optimisation, |time| scenario.reference.at(time));
    let random = &mut Random::new(1);
    let mut refused = 0;
    for _ in 0..400 {
        let mut draw = |size: f64| Vector3::from_fn(|_, _| random.between(-size, size));
        let angles = reference(0.0).angles + draw(0.3);
        let rates = draw(0.15);
        let measured = Measurement { angles, rates, ..Measurement::default() };
        let mut memory = Memory::default();
        crmpc(Constraints::Robust).update(&mut memory, 0, 0.0, &measured, &reference);
        let kinematics = InverseKinematics::at(&angles);
        let x_omega = kinematics::r(&angles) * rates;
        // The moment is affine in the second derivative of the angles.
        let moment = |acceleration| kinematics.moment(&settings.body, &x_omega, &acceleration);
        let at_rest = moment(Vector3::zeros());
        let slope =
            Matrix3::from_columns(&[0, 1, 2].map(|axis| moment(Vector3::ith(axis, 1.0)) - at_rest));
        let inverse = slope.try_inverse().unwrap();
        // Returns the rates relative to their limit after an interval that begins with this moment.
        let after = |moment: Vector3<f64>| {
            let input = inverse * (moment - at_rest);
            let next = angles + (x_omega + input * (0.5 * h)) * h;
            (kinematics::r_inverse(&next) * (x_omega + input * h)).norm() / settings.limit_rate
        };
        let least = (0..2000)
            .map(|_| after(random.direction(settings.limit_moment)))
            .fold(after(Vector3::zeros()), f64::min);
        if memory.report.status == SolverStatus::Fallback && memory.report.iterations == 0 {
            refused += 1;
            assert!(least > 1.0, "{angles} {rates}: {least}");
        }
    }
    assert!((50..350).contains(&refused), "{refused}");
}

/// Runs the paper's scenario with a budget of iterations. Returns the outcome, the last memory, the
/// most iterations of an optimisation, and whether a limit was violated under guarantee.
fn budgeted(budget: u32, kind: DisturbanceKind) -> (crate::harness::Outcome, Memory, u32, bool) {
    let settings = settings(Constraints::Robust);
    let solver = SolverSettings { iteration_budget: budget, ..settings.solver };
    let mut controller = Crmpc::new(Settings { solver, ..settings }).unwrap();
    let mut memory = Memory::default();
    let (mut most, mut broken, mut before) = (0, false, false);
    let outcome =
        simulate(&mut controller, &mut memory, 1.05, disturbance(kind), |memory, _, measured| {
            most = most.max(memory.report.iterations);
            broken |= before && measured.rates.norm() > settings.limit_rate;
            before = memory.guarantee == GuaranteeStatus::InForce;
        });
    (outcome, memory, most, broken)
}

#[test]
fn a_budget_of_iterations_is_never_exceeded_and_costs_no_limit() {
    let budgets = [0, 1, 2, 3, 4, 6, 8];
    let cases: Vec<(u32, DisturbanceKind)> = budgets
        .into_iter()
        .flat_map(|budget| {
            [DisturbanceKind::White, DisturbanceKind::AlongRate, DisturbanceKind::AgainstMoment]
                .map(|kind| (budget, kind))
        })
        .collect();
    let runs = in_parallel(&cases, |&(budget, kind)| (budget, budgeted(budget, kind)));
    for (budget, (outcome, memory, most, broken)) in runs {
        let context = format!("{budget}: {outcome:?}, most {most}, {:?}", memory.report);
        assert!(!broken && outcome.rate <= 1.0 && outcome.moment <= 1.0 + 1e-12, "{context}");
        if budget == 0 {
            assert!(memory.report.exhausted == 0 && most > 8, "{context}");
        } else {
            assert!(memory.report.exhausted > 0 && most == budget, "{context}");
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 60, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn iterations_of_all_solvers_together_keep_within_their_budget(
        seed in 0u64..1_000_000,
        budget in 1u32..40,
        paper: bool,
        size in 1.0..3.0,
    ) {
        let settings = settings(if paper { Constraints::Paper } else { Constraints::Robust });
        let solver = SolverSettings { iteration_budget: budget, ..settings.solver };
        let limited = &mut Crmpc::new(Settings { solver, ..settings }).unwrap();
        let free = &mut Crmpc::new(settings).unwrap();
        let case = Case::random(seed, size);
        let [cold, ..] = case.optimise(free, 1);
        let reports = case.optimise(limited, 1);
        for report in reports {
            prop_assert!(report.iterations <= budget, "{report:?}");
        }
        // A sufficient budget changes nothing.
        if cold.iterations < budget {
            prop_assert_eq!(SolverReport { time: 0.0, ..reports[0] }, SolverReport { time: 0.0, ..cold });
        } else if cold.iterations > budget {
            prop_assert_eq!(reports[0].exhausted, 1);
        }
    }
}
