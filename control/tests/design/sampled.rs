//! Bounds of the sampled error dynamics compared with simulation.

use super::{assert_digits, gain, published, settings};
use crate::prelude::*;
use control::crmpc::step_response_peak;
use control::error_dynamics::{Reach, response};
use proptest::prelude::*;

/// Returns the limit of [`SampledError::reach`] for infinitely many periods.
fn forever(error: &SampledError) -> Reach {
    error.reach(error.settling().unwrap()).pop().unwrap()
}

/// Deviation of one axis simulated without the code under test: ö = K o + Δ with K o held over each
/// period of `parts.len()` equal parts, and Δ given for each part.
struct Simulation {
    gain: Gain,
    period: f64,
    deviation: Vector2<f64>,
}

impl Simulation {
    fn new(gain: Gain, period: f64) -> Self {
        Self { gain, period, deviation: Vector2::zeros() }
    }

    fn feedback(&self) -> f64 {
        self.gain.k1 * self.deviation.x + self.gain.k2 * self.deviation.y
    }

    fn advance(&mut self, parts: &[f64]) {
        let (feedback, h) = (self.feedback(), self.period / parts.len() as f64);
        for disturbance in parts {
            let a = feedback + disturbance;
            self.deviation.x += h * self.deviation.y + 0.5 * h * h * a;
            self.deviation.y += h * a;
        }
    }

    /// Returns angle, rate and feedback.
    fn outputs(&self) -> [f64; 3] {
        [self.deviation.x, self.deviation.y, self.feedback()]
    }
}

const PUBLISHED_CASES: [(f64, f64, [f64; 3]); 3] = [
    (-5.0, 0.04, [0.2000, 0.3147, 1.2472]),
    (-5.0, 0.2, [0.2000, 0.4000, 1.3800]),
    (-10.0, 0.04, [0.1000, 0.1743, 1.1518]),
];

#[test]
fn oracle_sampled_bounds() {
    // The L1 norms under zero-order hold come from an independent calculation (docs/errata.md). A
    // disturbance that may change at any time reaches as far or slightly further, where a response
    // changes its sign within a period.
    for (k, period, expected) in PUBLISHED_CASES {
        let mut impulse = Simulation::new(gain(k), period);
        impulse.advance(&[1.0]);
        let mut held = [0.0; 3];
        for _ in 0..2000 {
            for (sum, output) in held.iter_mut().zip(impulse.outputs()) {
                *sum += output.abs();
            }
            impulse.advance(&[0.0]);
        }
        let reach = forever(&SampledError::new(gain(k), period));
        for (i, value) in [reach.angle, reach.rate, reach.feedback].into_iter().enumerate() {
            assert_digits(held[i], expected[i], 4);
            assert!(
                value >= held[i] * (1.0 - 1e-12) && value <= 1.1 * held[i],
                "K {k}: {value} {}",
                held[i]
            );
        }
    }
}

#[test]
fn oracle_marginal_gain_is_refused_with_its_spectral_radius() {
    // Here Φ = [0.8 0; −2 −1].
    let settings = Settings { feedback: gain(-10.0), period_feedback: 0.2, ..settings() };
    let error = Design::new(&settings).unwrap_err();
    let DesignError::Unstable { k1, k2, period, radius, .. } = error else { panic!("{error}") };
    assert_eq!([k1, k2, period], [-10.0, -10.0, 0.2]);
    assert!((radius - 1.0).abs() < 1e-12);
    assert!(error.to_string().contains("spectral radius 1.000000"), "{error}");
    // At 25 Hz the same gain is stable.
    Design::new(&Settings { period_feedback: 0.04, ..settings }).unwrap();
}

#[test]
fn oracle_constant_disturbance_reaches_the_peak_of_the_step_response_only() {
    // (24) and (26): c̄Δ̄ bounds the rate under a constant Δ. One change of sign after settling
    // doubles it.
    let c = published().c;
    let mut simulation = Simulation::new(gain(-10.0), 1e-4);
    let mut peak = |disturbance: f64| {
        let mut peak = 0.0f64;
        for _ in 0..200_000 {
            simulation.advance(&[disturbance]);
            peak = peak.max(simulation.deviation.y.abs());
        }
        peak
    };
    assert_digits(peak(-1.0), c, 4);
    assert_digits(peak(1.0) / 2.0, c, 4);
    // It cannot exceed that, as the exact bound tends to 2 c̄ with the period.
    let reach = forever(&SampledError::new(gain(-10.0), 1e-4));
    assert!((reach.rate / (2.0 * step_response_peak(gain(-10.0)).unwrap()) - 1.0).abs() < 1e-3);
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn one_period_is_what_simulation_says(
        k1 in -30.0..-0.1f64, k2 in -30.0..-0.1f64, period in 0.001..0.2f64,
        angle in -1.0..1.0f64, rate in -1.0..1.0f64, disturbance in -1.0..1.0f64,
    ) {
        let gain = Gain { k1, k2 };
        let mut simulation = Simulation { gain, period, deviation: Vector2::new(angle, rate) };
        let transition = *SampledError::new(gain, period).transition();
        let ours = transition * simulation.deviation + response(period) * disturbance;
        simulation.advance(&[disturbance; 7]);
        prop_assert!((ours - simulation.deviation).norm() < 1e-12);
    }
}

/// Returns settings in which every bound counts.
fn with_every_bound() -> Settings {
    let degree = f64::to_radians(1.0);
    Settings {
        delay: 0.06,
        disturbance_bound: 0.4 * degree,
        angle_error: 0.05 * degree,
        rate_error: 0.05 * degree,
        slow_angle_error: 0.2 * degree,
        slow_angle_rate: 0.03 * degree,
        tensor_error: 0.03,
        known_bound: 1e4,
        known_change: 1e3,
        ..Settings::new(Constraints::Robust)
    }
    .resolved()
    .unwrap()
}

#[test]
fn regress_every_constant_of_the_proof_has_its_part_in_the_tightening() {
    let settings = with_every_bound();
    let design = Design::new(&settings).unwrap();
    let at = [0, 1, 2, 5, 50].map(|tick| *design.tightening.at(tick));
    let (explained, left) = (design.tightening.explained, design.assessment);
    let shown =
        format!("{at:#.12?}\n{explained:#.12?}\n{left:#.12?}\n{:.6}", design.turn_time(&settings));
    if shown != include_str!("tightening.txt").trim_end() {
        println!("{shown}");
    }
    assert_eq!(shown, include_str!("tightening.txt").trim_end());
}
