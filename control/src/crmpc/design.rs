//! Offline design of CRMPC: every constant of Chai 2022 from the raw data, and the tightening of
//! the `robust` set.

use super::guarantee::{self, Assessment, Tightening};
use super::refusal;
use super::rule::{self, Tightened};
use super::settings::{Constraints, Guarantee, Settings};
use crate::delay;
use crate::error::{DesignError, positive};
use crate::error_dynamics::{Gain, SampledError};
use nalgebra::{Matrix2, Vector2};
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;
use vehicle::math::{exp, hypot, ln, powi, tan};

/// Turn whose time is told with the settings: the bank reversal of an entry, rad.
const TURN: f64 = 120.0 * PI / 180.0;

/// The constants printed in Chai 2022, section 5.1, computed from the raw data.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PaperConstants {
    /// Bound r̄₀ = √(1 + tan β̄). The proof of Lemma 1 has tan²; the printed number lacks the
    /// square.
    pub r0: f64,
    /// Bound r̄₁: the rate limit in rad/s. It is not a bound of ‖Ṙ‖ for all |β| ≤ 10°.
    pub r1: f64,
    /// Component-wise bound Ω̄ = √3 ω̄.
    pub omega: f64,
    /// Condition number Ī·Ī′ of I.
    pub condition: f64,
    /// Bound x̄_ω = r̄₀ ω̄ of (6), rad/s.
    pub x: f64,
    /// Bound ū = r̄₀ M̄ / λ_min(I) of (6), rad/s².
    pub u: f64,
    /// Peak of the step response, c̄ of (21), s.
    pub c: f64,
    /// Tightened bound x̄_tube of (21), rad/s.
    pub x_tube: f64,
    /// Tightened bound ū_tube of (21), rad/s².
    pub u_tube: f64,
    /// Terminal radius ε₁ of (13).
    pub epsilon1: f64,
    /// Terminal radius ε₂ of (13).
    pub epsilon2: f64,
    /// Tube of the angles, Δ̄/|k₁| of (26), rad.
    pub angle_tube: f64,
    /// Tube of the rates, c̄ Δ̄ of (26) with c̄ of the feedback gain, rad/s.
    pub rate_tube: f64,
}

/// Returns G of (15) per axis, with equality: AᵀG + G A + K̃ᵀQ K̃ + P = 0, A = [0 1; k̃₁ k̃₂]. The
/// paper requires < 0, which its printed G does not satisfy.
pub fn terminal_weight(gain: Gain, p: Vector2<f64>, q: f64) -> Matrix2<f64> {
    let Gain { k1, k2 } = gain;
    let load = Matrix2::from_diagonal(&p) + gain.row().transpose() * gain.row() * q;
    let g12 = -load.m11 / (2.0 * k1);
    let g22 = -(load.m22 + 2.0 * g12) / (2.0 * k2);
    let g11 = -(load.m12 + k2 * g12 + k1 * g22);
    Matrix2::new(g11, g12, g12, g22)
}

/// Returns G of (15) for a terminal law that is held over h, with equality:
/// ΦᵀG Φ − G + h (P + K̃ᵀQ K̃) = 0. With it (11c) holds for the sampled cost.
pub fn held_terminal_weight(
    held: &SampledError,
    gain: Gain,
    p: Vector2<f64>,
    q: f64,
) -> Matrix2<f64> {
    let mut load =
        (Matrix2::from_diagonal(&p) + gain.row().transpose() * gain.row() * q) * held.period();
    let mut power = *held.transition();
    let mut sum = Matrix2::zeros();
    // The sum Σ (Φᵀ)ⁱ L Φⁱ is doubled until Φ has vanished.
    for _ in 0..60 {
        let next = load + power.transpose() * load * power;
        sum = next;
        if next == load {
            break;
        }
        load = next;
        power *= power;
    }
    sum
}

/// Returns c̄ of (21): the peak over time of G_i(τ) = (e^{λ₂τ} − e^{λ₁τ})/√(k₂² + 4k₁), with λ₁ the
/// faster root.
pub fn step_response_peak(gain: Gain) -> Option<f64> {
    let (slow, fast) = gain.eigenvalues()?;
    let peak_time = ln(slow / fast) / (fast - slow);
    Some((exp(slow * peak_time) - exp(fast * peak_time)) / (slow - fast))
}

