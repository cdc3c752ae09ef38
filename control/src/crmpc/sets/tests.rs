//! The check of a motion compared with the bounds that it estimates.

use super::*;
use proptest::prelude::*;
use proptest::test_runner::{Config, RngAlgorithm, TestRng, TestRunner};
use std::cell::Cell;

fn robust() -> Sets {
    let settings = Settings::new(Constraints::Robust);
    Sets::new(&settings, &Design::new(&settings).unwrap()).unwrap()
}

/// A wave of (Θ̃, x̃_ω, a) over the horizon, which is all that the check needs of a motion.
fn wave() -> impl Strategy<Value = Motion<2>> {
    let component = || (-1.0..1.0, -1.0..1.0, 0.0..0.3, 0.0..6.3);
    let sizes = ((-2.0..0.0), (-3.0..-0.8), (-3.0..-0.8));
    (sizes, prop::collection::vec(component(), 9)).prop_map(
        |((angle, rate, acceleration), components)| {
            let mut motion = Motion::new(100);
            let at = |k: usize, first: usize, decade: f64| {
                Vector3::from_fn(|i, _| {
                    let (mean, amplitude, frequency, phase) = components[first + i];
                    10.0_f64.powf(decade)
                        * (mean + amplitude * f64::sin(phase + frequency * k as f64))
                })
            };
            for (k, state) in motion.states.iter_mut().enumerate() {
                *state = [at(k, 0, angle), at(k, 3, rate)];
            }
            for (k, input) in motion.inputs.iter_mut().enumerate() {
                *input = at(k, 6, acceleration);
            }
            motion
        },
    )
}

fn run(cases: u32, property: impl Fn(Motion<2>) -> Result<(), TestCaseError>) {
    let random = TestRng::deterministic_rng(RngAlgorithm::ChaCha);
    let config = Config { cases, failure_persistence: None, ..Config::default() };
    TestRunner::new_with_rng(config, random).run(&wave(), property).unwrap();
}

fn count(of: &Cell<[usize; 2]>, which: bool) {
    let mut counts = of.get();
    counts[usize::from(which)] += 1;
    of.set(counts);
}

#[test]
fn oracle_the_check_of_the_horizon_finds_what_exact_bounds_find() {
    let (violations, by_size) = (Cell::new([0; 2]), Cell::new([0; 2]));
    run(5000, |motion| {
        let n = motion.inputs.len();
        let sets = robust();
        let [mut checked, mut exact] = [(); 2].map(|()| mpc::Bounds::unlimited(n));
        let found = sets.violated(&motion, 0..n, &mut checked);
        sets.bounds_about(&motion, 0..n, &mut exact);
        let Kind::Robust(robust) = &sets.kind else { unreachable!() };
        let (of_rate, of_moment) = robust.reserves();
        let violates = |&k: &usize| {
            let input = motion.inputs.get(k + 1).copied().unwrap_or_default();
            let (rate, _) = robust.nonempty((exact.state[k + 1], 1.0));
            let (_, moment) = robust.nonempty((1.0, exact.input[k]));
            let of_end = sets.squares(k + 1, &motion.states[k + 1], &input, (rate, 1.0)).0;
            let of_input = sets.squares(k, &motion.states[k], &motion.inputs[k], (1.0, moment)).1;
            of_end.sqrt() * rate > exact.state[k + 1] + of_rate
                || of_input.sqrt() * moment > exact.input[k] + of_moment
        };
        let expected = (0..n).find(violates).zip((0..n).rfind(violates));
        count(&violations, found.is_some());
        let expected = expected.map(|(first, last)| first..last + 1);
        prop_assert_eq!(&found, &expected);
        // Bounds of the intervals between violated ones stay unchanged.
        for k in (0..n).filter(|k| !expected.as_ref().is_some_and(|range| range.contains(k))) {
            prop_assert!(checked.state[k + 1] <= exact.state[k + 1] + 1e-12, "{}", k);
            prop_assert!(checked.input[k] <= exact.input[k] + 1e-6, "{}", k);
            count(&by_size, checked.input[k] < exact.input[k]);
        }
        Ok(())
    });
    // Both outcomes must occur, and both ways of deciding them.
    let least = |of: &Cell<[usize; 2]>| of.get().into_iter().min().unwrap();
    assert!(least(&violations) > 40 && least(&by_size) > 4000, "{violations:?} {by_size:?}");
}

#[test]
fn oracle_bounds_by_size_hold_from_any_stage() {
    let tightest = Cell::new(0.0_f64);
    run(100, |motion| {
        let sets = robust();
        let Kind::Robust(robust) = &sets.kind else { unreachable!() };
        let point = |k| sets.point(&motion, k);
        for k in 0..motion.inputs.len() {
            let (here, next) = (point(k), point(k + 1));
            let anchor = robust.anchor(&point(k - k % 10));
            let (estimate, exact) =
                (robust.estimate(k, &here, &next, &anchor), robust.interval(k, &here, &next));
            let rounding = 1.0 + 1e-12;
            prop_assert!(estimate.moment * rounding >= exact.moment, "{}", k);
            prop_assert!(estimate.rate * rounding >= exact.rate, "{}", k);
            prop_assert!(estimate.moment_bound <= exact.moment_bound * rounding, "{}", k);
            prop_assert!(estimate.rate_bound <= exact.rate_bound * rounding, "{}", k);
            let known = anchor.motion.moment(&here.acceleration).norm();
            if estimate.moment > known {
                let share = (exact.moment - known) / (estimate.moment - known);
                tightest.set(tightest.get().max(share));
            }
        }
        Ok(())
    });
    assert!(tightest.get() > 0.3, "{tightest:?}");
}
