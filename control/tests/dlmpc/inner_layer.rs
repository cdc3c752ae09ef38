//! The inner layer: its sliding mode.

use super::dlmpc;
use crate::prelude::*;
use control::dlmpc::{Memory, Settings, SlidingMode};

/// Returns all ticks of the scenario with white noise.
fn ticks() -> Vec<Recorded<Memory>> {
    recorded(&mut dlmpc(), 1.05, 1)
}

/// Returns the rates under the inner law alone, one sample after another. The attitude rests at a
/// constant reference, so that the commanded rates are zero and ω⁺ = ω + T ω̇.
fn inner_law(
    sliding_mode: SlidingMode,
    rates: Vector3<f64>,
    ticks: u64,
) -> Vec<(Vector3<f64>, Memory)> {
    let settings = Settings { sliding_mode, ..Settings::published() };
    let mut controller = Dlmpc::new(settings).unwrap();
    let still = Reference { angles: Vector3::new(0.2, 0.1, -0.5), ..Reference::default() };
    let mut memory = controller.memory();
    let mut measured = Measurement { angles: still.angles, rates, ..Measurement::default() };
    (0..ticks)
        .map(|tick| {
            let moment = controller.update(&mut memory, tick, 0.0, &measured, &|_| still);
            assert_eq!(memory.rate_command, Vector3::zeros());
            let seen = (moment, memory.clone());
            measured.rates += settings.body.angular_acceleration(&measured.rates, &moment)
                * settings.period_feedback;
            seen
        })
        .collect()
}

#[test]
fn oracle_sampled_sliding_mode_chatters_with_the_closed_form_amplitude() {
    // The amplitude solves −s = (1 − q T) s − p T |s|^ρ sgn s.
    let period = Settings::published().period_feedback;
    for (q, p, rho) in [(5.0, 5.0, 0.7), (0.0, 5.0, 0.7), (2.0, 3.0, 0.6)] {
        let amplitude = (p * period / (2.0 - q * period)).powf(1.0 / (1.0 - rho));
        let seen =
            inner_law(SlidingMode { q, p, gamma: 0.0, rho }, Vector3::new(5e-3, -3e-3, 1e-3), 400);
        for pair in seen[300..].windows(2) {
            let (now, next) = (pair[0].1.sliding, pair[1].1.sliding);
            for i in 0..3 {
                assert!((now[i].abs() / amplitude - 1.0).abs() < 1e-6, "{now} {amplitude}");
                assert!(now[i] * next[i] < 0.0);
            }
        }
        // The gain of the manifold changes it little.
        let seen = inner_law(
            SlidingMode { q, p, gamma: 0.15, rho },
            Vector3::new(5e-3, -3e-3, 1e-3),
            2000,
        );
        for (_, memory) in &seen[1900..] {
            assert!((memory.sliding.amax() / amplitude - 1.0).abs() < 0.05, "{memory:?}");
        }
    }
}

#[test]
fn the_integral_rests_while_the_moment_is_scaled_into_its_limit() {
    let settings = Settings::published();
    let SlidingMode { gamma, rho, .. } = settings.sliding_mode;
    let seen = inner_law(settings.sliding_mode, Vector3::new(0.08, -0.05, 0.03), 200);
    let mut counts = [0, 0];
    for pair in seen.windows(2) {
        let (moment, memory) = &pair[1];
        let before = pair[0].1.integral;
        let saturated = moment.norm() > settings.limit_moment * (1.0 - 1e-12);
        counts[usize::from(saturated)] += 1;
        // The error e follows from s = e + Γ z.
        let e = memory.sliding - before * gamma;
        let growth = e.map(|e| e.abs().powf(rho).copysign(e)) * settings.period_feedback;
        let expected = if saturated { before } else { before + growth };
        assert!((memory.integral - expected).amax() <= 1e-12 * growth.amax());
    }
    assert!(counts.iter().all(|&count| count > 5), "{counts:?}");
}

#[test]
fn oracle_inner_law_is_the_reaching_law() {
    // The reaching law is ṡ = −q s − p sig^ρ(s), with ṡ = ω̇ + Γ sig^ρ(e) for a held command.
    let settings = Settings::published();
    let SlidingMode { q, p, gamma, rho } = settings.sliding_mode;
    let power = |x: Vector3<f64>| x.map(|x| x.abs().powf(rho).copysign(x));
    let mut controller = dlmpc();
    for sample in ticks().iter().step_by(13) {
        let (memory, moment) = sample.update(&mut controller);
        if moment.norm() > settings.limit_moment * (1.0 - 1e-9) {
            continue;
        }
        let e = sample.measured.rates - memory.rate_command;
        let s = e + sample.before.integral * gamma;
        let growth =
            settings.body.angular_acceleration(&sample.measured.rates, &moment) + power(e) * gamma;
        assert!(
            (growth + s * q + power(s) * p).norm() < 1e-12 * (1.0 + growth.norm()),
            "tick {}",
            sample.tick
        );
    }
}
