//! Bounds of the dynamics: from above by the verified inequalities, and from below by a search for
//! the worst state.
//!
//! The acceleration is F = R G with G = I⁻¹ (m − g) − Ẇ x, g = ω × I ω, ω = W x, and ∂R = −R ∂W R.
//! The derivatives of F and of m are taken by the product rule, and each factor is replaced by its
//! verified bound. As g″ is bilinear and symmetric, its norm is twice that of g on the unit sphere.

mod attained;
mod inequalities;

use crate::interval::Interval;
use crate::lemmas::{Finding, Suprema, over_the_domain};
use attained::attained;
use control::crmpc::{BRAKING, Lemmas, Settings};
use inequalities::from_lemmas;

/// Checks the bounds of F and m over their domain. Bounds that depend on the sizes of x and a are
/// checked at the sizes with which the horizon may end, and at the largest ones.
pub fn check(s: &Settings, lemmas: &Lemmas, sup: &Suprema, terminal_rate: f64) -> Vec<Finding> {
    let s = &over_the_domain(s, lemmas);
    let sizes = (terminal_rate, BRAKING * terminal_rate);
    let curved = (lemmas.dynamics.rate, lemmas.dynamics.acceleration);
    let [moment_by_angles, moment_by_rates, moment] = lemmas.moment(sizes.0, sizes.1);
    let [
        moment_curvature,
        rate_curvature,
        curvature_by_angles,
        curvature_by_rates,
        curvature_of_induced_norm,
    ] = lemmas.curvatures(curved.0, curved.1);
    let bounds = [
        ("‖F‖ ≤ b", lemmas.dynamics.acceleration),
        ("‖∂F/∂x‖ ≤ b", lemmas.dynamics.by_rates),
        ("‖∂F/∂(α, β)‖ ≤ b", lemmas.dynamics.by_angles),
        ("‖d²F/dt²‖ ≤ b, m held", lemmas.dynamics.jerk),
        ("‖∂m/∂(α, β)‖ ≤ b at the terminal sizes", moment_by_angles),
        ("‖∂m/∂x‖ ≤ b at the terminal sizes", moment_by_rates),
        ("‖m‖ ≤ b at the terminal sizes", moment),
        ("‖d²m/dt²‖ ≤ b at the largest sizes, a held", moment_curvature),
        ("‖d²ω/dt²‖ ≤ b at the largest sizes, a held", rate_curvature),
        ("‖d²/dt² ∂m/∂(α, β)‖ ≤ b at the largest sizes", curvature_by_angles),
        ("‖d²/dt² ∂m/∂x‖ ≤ b at the largest sizes", curvature_by_rates),
        ("d²/dt² ‖I W s‖ ≤ b at the largest sizes", curvature_of_induced_norm),
    ];
    let above = from_lemmas(s, sup, sizes, curved);
    let truths = attained(s, sizes, curved).into_iter().zip(above);
    let truths = truths.map(|(low, above)| Interval::new(low, above.high));
    let finding = |((statement, bound), truth): ((&str, f64), Interval)| Finding {
        statement: statement.into(),
        bound,
        truth,
    };
    bounds.into_iter().zip(truths).map(finding).collect()
}
