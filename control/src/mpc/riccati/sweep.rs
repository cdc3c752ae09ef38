//! One stage of the Riccati recursion of a chain of integrators, in 3×3 blocks.

use crate::mpc::constraints::NormConstraint;
use crate::mpc::problem::{Chain, State, zero_state};
use nalgebra::{Matrix3, Vector3};

/// A symmetric matrix on a state, in 3×3 blocks. Only the blocks on and above the diagonal are
/// used.
pub(super) type Blocks<const O: usize> = [[Matrix3<f64>; O]; O];

/// Quadratic cost of one stage, ½ EᵀQ E + EᵀSᵀv + ½ vᵀR v + qᵀE + rᵀv.
#[derive(Clone, Copy, Debug)]
pub(super) struct Quadratic<const O: usize> {
    pub q: Blocks<O>,
    pub s: [Matrix3<f64>; O],
    pub r: Matrix3<f64>,
}

impl<const O: usize> Quadratic<O> {
    /// Returns the quadratic with the given diagonal weights of state and input.
    pub(super) fn diagonal(state: &State<O>, input: &Vector3<f64>) -> Self {
        let mut q = [[Matrix3::zeros(); O]; O];
        for i in 0..O {
            q[i][i] = Matrix3::from_diagonal(&state[i]);
        }
        Self { q, s: [Matrix3::zeros(); O], r: Matrix3::from_diagonal(input) }
    }

    /// Adds the part of a norm constraint: λ JᵀJ, the curvature of ½‖y‖², and (λ/s) ∇c ∇cᵀ, where
    /// `slope` is ∇c = Jᵀy.
    pub(super) fn add_constraint(
        &mut self,
        constraint: &NormConstraint<O>,
        slope: &(State<O>, Vector3<f64>),
        multiplier: f64,
        scaling: f64,
    ) {
        self.add_state_constraint(constraint, &slope.0, multiplier, scaling);
        let by_input = constraint.by_input.transpose() * multiplier;
        let weighted = slope.1 * scaling;
        for i in 0..O {
            self.s[i] += by_input * constraint.by_state[i] + weighted * slope.0[i].transpose();
        }
        self.r += by_input * constraint.by_input + weighted * slope.1.transpose();
    }

    /// Adds the part of a norm constraint that does not depend on the input.
    pub(super) fn add_state_constraint(
        &mut self,
        constraint: &NormConstraint<O>,
        slope: &State<O>,
        multiplier: f64,
        scaling: f64,
    ) {
        for i in 0..O {
            let by_state = constraint.by_state[i].transpose() * multiplier;
            let weighted = slope[i] * scaling;
            for j in i..O {
                self.q[i][j] += by_state * constraint.by_state[j] + weighted * slope[j].transpose();
            }
        }
    }
}

/// Result of the recursion at a stage: v = K E + k with K = −M⁻¹F, M = R + BᵀPB, F = S + BᵀPA.
#[derive(Clone, Copy, Debug)]
pub(super) struct Gain<const O: usize> {
    pub k: [Matrix3<f64>; O],
    m: Ldl,
}

impl<const O: usize> Default for Gain<O> {
    fn default() -> Self {
        Self { k: [Matrix3::zeros(); O], m: Ldl::default() }
    }
}

impl<const O: usize> Gain<O> {
    /// Computes the gain of a stage with the given cost, and P ← Q + AᵀPA − FᵀM⁻¹F. Returns `None`
    /// if M is not positive definite.
    pub(super) fn factor(
        stage: &Quadratic<O>,
        chain: &Chain<O>,
        p: &mut Blocks<O>,
    ) -> Option<Self> {
        // The products P B and P A use that P is symmetric and that A has ones on its diagonal.
        let block = |i: usize, j: usize| if i <= j { p[i][j] } else { p[j][i].transpose() };
        let pb: [Matrix3<f64>; O] = std::array::from_fn(|i| {
            (0..O).fold(Matrix3::zeros(), |sum, j| sum + block(i, j) * chain.b[j])
        });
        let pa: Blocks<O> = std::array::from_fn(|i| {
            std::array::from_fn(|j| {
                (0..j).fold(block(i, j), |sum, l| sum + block(i, l) * chain.a[(l, j)])
            })
        });
        let m = (0..O).fold(stage.r, |sum, i| sum + pb[i] * chain.b[i]);
        let f: [Matrix3<f64>; O] = std::array::from_fn(|j| {
            (0..j).fold(stage.s[j] + pb[j].transpose(), |sum, l| {
                sum + pb[l].transpose() * chain.a[(l, j)]
            })
        });
        let m = Ldl::new(&m)?;
        let k = f.map(|f| -m.solve_columns(&f));
        for i in 0..O {
            for j in i..O {
                let apa = (0..i).fold(pa[i][j], |sum, l| sum + pa[l][j] * chain.a[(l, i)]);
                p[i][j] = stage.q[i][j] + apa + f[i].transpose() * k[j];
            }
        }
        Some(Self { k, m })
    }

