//! Random settings, and the results of trying them.

use super::random::Random;
use super::{Flight, Shown};
use control::crmpc::{Constraints, Crmpc, InitialState, Settings};
use control::error::{DesignError, Refusal};
use control::error_dynamics::Gain;

/// Returns the settings of Chai 2022 with another period of the optimisation (s), and with a
/// horizon of 20 s as there, or of 100 steps if that is shorter. The terminal law is one that is
/// stable if it is held over the period.
pub fn optimised_every(period: f64) -> Settings {
    let published = Settings::new(Constraints::Robust);
    let terminal = if period > 0.3 { Gain { k1: -0.6, k2: -1.6 } } else { published.terminal };
    let horizon = ((20.0 / period).round() as usize).min(100);
    Settings { period_optimisation: period, horizon, terminal, ..published }
}

/// Result of trying some settings.
#[derive(Clone, Debug)]
pub enum Tried {
    /// The settings were accepted and flown.
    Flown(Shown),
    /// The settings were refused because no guarantee can be given.
    Refused {
        /// Number of bounds that the message names.
        bounds: usize,
        /// Messages about the settings with a named bound that are not accepted either.
        not_accepted: Vec<String>,
    },
    /// The settings were refused for another reason.
    Invalid(String),
}

/// Draws every setting that a user may set.
pub fn random_settings(seed: u64) -> Settings {
    let random = &mut Random::new(seed);
    let half = |random: &mut Random, high: f64| {
        if random.below(2) == 0 { 0.0 } else { random.between(0.0, high) }
    };
    let published = Settings::new(Constraints::Robust);
    let period_feedback = [0.02, 0.04, 0.05, 0.1][random.below(4)];
    let initial_states = [InitialState::Measured, InitialState::Nominal];
    let mut settings = Settings {
        feedback: Gain { k1: random.between(-10.0, -0.5), k2: random.between(-10.0, -1.0) },
        delay: half(random, 0.15),
        angle_error: half(random, 0.2).to_radians(),
        rate_error: half(random, 0.2).to_radians(),
        disturbance_bound: random.between(0.0, 4.0).to_radians(),
        inertia_error: random.between(0.0, 0.1),
        horizon: 20 + random.below(81),
        period_feedback,
        // The period is at most 0.3 s, so that the terminal law is stable.
        period_optimisation: period_feedback
            * (1 + random.below((0.3 / period_feedback) as usize)) as f64,
        limit_rate: published.limit_rate * random.between(0.5, 2.0),
        limit_moment: published.limit_moment * random.between(0.5, 3.0),
        initial_state: initial_states[random.below(2)],
        tensor_error: half(random, 0.08),
        ..published
    };
    settings.slow_angle_error = half(random, 1.0).to_radians();
    settings.slow_angle_rate = half(random, 0.1).to_radians();
    settings
}

/// Flies the settings for 15 s if the design accepts them, and otherwise tries each bound that its
/// refusal names.
pub fn tried(settings: &Settings, seed: u64) -> Tried {
    let Err(error) = Crmpc::new(*settings) else {
        return Tried::Flown(Flight { duration: 15.0, ..Flight::random(settings, seed) }.fly());
    };
    let DesignError::NoGuarantee(bounds) = &error else {
        return Tried::Invalid(error.to_string());
    };
    let Refusal { disturbance, errors, slow_errors, delay, .. } = **bounds;
    // The bounds are rounded as the message prints them.
    let down = |value: f64| (value * 1e4).floor() / 1e4;
    let down_angle = |value: f64| down(value.to_degrees()).to_radians();
    let with = [
        disturbance.map(|bound| Settings { disturbance_bound: down_angle(bound), ..*settings }),
        errors.map(|(angle, rate)| Settings {
            angle_error: down_angle(angle),
            rate_error: down_angle(rate),
            ..*settings
        }),
        slow_errors.map(|(angle, rate)| Settings {
            slow_angle_error: down_angle(angle),
            slow_angle_rate: down_angle(rate),
            ..*settings
        }),
        delay.map(|delay| Settings { delay: down(delay), ..*settings }),
    ];
    let named: Vec<Settings> = with.into_iter().flatten().collect();
    let refusal = |settings: &Settings| Crmpc::new(*settings).err();
    let not_accepted =
        named.iter().filter_map(refusal).map(|refusal| format!("{error}; then {refusal}"));
    Tried::Refused { bounds: named.len(), not_accepted: not_accepted.collect() }
}
