//! The disturbance over time: square waves, tables, and values held from tick to tick.

use super::{config, moment, undisturbed};
use crate::prelude::*;
use vehicle::disturbance::Row;

/// Returns a plant under this disturbance with the bound of crmpc-2022.
fn disturbed(disturbance: Disturbance) -> Plant {
    let bound = config().disturbance.bound;
    let disturbance = Disturbance { bound, start: 0.5, ..disturbance };
    Plant::new(&Config { disturbance, ..config() }, 0.0).unwrap()
}

#[test]
fn oracle_square_and_constant_as_tables_bit_for_bit() {
    let direction = Vector3::new(1.0, -0.3, 0.8);
    let tabulated = |period: f64, rows: &[(f64, f64)]| {
        let row = |&(time, sign)| Row { time, direction: direction * sign };
        let table = DisturbanceTable { period, rows: rows.iter().map(row).collect() };
        disturbed(Disturbance { kind: DisturbanceKind::Table, table, ..Disturbance::default() })
    };
    let disturbed_by = |kind, square_period| {
        disturbed(Disturbance { kind, direction, square_period, ..Disturbance::default() })
    };
    // The jumps k · period / 2 of the square wave and the table's repetition · period + time are
    // the same numbers if period / 2 is a short binary fraction, and otherwise rounded differently.
    for (kind, square_period, period, rows, bound) in [
        (DisturbanceKind::Square, 1.5, 1.5, vec![(0.0, 1.0), (0.75, -1.0)], 0.0),
        (DisturbanceKind::Square, 0.7, 0.7, vec![(0.0, 1.0), (0.35, -1.0)], 1e-14),
        (DisturbanceKind::Constant, 1.0, 0.0, vec![(0.0, 1.0)], 0.0),
    ] {
        let (mut kind, mut table) = (disturbed_by(kind, square_period), tabulated(period, &rows));
        for k in 0..125 {
            let [from, to] = [0.04 * f64::from(k), 0.04 * f64::from(k + 1)];
            kind.advance(from, to, moment(k / 5)).unwrap();
            table.advance(from, to, moment(k / 5)).unwrap();
            let difference = (kind.state - table.state).amax();
            assert!(difference <= bound, "{difference} at {to} s");
        }
    }
}

#[test]
fn oracle_a_table_gives_the_parabolas_of_its_rows_whatever_the_communication_step() {
    // At beta = 0, without roll and yaw, Δ_α is the second derivative of α.
    let rows = [(0.3, 1.0), (0.7001, -0.5), (1.15, 0.0), (1.3, -1.0)];
    let row = |(time, x)| Row { time, direction: Vector3::new(x, 0.0, 0.0) };
    let table = DisturbanceTable { period: 1.7, rows: rows.map(row).to_vec() };
    let disturbance = Disturbance {
        kind: DisturbanceKind::Table,
        bound: 0.03,
        table,
        start: 0.1,
        ..Disturbance::default()
    };
    let (mut alpha, mut rate, mut time) = (0.1, 0.0, 0.0);
    for (until, factor) in [0.0, 1.7].into_iter().flat_map(|begin| {
        [(0.3, 0.0), (0.7001, 1.0), (1.15, -0.5), (1.3, 0.0), (1.7, -1.0)]
            .map(move |(until, factor)| (0.1 + begin + until, factor))
    }) {
        let (t, delta) = (until - time, 0.03 * factor);
        alpha += rate * t + delta * t * t / 2.0;
        rate += delta * t;
        time = until;
    }
    for steps in [1, 7, 85, 1000] {
        let initial = Vector6::new(0.1, 0.0, 0.3, 0.0, 0.0, 0.0);
        let config = Config { disturbance: disturbance.clone(), ..undisturbed(initial, 0.01) };
        let mut plant = Plant::new(&config, 0.0).unwrap();
        let at = |k: u32| time * f64::from(k) / f64::from(steps);
        for k in 0..steps {
            plant.advance(at(k), at(k + 1), Vector3::zeros()).unwrap();
        }
        assert!((plant.angles().x - alpha).abs() < 1e-14, "{steps}: {}", plant.angles().x - alpha);
        assert!((plant.rates().y - rate).abs() < 1e-15, "{steps}: {}", plant.rates().y - rate);
    }
}

#[test]
fn state_dependent_disturbance_is_drawn_at_the_tick_and_held() {
    let mut config = config();
    config.disturbance.kind = DisturbanceKind::AgainstMoment;
    config.disturbance.period = 0.2;
    let mut plant = Plant::new(&config, 0.0).unwrap();
    let push = Vector3::new(1e4, 1e4, 1e4);
    plant.advance(0.0, 0.04, push).unwrap();
    let held = plant.held().unwrap();
    plant.advance(0.04, 0.2, -push).unwrap();
    assert_eq!(plant.held().unwrap().delta(), held.delta());
    plant.advance(0.2, 0.24, -push).unwrap();
    assert_eq!(plant.held().unwrap().delta(), -held.delta());
}