    /// Returns the feedforward k = −M⁻¹r, and Kᵀr.
    pub(super) fn feedforward(&self, r: &Vector3<f64>) -> (Vector3<f64>, State<O>) {
        (-self.m.solve(r), self.k.map(|k| k.tr_mul(r)))
    }

    /// Returns the input K E + k.
    pub(super) fn input(&self, state: &State<O>, feedforward: &Vector3<f64>) -> Vector3<f64> {
        self.k.iter().zip(state).fold(*feedforward, |sum, (k, e)| sum + k * e)
    }
}

/// Returns −P⁻¹p by block elimination, or `None` if P is not positive definite.
pub(super) fn minimiser<const O: usize>(p: &Blocks<O>, slope: &State<O>) -> Option<State<O>> {
    let (mut p, mut rest) = (*p, *slope);
    let mut pivots = [Ldl::default(); O];
    for j in 0..O {
        pivots[j] = Ldl::new(&p[j][j])?;
        for i in j + 1..O {
            let factor = pivots[j].solve_columns(&p[j][i]).transpose();
            for l in i..O {
                let change = factor * p[j][l];
                p[i][l] -= change;
            }
            let change = factor * rest[j];
            rest[i] -= change;
        }
    }
    let mut solution = zero_state();
    for j in (0..O).rev() {
        let right_side = (j + 1..O).fold(rest[j], |sum, l| sum + p[j][l] * solution[l]);
        solution[j] = -pivots[j].solve(&right_side);
    }
    Some(solution)
}

/// Factors L D Lᵀ of a symmetric positive definite 3×3 matrix, with the inverse of D.
#[derive(Clone, Copy, Debug, Default)]
struct Ldl {
    l21: f64,
    l31: f64,
    l32: f64,
    inverse: [f64; 3],
}

impl Ldl {
    fn new(m: &Matrix3<f64>) -> Option<Self> {
        let d1 = m.m11;
        let r1 = 1.0 / d1;
        let (l21, l31) = (m.m21 * r1, m.m31 * r1);
        let d2 = m.m22 - l21 * m.m21;
        let r2 = 1.0 / d2;
        let u32 = m.m32 - l31 * m.m21;
        let l32 = u32 * r2;
        let d3 = m.m33 - l31 * m.m31 - l32 * u32;
        (d1 > 0.0 && d2 > 0.0 && d3 > 0.0).then_some(Self {
            l21,
            l31,
            l32,
            inverse: [r1, r2, 1.0 / d3],
        })
    }

    fn solve(&self, b: &Vector3<f64>) -> Vector3<f64> {
        let y2 = b.y - self.l21 * b.x;
        let y3 = b.z - self.l31 * b.x - self.l32 * y2;
        let x3 = y3 * self.inverse[2];
        let x2 = y2 * self.inverse[1] - self.l32 * x3;
        Vector3::new(b.x * self.inverse[0] - self.l21 * x2 - self.l31 * x3, x2, x3)
    }

    fn solve_columns(&self, b: &Matrix3<f64>) -> Matrix3<f64> {
        Matrix3::from_columns(&[
            self.solve(&b.column(0).into_owned()),
            self.solve(&b.column(1).into_owned()),
            self.solve(&b.column(2).into_owned()),
        ])
    }
}
