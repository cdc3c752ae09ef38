//! Benchmark of one 0.04 s step of the unit `ReentryPlant`, called from Rust. It measures the work
//! of `fmi2DoStep` behind the C interface, with the white noise of Chai 2022, once without and once
//! with the next outputs.

use criterion::{Criterion, criterion_group, criterion_main};
use fmi2_export::{Context, Inputs, Model};
use fmu_plant::ReentryPlant;
use std::hint::black_box;

const STEP: f64 = 0.04;
/// Number of steps after which the unit starts again, so that it stays near its start without a
/// controller.
const STEPS: u32 = 25;

/// Inputs that keep their values during a step.
struct Held;

impl Inputs<ReentryPlant> for Held {
    fn advance(&self, _: &mut ReentryPlant, _: f64) {}
}

fn steps(criterion: &mut Criterion) {
    let mut started = ReentryPlant::new();
    started.initialize(&Context { start_time: 0.0, stop_time: None, resources: None }).unwrap();
    for (name, outputs) in
        [("plant step of 0.04 s", false), ("plant step of 0.04 s with outputs", true)]
    {
        let (mut unit, mut k) = (started.clone(), 0);
        criterion.bench_function(name, |bencher| {
            bencher.iter(|| {
                if k == STEPS {
                    (unit, k) = (started.clone(), 0);
                }
                let time = f64::from(k) * STEP;
                unit.step(time, time + STEP, &Held, &mut |_| {}).unwrap();
                k += 1;
                if outputs {
                    unit.calculate(time + STEP).unwrap();
                }
                black_box(&unit);
            });
        });
    }
}

criterion_group!(benches, steps);
criterion_main!(benches);
