//! Values of the settings that would be accepted where no guarantee can be given.

use super::guarantee;
use super::rule::{self, Tightened};
use super::settings::Settings;
use crate::error::{DesignError, Refusal};
use crate::error_dynamics::Gain;
use vehicle::math::cos;

/// Returns the largest value of a setting between 0 and `tried` for which the design holds with the
/// other settings unchanged, and with any gain that may be taken; `None` if not even 0 does. The
/// search is short if the gain `closest` is the one that permits most.
fn largest(tried: f64, closest: Gain, with: impl Fn(f64) -> Settings) -> Option<f64> {
    let settings = with(tried);
    let others = rule::candidates(&settings).iter().filter(|&&gain| gain != closest);
    std::iter::once(&closest).chain(others).fold(None, |so_far, &feedback| {
        let holds = |value: f64| {
            let tightened = guarantee::tighten(&Settings { feedback, ..with(value) });
            tightened.is_ok_and(|(_, assessment)| assessment.holds())
        };
        if holds(tried) {
            return Some(tried);
        }
        let mut low = so_far.unwrap_or(0.0);
        if !holds(low) {
            return so_far;
        }
        let mut high = tried;
        for _ in 0..18 {
            let middle = 0.5 * (low + high);
            if holds(middle) { low = middle } else { high = middle }
        }
        Some(low)
    })
}

/// Returns the largest share, at most 1, of Δ̄ and the errors together for which the design holds
/// with the gain that is set.
pub(super) fn largest_share(s: &Settings) -> Option<f64> {
    largest(1.0, s.feedback, |share| guarantee::with_share(s, share))
}

/// Returns the largest Δ̄ for which the design holds with a gain by rule. No moment compensates for
/// more than sec β̄ `limit.moment` / λ_min(I).
fn by_rule(s: &Settings) -> Option<f64> {
    let with = |disturbance_bound| Settings { disturbance_bound, feedback: Gain::default(), ..*s };
    let smallest_inertia = s.body.inertia.symmetric_eigenvalues().min();
    let too_large = s.limit_moment / (smallest_inertia * cos(s.sideslip_domain));
    largest(too_large, *rule::candidates(&with(0.0)).first()?, with)
}

/// Returns the error that says why the guarantee cannot be given with the gain that comes closest,
/// and which values would be accepted.
pub(super) fn refusal(s: &Settings, closest: &Tightened) -> DesignError {
    let Tightened { settings: Settings { feedback, .. }, assessment, .. } = closest;
    let largest = |tried: f64, with: &dyn Fn(f64) -> Settings| largest(tried, *feedback, with);
    let error_share = largest(1.0, &|share| Settings {
        angle_error: share * s.angle_error,
        rate_error: share * s.rate_error,
        ..*s
    });
    let errors = (s.rate_error > 0.0 || s.angle_error > 0.0).then_some(error_share).flatten();
    let with_slow = |share: f64| Settings {
        slow_angle_error: share * s.slow_angle_error,
        slow_angle_rate: share * s.slow_angle_rate,
        ..*s
    };
    let are_slow = s.slow_angle_error > 0.0 || s.slow_angle_rate > 0.0;
    DesignError::NoGuarantee(Box::new(Refusal {
        feedback: *feedback,
        moment_left: assessment.moment_left,
        rate_left: assessment.rate_left,
        limit_moment: s.limit_moment,
        limit_rate: s.limit_rate,
        disturbance: largest(s.disturbance_bound, &|disturbance_bound| Settings {
            disturbance_bound,
            ..*s
        }),
        by_rule: (s.feedback != Gain::default()).then(|| by_rule(s)).flatten(),
        known_bound: (s.known_bound > 0.0)
            .then(|| largest(s.known_bound, &|known_bound| Settings { known_bound, ..*s }))
            .flatten(),
        delay: (s.delay > 0.0)
            .then(|| largest(s.delay, &|delay| Settings { delay, ..*s }))
            .flatten()
            .filter(|&delay| delay > 0.0),
        errors: errors.map(|share| (share * s.angle_error, share * s.rate_error)),
        slow_errors: are_slow
            .then(|| largest(1.0, &with_slow))
            .flatten()
            .map(|share| (share * s.slow_angle_error, share * s.slow_angle_rate)),
    }))
}
