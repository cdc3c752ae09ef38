//! Tests of disturbances: bounds, reproducibility, signs and waveforms.

use crate::prelude::*;
use proptest::prelude::*;
use rand_pcg::Pcg64;
use rand_pcg::rand_core::SeedableRng;
use vehicle::disturbance::{Row, View};
use vehicle::dynamics::RigidBody;
use vehicle::kinematics;

fn of_kind(kind: DisturbanceKind) -> Disturbance {
    Disturbance { kind, bound: 0.035, period: 0.04, square_period: 3.0, ..Disturbance::default() }
}

/// Returns a table whose rows have these times (s) and α factors.
fn table(start: f64, period: f64, rows: &[(f64, f64)]) -> Disturbance {
    let row = |&(time, alpha): &(f64, f64)| Row { time, direction: Vector3::new(alpha, 0.0, -0.5) };
    let table = DisturbanceTable { period, rows: rows.iter().map(row).collect() };
    Disturbance { start, table, bound: 1.0, ..of_kind(DisturbanceKind::Table) }
}

/// Times (s) and values of Δ_α after each change until `end` (s).
fn waveform(disturbance: &Disturbance, end: f64) -> Vec<(f64, f64)> {
    let body = body();
    let mut time = disturbance.start;
    let mut waveform = Vec::new();
    while time < end {
        waveform.push((time, disturbance.sample(disturbance.tick(0.0, time), &still(&body)).x));
        let Some(next) = disturbance.next_change(0.0, time) else { break };
        assert!(next > time, "{next} after {time}");
        time = next;
    }
    waveform
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
        noise: None,
    }
}

fn vector(size: f64) -> impl Strategy<Value = Vector3<f64>> {
    (-size..size, -size..size, -size..size).prop_map(|(x, y, z)| Vector3::new(x, y, z))
}

