//! Settings that the design accepts, drawn over everything that a user may set.

use crate::flights::Random;
use control::DesignError;
use control::crmpc::{Constraints, Design, InitialState, Settings};
use control::error_dynamics::Gain;

/// Number of kinds of draws; every kind also varies the share of the largest accepted disturbance.
const KINDS: u64 = 10;

/// Returns the settings of draw `seed`, or `None` if the design accepts nothing near them.
pub fn accepted(seed: u64) -> Option<Settings> {
    let random = &mut Random::new(seed);
    let settings = drawn(seed % KINDS, random);
    near(settings, random)
}

/// Returns the settings of the same draw with slow errors of the angles as well.
pub fn with_slow_errors(seed: u64) -> Option<Settings> {
    let random = &mut Random::new(seed);
    let settings = Settings {
        slow_angle_error: random.between(0.0, 1.0).to_radians(),
        slow_angle_rate: random.between(0.0, 0.15).to_radians(),
        ..drawn(seed % KINDS, random)
    };
    near(settings, random)
}

/// Returns the settings with the disturbance that they permit, or with less.
fn near(mut settings: Settings, random: &mut Random) -> Option<Settings> {
    for _ in 0..3 {
        match Design::new(&settings) {
            Ok(design) if design.accepted_share >= 1.0 => return Some(settings),
            Err(DesignError::NoGuarantee(refusal)) => {
                let bound = refusal.disturbance?;
                // Near the largest value little of the moment is left, and previous plans are kept
                // more often.
                settings.disturbance_bound = bound * random.between(0.5, 1.0);
            }
            _ => return None,
        }
    }
    None
}

fn drawn(kind: u64, random: &mut Random) -> Settings {
    let published = Settings::new(Constraints::Robust);
    match kind {
        0 => published,
        1 => Settings { delay: 0.04, ..published },
        2 => Settings { delay: random.between(0.0, 0.15), ..published },
        3 => Settings { initial_state: InitialState::Nominal, ..published },
        5 => erroneous(random, &published),
        6 => slow(random, &published),
        7 => late(random, &published),
        8 => turned(random, &published),
        // Two of the kinds are this one.
        _ => anything(random, &published),
    }
}

/// Errors of the measurement, which need a soft gain if they are large.
fn erroneous(random: &mut Random, published: &Settings) -> Settings {
    let soft = random.below(2) == 0;
    let size = if soft { 0.25_f64 } else { 0.03 }.to_radians();
    let feedback = if soft { Gain { k1: -0.5, k2: -1.5 } } else { published.feedback };
    Settings {
        feedback,
        angle_error: random.between(0.0, size),
        rate_error: random.between(0.0, size),
        delay: 0.04 * random.below(2) as f64,
        ..*published
    }
}

/// Optimisation periods of 0.08 to 1 s, with a terminal law that is stable if it is held that long.
fn slow(random: &mut Random, published: &Settings) -> Settings {
    let (ratio, k1, k2) = [(2, -5.0, -5.0), (10, -1.0, -2.5), (15, -0.5, -1.6), (25, -0.3, -1.2)]
        [random.below(4) as usize];
    Settings {
        period_optimisation: f64::from(ratio) * published.period_feedback,
        horizon: 500 / ratio as usize,
        terminal: Gain { k1, k2 },
        ..*published
    }
}

/// A delay, and plans that go on or begin anew.
fn late(random: &mut Random, published: &Settings) -> Settings {
    let delay = random.between(0.01, 0.12);
    Settings { delay, initial_state: either(random), ..*published }
}

/// An error of the whole tensor of inertia.
fn turned(random: &mut Random, published: &Settings) -> Settings {
    Settings {
        inertia_error: 0.05 * random.below(2) as f64,
        tensor_error: random.between(0.0, 0.06),
        delay: 0.04 * random.below(3) as f64,
        ..*published
    }
}

fn either(random: &mut Random) -> InitialState {
    [InitialState::Measured, InitialState::Nominal][random.below(2) as usize]
}

fn anything(random: &mut Random, published: &Settings) -> Settings {
    let period_feedback = [0.02, 0.04, 0.05, 0.1][random.below(4) as usize];
    let longest = (0.3 / period_feedback) as u64;
    let initial_state = either(random);
    let delay = random.between(0.0, 0.1);
    Settings {
        feedback: Gain { k1: -random.between(0.5, 8.0), k2: -random.between(1.0, 8.0) },
        delay,
        inertia_error: random.between(0.0, 0.1),
        tensor_error: random.between(-0.05, 0.05).max(0.0),
        horizon: 20 + random.below(81) as usize,
        period_feedback,
        period_optimisation: period_feedback * (1 + random.below(longest)) as f64,
        limit_rate: published.limit_rate * random.between(0.5, 2.0),
        limit_moment: published.limit_moment * random.between(0.5, 3.0),
        known_bound: published.limit_moment * random.between(-0.2, 0.2).max(0.0),
        known_change: published.limit_moment * random.between(-0.05, 0.05).max(0.0),
        sideslip_domain: random.between(10.0, 35.0).to_radians(),
        initial_state,
        ..*published
    }
}
