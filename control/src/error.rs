//! Errors in the settings of a controller. They name settings as these are declared.

use crate::error_dynamics::Gain;
use settings::Invalid;

/// A setting that the design refuses, by its declared name.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum DesignError {
    /// A number is outside its range.
    #[error(transparent)]
    Invalid(#[from] Invalid),
    /// The feedback gain does not stabilise the sampled error dynamics.
    #[error(
        "feedback gain K = [{k1}, {k2}] sampled every {period} s is not stable: spectral radius {radius:.6} is not below 1; use a smaller gain or a shorter period.feedback"
    )]
    Unstable {
        /// Gain on the angle, 1/s².
        k1: f64,
        /// Gain on the rate, 1/s.
        k2: f64,
        /// Feedback period, s.
        period: f64,
        /// Spectral radius of the sampled error dynamics.
        radius: f64,
    },
    /// The terminal gain does not stabilise the nominal trajectory when its command is held between
    /// two optimisations.
    #[error(
        "terminal gain K~ = [{k1}, {k2}] held for {period} s is not stable: spectral radius {radius:.6} is not below 1; use a smaller gain or a shorter period.optimisation"
    )]
    UnstableTerminal {
        /// Gain on the angle, 1/s².
        k1: f64,
        /// Gain on the rate, 1/s.
        k2: f64,
        /// Optimisation period, s.
        period: f64,
        /// Spectral radius of the held terminal law.
        radius: f64,
    },
    /// Only one part of the gain K is set.
    #[error(
        "feedback.k1 = {k1} and feedback.k2 = {k2}: both must be negative, or both 0 for the gain by rule"
    )]
    HalfGain {
        /// Gain on the angle, 1/s².
        k1: f64,
        /// Gain on the rate, 1/s.
        k2: f64,
    },
    /// The limits leave too little room for a guarantee.
    #[error("constraints = robust cannot be guaranteed: {0}")]
    NoGuarantee(Box<Refusal>),
    /// A gain violates Lemma 2 or 3 of Chai 2022.
    #[error(
        "{name}.k1 and {name}.k2 need k1 < 0, k2 < 0 and k2² + 4 k1 > 0 (real, distinct, stable eigenvalues)"
    )]
    NotReal {
        /// Name of the gain.
        name: &'static str,
    },
    /// The delay that a prediction compensates for is out of its range.
    #[error("delay = {value} s must lie between 0 and {longest} s")]
    Delay {
        /// Value of the delay, s.
        value: f64,
        /// Largest value that is allowed, s.
        longest: f64,
    },
    /// The two periods do not fit together.
    #[error(
        "period.optimisation = {optimisation} s must be a whole multiple of period.feedback = {feedback} s"
    )]
    Periods {
        /// Optimisation period, s.
        optimisation: f64,
        /// Feedback period, s.
        feedback: f64,
    },
    /// The period of the allocation is not a multiple of the modulator's.
    #[error("period = {period} s must be a whole multiple of pwpf.period = {pwpf} s")]
    Modulation {
        /// Period of the allocation, s.
        period: f64,
        /// Period of the modulator, s.
        pwpf: f64,
    },
    /// The end of an entry flight exceeds a limit.
    #[error(
        "{name} = {limit} is less than what altitude and speed of the target need with the standard atmosphere, {floor:.4}"
    )]
    LimitBelowTarget {
        /// Name of the limit.
        name: &'static str,
        /// Value of the limit.
        limit: f64,
        /// Value at the target.
        floor: f64,
    },
    /// One of the paper's sets is empty after tightening.
    #[error(
        "the paper's set is empty after tightening: {name} = {value:.4}; lower disturbance.bound or the reference bounds, or raise the limits"
    )]
    EmptySet {
        /// Symbol of the set's size.
        name: &'static str,
        /// Value of the set's size.
        value: f64,
    },
    /// A matrix must have an inverse.
    #[error("{name} must be finite and have an inverse")]
    Singular {
        /// Name of the matrix.
        name: String,
    },
    /// Condition (46) of Wu 2015 does not hold.
    #[error(
        "reaching.k1, k2, k3, k4 and m violate condition (46) of Wu 2015 on axis {index}: m² k3 k4 − (m³/(m−1) k3 + (4 m² − 4 m + 1) k1²) k2² = {value:.4} is not positive; use a smaller k2 or larger k3, k4"
    )]
    Condition46 {
        /// Axis, from 1: angle of attack, sideslip, bank.
        index: usize,
        /// Left-hand side of the condition.
        value: f64,
    },
    /// The reaching law of Jia et al. is weaker than the disturbance at the edge of its layer.
    #[error(
        "inner.rho[{index}] = {rho} must exceed {needed:.4} rad/s², which is 2^((b+1)/2) |I⁻¹ M_d| with b = {b} and |I⁻¹ M_d| = {acceleration:.4} rad/s²; raise it, or lower inner.b or disturbanceMoment.bound"
    )]
    WeakReaching {
        /// Axis, from 1: roll, pitch, yaw.
        index: usize,
        /// Gain ρ_n of the reaching law, rad/s².
        rho: f64,
        /// Power b of the finite-time factor.
        b: f64,
        /// Bound on the acceleration by the disturbance, rad/s².
        acceleration: f64,
        /// Value that ρ_n must exceed, rad/s².
        needed: f64,
    },
    /// The solver refuses the problem.
    #[error("the cone solver refuses the problem: {0}")]
    Solver(String),
}

