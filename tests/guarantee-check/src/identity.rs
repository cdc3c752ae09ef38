//! Exact proof of Lemma 1: WᵀW = diag(cos²β, 1, 1), as an identity of polynomials with integer
//! coefficients.
//!
//! The identity gives ‖W‖ = 1, attained by all (0, y₂, y₃) at every β, and ‖R‖ = sec β. An
//! inequality that is an equality on whole surfaces cannot be shown by halving boxes.

/// Polynomial in u = tan(β/2), with the coefficient of uⁱ at index i.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Polynomial(Vec<i64>);

impl Polynomial {
    fn plus(&self, other: &Self) -> Self {
        let at = |p: &Self, i: usize| p.0.get(i).copied().unwrap_or(0);
        Self((0..self.0.len().max(other.0.len())).map(|i| at(self, i) + at(other, i)).collect())
    }

    fn times(&self, other: &Self) -> Self {
        let mut product = vec![0; self.0.len() + other.0.len()];
        for (i, a) in self.0.iter().enumerate() {
            for (j, b) in other.0.iter().enumerate() {
                product[i + j] += a * b;
            }
        }
        Self(product)
    }

    fn minus(&self) -> Self {
        Self(self.0.iter().map(|a| -a).collect())
    }

    fn is_zero(&self) -> bool {
        self.0.iter().all(|a| *a == 0)
    }
}

/// Whether the identity of Lemma 1 holds.
pub(crate) fn lemma1() -> bool {
    // With n = 1 + u², n sin β = 2u and n cos β = 1 − u². The columns are those of n² V; T is left
    // out because it is orthogonal.
    let (n, s, c) = (Polynomial(vec![1, 0, 1]), Polynomial(vec![0, 2]), Polynomial(vec![1, 0, -1]));
    let (zero, square) = (Polynomial(vec![0]), n.times(&n));
    let columns = [
        [s.times(&c).minus(), c.times(&c), zero.clone()],
        [zero.clone(), zero.clone(), square.clone()],
        [n.times(&c).minus(), n.times(&s).minus(), zero.clone()],
    ];
    let diagonal = [c.times(&c).times(&square), square.times(&square), square.times(&square)];
    (0..3).all(|i| {
        (0..3).all(|j| {
            let product =
                (0..3).fold(zero.clone(), |sum, k| sum.plus(&columns[i][k].times(&columns[j][k])));
            let expected = if i == j { &diagonal[i] } else { &zero };
            product.plus(&expected.minus()).is_zero()
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn oracle_sine_and_cosine_in_u() {
        let (n, s, c) =
            (Polynomial(vec![1, 0, 1]), Polynomial(vec![0, 2]), Polynomial(vec![1, 0, -1]));
        assert!(s.times(&s).plus(&c.times(&c)).plus(&n.times(&n).minus()).is_zero());
        assert!(!s.plus(&c).is_zero());
        assert!(lemma1());
    }
}