/// Returns the smallest eigenvalue of a symmetric 2×2 matrix.
fn smallest_eigenvalue(m: &Matrix2<f64>) -> f64 {
    0.5 * m.trace() - (0.25 * powi(m.m11 - m.m22, 2) + m.m12 * m.m12).sqrt()
}

/// The result of the offline design.
#[derive(Clone, Debug, PartialEq)]
pub struct Design {
    /// Gain K of the feedback law: the one that is set, or the one that the rule takes.
    pub feedback: Gain,
    /// Terminal weight G per axis.
    pub g: [Matrix2<f64>; 3],
    /// Constants of the paper; `None` if its assumptions (real distinct eigenvalues) do not hold.
    pub paper: Option<PaperConstants>,
    /// Tightening of the robust set.
    pub tightening: Tightening,
    /// Tightenings for smaller bounds on the disturbance, by equal parts of it.
    lower: Vec<Tightening>,
    /// Remainder of the limits after the tightening.
    pub assessment: Assessment,
    /// Share of the disturbance bound and the errors that the tightening includes; 1 if the
    /// guarantee is given.
    pub accepted_share: f64,
    /// Feedback ticks per optimisation.
    pub ratio: usize,
    /// Number of feedback ticks that begin before the command of the first of them acts.
    pub delay_ticks: u32,
    /// Largest eigenvalue of I, kg m².
    pub largest_inertia: f64,
    /// Smallest eigenvalue of I, kg m².
    pub smallest_inertia: f64,
    /// Ratio of the largest moment of inertia to the smallest.
    pub inertia_ratio: f64,
}

impl Design {
    /// Returns the tightening for `level` parts less than the whole bound on the disturbance.
    pub fn at_level(&self, level: usize) -> &Tightening {
        level.checked_sub(1).and_then(|i| self.lower.get(i)).unwrap_or(&self.tightening)
    }

    /// Computes the design from the settings.
    ///
    /// # Errors
    /// Returns an error that names the setting out of range, or the gain that does not stabilise,
    /// with its spectral radius.
    pub fn new(s: &Settings) -> Result<Self, DesignError> {
        let ratio = ratio(s)?;
        for (name, gain) in [("terminal", s.terminal), ("tube", s.tube)] {
            if gain.eigenvalues().is_none() {
                return Err(DesignError::NotReal { name });
            }
        }
        let (Tightened { settings, tightening, assessment }, accepted_share) = robust(s)?;
        let s = &settings;
        let lower = if accepted_share < 1.0 { Vec::new() } else { lower(s)? };

        let held = SampledError::new(s.terminal, s.period_optimisation);
        let g: [Matrix2<f64>; 3] = std::array::from_fn(|i| {
            let p = Vector2::new(s.p[i], s.p[i + 3]);
            match s.constraints {
                Constraints::Robust => held_terminal_weight(&held, s.terminal, p, s.q[i]),
                Constraints::Paper => terminal_weight(s.terminal, p, s.q[i]),
            }
        });
        if held.settling().is_none() {
            let (Gain { k1, k2 }, radius) = (s.terminal, held.spectral_radius());
            let period = s.period_optimisation;
            return Err(DesignError::UnstableTerminal { k1, k2, period, radius });
        }
        let eigenvalues = s.body.inertia.symmetric_eigenvalues();
        let (smallest_inertia, largest_inertia) = (eigenvalues.min(), eigenvalues.max());

        Ok(Self {
            feedback: s.feedback,
            paper: paper_constants(s, smallest_inertia, largest_inertia),
            g,
            tightening,
            lower,
            assessment,
            accepted_share,
            ratio,
            delay_ticks: delay::ticks(s.delay, s.period_feedback) as u32,
            largest_inertia,
            smallest_inertia,
            inertia_ratio: largest_inertia / smallest_inertia,
        })
    }
}

impl Design {
    /// Returns the time of a turn of 120° from rest to rest with what is left of both limits, s: at a
    /// constant acceleration, at the largest rate, and braking. Of the rate, the deviation is
    /// reserved that can develop until the next optimisation, which begins anew.
    pub fn turn_time(&self, s: &Settings) -> f64 {
        let rate = (s.limit_rate - self.tightening.at(self.ratio).rate).max(0.0);
        let left = self.assessment.moment_left.max(0.0);
        let acceleration = left * s.limit_moment / self.largest_inertia;
        let rate = rate.min((TURN * acceleration).sqrt());
        TURN / rate + rate / acceleration
    }
}