/// Why there is no guarantee, and which values would be accepted.
#[derive(Clone, Debug, PartialEq)]
pub struct Refusal {
    /// Gain K of the feedback law, the one that comes closest if it is left to the rule.
    pub feedback: Gain,
    /// Unused share of the moment limit; negative if the limit is exceeded.
    pub moment_left: f64,
    /// Unused share of the rate limit; negative if the limit is exceeded.
    pub rate_left: f64,
    /// Limit on the moment, N m.
    pub limit_moment: f64,
    /// Limit on the rate, rad/s.
    pub limit_rate: f64,
    /// Largest accepted disturbance.bound with the other settings unchanged, rad/s²; `None`
    /// if not even 0 is accepted.
    pub disturbance: Option<f64>,
    /// The same with the gain by rule, if another one is set.
    pub by_rule: Option<f64>,
    /// Largest accepted knownMoment.bound, N m.
    pub known_bound: Option<f64>,
    /// Largest accepted errors of angles (rad) and rates (rad/s) in the given proportion.
    pub errors: Option<(f64, f64)>,
    /// Largest accepted slow errors of the angles (rad) and their rates of change (rad/s) in the
    /// given proportion.
    pub slow_errors: Option<(f64, f64)>,
    /// Largest accepted delay, s.
    pub delay: Option<f64>,
}

impl std::fmt::Display for Refusal {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        f.write_str(&no_guarantee(self))
    }
}

/// Returns why there is no guarantee, and which values would be accepted.
fn no_guarantee(refusal: &Refusal) -> String {
    let Refusal {
        feedback: Gain { k1, k2 },
        moment_left,
        rate_left,
        limit_moment,
        limit_rate,
        disturbance,
        by_rule,
        known_bound,
        errors,
        slow_errors,
        delay,
    } = refusal;
    let mut reasons = Vec::new();
    for (what, left, limit) in [
        ("moment", *moment_left, format!("limit.moment = {limit_moment} N m")),
        ("rate", *rate_left, format!("limit.rate = {:.4} deg/s", limit_rate.to_degrees())),
    ] {
        if left <= 0.0 {
            reasons.push(format!(
                "the {what} required under the worst disturbance exceeds {limit} by {} %",
                up(-100.0 * left)
            ));
        }
    }
    if reasons.is_empty() {
        reasons.push(format!(
            "the worst disturbance leaves only {:.1} % of the moment and {:.1} % of the rate for manoeuvres",
            100.0 * moment_left,
            100.0 * rate_left
        ));
    }
    let mut accepted = Vec::new();
    if let Some(bound) = known_bound {
        accepted.push(format!("at most knownMoment.bound = {} N m", bound.floor()));
    }
    match disturbance {
        Some(bound) => {
            accepted.push(format!(
                "at most disturbance.bound = {:.4} deg/s2",
                down(bound.to_degrees())
            ));
        }
        None => accepted.push("no disturbance.bound".into()),
    }
    if let Some(bound) = by_rule {
        accepted.push(format!(
            "with the gain by rule, feedback.k1 = feedback.k2 = 0, at most disturbance.bound = {:.4} deg/s2",
            down(bound.to_degrees())
        ));
    }
    if let Some((angle, rate)) = errors {
        accepted.push(format!(
            "at most estimation.angleError = {:.4} deg with estimation.rateError = {:.4} deg/s",
            down(angle.to_degrees()),
            down(rate.to_degrees())
        ));
    }
    if let Some((angle, rate)) = slow_errors {
        accepted.push(format!(
            "at most estimation.slowAngleError = {:.4} deg with estimation.slowAngleRate = {:.4} deg/s",
            down(angle.to_degrees()),
            down(rate.to_degrees())
        ));
    }
    if let Some(delay) = delay {
        accepted.push(format!("at most delay = {:.4} s", down(*delay)));
    }
    format!(
        "with feedback.k1 = {k1} and feedback.k2 = {k2}, {}; accepted with the other settings unchanged: {}; guarantee.policy = bestEffort runs without a guarantee",
        reasons.join(" and "),
        accepted.join(", or ")
    )
}

/// Returns the value rounded up to one digit after the point, so that no excess is told as none.
fn up(value: f64) -> f64 {
    (value * 10.0).ceil() / 10.0
}

/// Returns the value rounded down to four digits after the point, so that the printed number is
/// accepted.
fn down(value: f64) -> f64 {
    (value * 1e4).floor() / 1e4
}

/// Checks a limit that is no declared setting: it must be positive and finite.
///
/// # Errors
/// Returns an error that names the setting.
pub(crate) fn positive(name: &str, value: f64) -> Result<(), DesignError> {
    if value > 0.0 && value.is_finite() {
        return Ok(());
    }
    Err(invalid(name, value, "must be positive and finite"))
}

/// Returns the error for a setting whose value must satisfy something.
pub(crate) fn invalid(name: &str, value: f64, problem: impl Into<String>) -> DesignError {
    Invalid { name: name.into(), value, problem: problem.into() }.into()
}
