//! Lemma 5: the observer.

use crate::prelude::*;
use control::sliding::{Estimate, Settings};
use proptest::prelude::*;

/// Returns the observer of Table 1 with `l` in place of L.
fn observer(l: f64) -> Observer {
    let published = Settings::sotvsmc_do().observer.unwrap();
    Observer { l: [l; 3], ..published }
}

/// A run of the observer in which time is stretched by `stretch` and Δv̈ is multiplied by `size`.
/// The noise on s is then stretched by size · stretch³. Returns all estimates.
fn estimates(stretch: f64, size: f64, noise: &[f64]) -> Vec<Estimate> {
    let (observer, period) = (observer(0.005 * size), 0.01 * stretch);
    let (of_s, of_v) = (size * stretch.powi(3), size * stretch * stretch);
    let mut estimate = Estimate::default();
    let mut at = 0.0;
    let samples = noise.iter().map(|noise| {
        // The time τ = t/stretch is that of the run which is not stretched.
        at += 0.01;
        let tau: f64 = at;
        let s = 1e-3 * (3.0 * tau).sin() + 0.5e-3 * (8.0 * tau).cos() + 1e-5 * noise;
        let drive = 0.02 * (2.0 * tau).cos() - 0.01;
        estimate = observer.advance(
            &estimate,
            &Vector3::repeat(s * of_s),
            &Vector3::repeat(drive * of_v),
            period,
        );
        estimate
    });
    samples.collect()
}

proptest! {
    #[test]
    fn oracle_estimates_scale_with_the_noise_as_25_says(
        stretch in prop_oneof![0.1..0.7, 1.5..10.0],
        size in prop_oneof![0.1..0.7, 1.5..10.0],
        noise in proptest::collection::vec(-1.0..1.0, 300),
    ) {
        // If s and its noise ε are stretched by κ³ and time by κ, the estimates are stretched by
        // κ³, κ² and κ, that is by ε, ε^(2/3) and ε^(1/3). What holds for one noise with
        // constants μ therefore holds for every noise, and the same if all is scaled, L included.
        // Differences are of 1e-15, but the square root in (24) can make 1e-9 of a rounding error
        // near its zero. A power that is wrong by 0.003 shows at 1e-6.
        let (plain, stretched) = (estimates(1.0, 1.0, &noise), estimates(stretch, size, &noise));
        for (plain, stretched) in plain.iter().zip(&stretched) {
            for (plain, stretched, power) in [
                (plain.sliding, stretched.sliding, 3),
                (plain.disturbance, stretched.disturbance, 2),
                (plain.disturbance_rate, stretched.disturbance_rate, 1),
            ] {
                let back = stretched.x / (size * stretch.powi(power));
                prop_assert!((back - plain.x).abs() < 1e-9, "{back} {}", plain.x);
            }
        }
    }

    #[test]
    fn oracle_the_observer_follows_a_second_derivative_up_to_lambda_2_l(
        share in -0.7..0.7,
        more in 1.05..1.5,
        start in -0.02..0.02,
        rate in -0.01..0.01,
    ) {
        let observer = observer(0.005);
        let strongest = observer.lambda[2] * observer.l[0];
        // Errors of z₁ and z₂ after `ticks` of Δv with this constant second derivative.
        let off = |second: f64, ticks: u32| {
            let (start, rate): (f64, f64) = (start, rate);
            let (mut estimate, mut s, period) = (Estimate::default(), 0.0, 1e-3);
            let mut off = (0.0_f64, 0.0_f64);
            for k in 0..ticks {
                let t = f64::from(k) * period;
                let value = start + rate * t + second * t * t / 2.0;
                if k + 1000 > ticks {
                    let slope = rate + second * t;
                    off.0 = off.0.max((estimate.disturbance.x - value).abs());
                    off.1 = off.1.max((estimate.disturbance_rate.x - slope).abs());
                }
                estimate = observer.advance(&estimate, &Vector3::repeat(s), &Vector3::zeros(), period);
                s += value * period;
            }
            off
        };
        let (of_z1, of_z2) = off(share * strongest, 8_000);
        prop_assert!(of_z1 < 6e-7 && of_z2 < 2.4e-4, "{of_z1} {of_z2}");
        // A stronger one outruns z₂, whose rate is λ₂ L at most.
        let (early, late) = (off(more * strongest, 8_000).1, off(more * strongest, 16_000).1);
        let expected: f64 = (more - 1.0) * strongest * 8.0;
        prop_assert!(((late - early) / expected - 1.0).abs() < 8e-12, "{early} {late} {expected}");
    }
}
