//! Tests of disturbances: bounds, reproducibility, signs and course over time.

use nalgebra::Vector3;
use proptest::prelude::*;
use rand_pcg::Pcg64;
use rand_pcg::rand_core::SeedableRng;
use vehicle::disturbance::{Disturbance, Kind, View};
use vehicle::dynamics::RigidBody;
use vehicle::kinematics::Kinematics;
use vehicle::{Scenario, kinematics};

fn of(kind: Kind) -> Disturbance {
    Disturbance { kind, bound: 0.035, period: 0.04, square_period: 3.0, ..Disturbance::default() }
}

fn body() -> RigidBody {
    Scenario::crmpc2022().inertia.body(1.0).unwrap()
}

fn still(body: &RigidBody) -> View<'_> {
    View {
        body,
        kinematics: Kinematics::Printed,
        angles: Vector3::zeros(),
        rates: Vector3::zeros(),
        moment: Vector3::zeros(),
    }
}

fn vector(size: f64) -> impl Strategy<Value = Vector3<f64>> {
    (-size..size, -size..size, -size..size).prop_map(|(x, y, z)| Vector3::new(x, y, z))
}

proptest! {
    #[test]
    fn each_component_keeps_the_bound(seed: u64, tick in 0..1_000_000_i64, angles in vector(1.0), rates in vector(0.1), moment in vector(1e5)) {
        let body = body();
        let view = View { body: &body, kinematics: Kinematics::Printed, angles, rates, moment };
        for kind in [Kind::None, Kind::White, Kind::Constant, Kind::Square, Kind::AlongRate, Kind::AgainstMoment] {
            let delta = Disturbance { seed, ..of(kind) }.sample(tick, &view);
            prop_assert!(delta.amax() <= 0.035, "{kind:?}: {delta}");
        }
    }

    #[test]
    fn state_dependent_kinds_choose_the_worst_corner(angles in vector(1.0), rates in vector(0.1), moment in vector(1e5)) {
        let body = body();
        let view = View { body: &body, kinematics: Kinematics::Printed, angles, rates, moment };
        let along = of(Kind::AlongRate).sample(0, &view);
        let against = of(Kind::AgainstMoment).sample(0, &view);
        let control = kinematics::r(&angles) * body.inverse * moment;
        for corner in 0..8 {
            let other = Vector3::from_fn(|i, _| if corner >> i & 1 == 0 { 0.035 } else { -0.035 });
            let growth = |delta: &Vector3<f64>| rates.dot(&(kinematics::r_inverse(&angles) * delta));
            prop_assert!(growth(&along) >= growth(&other) - 1e-15);
            prop_assert!(against.dot(&control) <= other.dot(&control) + 1e-15);
        }
    }

    #[test]
    fn changes_come_one_after_the_other(origin in -10.0..10.0, period in 1e-3..1.0) {
        let disturbance = Disturbance { period, start: origin + 0.5, end: origin + 2.0, ..of(Kind::White) };
        let mut time = origin;
        let mut changes = Vec::new();
        while let Some(next) = disturbance.next_change(origin, time) {
            prop_assert!(next > time);
            changes.push(next);
            time = next;
        }
        prop_assert_eq!(changes.first(), Some(&(origin + 0.5)));
        prop_assert_eq!(changes.last(), Some(&(origin + 2.0)));
        prop_assert!(changes.len() <= (1.5 / period) as usize + 3);
        prop_assert!(!disturbance.acts(origin) && disturbance.acts(origin + 0.5) && !disturbance.acts(origin + 2.0));
    }
}

#[test]
fn white_noise_is_a_pure_function_of_seed_and_tick() {
    let body = body();
    let noise = of(Kind::White);
    let forward: Vec<_> = (0..200).map(|tick| noise.sample(tick, &still(&body))).collect();
    let backward: Vec<_> = (0..200).rev().map(|tick| noise.sample(tick, &still(&body))).collect();
    assert!(forward.iter().eq(backward.iter().rev()));
    assert_ne!(forward[0], Disturbance { seed: 2, ..noise.clone() }.sample(0, &still(&body)));
}

