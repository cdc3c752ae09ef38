//! Tests of instances in several threads of one process.

use conformance::interface::CO_SIMULATION;
use conformance::{Bits, Instance, Unit, units};
use std::sync::Barrier;

/// Number of ticks, large enough for the threads to overlap within optimisations.
const TICKS: u32 = 30;

fn run(unit: &Unit) -> Vec<Bits> {
    unit.instance(CO_SIMULATION).initialized().drive(0..TICKS)
}

#[test]
fn eight_instances_in_eight_threads_give_the_bits_of_one() {
    for unit in units() {
        let alone = run(&unit);
        let start = Barrier::new(8);
        let one_of_eight = || {
            start.wait();
            run(&unit)
        };
        std::thread::scope(|scope| {
            let runs: Vec<_> = (0..8).map(|_| scope.spawn(one_of_eight)).collect();
            for (k, result) in runs.into_iter().enumerate() {
                assert!(result.join().unwrap() == alone, "{} in thread {k}", unit.name());
            }
        });
    }
}

#[test]
fn different_units_in_threads_do_not_see_each_other() {
    let units = units();
    let alone: Vec<_> = units.iter().map(run).collect();
    std::thread::scope(|scope| {
        let runs: Vec<_> = units.iter().map(|unit| scope.spawn(|| run(unit))).collect();
        for ((result, alone), unit) in runs.into_iter().zip(alone).zip(&units) {
            assert!(result.join().unwrap() == alone, "{}", unit.name());
        }
    });
}

struct Moving(Instance);

// SAFETY: only one thread at a time uses it, because each thread is joined before the next begins.
#[allow(unsafe_code)]
unsafe impl Sync for Moving {}

impl Moving {
    fn drive(&self, tick: u32) -> Vec<Bits> {
        self.0.drive(tick..tick + 1)
    }
}

#[test]
fn an_instance_may_move_from_thread_to_thread() {
    for unit in units() {
        let alone = run(&unit);
        let moving = Moving(unit.instance(CO_SIMULATION).initialized());
        let mut rows = vec![];
        for tick in 0..TICKS {
            rows.extend(std::thread::scope(|scope| {
                scope.spawn(|| moving.drive(tick)).join().unwrap()
            }));
        }
        assert!(rows == alone, "{}", unit.name());
    }
}
