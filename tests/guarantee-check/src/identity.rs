//! Exact proof of Lemma 1: WᵀW = diag(cos²β, 1, 1), in rational numbers.
//!
//! The identity gives ‖W‖ = 1, attained by all (0, y₂, y₃) at every β, and ‖R‖ = sec β. An
//! inequality that is an equality on whole surfaces cannot be shown by halving boxes.

use crate::dual::Number;
use crate::kinematics::{Turn, dot, sine_cosine, unit};
use num_rational::Ratio;

impl Number for Ratio<i64> {
    fn constant(value: i32) -> Self {
        Self::from_integer(value.into())
    }
}

/// Degree in u = tan(β/2) of the identity times (1 + u²)⁴. V times (1 + u²)² has polynomials of u
/// as entries. A polynomial of this degree that is zero at more values of u is zero.
const DEGREE: i32 = 8;

/// Whether the identity of Lemma 1 holds. T is left out because it is orthogonal.
pub(crate) fn lemma1() -> bool {
    (0..=DEGREE).all(|u| holds(Ratio::constant(u), Turn::new))
}

/// Whether the identity holds at u with the W that `turn` makes of sine and cosine.
fn holds(u: Ratio<i64>, turn: fn(Ratio<i64>, Ratio<i64>) -> Turn<Ratio<i64>>) -> bool {
    let (sine, cosine) = sine_cosine(u);
    let columns = [0, 1, 2].map(|i| turn(sine, cosine).along(&[], &unit(i)));
    let diagonal = [cosine.squared(), Ratio::constant(1), Ratio::constant(1)];
    let expected = |i: usize, j: usize| if i == j { diagonal[i] } else { Ratio::constant(0) };
    (0..9).all(|at| dot(&columns[at / 3], &columns[at % 3]) == expected(at / 3, at % 3))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn oracle_the_identity_holds_for_w_alone() {
        assert!(lemma1());
        assert!(!holds(Ratio::constant(2), |sine, cosine| Turn::new(cosine, sine)));
    }
}