#[test]
fn oracle_random_access_gives_the_generator_s_sequence() {
    let body = body();
    let unit = Disturbance { bound: 1.0, seed: 42, ..of(Kind::White) };
    let mut generator = Pcg64::seed_from_u64(42);
    for tick in 0..1000 {
        let expected =
            Vector3::from_fn(|_, _| (generator.next_u64() >> 11) as f64 * 2f64.powi(-52) - 1.0);
        assert_eq!(unit.sample(tick, &still(&body)), expected, "tick {tick}");
    }
}

#[test]
fn regress_white_noise_of_seed_1() {
    let body = body();
    let unit = Disturbance { bound: 1.0, ..of(Kind::White) };
    let got = [0, 1, 1_000_000].map(|tick| unit.sample(tick, &still(&body)).x);
    assert_eq!(got, [0.6797473170518498, 0.9660317626188819, 0.08812515661859677]);
}

#[test]
fn oracle_white_noise_has_the_moments_of_a_uniform_distribution_and_no_memory() {
    let body = body();
    for seed in [1, 2, 3] {
        let unit = Disturbance { bound: 1.0, seed, ..of(Kind::White) };
        let n = 100_000;
        let samples: Vec<_> = (0..n).map(|tick| unit.sample(tick, &still(&body))).collect();
        let mean = samples.iter().sum::<Vector3<f64>>() / n as f64;
        let variance = samples.iter().map(|s| s.component_mul(s)).sum::<Vector3<f64>>() / n as f64;
        let next =
            samples.windows(2).map(|w| w[0].component_mul(&w[1])).sum::<Vector3<f64>>() / n as f64;
        let across = samples.iter().map(|s| s.x * s.y + s.y * s.z).sum::<f64>() / n as f64;
        // The bounds are five standard deviations of each estimate.
        assert!(mean.amax() < 0.0092, "{mean}");
        assert!((variance - Vector3::repeat(1.0 / 3.0)).amax() < 0.0048, "{variance}");
        assert!(next.amax() < 0.0053, "{next}");
        assert!(across.abs() < 0.0075, "{across}");
    }
}

#[test]
fn different_seeds_are_uncorrelated() {
    let body = body();
    let sum: f64 = (0..10_000)
        .map(|tick| {
            let [a, b] = [7, 8].map(|seed| {
                Disturbance { bound: 1.0, seed, ..of(Kind::White) }.sample(tick, &still(&body))
            });
            a.dot(&b)
        })
        .sum();
    assert!((sum / 10_000.0).abs() < 0.029, "{sum}"); // five standard deviations
}

#[test]
fn square_wave_begins_positive_at_its_start() {
    let body = body();
    let square =
        Disturbance { start: 1.0, direction: Vector3::new(1.0, 0.0, -0.5), ..of(Kind::Square) };
    let at = |time: f64| square.sample(square.tick(0.0, time), &still(&body));
    let high = Vector3::new(0.035, 0.0, -0.0175);
    for (time, expected) in [(1.0, high), (2.4, high), (2.5, -high), (3.9, -high), (4.0, high)] {
        assert_eq!(at(time), expected, "at {time}");
    }
    assert_eq!(square.next_change(0.0, 0.0), Some(1.0));
    assert_eq!(square.next_change(0.0, 1.0), Some(2.5));
    assert_eq!(square.next_change(0.0, 2.5), Some(4.0));
}

#[test]
fn values_out_of_range_are_refused_by_name() {
    let good = of(Kind::White);
    good.check().unwrap();
    for (bad, name) in [
        (Disturbance { bound: -1.0, ..good.clone() }, "disturbance.bound"),
        (Disturbance { bound: f64::NAN, ..good.clone() }, "disturbance.bound"),
        (Disturbance { period: 0.0, ..good.clone() }, "disturbance.period"),
        (Disturbance { square_period: f64::INFINITY, ..good.clone() }, "disturbance.square_period"),
        (Disturbance { direction: Vector3::repeat(1.5), ..good.clone() }, "disturbance.direction"),
        (Disturbance { start: 3.0, end: 2.0, ..good.clone() }, "disturbance.end"),
    ] {
        let message = bad.check().unwrap_err().to_string();
        assert!(message.starts_with(&format!("`{name}`")), "{message}");
    }
}