proptest! {
    #[test]
    fn each_component_keeps_the_bound(seed: u64, tick in 0..1_000_000_i64, angles in vector(1.0), rates in vector(0.1), moment in vector(1e5)) {
        let body = body();
        let view = View { body: &body, kinematics: Kinematics::Printed, angles, rates, moment, noise: None };
        for kind in [DisturbanceKind::None, DisturbanceKind::White, DisturbanceKind::Constant, DisturbanceKind::Square, DisturbanceKind::AlongRate, DisturbanceKind::AgainstMoment] {
            let delta = Disturbance { seed, ..of_kind(kind) }.sample(tick, &view);
            prop_assert!(delta.amax() <= 0.035, "{kind:?}: {delta}");
        }
    }

    #[test]
    fn state_dependent_kinds_choose_the_worst_corner(angles in vector(1.0), rates in vector(0.1), moment in vector(1e5)) {
        let body = body();
        let view = View { body: &body, kinematics: Kinematics::Printed, angles, rates, moment, noise: None };
        let along = of_kind(DisturbanceKind::AlongRate).sample(0, &view);
        let against = of_kind(DisturbanceKind::AgainstMoment).sample(0, &view);
        let control = kinematics::r(&angles) * body.inverse * moment;
        for corner in 0..8 {
            let other = Vector3::from_fn(|i, _| if corner >> i & 1 == 0 { 0.035 } else { -0.035 });
            let growth = |delta: &Vector3<f64>| rates.dot(&(kinematics::r_inverse(&angles) * delta));
            prop_assert!(growth(&along) >= growth(&other) - 1e-15);
            prop_assert!(against.dot(&control) <= other.dot(&control) + 1e-15);
        }
    }

    #[test]
    fn oracle_a_table_changes_where_its_rows_begin(
        start in -1e3..1e3,
        gaps in proptest::collection::vec(1e-3..2.0, 1..9),
        first in prop_oneof![Just(0.0), 1e-3..2.0],
        repeats: bool,
    ) {
        let times: Vec<f64> = gaps.iter().scan(first, |time, gap| {
            let now = *time;
            *time += gap;
            Some(now)
        }).collect();
        let last = times[times.len() - 1] + gaps[gaps.len() - 1];
        let period = if repeats { last } else { 0.0 };
        let rows: Vec<_> = times.iter().zip(1..).map(|(&time, i)| (time, 0.1 * f64::from(i))).collect();
        let disturbance = table(start, period, &rows);
        disturbance.check().unwrap();
        // Written out, with the interval before the first row if there is one.
        let mut expected = Vec::new();
        for repetition in 0..if repeats { 3 } else { 1 } {
            let begin = start + f64::from(repetition) * period;
            expected.extend((first > 0.0).then_some((begin, 0.0)));
            expected.extend(rows.iter().map(|(time, alpha)| (begin + time, *alpha)));
        }
        let changes = waveform(&disturbance, if repeats { start + 3.0 * period - 1e-9 } else { 1e9 });
        prop_assert_eq!(changes.len(), expected.len());
        for (change, expected) in changes.iter().zip(&expected) {
            prop_assert_eq!(change.1, expected.1);
            prop_assert!((change.0 - expected.0).abs() <= 1e-12, "{:?} {:?}", change, expected);
        }
    }

    #[test]
    fn changes_come_one_after_the_other(origin in -10.0..10.0, period in 1e-3..1.0) {
        let disturbance = Disturbance { period, start: origin + 0.5, end: origin + 2.0, ..of_kind(DisturbanceKind::White) };
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
fn oracle_random_access_gives_the_generator_s_sequence_of_each_seed() {
    let body = body();
    for seed in [7, 42] {
        let unit = Disturbance { bound: 1.0, seed, ..of_kind(DisturbanceKind::White) };
        let mut generator = Pcg64::seed_from_u64(seed);
        for tick in 0..1000 {
            let mut next = || (generator.next_u64() >> 11) as f64 * 2f64.powi(-52) - 1.0;
            let expected = Vector3::from_fn(|_, _| next());
            assert_eq!(unit.sample(tick, &still(&body)), expected, "tick {tick}");
        }
    }
}

#[test]
fn oracle_white_noise_has_the_moments_of_a_uniform_distribution_and_no_memory() {
    let body = body();
    for seed in [1, 2, 3] {
        let unit = Disturbance { bound: 1.0, seed, ..of_kind(DisturbanceKind::White) };
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
fn rows_closer_than_rounding_far_from_the_start_neither_stop_time_nor_panic() {
    let rows = [(0.0, 1.0), (1e-13, 0.5), (2e-3, -1.0), (5e14, 1.0)];
    for (period, rows) in [(0.0, &rows[..]), (3e-3, &rows[..3]), (1e-3, &rows[..2])] {
        for start in [-1e300, -1e15, -1e9, 0.0, 0.1, 1e9] {
            let table = table(start, period, rows);
            table.check().unwrap();
            for mut time in [-1e300, -1e15, 0.0, start, 1.7e9, 1e15, 1e300] {
                for _ in 0..100 {
                    assert!(table.tick(0.0, time) <= 4);
                    let Some(next) = table.next_change(0.0, time) else { break };
                    assert!(next > time, "{next} after {time}, start {start}");
                    time = next;
                }
            }
        }
    }
}

#[test]
fn far_from_its_start_a_table_still_goes_through_all_rows() {
    // The start is so long ago that the number of a repetition may be rounded down or up.
    for start in [-1.1e12, -3.44e10 - 0.1] {
        let table = table(start, 0.3, &[(0.0, 1.0), (0.15, -1.0)]);
        let mut time = 0.0;
        let mut row = table.tick(0.0, time);
        for change in 0..5000 {
            let next = table.next_change(0.0, time).unwrap();
            assert!(next - time < 0.1505, "change {change} from {time} s to {next} s");
            let shortly_before = next - 2e-6;
            assert_eq!(table.tick(0.0, shortly_before), row, "change {change} at {next} s");
            assert_eq!(table.next_change(0.0, shortly_before), Some(next));
            row = 3 - row;
            time = next;
            assert_eq!(table.tick(0.0, time), row, "change {change} at {time} s");
        }
    }
}
