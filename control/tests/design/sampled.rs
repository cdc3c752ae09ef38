//! Bounds of the sampled error dynamics compared with simulation.

use super::{assert_digits, gain, settings};
use control::DesignError;
use control::crmpc::{Design, Published, Settings, step_response_peak};
use control::error_dynamics::{Gain, Reach, SampledError};
use nalgebra::Vector2;

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
fn oracle_bang_bang_disturbance_reaches_the_sampled_bounds() {
    // The disturbance changes its sign at any of the parts of a period. Compared with disturbances
    // that may change at any time this loses one part in a thousand.
    const PARTS: usize = 40;
    for (k, period, _) in PUBLISHED_CASES {
        let n = 60;
        let reach = SampledError::new(gain(k), period).reach(n);
        // These are the responses to a pulse in each part of a period, at the ends of the later
        // periods.
        let responses: Vec<Vec<[f64; 3]>> = (0..PARTS)
            .map(|part| {
                let mut impulse = Simulation::new(gain(k), period);
                impulse.advance(&std::array::from_fn::<f64, PARTS, _>(|i| {
                    if i == part { 1.0 } else { 0.0 }
                }));
                let respond = |_| {
                    let outputs = impulse.outputs();
                    impulse.advance(&[0.0]);
                    outputs
                };
                (0..n).map(respond).collect()
            })
            .collect();
        for output in 0..3 {
            for steps in [1, 2, 5, 20, n] {
                let mut worst = Simulation::new(gain(k), period);
                for j in (0..steps).rev() {
                    worst.advance(&std::array::from_fn::<f64, PARTS, _>(|part| {
                        responses[part][j][output].signum()
                    }));
                }
                let bound = [reach[steps].angle, reach[steps].rate, reach[steps].feedback][output];
                let reached = worst.outputs()[output];
                assert!(reached <= bound * (1.0 + 1e-12), "K {k}, {steps} steps, output {output}");
                assert!(
                    reached >= bound * (1.0 - 2e-3),
                    "K {k}, {steps} steps, output {output}: {reached} {bound}"
                );
            }
        }
    }
}

#[test]
fn oracle_constant_disturbance_reaches_the_peak_of_the_step_response_only() {
    // (24) and (26): c̄Δ̄ bounds the rate under a constant Δ. One change of sign after settling
    // doubles it.
    let c = Published::crmpc2022().c;
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

mod properties {
    use super::{PUBLISHED_CASES, Simulation, gain};
    use control::error_dynamics::{SampledError, response};
    use nalgebra::Vector2;
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

        #[test]
        fn no_held_disturbance_exceeds_the_sampled_bounds(
            case in 0..3usize,
            disturbances in prop::collection::vec(prop_oneof![-1.0..=1.0f64, Just(1.0), Just(-1.0)], 1..400),
        ) {
            let (k, period, _) = PUBLISHED_CASES[case];
            let reach = SampledError::new(gain(k), period).reach(disturbances.len());
            let mut simulation = Simulation::new(gain(k), period);
            for (disturbance, bound) in disturbances.iter().zip(&reach[1..]) {
                simulation.advance(&[*disturbance]);
                let bounds = [bound.angle, bound.rate, bound.feedback];
                for (value, bound) in simulation.outputs().into_iter().zip(bounds) {
                    prop_assert!(value.abs() <= bound + 1e-12);
                }
            }
        }

        #[test]
        fn one_period_is_what_simulation_says(
            k1 in -30.0..-0.1f64, k2 in -30.0..-0.1f64, period in 0.001..0.2f64,
            angle in -1.0..1.0f64, rate in -1.0..1.0f64, disturbance in -1.0..1.0f64,
        ) {
            let gain = control::error_dynamics::Gain { k1, k2 };
            let mut simulation = Simulation { gain, period, deviation: Vector2::new(angle, rate) };
            let transition = *SampledError::new(gain, period).transition();
            let ours = transition * simulation.deviation + response(period) * disturbance;
            simulation.advance(&[disturbance; 7]);
            prop_assert!((ours - simulation.deviation).norm() < 1e-12);
        }

        #[test]
        fn no_disturbance_leaves_the_invariant_set(
            case in 0..3usize,
            direction in 0.0..std::f64::consts::TAU,
            disturbances in prop::collection::vec(prop_oneof![Just(1.0), Just(-1.0)], 1..200),
        ) {
            let (k, period, _) = PUBLISHED_CASES[case];
            let set = SampledError::new(gain(k), period).invariant_set(0.0).unwrap();
            let normals = set.normals();
            let size = |o: &Vector2<f64>| normals.iter().map(|normal| normal.dot(o).abs()).fold(0.0, f64::max);
            // The deviation starts anywhere on the border of the set.
            let direction = Vector2::new(direction.cos(), direction.sin());
            let mut simulation = Simulation { gain: gain(k), period, deviation: direction / size(&direction) };
            let reach = set.reach();
            for disturbance in disturbances {
                for (value, bound) in simulation.outputs().into_iter().zip([reach.angle, reach.rate, reach.feedback]) {
                    prop_assert!(value.abs() <= bound * (1.0 + 1e-9));
                }
                simulation.advance(&[disturbance]);
                prop_assert!(size(&simulation.deviation) <= 1.0 + 1e-9, "{}", size(&simulation.deviation));
            }
        }
    }
}

#[test]
fn oracle_invariant_set_holds_what_can_be_reached_and_is_less_than_half_larger() {
    let delays = [0.0, 0.03, 0.1];
    let cases = PUBLISHED_CASES.into_iter().flat_map(|case| delays.map(|delay| (case, delay)));
    for ((k, period, _), delay) in cases {
        let error = SampledError::delayed(gain(k), period, delay);
        let set = error.invariant_set(0.25 * period * period).unwrap().reach();
        let least = forever(&error);
        let pairs =
            [(set.angle, least.angle), (set.rate, least.rate), (set.feedback, least.feedback)];
        for (of_set, least) in pairs {
            assert!(of_set >= least * (1.0 - 1e-12), "K {k}, period {period}: {of_set} {least}");
            assert!(of_set < 1.5 * least, "K {k}, period {period}: {of_set} {least}");
        }
    }
}