/// Returns the tightenings for smaller bounds on the disturbance.
fn lower(s: &Settings) -> Result<Vec<Tightening>, DesignError> {
    let parts = s.disturbance_parts;
    let part = |part: usize| {
        let disturbance_bound = s.disturbance_bound * (part as f64 / parts as f64);
        Ok(guarantee::tighten(&Settings { disturbance_bound, ..*s })?.0)
    };
    (1..parts).rev().map(part).collect()
}

/// Returns the settings with their gain K, the tightening, what it leaves of the limits, and the
/// share of the bounds that it includes.
fn robust(s: &Settings) -> Result<(Tightened, f64), DesignError> {
    let chosen = rule::chosen(s)?;
    if s.constraints == Constraints::Paper || chosen.assessment.holds() {
        return Ok((chosen, 1.0));
    }
    if s.guarantee == Guarantee::Required {
        return Err(refusal::refusal(s, &chosen));
    }
    let share = refusal::largest_share(&chosen.settings).unwrap_or(0.0);
    let Tightened { mut tightening, assessment: within, .. } =
        Tightened::new(&guarantee::with_share(&chosen.settings, share))?;
    // Contradictions of the assumptions still follow from the whole bounds.
    (tightening.observable, tightening.explained) =
        (chosen.tightening.observable, chosen.tightening.explained);
    let assessment = Assessment { terminal_rate: within.terminal_rate, ..chosen.assessment };
    Ok((Tightened { tightening, assessment, ..chosen }, share))
}

fn ratio(s: &Settings) -> Result<usize, DesignError> {
    settings::check(s)?;
    positive("limit.rate", s.limit_rate)?;
    positive("limit.moment", s.limit_moment)?;
    if !(0.0..=delay::LONGEST).contains(&s.delay) {
        return Err(DesignError::Delay { value: s.delay, longest: delay::LONGEST });
    }
    let (optimisation, feedback) = (s.period_optimisation, s.period_feedback);
    let ratio = (optimisation / feedback).round();
    if ratio < 1.0 || (ratio * feedback - optimisation).abs() > 1e-9 * optimisation {
        return Err(DesignError::Periods { optimisation, feedback });
    }
    Ok(ratio as usize)
}

fn paper_constants(s: &Settings, smallest: f64, largest: f64) -> Option<PaperConstants> {
    let weight = |i: usize| terminal_weight(s.terminal, Vector2::new(s.p[i], s.p[i + 3]), s.q[i]);
    let terminal_scale =
        (0..3).map(|i| smallest_eigenvalue(&weight(i))).fold(f64::INFINITY, f64::min).sqrt();
    let root3 = 3.0_f64.sqrt();
    let r0 = (1.0 + tan(s.sideslip_bound)).sqrt();
    let r1 = s.limit_rate;
    let omega = root3 * s.limit_rate;
    let condition = largest / smallest;
    let c = step_response_peak(s.tube)?;

    // Outer sets (6).
    let x = r0 * s.limit_rate;
    let u = r0 * s.limit_moment / smallest;
    // r̄₀ Ī′ Ω̄ Ī r̄₀′ with r̄₀′ = 1, the recurring product of (13), (17) and (21).
    let gyroscopic = r0 * condition * omega;
    // Tightened sets (21).
    let x_tube = x - root3 * s.disturbance_bound * c;
    let u_tube = u - 2.0 * gyroscopic * x + root3 * s.disturbance_bound * c * (r1 + gyroscopic);
    // Terminal radii (13), with "− r̄₁" as printed; the triangle inequality would give "+ r̄₁".
    let terminal_gain = hypot(s.terminal.k1, s.terminal.k2);
    let epsilon1 = terminal_scale * (x_tube - s.reference_rate);
    let epsilon2 = terminal_scale
        * (u_tube - (gyroscopic - r1) * x_tube - s.reference_acceleration)
        / terminal_gain;
    Some(PaperConstants {
        r0,
        r1,
        omega,
        condition,
        x,
        u,
        c,
        x_tube,
        u_tube,
        epsilon1,
        epsilon2,
        angle_tube: s.disturbance_bound / s.feedback.k1.abs(),
        rate_tube: s.disturbance_bound * step_response_peak(s.feedback)?,
    })
}

impl Settings {
    /// Returns these settings with the gain K that the controller uses, if it is left to the rule.
    ///
    /// # Errors
    /// Returns an error that names the setting at fault.
    pub fn resolved(&self) -> Result<Self, DesignError> {
        ratio(self)?;
        Ok(rule::chosen(self)?.settings)
    }
}
