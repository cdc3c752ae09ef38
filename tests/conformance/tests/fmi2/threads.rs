//! Tests of instances in several threads of one process.

use crate::prelude::*;
use std::sync::Barrier;

/// Number of ticks, large enough for the threads to overlap within optimisations.
const TICKS: u32 = 30;

fn run(fmu: &Fmu) -> Vec<Bits> {
    fmu.instance(CO_SIMULATION).initialized().drive(0..TICKS)
}

#[test]
fn eight_instances_in_eight_threads_give_the_bits_of_one() {
    for fmu in fmus() {
        let alone = run(&fmu);
        let start = Barrier::new(8);
        let one_of_eight = || {
            start.wait();
            run(&fmu)
        };
        std::thread::scope(|scope| {
            let runs: Vec<_> = (0..8).map(|_| scope.spawn(one_of_eight)).collect();
            for (k, result) in runs.into_iter().enumerate() {
                assert!(result.join().unwrap() == alone, "{} in thread {k}", fmu.name());
            }
        });
    }
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
    for fmu in fmus() {
        let alone = run(&fmu);
        let moving = Moving(fmu.instance(CO_SIMULATION).initialized());
        let mut rows = vec![];
        for tick in 0..TICKS {
            rows.extend(std::thread::scope(|scope| {
                scope.spawn(|| moving.drive(tick)).join().unwrap()
            }));
        }
        assert!(rows == alone, "{}", fmu.name());
    }
}
