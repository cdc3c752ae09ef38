//! Time of one control allocation, with the effectors of Wu 2015 and moments as in its figures: the
//! distribution over 20 s at 0.01 s. Each sample is repeated from the same memory. The smallest
//! time of each sample and the mean over all are printed.

use control::allocation::{Allocator, Command, JetCommand, Memory, Method, Settings};
use criterion::{Criterion, criterion_group, criterion_main};
use nalgebra::Vector3;
use std::hint::black_box;

/// Number of repetitions of each sample.
const REPETITIONS: usize = 20;
/// Number of samples in 20 s.
const SAMPLES: u32 = 2000;

/// Returns a large moment that decays, with the disturbance (66) of Wu 2015 to be cancelled: from
/// saturation to rest.
fn command(sample: u32) -> Command {
    let t = f64::from(sample) * 0.01;
    let disturbance = 1e4 * (0.5 + (0.1 * t).sin() + t.sin());
    let manoeuvre = Vector3::new(-1.5e5, 2.5e5, 1e5) * (1.0 - t) * (-t).exp();
    Command {
        moment: manoeuvre - Vector3::repeat(disturbance),
        dynamic_pressure: 2859.0,
        ..Command::default()
    }
}

fn allocations(criterion: &mut Criterion) {
    for (name, method) in [("optimal", Method::Optimal), ("blending", Method::Blending)] {
        let settings = Settings { method, jets: JetCommand::Duty, ..Settings::published() };
        let mut allocator = Allocator::new(settings).unwrap();
        let mut memory = Memory::default();
        let (mut smallest, mut all, mut middle) = (Vec::new(), Vec::new(), memory);
        let mut iterations = 0;
        for sample in 0..SAMPLES {
            let command = command(sample);
            let mut after = memory;
            let times: Vec<f64> = (0..REPETITIONS)
                .map(|_| {
                    after = memory;
                    allocator.update(&mut after, u64::from(sample), 0.0, black_box(&command));
                    after.report.time * 1e3
                })
                .collect();
            smallest.push(times.iter().copied().fold(f64::INFINITY, f64::min));
            all.extend(times);
            memory = after;
            iterations += memory.report.iterations;
            if sample == SAMPLES / 2 {
                middle = memory;
            }
        }
        let mean = |times: &[f64]| times.iter().sum::<f64>() / times.len() as f64;
        let (mean_smallest, mean_all) = (mean(&smallest), mean(&all));
        smallest.sort_by(f64::total_cmp);
        println!(
            "{name}: {SAMPLES} samples, ms: mean of all {mean_all:.4}, mean of the smallest {mean_smallest:.4}, median {:.4}, \
             worst {:.4}; iterations {:.1}, fallbacks {}",
            smallest[smallest.len() / 2],
            smallest[smallest.len() - 1],
            f64::from(iterations) / f64::from(SAMPLES),
            memory.report.fallbacks,
        );
        criterion.bench_function(name, |bencher| {
            bencher.iter(|| {
                let mut after = middle;
                allocator.update(&mut after, 0, 0.0, black_box(&command(SAMPLES / 2 + 1)));
                after
            });
        });
    }
}

criterion_group!(benches, allocations);
criterion_main!(benches);
